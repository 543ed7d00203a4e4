#pragma once
// open_mjpeg(): JPEG pictures in the answer to one HTTP request (multipart/x-mixed-replace;
// libcurl, multipart_scanner.h, libjpeg-turbo). A receiving thread connects, stamps and queues;
// read() decodes. The first read() starts the thread, which inherits its scheduling.
// receive_time_s: arrival of the first byte of the picture's part, headers included. Unlike the
// arrival of the last byte, it does not depend on the picture's size. sender_time_s: the part's
// X-Timestamp if it can be true (stamp_guard.h). Damaged pictures are skipped and counted; 30 in a
// row end the connection. If the reader is too slow, the oldest waiting pictures are dropped and
// counted. Sender clock, copies and statuses: docs/derivations.md.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "platform/streams/picture_size.h"
#include "platform/system/link_rules.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct MjpegSourceOptions {
  std::string url;   // http://host[:port]/path or https://...
  std::string user;  // user and password take precedence over those in the URL
  std::string password;
  LinkRules rules;
  bool decode = true;        // false: Frame::luma stays null, only the JPEG headers are read
  double timeout_s = 3;      // after so long without a picture the connection counts as lost
  double max_backoff_s = 5;  // longest pause between two attempts
  // A larger picture is not decoded: its frame has its size, but no luma. A part longer than such a
  // picture can be (most_picture_bytes) is discarded.
  std::int64_t max_pixels = kMostLivePixels;
};

[[nodiscard]] std::unique_ptr<FrameSource> open_mjpeg(const MjpegSourceOptions& options);

}  // namespace alidade
