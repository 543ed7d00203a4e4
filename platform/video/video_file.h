#pragma once
// open_video_file(): the frames of any video file that libav reads (MP4, MKV, AVI, ...), at full speed, in the order in which
// they are shown. sender_time_s is the container's time stamp, receive_time_s the same, where it has one; without one read()
// fails. sequence: none. A picture that cannot be decoded is skipped and counted as damaged. read() allocates and never waits.

#include <memory>
#include <string>

#include "platform/video/frame_source.h"

namespace alidade {

[[nodiscard]] std::unique_ptr<FrameSource> open_video_file(const std::string& path);

}  // namespace alidade
