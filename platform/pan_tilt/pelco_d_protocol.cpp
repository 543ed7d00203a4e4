#include "platform/pan_tilt/pelco_d_protocol.h"

namespace alidade {
namespace {

constexpr std::size_t kFrame = 7;  // bytes
constexpr std::uint8_t kSync = 0xFF;
constexpr std::uint8_t kPan = 0x51;
constexpr std::uint8_t kTilt = 0x53;
constexpr std::uint8_t kZoom = 0x55;
constexpr std::uint8_t kToAnswer = 0x08;  // opcode of an answer minus that of its query

std::uint8_t sum_of(std::string_view frame) {
  unsigned sum = 0;
  for (std::size_t i = 1; i + 1 < kFrame; ++i) {
    sum += byte_at(frame, i);
  }
  return static_cast<std::uint8_t>(sum);
}

std::uint8_t opcode_of(Answer::Kind asked) {
  return asked == Answer::Kind::kPan ? kPan : asked == Answer::Kind::kTilt ? kTilt : kZoom;
}

}  // namespace

std::string pelco_d_query(int address, std::uint8_t opcode) {
  std::string frame(kFrame, '\0');
  frame[0] = static_cast<char>(kSync);
  frame[1] = static_cast<char>(address);
  frame[3] = static_cast<char>(opcode);
  frame[6] = static_cast<char>(sum_of(frame));
  return frame;
}

std::optional<PelcoDAnswer> find_pelco_d_answer(std::string_view bytes, int address,
                                                std::uint8_t opcode, std::string* problem) {
  std::optional<PelcoDAnswer> found;
  bool wrong_sum = false;
  int other_address = 0;
  for (std::size_t i = 0; i + kFrame <= bytes.size(); ++i) {
    const std::string_view frame = bytes.substr(i, kFrame);
    if (byte_at(frame, 0) != kSync || byte_at(frame, 3) != opcode) {
      continue;
    }
    if (byte_at(frame, kFrame - 1) != sum_of(frame)) {
      wrong_sum = true;
    } else if (byte_at(frame, 1) != address) {
      other_address = byte_at(frame, 1);
    } else {
      found =
          PelcoDAnswer{static_cast<std::uint16_t>(byte_at(frame, 4) * 256 + byte_at(frame, 5)), i};
      i += kFrame - 1;
    }
  }
  if (found) {
    problem->clear();
  } else if (other_address != 0) {
    *problem = "the device answers with address " + std::to_string(other_address) + ", not " +
               std::to_string(address);
  } else if (wrong_sum) {
    *problem = "answers have a wrong sum: noise on the line, or a wrong baud";
  } else if (bytes.size() >= kFrame) {
    *problem = "bytes come, but no answer of Pelco-D among them: is it this protocol and baud?";
  }
  return found;
}

Query PelcoDProtocol::next() {
  const int zoom_turn = 2 * kReadingsPerZoom;
  if (options_.read_zoom && turn_ == 0 && asked_ != Answer::Kind::kZoom) {
    asked_ = Answer::Kind::kZoom;
  } else {
    asked_ = turn_ % 2 == 0 ? Answer::Kind::kPan : Answer::Kind::kTilt;
    turn_ = (turn_ + 1) % zoom_turn;
  }
  return {pelco_d_query(options_.address, opcode_of(asked_))};
}

Answer PelcoDProtocol::find(std::string_view bytes) {
  Answer answer;
  const auto found = find_pelco_d_answer(bytes, options_.address,
                                         static_cast<std::uint8_t>(opcode_of(asked_) + kToAnswer),
                                         &answer.problem);
  if (!found) {
    return answer;
  }
  answer.begin = found->begin;
  answer.kind = asked_;
  answer.zoom = found->value;
  answer.pan_deg = found->value * options_.pan_deg_per_step;
  answer.tilt_deg = found->value * options_.tilt_deg_per_step;
  const double angle_deg = asked_ == Answer::Kind::kPan    ? answer.pan_deg
                           : asked_ == Answer::Kind::kTilt ? answer.tilt_deg
                                                           : 0;
  if (!is_within_a_turn(angle_deg)) {
    answer.kind = Answer::Kind::kRefused;
    answer.problem = "an answer of " + std::to_string(found->value) +
                     " steps is more than a turn; are the degrees per step right?";
  }
  return answer;
}

}  // namespace alidade
