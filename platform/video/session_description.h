#pragma once
// What a session description (SDP, RFC 8866) says about the first video in it, by GStreamer's parser.
// Text in, value or nothing out.

#include <optional>
#include <string>
#include <vector>

namespace alidade {

struct VideoDescription {
  std::string address;    // to listen to; 0.0.0.0 if none is given
  int port = 0;           // UDP, for RTP; 0: to be agreed upon by RTSP
  int payload_type = -1;  // the first that the m= line names, and the one that is read; -1: none
  std::string control;    // a=control of the video; empty if not given
  std::string session_control;  // and of the session
  // Who sends, as a=source-filter has it (RFC 4570); empty: not told. Nothing but `incl` counts.
  std::vector<std::string> senders;
};

// Nothing if the text describes no video.
[[nodiscard]] std::optional<VideoDescription> find_video(const std::string& sdp);

}  // namespace alidade
