#pragma once
// The fields of an RTP packet header (RFC 3550, 5.1) for a picture's end and capture time:
// libavformat does not report these two. Also corrects timestamps that libavformat cannot handle.
// No I/O; no allocation.

#include <cstddef>
#include <cstdint>
#include <optional>

namespace alidade {

struct RtpHeader {
  bool marker = false;          // video: last packet of a picture
  std::uint16_t sequence = 0;   // wraps
  std::uint32_t timestamp = 0;  // capture time in ticks of the payload's clock; wraps
  int payload_type = 0;
  std::uint32_t source = 0;  // SSRC
  // Capture time in Unix seconds, from the extension 0xABAC (ONVIF Streaming Specification, 6.3) if
  // the packet has it with a time. The 32 bits of NTP seconds are taken to lie in 1968..2104.
  std::optional<double> capture_utc_s;
};

// nullopt for RTCP and for anything that is not an RTP packet.
[[nodiscard]] std::optional<RtpHeader> parse_rtp_header(const std::uint8_t* data, std::size_t size);

// SSRC of the sender of an RTCP sender report; nullopt for anything else.
[[nodiscard]] std::optional<std::uint32_t> reporting_source(const std::uint8_t* data,
                                                            std::size_t size);

// Hides two timestamps from libavformat. libavformat takes a first timestamp of 0 for "none yet"
// and gives the second picture the same stamp. If the first timestamp is 0, all timestamps, also of
// sender reports, are moved by a second. libavformat takes the largest timestamp for "unknown"; so
// the largest is replaced by one tick less.
class BearableTimestamps {
 public:
  // Changes the packet in place. To be called for each RTP and RTCP packet of a connection, in
  // order of arrival.
  void move(std::uint8_t* data, std::size_t size);

 private:
  std::optional<std::uint32_t> shift_;
};

}  // namespace alidade
