#pragma once
// open_v4l2(): a camera on this machine: USB (UVC), CSI, frame grabbers; any single-planar V4L2 capture
// device (v4l2_device.h), with GREY, NV12, YUYV, UYVY or MJPG pictures.
//
// No thread of its own: the kernel stamps and queues, read() takes out and decodes.
// - receive_time_s: the driver's stamp if it is of CLOCK_MONOTONIC and not in the future, at the
//   start or at the end of the frame as the driver has it; else the moment read() took the buffer out
//   (v4l2_stamps.h). sequence: the driver's count; a gap counts as dropped.
// - GREY and NV12: luma is the driver's buffer, without a copy; it goes back when the frame's owner
//   dies, also after this source. While too few buffers are left for the driver, luma is a copy.
//   YUYV and UYVY: one pass takes the luma out. MJPG: libjpeg-turbo.
// - Buffers with an error flag, short and undecodable ones are skipped and counted as damaged; a
//   buffer that comes twice is skipped.
// - copy_to: each delivered picture is also stored in that Matroska file: MJPG as it came, others as
//   uncompressed luma. The file goes on over reconnections.
// kDisconnected: unplugged, busy, not there, silent for timeout_s. kFailed: no permission, no capture
// device, not the format, size and rate wanted; said only until the first frame has come, as a device
// that is plugged in again may be all that for a moment. No permission counts only at the first try: a
// device that is plugged in later gets its group a moment after its name.

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
  double timeout_s = 3;      // without a picture for so long, the device counts as lost
  double max_backoff_s = 5;  // longest pause between two tries
  std::string copy_to;       // video.mkv to store the pictures in; empty: none
};

[[nodiscard]] std::unique_ptr<FrameSource> open_v4l2(const V4l2SourceOptions& options);

}  // namespace alidade
