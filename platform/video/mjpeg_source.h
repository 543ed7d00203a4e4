#pragma once
// open_mjpeg(): JPEG pictures one after another in the answer to one HTTP request
// (multipart/x-mixed-replace; libcurl, multipart_scanner.h, libjpeg-turbo), with a login by
// link_rules.h.
//
// A thread of its own, started by the first read() and so with the scheduling of the capture
// thread, connects, stamps and queues; read() decodes. So a stamp is never late by a decoding time,
// and a read() can time out without hurting the stream.
// - receive_time_s: arrival of the first byte of the picture's part, headers included. Unlike the
//   last byte's, it does not depend on how large the picture is.
// - sender_time_s: the part's X-Timestamp, where it can be true (stamp_guard.h). Where some agree on another time, the clock
//   was set: the frame says that it begins anew (restarted). A part without a stamp, or with that of the part before, has
//   no sender time. After three of these or of those that cannot be true in a row, or more than one in twenty, the camera has
//   no clock for the rest of the connection: too coarse, or mixed with receive times, it would be worse than none.
// - Damaged pictures are skipped and counted; many in a row are reported. When the reader is too
//   slow, the oldest that wait are dropped and counted.
// - copy_to: each delivered picture is also stored as it came in that Matroska file, in which a kill
//   loses at most the last second. The file goes on over reconnections.
// kDisconnected: unreachable, no whole picture for timeout_s, a redirection that is refused (link_rules.h), another HTTP
// status than 200, an answer that is no multipart stream. kFailed: unusable URL, copy_to cannot be written; wrong user or password
// (401), said only until the first picture has come, as a camera that starts again may refuse for a moment.

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
  std::string user;  // these go before what the URL may hold
  std::string password;
  LinkRules rules;
  bool decode = true;        // false: Frame::luma stays null, only the headers are read
  double timeout_s = 3;      // without a picture for so long, the connection counts as lost
  double max_backoff_s = 5;  // longest pause between two tries
  // A larger picture is not decoded: its frame has its size, and no luma. In a copy there is none. A part that is longer
  // than such a picture can be (most_picture_bytes) is none.
  std::int64_t max_pixels = kMostLivePixels;
  std::string copy_to;  // video.mkv to copy the pictures into; empty: none
};

[[nodiscard]] std::unique_ptr<FrameSource> open_mjpeg(const MjpegSourceOptions& options);

}  // namespace alidade
