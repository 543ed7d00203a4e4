#include "platform/video/rtp_packet.h"

#include <algorithm>

namespace alidade {
namespace {

constexpr std::size_t kFixedHeader = 12;                  // bytes
constexpr std::size_t kWord = 4;                          // bytes
constexpr std::size_t kTimestamp = 4;                     // offset in the RTP header
constexpr std::size_t kReportTimestamp = 16;              // offset in a sender report
constexpr std::uint8_t kSenderReport = 200;               // RTCP type; others follow it
constexpr std::uint32_t kSecond = 90'000;                 // ticks of the video clock
constexpr std::uint32_t kUnknownTimestamp = 0xFFFF'FFFF;  // means "unknown" to libavformat
constexpr std::uint32_t kOnvifReplay = 0xABAC;            // profile of the extension
constexpr std::size_t kReplayWords = 3;                   // two words of time, one of flags
constexpr double kUnixInNtp = 2'208'988'800.0;            // s; from 1900 to 1970
constexpr double kNtpEra = 4'294'967'296.0;               // s; period of the NTP seconds
constexpr std::uint32_t kSecondHalf = 0x8000'0000;  // of the era that started in 1900: from 1968 on

std::uint32_t big_endian(const std::uint8_t* bytes, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8U | bytes[i];
  return value;
}

std::optional<double> unix_time(std::uint32_t ntp_seconds, std::uint32_t ntp_fraction) {
  if (ntp_seconds == 0 && ntp_fraction == 0) return std::nullopt;  // unknown to the sender
  const double era_s = ntp_seconds < kSecondHalf ? kNtpEra : 0;
  return era_s + ntp_seconds - kUnixInNtp + ntp_fraction / kNtpEra;
}

}  // namespace

std::optional<RtpHeader> parse_rtp_header(const std::uint8_t* data, std::size_t size) {
  if (size < kFixedHeader || data[0] >> 6U != 2) return std::nullopt;
  // RTCP packet types, which payload types avoid for this purpose (RFC 5761, 4).
  if (data[1] >= 192 && data[1] <= 223) return std::nullopt;
  RtpHeader header;
  header.marker = (data[1] & 0x80U) != 0;
  header.sequence = static_cast<std::uint16_t>(big_endian(data + 2, 2));
  header.timestamp = big_endian(data + 4, 4);
  header.payload_type = data[1] & 0x7FU;
  header.source = big_endian(data + 8, 4);
  const bool has_extension = (data[0] & 0x10U) != 0;
  const std::size_t extension = kFixedHeader + kWord * (data[0] & 0x0FU);  // after the CSRCs
  if (!has_extension || size < extension + kWord) return header;
  const std::size_t words = big_endian(data + extension + 2, 2);
  if (big_endian(data + extension, 2) == kOnvifReplay && words >= kReplayWords &&
      size >= extension + kWord * (1 + words)) {
    header.capture_utc_s = unix_time(big_endian(data + extension + kWord, kWord),
                                     big_endian(data + extension + 2 * kWord, kWord));
  }
  return header;
}

std::optional<std::uint32_t> reporting_source(const std::uint8_t* data, std::size_t size) {
  if (size < kReportTimestamp + kWord || data[0] >> 6U != 2 || data[1] != kSenderReport) {
    return std::nullopt;
  }
  return big_endian(data + kWord, kWord);
}

void BearableTimestamps::move(std::uint8_t* data, std::size_t size) {
  std::uint8_t* timestamp = nullptr;
  if (parse_rtp_header(data, size)) {
    timestamp = data + kTimestamp;
  } else if (reporting_source(data, size)) {
    timestamp = data + kReportTimestamp;
  } else {
    return;
  }
  const std::uint32_t value = big_endian(timestamp, kWord);
  if (!shift_) shift_ = value == 0 ? kSecond : 0;
  const std::uint32_t moved = std::min(value + *shift_, kUnknownTimestamp - 1);
  for (std::size_t i = 0; i < kWord; ++i) {
    timestamp[i] = static_cast<std::uint8_t>(moved >> 8U * (kWord - 1 - i));
  }
}

}  // namespace alidade
