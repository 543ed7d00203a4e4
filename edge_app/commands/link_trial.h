#pragma once
// Whether a link works at all: its first frame or sample.

#include <string>

#include "edge_app/config/config.h"
#include "platform/streams/pan_tilt_sample.h"

namespace alidade {

// Both wait until the first item comes, the link fails for good or is lost twice, or the wait is
// over: config.timeout_s + kConnectSlack_s, for a picture 10 s more, for a key frame. False: *error
// is one line for the user.
[[nodiscard]] bool first_sample(const PanTiltConfig& config, PanTiltSample* sample,
                                std::string* error);
// Sets the size of the picture that really comes. The picture is decoded.
[[nodiscard]] bool first_picture(const VideoConfig& config, int* width, int* height,
                                 std::string* error);

}  // namespace alidade
