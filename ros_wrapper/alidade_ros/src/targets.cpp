#include "alidade_ros/targets.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "alidade_ros/target_reader.h"

namespace alidade_ros {
namespace {

using Json = nlohmann::json;

}  // namespace

bool parse_targets(const std::string& text, const ClockMap& clock, const FrameNames& names,
                   alidade_msgs::Targets* targets, std::string* error) {
  try {
    const Json json = Json::parse(text);
    alidade_msgs::Targets read;
    read_fields(TargetListReader(json, names, clock), &read);
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
