#pragma once
// Converts tracked targets to messages, and a detector's messages to requests for the edge's API:
// pixels, angles and times change their conventions here (conversions.h). Azimuth is positive to
// the right there and to the left here, so it and the rows and columns of its covariance change
// sign. No side effects.

#include <alidade_msgs/Detections.h>
#include <alidade_msgs/Targets.h>

#include <cstddef>
#include <string>

#include "alidade_ros/clock_map.h"
#include "alidade_ros/conversions.h"

namespace alidade_ros {

// Parses the event `targets` of the stream. False: *error is one line.
[[nodiscard]] bool parse_targets(const std::string& json, const ClockMap& clock,
                                 const FrameNames& names, alidade_msgs::Targets* targets,
                                 std::string* error);

// False: *error is one line; the clock has no pair yet. The edge reports other errors in them.
[[nodiscard]] bool detections_question(const alidade_msgs::Detections& detections,
                                       const ClockMap& clock, std::string* json,
                                       std::string* error);
// Number of boxes that the edge left out, from its answer; *why is the reason for the first.
[[nodiscard]] std::size_t detections_left_out(const std::string& answer, std::string* why);

}  // namespace alidade_ros
