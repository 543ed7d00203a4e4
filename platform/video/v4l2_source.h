#pragma once
// open_v4l2(): a camera on this machine (USB/UVC, CSI, frame grabber): any single-planar V4L2
// capture device (v4l2_device.h) with GREY, NV12, YUYV, UYVY or MJPG pictures. The source has no
// thread: the kernel stamps and queues, read() dequeues and decodes. receive_time_s: the driver's
// stamp if it is valid, else the moment of dequeueing; sequence: the driver's count
// (v4l2_stamps.h). Luma of GREY and NV12 is the driver's buffer, without copy. The buffer goes back
// when the frame's owner dies, even after this source; if the driver has too few buffers left, luma
// is a copy. MJPG: libjpeg-turbo. Buffers that have an error flag, are too short or cannot be
// decoded are skipped and counted as damaged. Statuses and copies: docs/derivations.md.

#include <cstdint>
#include <memory>
#include <string>

#include "platform/video/frame_source.h"
#include "platform/video/v4l2_mode.h"

namespace alidade {

struct V4l2SourceOptions {
  std::string device;  // /dev/video0
  V4l2Wish wish;
  bool decode = true;        // false: Frame::luma stays null
  double timeout_s = 3;      // after so long without a picture the device counts as lost
  double max_backoff_s = 5;  // longest pause between two attempts
};

[[nodiscard]] std::unique_ptr<FrameSource> open_v4l2(const V4l2SourceOptions& options);

}  // namespace alidade
