#pragma once
// The same camera with pictures of another size: all lengths in px are scaled with the width, and
// reading out a frame takes as long as before. Angles and the distortion stay. Live JPEG becomes H.264
// where RTP does not carry JPEG of the new size.

#include "test/simulator/config.h"

namespace alidade::simulator {

// "480x270". Throws ConfigError.
void resize(const std::string& size, Config* config);

}  // namespace alidade::simulator
