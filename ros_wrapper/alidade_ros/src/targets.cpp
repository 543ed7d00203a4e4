#include "alidade_ros/targets.h"

#include <array>
#include <limits>
#include <nlohmann/json.hpp>

namespace alidade_ros {
namespace {

using Json = nlohmann::json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ros::Time stamp_of(double time_s, const ClockMap& clock) {
  const std::optional<double> wall = clock.wall_from_monotonic(time_s);
  return wall ? ros_time(*wall) : ros::Time();
}

double number_or_nan(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() || found->is_null() ? kNan : found->get<double>();
}

// signs: factors of the state's components from the edge's convention to this one.
void read_covariance(const Json& rows, const std::array<double, 4>& signs,
                     alidade_msgs::Target* target) {
  target->covariance.fill(kNan);
  if (rows.is_null()) return;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j)
      target->covariance[4 * i + j] = signs[i] * signs[j] * rows.at(i).at(j).get<double>();
  }
}

void read_state(const Json& json, bool on_plane, alidade_msgs::Target* target) {
  target->position.x = target->position.y = target->position.z = kNan;
  target->velocity.x = target->velocity.y = target->velocity.z = kNan;
  target->azimuth = target->elevation = kNan;
  target->azimuth_rate = target->elevation_rate = kNan;
  target->latitude = number_or_nan(json, "latitude_deg");
  target->longitude = number_or_nan(json, "longitude_deg");
  if (on_plane) {
    target->position.x = json.at("position_m").at(0).get<double>();
    target->position.y = json.at("position_m").at(1).get<double>();
    target->position.z = 0;
    target->velocity.x = json.at("velocity_m_s").at(0).get<double>();
    target->velocity.y = json.at("velocity_m_s").at(1).get<double>();
    target->velocity.z = 0;
    read_covariance(json.at("covariance"), {1, 1, 1, 1}, target);
  } else {
    target->azimuth = -number_or_nan(json, "azimuth_rad");
    target->elevation = number_or_nan(json, "elevation_rad");
    target->azimuth_rate = -number_or_nan(json, "azimuth_rate_rad_s");
    target->elevation_rate = number_or_nan(json, "elevation_rate_rad_s");
    read_covariance(json.at("covariance"), {-1, 1, -1, 1}, target);
  }
}

void read_picture(const Json& json, alidade_msgs::Target* target) {
  const Json& pixel = json.at("pixel");
  const Json& box = json.at("box");
  target->in_picture = !pixel.is_null() && !box.is_null();
  if (!target->in_picture) {
    target->pixel.u = target->pixel.v = kNan;
    target->box.u = target->box.v = target->box.width = target->box.height = kNan;
    target->pixel_covariance.fill(kNan);
    return;
  }
  target->pixel = ros_from_pixel(pixel.at(0).get<double>(), pixel.at(1).get<double>());
  for (std::size_t i = 0; i < 4; ++i)
    target->pixel_covariance[i] = json.at("covariance_px2").at(i / 2).at(i % 2).get<double>();
  const alidade_msgs::Pixel corner =
      ros_from_pixel(box.at("u").get<double>(), box.at("v").get<double>());
  target->box.u = corner.u;
  target->box.v = corner.v;
  target->box.width = box.at("width").get<double>();
  target->box.height = box.at("height").get<double>();
}

alidade_msgs::Target read_target(const Json& json, bool on_plane, const ClockMap& clock) {
  alidade_msgs::Target target;
  target.identity = json.at("identity").get<std::uint64_t>();
  if (!json.at("class").is_null()) target.label = json.at("class").get<std::string>();
  target.score = json.at("score").get<double>();
  target.born = stamp_of(json.at("born_s").get<double>(), clock);
  target.seen = stamp_of(json.at("seen_s").get<double>(), clock);
  target.in_view = json.at("in_view").get<double>();
  target.direction = ros_from_base(json.at("direction").get<std::array<double, 3>>());
  read_state(json, on_plane, &target);
  read_picture(json, &target);
  return target;
}

}  // namespace

bool parse_targets(const std::string& text, const ClockMap& clock, const FrameNames& names,
                   alidade_msgs::Targets* targets, std::string* error) {
  try {
    const Json json = Json::parse(text);
    alidade_msgs::Targets read;
    const bool on_plane = json.at("space").get<std::string>() == "plane";
    read.header.stamp = stamp_of(json.at("time_s").get<double>(), clock);
    read.header.frame_id = on_plane ? names.plane : names.base;
    read.frame = json.at("frame").get<std::int64_t>();
    read.space = on_plane ? alidade_msgs::Targets::PLANE : alidade_msgs::Targets::SPHERE;
    for (const Json& target : json.at("targets"))
      read.targets.push_back(read_target(target, on_plane, clock));
    *targets = std::move(read);
    return true;
  } catch (const Json::exception& e) {
    *error = std::string("the edge's targets cannot be understood: ") + e.what();
    return false;
  }
}

bool detections_question(const alidade_msgs::Detections& detections, const ClockMap& clock,
                         std::string* json, std::string* error) {
  Json question;
  if (detections.by_frame) {
    question["frame"] = detections.frame;
  } else {
    const std::optional<double> time_s = clock.monotonic_from_wall(detections.header.stamp.toSec());
    if (!time_s) {
      *error = "the edge's clock is not known yet";
      return false;
    }
    question["time_s"] = *time_s;
  }
  question["boxes"] = Json::array();
  for (const alidade_msgs::Detection& detection : detections.detections) {
    alidade_msgs::Pixel corner;
    corner.u = detection.box.u;
    corner.v = detection.box.v;
    const auto [u, v] = pixel_from_ros(corner);
    Json box{{"u", u},
             {"v", v},
             {"width", detection.box.width},
             {"height", detection.box.height},
             {"score", detection.score}};
    if (!detection.label.empty()) box["class"] = detection.label;
    question["boxes"].push_back(std::move(box));
  }
  *json = question.dump(-1, ' ', false, Json::error_handler_t::replace);
  return true;
}

std::size_t detections_left_out(const std::string& answer, std::string* why) {
  try {
    const Json told = Json::parse(answer);
    const Json& left_out = told.at("left_out");
    if (left_out.empty()) return 0;
    *why = left_out.at(0).at("reason").get<std::string>();
    return left_out.size();
  } catch (const Json::exception&) {
    return 0;  // an edge that does not report it
  }
}

}  // namespace alidade_ros
