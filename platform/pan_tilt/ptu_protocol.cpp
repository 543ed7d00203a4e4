#include "platform/pan_tilt/ptu_protocol.h"

#include <cmath>
#include <cstdlib>
#include <utility>

#include "platform/system/shown.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

constexpr std::string_view kEndOfLine = "\r\n";
constexpr std::size_t kLongestLine = 80;  // bytes
constexpr double kMaxSteps = 1e7;         // more than any resolution has per turn
constexpr double kDegPerArcSecond = 1.0 / 3600;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// line: without its line end. nullopt: not an answer of a PTU.
std::optional<PtuLine> parse_line(std::string_view line) {
  const std::size_t sign = line.find_last_of("*!");
  if (sign == std::string_view::npos) {
    return std::nullopt;
  }
  PtuLine parsed;
  parsed.begin = sign;
  const std::string_view rest = trimmed(line.substr(sign + 1), " ");
  if (line[sign] == '!') {
    parsed.kind = PtuLine::Kind::kError;
    parsed.words = shown(rest);
    return parsed;
  }
  const std::size_t digit = rest.find_first_of("0123456789+-.");
  std::string words(trimmed(rest.substr(0, digit), " "));
  for (char& c : words) {
    if (c != ' ' && !(c >= 'a' && c <= 'z') && !(c >= 'A' && c <= 'Z')) {
      return std::nullopt;
    }
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  parsed.words = std::move(words);
  if (digit == std::string_view::npos) {
    return parsed;
  }
  std::size_t end = digit + 1;
  while (end < rest.size() && (is_digit(rest[end]) || rest[end] == '.')) {
    ++end;
  }
  // A unit may follow after a space; anything else is damage.
  if (end < rest.size() && rest[end] != ' ') {
    return std::nullopt;
  }
  const std::string number(rest.substr(digit, end - digit));
  char* parsed_to = nullptr;
  parsed.number = std::strtod(number.c_str(), &parsed_to);
  if (*parsed_to != '\0' || !is_digit(number.back()) || std::abs(parsed.number) > kMaxSteps) {
    return std::nullopt;
  }
  parsed.kind = PtuLine::Kind::kNumber;
  return parsed;
}

}  // namespace

std::optional<PtuLine> find_ptu_line(std::string_view bytes) {
  std::optional<PtuLine> found;
  std::size_t begin = 0;
  for (std::size_t end = bytes.find_first_of(kEndOfLine); end != std::string_view::npos;
       end = bytes.find_first_of(kEndOfLine, begin)) {
    if (std::optional<PtuLine> line = parse_line(bytes.substr(begin, end - begin))) {
      line->begin += begin;
      found = std::move(line);
    }
    begin = end + 1;
  }
  return found;
}

void PtuProtocol::restart() {
  asked_ = Asked::kFeedback;
  begun_ = false;
  fence_next_ = false;
  since_fence_ = 0;
  step_heard_ = 0;
  pan_deg_per_step_ = options_.pan_deg_per_step.value_or(0);
  tilt_deg_per_step_ = options_.tilt_deg_per_step.value_or(0);
}

void PtuProtocol::advance() {
  switch (asked_) {
    case Asked::kFeedback:
      asked_ = Asked::kEcho;
      return;
    case Asked::kEcho:
      asked_ = Asked::kImmediate;
      return;
    case Asked::kImmediate:
    case Asked::kPanStep:
    case Asked::kTiltStep:
      // A damaged answer would scale all later readings, so two equal answers are needed.
      asked_ = pan_deg_per_step_ <= 0    ? Asked::kPanStep
               : tilt_deg_per_step_ <= 0 ? Asked::kTiltStep
                                         : Asked::kPan;
      return;
    case Asked::kPan:
      asked_ = Asked::kTilt;
      return;
    case Asked::kTilt:
      asked_ = Asked::kPan;
      return;
    case Asked::kFence:
      asked_ = behind_fence_;
      advance();
      return;
  }
}

void PtuProtocol::ask_fence_next(bool of_number) {
  fence_next_ = true;
  fence_is_number_ = of_number;
}

