#pragma once
// TargetListReader: reads the fields of the edge's JSON with the targets of a frame, each into the
// type and the conventions of its message. TargetReader: those of one target. What the target's
// space does not have is NaN. Both throw Json::exception for what cannot be understood.

#include <alidade_msgs/Box.h>
#include <alidade_msgs/Pixel.h>
#include <alidade_msgs/Target.h>
#include <alidade_msgs/Targets.h>
#include <geometry_msgs/Point.h>
#include <geometry_msgs/Vector3.h>
#include <std_msgs/Header.h>

#include <boost/array.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "alidade_ros/clock_map.h"
#include "alidade_ros/conversions.h"

namespace alidade_ros {

// Not a time yet while the clock is not known.
[[nodiscard]] ros::Time stamp_of(double time_s, const ClockMap& clock);

class TargetReader {
 public:
  // Keeps references to `target` and `clock`, which must outlive this object.
  TargetReader(const nlohmann::json& target, bool on_plane, const ClockMap& clock)
      : json_(target), on_plane_(on_plane), clock_(clock) {}

  [[nodiscard]] std::uint64_t integer(const char* name) const;
  [[nodiscard]] double number(const char* name) const;
  [[nodiscard]] double number_or_nan(const char* name) const;
  [[nodiscard]] double turned(const char* name) const;     // with the opposite sign, or NaN
  [[nodiscard]] std::string word(const char* name) const;  // empty: null
  [[nodiscard]] ros::Time stamp(const char* name) const;

  [[nodiscard]] geometry_msgs::Vector3 base_vector(const char* name) const;
  [[nodiscard]] geometry_msgs::Point plane_point(const char* name) const;
  [[nodiscard]] geometry_msgs::Vector3 plane_vector(const char* name) const;
  // Azimuth is positive to the right there and to the left here, so its rows and columns change
  // sign.
  [[nodiscard]] boost::array<double, 16> state_covariance(const char* name) const;

  // All of these are NaN for a target that is not in the picture.
  [[nodiscard]] bool in_picture() const;
  [[nodiscard]] alidade_msgs::Pixel pixel(const char* name) const;
  [[nodiscard]] boost::array<double, 4> pixel_covariance(const char* name) const;
  [[nodiscard]] alidade_msgs::Box box(const char* name) const;

 private:
  template <class Triple>
  [[nodiscard]] Triple on_plane(const char* name) const;

  const nlohmann::json& json_;
  bool on_plane_;
  const ClockMap& clock_;
};

class TargetListReader {
 public:
  // Keeps references to all three, which must outlive this object.
  TargetListReader(const nlohmann::json& list, const FrameNames& names, const ClockMap& clock)
      : json_(list), names_(names), clock_(clock) {}

  [[nodiscard]] std::int64_t integer(const char* name) const;
  [[nodiscard]] std_msgs::Header header(const char* name) const;  // of this time and the space
  [[nodiscard]] std::uint8_t space(const char* name) const;
  [[nodiscard]] std::vector<alidade_msgs::Target> targets(const char* name) const;

 private:
  [[nodiscard]] bool on_plane() const;

  const nlohmann::json& json_;
  const FrameNames& names_;
  const ClockMap& clock_;
};

// All fields of the messages; target_fields.cpp and target_list_fields.cpp, which are generated.
void read_fields(const TargetReader& read, alidade_msgs::Target* message);
void read_fields(const TargetListReader& read, alidade_msgs::Targets* message);

}  // namespace alidade_ros
