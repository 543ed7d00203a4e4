#pragma once
// Reads the first video of a session description (SDP, RFC 8866) by GStreamer's parser. No I/O.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace alidade {

struct VideoDescription {
  std::string address;          // address to listen to; 0.0.0.0 if none is given
  int port = 0;                 // UDP port for RTP; 0: to be agreed on by RTSP
  int payload_type = -1;        // the first in the m= line, which is the one read; -1: none
  std::string control;          // a=control of the video; empty if not given
  std::string session_control;  // a=control of the session
  // Senders by a=source-filter (RFC 4570); empty: not given. Only `incl` is considered.
  std::vector<std::string> senders;
  std::optional<std::uint32_t> source;  // the first SSRC by a=ssrc (RFC 5576)
};

// nullopt: not an SDP, without a video, or with a port beyond 65535.
[[nodiscard]] std::optional<VideoDescription> find_video(const std::string& sdp);

}  // namespace alidade
