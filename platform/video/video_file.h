#pragma once
// open_video_file(): the frames of any video file that libav reads (MP4, MKV, AVI, ...), in display
// order, as fast as they can be read and decoded. sender_time_s and receive_time_s are both the
// container's time stamp, in s from the container's own zero; they are not times of a host clock.
// FrameStamp::sequence is not set. Pictures that cannot be decoded are skipped and counted as
// damaged. read() ignores timeout_s, allocates, and returns kOk, kEnd (also where the file is cut
// off), kStopped or kFailed: a file that cannot be opened, a picture without a time stamp, or one
// that cannot be converted to grey. kFailed is final.

#include <memory>
#include <string>

#include "platform/video/frame_source.h"

namespace alidade {

// Never null. The first read() opens the file; if it cannot be opened, read() returns kFailed and
// error() says why.
[[nodiscard]] std::unique_ptr<FrameSource> open_video_file(const std::string& path);

}  // namespace alidade
