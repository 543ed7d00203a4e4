#include "platform/pan_tilt/visca_protocol.h"

#include <algorithm>
#include <cstdio>

namespace alidade {
namespace {

constexpr char kEnd = '\xFF';
constexpr std::size_t kHeader = 8;    // bytes
constexpr std::size_t kLongest = 12;  // bytes of a frame without its FF
constexpr std::uint16_t kInquiry = 0x0110;
constexpr std::uint16_t kControl = 0x0200;
constexpr std::uint16_t kControlReply = 0x0201;
constexpr std::string_view kBeginNumbering("\x01", 1);
constexpr std::string_view kWrongNumber("\x0F\x01", 2);
constexpr std::string_view kWrongMessage("\x0F\x02", 2);
constexpr const char* kNoHeader =
    "datagrams come without a VISCA header; would header: false be right?";

// Big endian, `count` bytes.
std::uint32_t number_at(std::string_view bytes, std::size_t begin, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = begin; i < begin + count; ++i) {
    value = value << 8U | byte_at(bytes, i);
  }
  return value;
}

std::string with_header(std::uint16_t type, std::uint32_t sequence, const std::string& payload) {
  const auto length = static_cast<std::uint32_t>(payload.size());
  std::string bytes;
  for (const std::uint32_t byte :
       {std::uint32_t{type} >> 8U, std::uint32_t{type}, length >> 8U, length, sequence >> 24U,
        sequence >> 16U, sequence >> 8U, sequence}) {
    bytes += static_cast<char>(byte & 0xFFU);
  }
  return bytes + payload;
}

// nullopt if one of the bytes is more than a nibble.
std::optional<unsigned> nibbles(std::string_view bytes) {
  unsigned value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (byte_at(bytes, i) > 0x0F) {
      return std::nullopt;
    }
    value = value << 4U | byte_at(bytes, i);
  }
  return value;
}

std::optional<int> signed_nibbles(std::string_view bytes) {
  const std::optional<unsigned> value = nibbles(bytes);
  if (!value) {
    return std::nullopt;
  }
  const unsigned sign = 1U << (4 * bytes.size() - 1);
  return static_cast<int>(*value & (sign - 1)) - static_cast<int>(*value & sign);
}

// frame: without its FF.
std::optional<ViscaFrame> parse_frame(std::string_view frame, int address) {
  if (frame.size() < 3 || byte_at(frame, 0) != 0x80U + 16U * static_cast<unsigned>(address)) {
    return std::nullopt;
  }
  ViscaFrame parsed;
  parsed.length = frame.size() + 1;
  if (byte_at(frame, 1) >> 4U == 6 && frame.size() == 3) {
    parsed.kind = ViscaFrame::Kind::kError;
    parsed.error = static_cast<int>(byte_at(frame, 2));
    return parsed;
  }
  if (byte_at(frame, 1) != 0x50) {
    return std::nullopt;
  }
  const std::string_view digits = frame.substr(2);
  if (digits.size() == 4) {
    const std::optional<unsigned> zoom = nibbles(digits);
    parsed.kind = ViscaFrame::Kind::kZoom;
    parsed.zoom = static_cast<int>(zoom.value_or(0));
    return zoom ? std::optional(parsed) : std::nullopt;
  }
  if (digits.size() < 8 || digits.size() > 10) {
    return std::nullopt;
  }
  const std::size_t of_pan = digits.size() == 8 ? 4 : 5;
  const std::optional<int> pan = signed_nibbles(digits.substr(0, of_pan));
  const std::optional<int> tilt = signed_nibbles(digits.substr(of_pan));
  if (!pan || !tilt) {
    return std::nullopt;
  }
  parsed.pan = *pan;
  parsed.tilt = *tilt;
  return parsed;
}

}  // namespace

std::optional<ViscaHeader> parse_visca_header(std::string_view datagram) {
  if (datagram.size() <= kHeader || number_at(datagram, 2, 2) != datagram.size() - kHeader) {
    return std::nullopt;
  }
  return ViscaHeader{static_cast<std::uint16_t>(number_at(datagram, 0, 2)),
                     number_at(datagram, 4, 4), datagram.substr(kHeader)};
}

