#pragma once
// open_video_file(): the frames of any video file that libav reads (MP4, MKV, AVI, ...), at full
// speed, in display order. sender_time_s and receive_time_s are both the container's time stamp, in
// s from the container's own zero; they are not times of a host clock. A picture without a time
// stamp makes read() fail. There is no sequence. Pictures that cannot be decoded are skipped and
// counted as damaged. read() returns kOk, kEnd, kStopped or kFailed; it allocates and never waits.

#include <memory>
#include <string>

#include "platform/video/frame_source.h"

namespace alidade {

// Never null. The first read() opens the file; if it cannot be opened, read() returns kFailed and
// error() says why.
[[nodiscard]] std::unique_ptr<FrameSource> open_video_file(const std::string& path);

}  // namespace alidade
