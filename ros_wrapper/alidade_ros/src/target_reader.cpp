#include "alidade_ros/target_reader.h"

#include <array>
#include <cstddef>
#include <limits>
#include <optional>

#include "alidade_ros/conversions.h"

namespace alidade_ros {
namespace {

using Json = nlohmann::json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

ros::Time stamp_of(double time_s, const ClockMap& clock) {
  const std::optional<double> wall = clock.wall_from_monotonic(time_s);
  return wall ? ros_time(*wall) : ros::Time();
}

std::uint64_t TargetReader::integer(const char* name) const {
  return json_.at(name).get<std::uint64_t>();
}

double TargetReader::number(const char* name) const { return json_.at(name).get<double>(); }

double TargetReader::number_or_nan(const char* name) const {
  const auto found = json_.find(name);
  return found == json_.end() || found->is_null() ? kNan : found->get<double>();
}

double TargetReader::turned(const char* name) const { return -number_or_nan(name); }

std::string TargetReader::word(const char* name) const {
  const Json& word = json_.at(name);
  return word.is_null() ? "" : word.get<std::string>();
}

ros::Time TargetReader::stamp(const char* name) const { return stamp_of(number(name), clock_); }

geometry_msgs::Vector3 TargetReader::base_vector(const char* name) const {
  return ros_from_base(json_.at(name).get<std::array<double, 3>>());
}

template <class Triple>
Triple TargetReader::on_plane(const char* name) const {
  Triple triple;
  triple.x = triple.y = triple.z = kNan;
  if (!on_plane_) return triple;
  triple.x = json_.at(name).at(0).get<double>();
  triple.y = json_.at(name).at(1).get<double>();
  triple.z = 0;
  return triple;
}

geometry_msgs::Point TargetReader::plane_point(const char* name) const {
  return on_plane<geometry_msgs::Point>(name);
}

geometry_msgs::Vector3 TargetReader::plane_vector(const char* name) const {
  return on_plane<geometry_msgs::Vector3>(name);
}

boost::array<double, 16> TargetReader::state_covariance(const char* name) const {
  const double of_azimuth = on_plane_ ? 1 : -1;
  const std::array<double, 4> signs{of_azimuth, 1, of_azimuth, 1};
  boost::array<double, 16> covariance;
  covariance.fill(kNan);
  const Json& rows = json_.at(name);
  if (rows.is_null()) return covariance;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j)
      covariance[4 * i + j] = signs[i] * signs[j] * rows.at(i).at(j).get<double>();
  }
  return covariance;
}

bool TargetReader::in_picture() const {
  return !json_.at("pixel").is_null() && !json_.at("box").is_null();
}

alidade_msgs::Pixel TargetReader::pixel(const char* name) const {
  alidade_msgs::Pixel none;
  none.u = none.v = kNan;
  if (!in_picture()) return none;
  return ros_from_pixel(json_.at(name).at(0).get<double>(), json_.at(name).at(1).get<double>());
}

boost::array<double, 4> TargetReader::pixel_covariance(const char* name) const {
  boost::array<double, 4> covariance;
  covariance.fill(kNan);
  if (!in_picture()) return covariance;
  for (std::size_t i = 0; i < 4; ++i)
    covariance[i] = json_.at(name).at(i / 2).at(i % 2).get<double>();
  return covariance;
}

alidade_msgs::Box TargetReader::box(const char* name) const {
  alidade_msgs::Box box;
  box.u = box.v = box.width = box.height = kNan;
  if (!in_picture()) return box;
  const Json& read = json_.at(name);
  const alidade_msgs::Pixel corner =
      ros_from_pixel(read.at("u").get<double>(), read.at("v").get<double>());
  box.u = corner.u;
  box.v = corner.v;
  box.width = read.at("width").get<double>();
  box.height = read.at("height").get<double>();
  return box;
}

bool TargetListReader::on_plane() const { return json_.at("space").get<std::string>() == "plane"; }

std::int64_t TargetListReader::integer(const char* name) const {
  return json_.at(name).get<std::int64_t>();
}

std_msgs::Header TargetListReader::header(const char* name) const {
  std_msgs::Header header;
  header.stamp = stamp_of(json_.at(name).get<double>(), clock_);
  header.frame_id = on_plane() ? names_.plane : names_.base;
  return header;
}

std::uint8_t TargetListReader::space(const char* name) const {
  return json_.at(name).get<std::string>() == "plane" ? alidade_msgs::Targets::PLANE
                                                      : alidade_msgs::Targets::SPHERE;
}

std::vector<alidade_msgs::Target> TargetListReader::targets(const char* name) const {
  std::vector<alidade_msgs::Target> targets;
  for (const Json& one : json_.at(name)) {
    targets.emplace_back();
    read_fields(TargetReader(one, on_plane(), clock_), &targets.back());
  }
  return targets;
}

}  // namespace alidade_ros