std::optional<ViscaFrame> find_visca_frame(std::string_view bytes, int address) {
  std::optional<ViscaFrame> found;
  std::size_t begin = 0;
  for (std::size_t end = bytes.find(kEnd); end != std::string_view::npos;
       end = bytes.find(kEnd, begin)) {
    // Noise may come before the frame.
    for (std::size_t i = std::max(begin, end - std::min(end, kLongest)); i < end; ++i) {
      if (std::optional<ViscaFrame> frame = parse_frame(bytes.substr(i, end - i), address)) {
        frame->begin = i;
        found = frame;
      }
    }
    begin = end + 1;
  }
  return found;
}

const char* visca_error_text(int code) {
  switch (code) {
    case 0x01:
      return "wrong message length";
    case 0x02:
      return "syntax error";
    case 0x03:
      return "command buffer full";
    case 0x04:
      return "cancelled";
    case 0x05:
      return "no socket";
    case 0x41:
      return "not executable now";
    default:
      return "unknown error";
  }
}

void ViscaProtocol::restart() {
  numbered_ = false;
  sequence_ = 0;
  answered_ = false;
  other_number_ = false;
  fence_next_ = needs_fences();  // the line may still hold what another program asked
  since_fence_ = 0;
  turn_ = 0;
  heard_length_ = 0;
  answer_length_ = 0;
  asked_ = Asked::kPosition;
}

Query ViscaProtocol::next() {
  answered_ = false;
  other_number_ = false;
  if (options_.header && !numbered_) {
    asked_ = Asked::kNumbering;
    sequence_ = 0;
    return {with_header(kControl, 0, std::string(kBeginNumbering)), false};
  }
  const bool was_zoom = asked_ == Asked::kZoom || asked_ == Asked::kFence;
  if (fence_next_ || (needs_fences() && since_fence_ >= kQueriesPerFence)) {
    asked_ = Asked::kFence;
  } else if (options_.read_zoom && turn_ == 0 && !was_zoom) {
    asked_ = Asked::kZoom;
  } else {
    asked_ = Asked::kPosition;
    turn_ = (turn_ + 1) % kReadingsPerZoom;
  }
  fence_next_ = false;
  since_fence_ = asked_ == Asked::kPosition ? since_fence_ + 1 : 0;
  std::string query(1, static_cast<char>(0x80 + options_.address));
  query += asked_ == Asked::kPosition ? "\x09\x06\x12\xFF" : "\x09\x04\x47\xFF";
  if (options_.header) {
    sequence_ = number_stands_ ? heard_number_.value_or(1) : sequence_ + 1;
    return {with_header(kInquiry, sequence_, query), asked_ != Asked::kFence};
  }
  return {query, asked_ != Asked::kFence};
}

std::string ViscaProtocol::give_up() {
  if (asked_ == Asked::kNumbering) {
    numbered_ = true;  // a device that does not answer control datagrams is queried all the same
  } else if (!numbers_count_ && !answered_) {
    number_stands_ = !number_stands_;
  }
  numbers_count_ = numbers_count_ && !other_number_;
  fence_next_ = needs_fences() && asked_ == Asked::kPosition;
  return {};
}

std::string ViscaProtocol::peculiarity() const {
  if (!options_.header || numbers_count_) {
    return {};
  }
  return std::string("the device's answers ") +
         (heard_number_ ? "do not have the sequence numbers of their queries"
                        : "have no valid VISCA header") +
         "; they are matched by their order instead";
}

Answer ViscaProtocol::find(std::string_view bytes) {
  return options_.header ? find_in_datagram(bytes) : find_in_payload(bytes);
}

// Sony's tables list the errors among the control commands; devices send either type.
Answer ViscaProtocol::find_control(const ViscaHeader& header) {
  Answer answer;
  const std::string_view error = header.payload.substr(0, kWrongNumber.size());
  if (asked_ == Asked::kNumbering && header.type == kControlReply &&
      header.payload == kBeginNumbering) {
    numbered_ = true;
    answer.kind = Answer::Kind::kDone;
  } else if (error == kWrongNumber) {
    numbered_ = false;
    number_stands_ = false;
    answered_ = true;
    answer.kind = Answer::Kind::kRefused;
    answer.problem = "the device finds the sequence number wrong";
  } else if (error == kWrongMessage) {
    answered_ = true;
    answer.kind = Answer::Kind::kRefused;
    answer.problem = "the device finds the type of the message wrong";
  }
  return answer;
}

