#include "platform/video/rtsp_framing.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <optional>

namespace alidade {
namespace {

constexpr std::size_t kPacketHead = 4;  // bytes
constexpr std::size_t kLargestPacket = 65'535;
constexpr std::size_t kLeastPacket = 8;             // RTCP's shortest
constexpr unsigned kMostChannels = 32;              // channels that were not agreed on
constexpr std::size_t kMaxHeadInGarbage = 2 << 10;  // bytes of a message that follows garbage

// Possible starts of a camera's message.
constexpr std::array<std::string_view, 12> kBeginnings = {
    "RTSP/1.", "OPTIONS ",  "ANNOUNCE ", "GET_PARAMETER ", "SET_PARAMETER ", "REDIRECT ",
    "PLAY ",   "DESCRIBE ", "SETUP ",    "PAUSE ",         "TEARDOWN ",      "RECORD "};

unsigned byte_at(std::string_view bytes, std::size_t at) {
  return static_cast<unsigned char>(bytes[at]);
}

bool is_line_end(char c) { return c == '\r' || c == '\n'; }

// Size of the body, at most one byte more than a message may have; nullopt: not a number.
std::optional<std::size_t> body_size(std::string_view head) {
  constexpr std::string_view kName = "content-length:";
  const auto same = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == static_cast<unsigned char>(b);
  };
  const auto* name = std::search(head.begin(), head.end(), kName.begin(), kName.end(), same);
  if (name == head.end()) return 0;
  std::size_t value = 0;
  const char* digit = name + kName.size();
  while (*digit == ' ' || *digit == '\t') ++digit;
  if (*digit < '0' || *digit > '9') return std::nullopt;
  for (; *digit >= '0' && *digit <= '9'; ++digit) {
    value =
        std::min(10 * value + static_cast<std::size_t>(*digit - '0'), RtspFraming::kMaxMessage + 1);
  }
  return value;
}

}  // namespace

RtspFraming::RtspFraming() : buffer_(2 * std::max(kMaxMessage, kPacketHead + kLargestPacket)) {}

std::pair<char*, std::size_t> RtspFraming::room() {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  return {buffer_.data() + end_, buffer_.size() - end_};
}

void RtspFraming::came(std::size_t bytes, double arrival_s) {
  end_ += bytes;
  arrival_s_ = arrival_s;
}

RtspFraming::Extent RtspFraming::packet_at(std::string_view bytes) const {
  if (bytes.front() != '$') return {Guess::kNot};
  if (bytes.size() < kPacketHead) return {Guess::kMayBecome};
  const int behind_first = static_cast<int>(byte_at(bytes, 1)) - first_channel_;
  const bool known = behind_first == 0 || behind_first == 1;
  const std::size_t length = byte_at(bytes, 2) << 8U | byte_at(bytes, 3);
  const bool searches = garbage_in_a_row_ > 0;
  if (length == 0 && !searches) return {Guess::kIs, kPacketHead};
  const bool possible = known || (!searches && byte_at(bytes, 1) < kMostChannels);
  if (length < kLeastPacket || !possible) return {Guess::kNot};
  if (bytes.size() == kPacketHead) return {Guess::kMayBecome};
  if (byte_at(bytes, kPacketHead) >> 6U != 2) return {Guess::kNot};
  if (bytes.size() < kPacketHead + length) return {Guess::kMayBecome};
  return {Guess::kIs, kPacketHead + length};
}

RtspFraming::Extent RtspFraming::message_at(std::string_view bytes) const {
  const bool begins = std::any_of(kBeginnings.begin(), kBeginnings.end(), [&](auto beginning) {
    const std::size_t common = std::min(bytes.size(), beginning.size());
    return bytes.substr(0, common) == beginning.substr(0, common);
  });
  if (!begins) return {Guess::kNot};
  // Within garbage a message may seem to begin every few bytes.
  const std::size_t most_head = garbage_in_a_row_ > 0 ? kMaxHeadInGarbage : kMaxHead;
  std::size_t line = 0;  // start of the current line
  for (std::size_t at = 0; at < std::min(bytes.size(), most_head); ++at) {
    if (bytes[at] == '\n') {
      const bool empty = at == line || (at == line + 1 && bytes[line] == '\r');
      if (empty) {
        const auto body = body_size(bytes.substr(0, at + 1));
        if (!body) return {Guess::kNot};
        if (at + 1 + *body > kMaxMessage) return {Guess::kTooLong};
        if (bytes.size() < at + 1 + *body) return {Guess::kMayBecome};
        return {Guess::kIs, at + 1 + *body};
      }
      line = at + 1;
    } else if (packets_ ? bytes[at] != '\r' && bytes[at] != '\t' &&
                              std::isprint(static_cast<unsigned char>(bytes[at])) == 0
                        : bytes[at] == '\0') {
      return {Guess::kNot};
    }
  }
  return {bytes.size() < most_head ? Guess::kMayBecome : Guess::kTooLong};
}

RtspFraming::Item RtspFraming::next() {
  while (begin_ < end_ && !is_lost()) {
    const std::string_view bytes(buffer_.data() + begin_, end_ - begin_);
    if (is_line_end(bytes.front()) && garbage_in_a_row_ == 0) {
      ++begin_;
      continue;
    }
    const Extent packet = packet_at(bytes);
    const Extent message = packet.guess == Guess::kNot ? message_at(bytes) : Extent{};
    if (packet.guess == Guess::kMayBecome || message.guess == Guess::kMayBecome) {
      return {};
    }
    if (packet.guess != Guess::kIs && message.guess != Guess::kIs) {
      had_long_message_ = had_long_message_ || message.guess == Guess::kTooLong;
      ++begin_;
      ++garbage_;
      ++garbage_in_a_row_;
      continue;
    }
    garbage_in_a_row_ = 0;
    if (message.guess == Guess::kIs) {
      begin_ += message.size;
      return {Item::Kind::kMessage, 0, bytes.substr(0, message.size), arrival_s_};
    }
    begin_ += packet.size;
    if (packet.size == kPacketHead) continue;
    return {Item::Kind::kPacket, static_cast<int>(byte_at(bytes, 1)),
            bytes.substr(kPacketHead, packet.size - kPacketHead), arrival_s_};
  }
  return {};
}

}  // namespace alidade
