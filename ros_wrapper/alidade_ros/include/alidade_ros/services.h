#pragma once
// Converts service requests to JSON for the edge's API, and its answers to responses: pixels,
// directions and times change their conventions here (conversions.h). No side effects.

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

// Fill the response except success and error.
[[nodiscard]] bool direction_answer(const std::string& json, const ClockMap& clock,
                                    alidade_msgs::PixelToDirection::Response* response,
                                    std::string* error);
[[nodiscard]] bool pixel_answer(const std::string& json, const ClockMap& clock,
                                alidade_msgs::DirectionToPixel::Response* response,
                                std::string* error);

}  // namespace alidade_ros
