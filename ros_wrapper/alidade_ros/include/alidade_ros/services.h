#pragma once
// The services' questions as JSON for the edge's API, and its answers as messages. Pure.
//
// Here pixels, directions and times change their convention (conversions.h); the edge does the rest.

#include <alidade_msgs/DirectionToPixel.h>
#include <alidade_msgs/PixelToDirection.h>

#include <string>

#include "alidade_ros/clock_map.h"

namespace alidade_ros {

// False: *error is one line; the clock has no pair yet, or `at` is unknown.
[[nodiscard]] bool direction_question(const alidade_msgs::PixelToDirection::Request& request,
                                      const ClockMap& clock, std::string* json, std::string* error);
[[nodiscard]] bool pixel_question(const alidade_msgs::DirectionToPixel::Request& request,
                                  const ClockMap& clock, std::string* json, std::string* error);

// Fill all of the response but success and error.
[[nodiscard]] bool direction_answer(const std::string& json, const ClockMap& clock,
                                    alidade_msgs::PixelToDirection::Response* response,
                                    std::string* error);
[[nodiscard]] bool pixel_answer(const std::string& json, const ClockMap& clock,
                                alidade_msgs::DirectionToPixel::Response* response,
                                std::string* error);

}  // namespace alidade_ros
