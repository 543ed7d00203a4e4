#include "alidade_ros/services.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "alidade_ros/conversions.h"

namespace alidade_ros {
namespace {

using Json = nlohmann::json;
using Vector = std::array<double, 3>;

template <typename Request>
bool ask_for_frame(const Request& request, const ClockMap& clock, Json* question,
                   std::string* error) {
  if (request.at == Request::FRAME) {
    (*question)["frame"] = request.frame;
  } else if (request.at == Request::STAMP) {
    const std::optional<double> time_s = clock.monotonic_from_wall(request.stamp.toSec());
    if (!time_s) {
      *error = "the edge's clock is not known yet; ask again once it is connected";
      return false;
    }
    (*question)["time_s"] = *time_s;
  } else if (request.at != Request::NEWEST) {
    *error = "at: must be NEWEST (0), FRAME (1) or STAMP (2), not " + std::to_string(request.at);
    return false;
  }
  return true;
}

ros::Time stamp_of(const Json& item, const ClockMap& clock) {
  const std::optional<double> wall = clock.wall_from_monotonic(item.at("time_s").get<double>());
  return wall ? ros_time(*wall) : ros::Time();
}

template <typename Message>
void read_covariance(const Json& rows, Message* message) {
  for (std::size_t i = 0; i < 4; ++i) {
    message->covariance[i] = rows.at(i / 2).at(i % 2).template get<double>();
  }
}

template <typename Response>
void read_frame(const Json& answer, const ClockMap& clock, Response* response) {
  response->frame = answer.at("frame").get<std::int64_t>();
  response->stamp = stamp_of(answer, clock);
  response->mode = mode_number(answer.at("mode").get<std::string>());
  response->calibrated = answer.at("calibrated").get<bool>();
}

template <typename Read>
bool parse(const std::string& text, std::string* error, const Read& read) {
  try {
    read(Json::parse(text));
    return true;
  } catch (const Json::exception& e) {
    *error = std::string("the edge's answer cannot be understood: ") + e.what();
    return false;
  }
}

}  // namespace

bool direction_question(const alidade_msgs::PixelToDirection::Request& request,
                        const ClockMap& clock, std::string* json, std::string* error) {
  Json question;
  if (!ask_for_frame(request, clock, &question, error)) return false;
  question["pixels"] = Json::array();
  for (const alidade_msgs::Pixel& pixel : request.pixels) {
    question["pixels"].push_back(pixel_from_ros(pixel));
  }
  if (request.pixel_sigma != 0) question["pixel_sigma_px"] = request.pixel_sigma;
  *json = question.dump();
  return true;
}

bool pixel_question(const alidade_msgs::DirectionToPixel::Request& request, const ClockMap& clock,
                    std::string* json, std::string* error) {
  Json question;
  if (!ask_for_frame(request, clock, &question, error)) return false;
  question["directions"] = Json::array();
  for (const geometry_msgs::Vector3& direction : request.directions) {
    question["directions"].push_back(base_from_ros(direction));
  }
  *json = question.dump();
  return true;
}

bool direction_answer(const std::string& json, const ClockMap& clock,
                      alidade_msgs::PixelToDirection::Response* response, std::string* error) {
  return parse(json, error, [&](const Json& answer) {
    read_frame(answer, clock, response);
    for (const Json& item : answer.at("directions")) {
      alidade_msgs::PixelDirection direction;
      direction.pixel = ros_from_pixel(item.at("pixel").at(0), item.at("pixel").at(1));
      if (item.contains("error")) {
        direction.error = item.at("error").get<std::string>();
      } else {
        direction.stamp = stamp_of(item, clock);
        direction.direction = ros_from_base(item.at("direction").get<Vector>());
        direction.azimuth = std::atan2(direction.direction.y, direction.direction.x);
        direction.elevation = std::atan2(direction.direction.z,
                                         std::hypot(direction.direction.x, direction.direction.y));
        read_covariance(item.at("covariance"), &direction);
        direction.basis[0] = ros_from_base(item.at("basis").at(0).get<Vector>());
        direction.basis[1] = ros_from_base(item.at("basis").at(1).get<Vector>());
        direction.sigma = item.at("sigma_rad").get<double>();
      }
      response->directions.push_back(direction);
    }
  });
}

bool pixel_answer(const std::string& json, const ClockMap& clock,
                  alidade_msgs::DirectionToPixel::Response* response, std::string* error) {
  return parse(json, error, [&](const Json& answer) {
    read_frame(answer, clock, response);
    for (const Json& item : answer.at("pixels")) {
      alidade_msgs::DirectionPixel pixel;
      pixel.direction = ros_from_base(item.at("direction").get<Vector>());
      if (item.contains("error")) {
        pixel.error = item.at("error").get<std::string>();
      } else {
        pixel.stamp = stamp_of(item, clock);
        pixel.pixel = ros_from_pixel(item.at("pixel").at(0), item.at("pixel").at(1));
        pixel.inside = item.at("inside").get<bool>();
        read_covariance(item.at("covariance_px2"), &pixel);
      }
      response->pixels.push_back(pixel);
    }
  });
}

}  // namespace alidade_ros
