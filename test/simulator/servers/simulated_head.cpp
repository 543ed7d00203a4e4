#include "test/simulator/servers/simulated_head.h"

#include <cmath>
#include <cstdio>

namespace alidade {
namespace {

std::string bytes_of(std::initializer_list<long> values) {
  std::string bytes;
  for (const long value : values) {
    bytes += static_cast<char>(value & 0xFF);
  }
  return bytes;
}

long byte_at(const std::string& bytes, std::size_t i) {
  return static_cast<unsigned char>(bytes.at(i));
}

std::string nibbles(long value, int count) {
  std::string bytes;
  for (int i = count - 1; i >= 0; --i) {
    bytes += static_cast<char>(value >> (4 * i) & 0xF);
  }
  return bytes;
}

}  // namespace

std::vector<std::string> PelcoDHead::take(const std::string& bytes) {
  std::vector<std::string> replies;
  received_ += bytes;
  while (received_.size() >= 7) {
    long sum = 0;
    for (std::size_t i = 1; i < 6; ++i) {
      sum += byte_at(received_, i);
    }
    if (byte_at(received_, 0) != 0xFF || byte_at(received_, 6) != sum % 256) {
      received_.erase(0, 1);
      continue;
    }
    const long to = byte_at(received_, 1);
    const long command = byte_at(received_, 3);
    received_.erase(0, 7);
    if (to != address || (command == 0x53 && !knows_tilt) || (command == 0x55 && !knows_zoom) ||
        (command != 0x51 && command != 0x53 && command != 0x55)) {
      continue;
    }
    const HeadPosition now = position_();
    const double angle_deg = command == 0x51 ? now.pan_deg : -now.tilt_deg;
    long value = std::lround(100 * angle_deg) % 36000;
    value = value < 0 ? value + 36000 : value;
    value = command == 0x55 ? now.zoom : value;
    const long reply = command + 8;
    replies.push_back(bytes_of({0xFF, address, 0, reply, value / 256, value % 256,
                                address + reply + value / 256 + value % 256}));
  }
  return replies;
}

// The general response to another master's command.
std::string PelcoDHead::unsolicited() { return bytes_of({0xFF, address, 0, address}); }

void ViscaHead::power_on() {
  SimulatedHead::power_on();
  last_sequence_ = 0;
}

std::string ViscaHead::reply_to(const std::string& query) const {
  if (error != 0) {
    return bytes_of({0x90, 0x60, error, 0xFF});
  }
  const HeadPosition now = position_();
  if (query == bytes_of({0x81, 0x09, 0x06, 0x12, 0xFF})) {
    return "\x90\x50" + nibbles(std::lround(steps_per_deg * now.pan_deg), pan_nibbles) +
           nibbles(std::lround(steps_per_deg * now.tilt_deg), tilt_nibbles) + "\xFF";
  }
  if (query == bytes_of({0x81, 0x09, 0x04, 0x47, 0xFF})) {
    return "\x90\x50" + nibbles(now.zoom, 4) + "\xFF";
  }
  return bytes_of({0x90, 0x60, 0x02, 0xFF});
}

std::string ViscaHead::header_of(const std::string& sequence, long length) const {
  const std::string start = bytes_of({1, 0x11, 0, length});
  switch (numbers) {
    case Numbers::kOfTheQuery:
      break;
    case Numbers::kOne:
      return start + bytes_of({0, 0, 0, 1});
    case Numbers::kZero:
      return start + bytes_of({0, 0, 0, 0});
    case Numbers::kOneLess:
    case Numbers::kOneMore: {
      const long number = byte_at(sequence, 2) * 256 + byte_at(sequence, 3) +
                          (numbers == Numbers::kOneMore ? 1 : -1);
      return start + bytes_of({0, 0, number / 256, number % 256});
    }
    case Numbers::kTurnedRound:
      return start + std::string(sequence.rbegin(), sequence.rend());
    case Numbers::kNoHeader:
      return {};
  }
  return start + sequence;
}

std::vector<std::string> ViscaHead::take(const std::string& bytes) {
  if (header) {
    if (bytes.size() < 9) {
      return {};
    }
    const std::string sequence = bytes.substr(4, 4);
    if (byte_at(bytes, 0) == 2) {
      last_sequence_ = 0;
      forgets_numbering = false;
      return {bytes_of({2, 1, 0, 1}) + sequence + "\x01"};
    }
    unsigned number = 0;
    for (std::size_t i = 4; i < 8; ++i) {
      number = number * 256 + static_cast<unsigned>(byte_at(bytes, i));
    }
    if (highest_number != 0 && number > highest_number) {
      return {};
    }
    if ((number <= last_sequence_ && highest_number == 0) || forgets_numbering) {
      return {bytes_of({2, error_is_reply ? 1 : 0, 0, 2}) + sequence + "\x0F\x01"};
    }
    last_sequence_ = number;
    const std::string reply = reply_to(bytes.substr(8));
    return {header_of(sequence, static_cast<long>(reply.size())) + reply};
  }
  std::vector<std::string> replies;
  received_ += bytes;
  for (std::size_t end = received_.find('\xFF'); end != std::string::npos;
       end = received_.find('\xFF')) {
    replies.push_back(reply_to(received_.substr(0, end + 1)));
    received_.erase(0, end + 1);
  }
  return replies;
}

// Completion of another master's command.
std::string ViscaHead::unsolicited() {
  return header ? bytes_of({1, 0x11, 0, 3, 0, 0, 0, 99, 0x90, 0x51, 0xFF})
                : bytes_of({0x90, 0x51, 0xFF});
}

void PtuHead::power_on() {
  SimulatedHead::power_on();
  terse_ = false;
  echo_ = true;
}

std::string PtuHead::reply_to(const std::string& command) {
  const HeadPosition now = position_();
  char text[80] = "! Illegal command entered";
  if (command == "FT" || command == "FV" || command == "ED" || command == "CI") {
    terse_ = command == "FT" || (terse_ && command != "FV");
    echo_ = echo_ && command != "ED";
    std::snprintf(text, sizeof text, "*");
  } else if (command == "PR" || command == "TR") {
    std::snprintf(text, sizeof text, "* %.4f seconds arc per position",
                  command == "PR" ? kPanArcSeconds : kTiltArcSeconds);
  } else if (command == "PP" || command == "TP") {
    const bool pan = command == "PP";
    const long steps = pan ? std::lround(-now.pan_deg * 3600 / kPanArcSeconds)
                           : std::lround(now.tilt_deg * 3600 / kTiltArcSeconds);
    std::snprintf(text, sizeof text, "* %s%s%s%ld", terse_ ? "" : "Current ",
                  terse_ ? "" : (pan ? "Pan" : "Tilt"), terse_ ? "" : " position is ", steps);
  }
  return std::string(text) + "\r\n";
}

std::vector<std::string> PtuHead::take(const std::string& bytes) {
  std::vector<std::string> replies;
  for (const char c : bytes) {
    if (c != ' ' && c != '\r' && c != '\n') {
      received_ += c;
      continue;
    }
    if (!received_.empty()) {
      const std::string echo = echo_ ? received_ + " " : "";
      replies.push_back(echo + reply_to(received_));
    }
    received_.clear();
  }
  return replies;
}

}  // namespace alidade
