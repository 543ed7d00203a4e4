#pragma once
// open_rtp(): MJPEG, H.264 or H.265 video over RTSP or plain RTP (libavformat, libavcodec). A
// receiving thread connects, stamps and queues; read() decodes. The first read() starts the thread,
// which inherits its scheduling. receive_time_s: arrival of the frame's last packet. sender_time_s:
// the RTP timestamp in seconds, unwrapped, starting near the start of the connection. sender_utc_s:
// from the packets' extension 0xABAC (ONVIF capture time), else from the latest RTCP report. Luma
// is the decoder's plane 0, without copy or conversion. Delivery, losses, key frames, copies and
// statuses: docs/derivations.md.

#include <cstdint>
#include <memory>
#include <string>

#include "platform/streams/picture_size.h"
#include "platform/system/link_rules.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct RtpSourceOptions {
  enum class Transport { kTcp, kUdp };

  // rtsp://host[:port]/path; rtsps:// for the same over TLS; the name of an .sdp file; rtp://@:port
  // or rtp://group:port (then `format` is needed).
  std::string url;
  std::string user;  // user and password take precedence over those in the URL
  std::string password;
  LinkRules rules;                        // for rtsp:// and rtsps://
  std::string format = "MJPG";            // rtp:// only: MJPG, H264 or H265
  Transport transport = Transport::kTcp;  // rtsp:// only: RTP interleaved with RTSP, or UDP;
                                          // rtsps:// supports kTcp only
  bool decode = true;  // false: Frame::luma stays null, only the first frame is decoded
  // rtsps:// only: PEM file with the camera's own certificate or its authority's, in place of the
  // system's authorities. The camera's own certificate is accepted whatever its name and dates.
  std::string certificate_file;
  double timeout_s = 3;      // after so long without a whole picture the connection is lost
  double max_backoff_s = 5;  // longest pause between two attempts
  // H.264 and H.265: a larger picture is not decoded: its frame has its size, but no luma.
  std::int64_t max_pixels = kMostLivePixels;
};

[[nodiscard]] std::unique_ptr<FrameSource> open_rtp(const RtpSourceOptions& options);

}  // namespace alidade
