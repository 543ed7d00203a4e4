#pragma once
// What is tracked as messages, and a detector's messages as questions to the edge's API. Pure.
//
// Here pixels, angles and times change their convention (conversions.h). Azimuth, positive to the right there and to the
// left here, changes its sign, and with it the rows and columns of its covariance.

#include <alidade_msgs/Detections.h>
#include <alidade_msgs/Targets.h>

#include <cstddef>
#include <string>

#include "alidade_ros/clock_map.h"
#include "alidade_ros/conversions.h"

namespace alidade_ros {

// The event `targets` of the stream. False: *error is one line.
[[nodiscard]] bool parse_targets(const std::string& json, const ClockMap& clock,
                                 const FrameNames& names, alidade_msgs::Targets* targets,
                                 std::string* error);

// False: *error is one line; the clock has no pair yet. What else is wrong with them, the edge says.
[[nodiscard]] bool detections_question(const alidade_msgs::Detections& detections,
                                       const ClockMap& clock, std::string* json,
                                       std::string* error);
// How many boxes the edge has left out, by its answer, and why the first.
[[nodiscard]] std::size_t detections_left_out(const std::string& answer, std::string* why);

}  // namespace alidade_ros
