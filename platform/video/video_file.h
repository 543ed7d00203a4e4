#pragma once
// open_video_file(): the frames of any video file that libav reads (MP4, MKV, AVI, ...), at full
// speed, in display order. sender_time_s and receive_time_s are the container's time stamp; without
// one read() fails. sequence: none. Pictures that cannot be decoded are skipped and counted as
// damaged. read() allocates and never waits.

#include <memory>
#include <string>

#include "platform/video/frame_source.h"

namespace alidade {

[[nodiscard]] std::unique_ptr<FrameSource> open_video_file(const std::string& path);

}  // namespace alidade