Answer ViscaProtocol::find_in_datagram(std::string_view bytes) {
  Answer answer;
  const std::optional<ViscaHeader> header = parse_visca_header(bytes);
  if (header && (header->type == kControlReply || header->type == kControl)) {
    return find_control(*header);
  }
  const std::optional<ViscaFrame> frame =
      find_visca_frame(header ? header->payload : bytes, options_.address);
  if (!header && !bytes.empty()) {
    answer.problem = kNoHeader;
  }
  // Of any type: some devices answer with an inquiry's.
  const bool is_its_own = header && header->sequence == sequence_;
  if (is_its_own && !frame) {
    answer = find_in_payload(header->payload);  // reports that it is not an answer
  }
  if (asked_ == Asked::kNumbering || !frame || !fits(*frame)) {
    return answer;
  }
  answered_ = true;
  if (is_its_own) {
    other_number_ = false;
    // A constant number proves nothing. Nor does a first one (1), which many of these devices
    // always send.
    numbers_count_ =
        numbers_count_ || (asked_ == Asked::kFence && !number_stands_ && sequence_ > 1);
  } else {
    heard_number_ = header ? std::optional(header->sequence) : std::nullopt;
    if (numbers_count_) {
      other_number_ = true;
      if (header) {
        answer.problem = "an answer with the sequence number " + std::to_string(header->sequence) +
                         " came to the query " + std::to_string(sequence_);
      }
      return answer;
    }
  }
  answer = find_in_payload(header ? header->payload : bytes);
  // A device that refuses, without a header, most likely does not know the header.
  if (!header && answer.kind == Answer::Kind::kRefused) answer.problem = kNoHeader;
  answer.begin = 0;
  return answer;
}

// Whether the frame's kind answers the latest query.
bool ViscaProtocol::fits(const ViscaFrame& frame) const {
  return frame.kind == ViscaFrame::Kind::kError ||
         (frame.kind == ViscaFrame::Kind::kPosition) == (asked_ == Asked::kPosition);
}

Answer ViscaProtocol::find_in_payload(std::string_view bytes) {
  Answer answer;
  const std::optional<ViscaFrame> frame = find_visca_frame(bytes, options_.address);
  if (!frame) {
    if (bytes.find(kEnd) != std::string_view::npos) {
      answer.problem =
          "bytes come, but no answer of VISCA among them: is it this address and baud?";
    }
    return answer;
  }
  answer.begin = frame->begin;
  if (frame->kind == ViscaFrame::Kind::kError) {
    // An error also completes a fence: the device does not know the zoom, but older answers are
    // out.
    answer.kind = asked_ == Asked::kFence ? Answer::Kind::kDone : Answer::Kind::kRefused;
    char code[8];
    std::snprintf(code, sizeof code, "%02X", static_cast<unsigned>(frame->error));
    answer.problem = std::string("the device answers '") + visca_error_text(frame->error) +
                     "' (error " + code + ")";
  } else if (frame->kind == ViscaFrame::Kind::kZoom && asked_ != Asked::kPosition) {
    answer.kind = options_.read_zoom ? Answer::Kind::kZoom : Answer::Kind::kDone;
    answer.zoom = frame->zoom;
  } else if (frame->kind == ViscaFrame::Kind::kPosition && asked_ == Asked::kPosition) {
    if (answer_length_ == 0 && frame->length == heard_length_) {
      answer_length_ = heard_length_;
    }
    const bool is_first = heard_length_ == 0;
    heard_length_ = frame->length;
    answer.pan_deg = frame->pan * options_.pan_deg_per_step;
    answer.tilt_deg = frame->tilt * options_.tilt_deg_per_step;
    if (!is_within_a_turn(answer.pan_deg) || !is_within_a_turn(answer.tilt_deg)) {
      answer.kind = Answer::Kind::kRefused;
      answer.problem = "a position of " + std::to_string(frame->pan) + ", " +
                       std::to_string(frame->tilt) +
                       " steps is more than a turn; are the degrees per step right?";
    } else if (frame->length != answer_length_) {
      answer.kind = Answer::Kind::kRefused;
      answer.problem = is_first ? "one position only, and its length was not confirmed by a second"
                                : "positions of changing length: noise on the line";
    } else {
      answer.kind = Answer::Kind::kPanTilt;
    }
  }
  return answer;
}

}  // namespace alidade
