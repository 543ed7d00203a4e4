#pragma once
// TargetReader: reads the fields of one target of the edge's JSON, each into the type and the
// conventions of its message. What the target's space does not have is NaN. Throws Json::exception
// for what cannot be understood.

#include <alidade_msgs/Box.h>
#include <alidade_msgs/Pixel.h>
#include <alidade_msgs/Target.h>
#include <geometry_msgs/Point.h>
#include <geometry_msgs/Vector3.h>

#include <boost/array.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "alidade_ros/clock_map.h"

namespace alidade_ros {

// Not a time yet while the clock is not known.
[[nodiscard]] ros::Time stamp_of(double time_s, const ClockMap& clock);

class TargetReader {
 public:
  // Keeps references to both.
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

// All fields of the message; target_fields.cpp, which is generated.
void read_fields(const TargetReader& read, alidade_msgs::Target* message);

}  // namespace alidade_ros