void PtuProtocol::doubt() {
  if (!options_.verbose) {
    ask_fence_next(false);
  }
}

Query PtuProtocol::next() {
  if (!options_.verbose && since_fence_ >= kQueriesPerFence) {
    ask_fence_next(false);
  }
  if (fence_next_) {
    fence_next_ = false;
    since_fence_ = 0;
    behind_fence_ = asked_ == Asked::kFence ? behind_fence_ : asked_;
    asked_ = Asked::kFence;
    return {fence_is_number_ ? "PP " : "CI ", false};
  }
  if (begun_) {
    advance();
  }
  begun_ = true;
  ++since_fence_;
  switch (asked_) {
    case Asked::kFeedback:
      return {options_.verbose ? "FV " : "FT ", false};
    case Asked::kEcho:
      return {"ED ", false};
    case Asked::kImmediate:
      return {"CI ", false};
    case Asked::kPanStep:
      return {"PR "};
    case Asked::kTiltStep:
      return {"TR "};
    case Asked::kPan:
      return {"PP "};
    case Asked::kTilt:
    case Asked::kFence:
      break;
  }
  return {"TP "};
}

std::string PtuProtocol::give_up() {
  if (asked_ != Asked::kFence) {
    ask_fence_next(asked_ == Asked::kFeedback || asked_ == Asked::kEcho ||
                   asked_ == Asked::kImmediate);
  }
  return " ";
}

Answer PtuProtocol::find(std::string_view bytes) {
  Answer answer;
  const std::optional<PtuLine> line = find_ptu_line(bytes);
  if (!line) {
    if (bytes.find_first_of(kEndOfLine) != std::string_view::npos || bytes.size() > kLongestLine) {
      answer.problem =
          "bytes come, but no answer of a PTU among them: is it this protocol and baud?";
    }
    return answer;
  }
  answer.begin = line->begin;
  if (line->kind == PtuLine::Kind::kError) {
    // Limits are reported unasked ("!P", "!T") and answer no query.
    if (line->words.size() > 2) {
      answer.kind = asked_ == Asked::kFence ? Answer::Kind::kDone : Answer::Kind::kRefused;
    }
    answer.problem = "the device answers '! " + line->words + "'";
    return answer;
  }
  const bool number = line->kind == PtuLine::Kind::kNumber;
  switch (asked_) {
    case Asked::kFeedback:
    case Asked::kEcho:
    case Asked::kImmediate:
      answer.kind = number ? Answer::Kind::kNone : Answer::Kind::kDone;
      return answer;
    case Asked::kPanStep:
    case Asked::kTiltStep:
      if (number && line->words.empty() && line->number > 0) {
        if (line->number == step_heard_) {
          (asked_ == Asked::kPanStep ? pan_deg_per_step_ : tilt_deg_per_step_) =
              line->number * kDegPerArcSecond;
          step_heard_ = 0;
          ask_fence_next(false);
        } else {
          step_heard_ = line->number;
        }
        answer.kind = Answer::Kind::kDone;
      }
      return answer;
    case Asked::kFence:
      answer.kind = number == fence_is_number_ ? Answer::Kind::kDone : Answer::Kind::kNone;
      return answer;
    case Asked::kPan:
    case Asked::kTilt:
      break;
  }
  const bool pan = asked_ == Asked::kPan;
  const bool named = line->words == (pan ? "current pan position is" : "current tilt position is");
  if (!number || !(named || (line->words.empty() && !options_.verbose))) {
    return answer;
  }
  const double angle_deg = line->number * (pan ? pan_deg_per_step_ : tilt_deg_per_step_);
  if (!is_within_a_turn(angle_deg)) {
    answer.kind = Answer::Kind::kRefused;
    answer.problem = "a position of " + std::to_string(std::lround(line->number)) +
                     " steps is more than a turn; are the degrees per step right?";
    return answer;
  }
  answer.kind = pan ? Answer::Kind::kPan : Answer::Kind::kTilt;
  (pan ? answer.pan_deg : answer.tilt_deg) = angle_deg;
  return answer;
}

}  // namespace alidade
