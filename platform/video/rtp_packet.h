#pragma once
// The header of an RTP packet (RFC 3550, 5.1), as far as a picture's end and capture time stand in it:
// libavformat takes the packets apart and tells neither. And what libavformat cannot bear in it.
// Bytes in, value or nothing out; no allocation.

#include <cstddef>
#include <cstdint>
#include <optional>

namespace alidade {

struct RtpHeader {
  bool marker = false;          // video: last packet of a picture
  std::uint16_t sequence = 0;   // wraps
  std::uint32_t timestamp = 0;  // capture time in ticks of the payload's clock, wraps
  int payload_type = 0;
  std::uint32_t source = 0;  // SSRC
  // Capture time in Unix seconds by the extension 0xABAC (ONVIF Streaming Specification, 6.3), if the
  // packet has it and it says a time. NTP's 32 bits of seconds are taken to lie in 1968..2104.
  std::optional<double> capture_utc_s;
};

// Nothing for RTCP and for what is no RTP packet.
[[nodiscard]] std::optional<RtpHeader> parse_rtp_header(const std::uint8_t* data, std::size_t size);

// Whose RTCP sender report it is (SSRC); nothing for all else.
[[nodiscard]] std::optional<std::uint32_t> reporting_source(const std::uint8_t* data,
                                                            std::size_t size);

// Keeps two timestamps from libavformat. A first one of 0 it takes for "none yet", and gives the second
// picture the first one's stamp again: then all are moved by a second, and those of the sender's
// reports with them. The largest it takes for "unknown": one tick less comes in its place.
class BearableTimestamps {
 public:
  // Each RTP and RTCP packet of a connection, in the order of arrival.
  void move(std::uint8_t* data, std::size_t size);

 private:
  std::optional<std::uint32_t> shift_;
};

}  // namespace alidade
