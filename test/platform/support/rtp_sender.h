#pragma once
// RtpSender: sends numbered pictures as plain RTP to a port of the loopback (libavformat's muxer), each
// when the test says. Picture n is of one grey, grey_of(n), and has the timestamp first_time_s + n/30, from a random zero on.

#include <cstdint>
#include <ostream>
#include <string>

#include "platform/video/av_handles.h"

namespace alidade {

class RtpSender {
 public:
  enum class Codec { kMjpeg, kH264, kH265 };

  static constexpr int kWidth = 160;
  static constexpr int kHeight = 120;
  static constexpr double kPeriod_s = 1.0 / 30;
  static int grey_of(std::int64_t n) { return 40 + static_cast<int>(n * 7 % 160); }

  // H.264 and H.265 have a key frame every 10 pictures and their parameter sets in band.
  // from: its numeric address; empty: the system's choice. to: an address or a group.
  RtpSender(Codec codec, int port, double first_time_s = 1, int packet_bytes = 1200,
            const std::string& from = "", const std::string& to = "127.0.0.1");
  ~RtpSender();
  RtpSender(const RtpSender&) = delete;
  RtpSender& operator=(const RtpSender&) = delete;

  // Sends the next picture, cut off after this fraction of its bytes, behind these NAL units (with start codes).
  void send(double fraction = 1, const std::string& nal_units = "");

  // What its RTCP reports give as Unix time of picture 0.
  double began_utc_s() const { return 1e-6 * static_cast<double>(began_utc_us_); }

  std::int64_t sent() const { return next_; }

  // The session's description.
  std::string sdp() const;

 private:
  CodecContextPtr encoder_;
  AVFormatContext* format_ = nullptr;
  FramePtr picture_;
  double first_time_s_;
  std::int64_t began_utc_us_;
  std::int64_t next_ = 0;
};

inline void PrintTo(const RtpSender::Codec& codec, std::ostream* out) {
  *out << (codec == RtpSender::Codec::kMjpeg  ? "Mjpeg"
           : codec == RtpSender::Codec::kH264 ? "H264"
                                              : "H265");
}

// Whether somebody listens at this pair of ports.
bool rtp_port_taken(int port);

}  // namespace alidade
