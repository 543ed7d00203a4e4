#pragma once
// Whether a link works at all: its first frame or sample.

#include <string>

#include "edge_app/config/config.h"
#include "platform/streams/pan_tilt_sample.h"

namespace alidade {

// Wait until the first item comes or the link fails. False: *error is one line for the user.
[[nodiscard]] bool first_sample(const PanTiltConfig& config, PanTiltSample* sample,
                                std::string* error);
// Sets the size of the picture that really comes. The picture is decoded.
[[nodiscard]] bool first_picture(const VideoConfig& config, int* width, int* height,
                                 std::string* error);

}  // namespace alidade
