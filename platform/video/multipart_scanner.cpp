#include "platform/video/multipart_scanner.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace alidade {
namespace {

constexpr std::size_t kMaxBoundary = 200;      // bytes of a line; RFC 2046 permits a boundary of 70
constexpr std::size_t kMaxHeaders = 8192;      // bytes of one part's headers
constexpr int kMaxHeaderLines = 64;            // of one part
constexpr std::size_t kMaxDashes = 32;         // before a boundary, including the line end before
                                               // them
constexpr std::size_t kMaxDelimiterTail = 32;  // dashes and blanks between boundary and line end
constexpr std::size_t kMaxName = 32;           // bytes of a header name directly behind a boundary
constexpr const char* kHeaderBlanks = " \t\r\n";

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string lower(std::string_view text) {
  std::string copy(text);
  std::transform(copy.begin(), copy.end(), copy.begin(), [](char c) { return lower(c); });
  return copy;
}

std::string_view stripped(std::string_view text, const char* what) {
  const std::size_t first = text.find_first_not_of(what);
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(what) - first + 1);
}

// The boundary without the dashes around it; empty if it is not printable. A printable one cannot
// be taken for the end of a picture.
std::string core_of(std::string_view boundary) {
  const bool printable =
      std::all_of(boundary.begin(), boundary.end(), [](char c) { return c >= ' ' && c <= '~'; });
  return std::string(printable ? stripped(boundary, "-") : std::string_view());
}

// Digits only; nullopt if it is not such a number or too large to matter.
std::optional<std::size_t> parse_length(std::string_view text, std::size_t max) {
  if (text.empty()) {
    return std::nullopt;
  }
  std::size_t value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') {
      return std::nullopt;
    }
    value = 10 * value + static_cast<std::size_t>(c - '0');
    if (value > max) {
      return std::nullopt;
    }
  }
  return value;
}

std::optional<double> parse_seconds(std::string_view text) {
  const std::string copy(text);  // strtod needs the terminating null
  char* end = nullptr;
  const double value = std::strtod(copy.c_str(), &end);
  if (end == copy.c_str() || *end != '\0' || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

// What comes directly after a boundary, without a line end.
enum class Follows { kNothing, kPart, kUnknown };

// kPart: a header or a JPEG. kUnknown: more bytes are needed.
Follows what_follows(std::string_view bytes) {
  if (bytes.empty()) return Follows::kUnknown;
  if (bytes[0] == '\xFF') {
    if (bytes.size() < 2) return Follows::kUnknown;
    return bytes[1] == '\xD8' ? Follows::kPart : Follows::kNothing;
  }
  for (std::size_t i = 0; i < kMaxName; ++i) {
    if (i == bytes.size()) return Follows::kUnknown;
    const char c = lower(bytes[i]);
    if (c == ':' && i > 0) return Follows::kPart;
    const bool in_name = (c >= 'a' && c <= 'z') || (i > 0 && (c == '-' || c == '_'));
    if (!in_name) return Follows::kNothing;
  }
  return Follows::kNothing;
}

// Start of the first header in a line like "--boundaryContent-Type: image/jpeg"; npos: none.
std::size_t header_behind_boundary(std::string_view line) {
  const std::string small = lower(line);
  return std::min(small.find("content-"), small.find("x-timestamp:"));
}

bool jpeg_ends_at(std::string_view bytes, std::size_t end) {
  return end >= 2 && bytes[end - 2] == '\xFF' && bytes[end - 1] == '\xD9';
}

}  // namespace

bool parse_multipart_type(std::string_view content_type, std::string* boundary) {
  boundary->clear();
  const std::string small = lower(content_type);
  if (small.rfind("multipart/", 0) != 0) {
    return false;
  }
  for (std::size_t at = small.find(';'); at != std::string::npos; at = small.find(';', at + 1)) {
    const std::string_view rest = std::string_view(small).substr(at + 1);
    const std::size_t name_at = rest.find_first_not_of(kHeaderBlanks);
    constexpr std::string_view kName = "boundary";
    if (name_at == std::string_view::npos || rest.substr(name_at, kName.size()) != kName) {
      continue;
    }
    const std::size_t equals = rest.find_first_not_of(kHeaderBlanks, name_at + kName.size());
    if (equals == std::string_view::npos || rest[equals] != '=') {
      continue;
    }
    const std::string_view value =
        stripped(content_type.substr(at + 1 + equals + 1), kHeaderBlanks);
    *boundary = !value.empty() && value.front() == '"'
                    ? value.substr(1, value.find('"', 1) - 1)
                    : stripped(value.substr(0, value.find(';')), kHeaderBlanks);
    return true;
  }
  return true;
}

MultipartScanner::MultipartScanner(std::string_view boundary, std::size_t max_part_bytes)
    : core_(core_of(boundary)),
      max_part_bytes_(max_part_bytes),
      state_(core_.empty() ? State::kLearnBoundary : State::kSkip) {}

void MultipartScanner::feed(std::string_view bytes, double arrival_s) {
  if (bytes.empty()) {
    return;
  }
  arrival_s_ = arrival_s;
  if (std::exchange(stamp_next_byte_, false)) {
    part_.first_byte_s = arrival_s;
  }
  if (used_ > buffer_.size() / 2) buffer_.erase(0, std::exchange(used_, 0));
  buffer_.append(bytes);
  while (advance()) {
  }
}

bool MultipartScanner::next(MultipartPart* part) {
  if (whole_.empty()) {
    return false;
  }
  *part = std::move(whole_.front());
  whole_.pop_front();
  return true;
}

std::size_t MultipartScanner::missing_bytes() const {
  const bool known = state_ == State::kBody && lengths_hold_ && content_length_;
  return known && *content_length_ > pending_bytes() ? *content_length_ - pending_bytes() : 1;
}

// False: more bytes are needed.
bool MultipartScanner::advance() {
  switch (state_) {
    case State::kLearnBoundary:
      return learn_boundary();
    case State::kSkip:
      return skip_to_delimiter();
    case State::kHeaders:
      return read_header_line();
    case State::kBody:
      return read_body();
  }
  return false;
}

void MultipartScanner::drop_front(std::size_t count) {
  used_ += count;
  scan_ -= std::min(scan_, count);
}

bool MultipartScanner::learn_boundary() {
  const std::size_t end = rest().find('\n');
  if (end == std::string::npos) {
    if (pending_bytes() > kMaxBoundary) {
      buffer_.assign(kMaxBoundary, ' ');  // not a boundary; only its line end still matters
      used_ = 0;
    }
    return false;
  }
  const std::string_view line = stripped(rest().substr(0, end), kHeaderBlanks);
  const bool told = line.substr(0, 2) == "--" && end < kMaxBoundary;
  core_ =
      told ? core_of(stripped(line.substr(0, header_behind_boundary(line)), kHeaderBlanks)) : "";
  if (core_.empty()) {
    drop_front(end + 1);
  } else {
    state_ = State::kSkip;
  }
  return true;
}

// Advances scan_ as far as it can decide.
std::optional<MultipartScanner::Delimiter> MultipartScanner::find_delimiter() {
  const std::string_view bytes = rest();
  for (;;) {
    const std::size_t at = bytes.find(core_, scan_);
    if (at == std::string::npos) {
      scan_ = std::max(scan_, bytes.size() - std::min(bytes.size(), core_.size() - 1));
      return std::nullopt;
    }
    scan_ = at;
    std::size_t begin = at;
    while (begin > 0 && at - begin < kMaxDashes - 2 && bytes[begin - 1] == '-') {
      --begin;
    }
    const bool at_line_start = begin == 0 || bytes[begin - 1] == '\n';
    const std::size_t after = at + core_.size();
    std::size_t end = after;
    while (end < bytes.size() && end - after < kMaxDelimiterTail &&
           std::string_view("- \t\r").find(bytes[end]) != std::string_view::npos) {
      ++end;
    }
    if (end == bytes.size()) {
      return std::nullopt;  // the line may continue
    }
    const bool dashed = at - begin >= 2;
    const bool ends_line = bytes[end] == '\n' && (at_line_start || dashed);
    const bool may_go_on =
        dashed && bytes.substr(after, end - after).find('-') == std::string_view::npos;
    const Follows follows = may_go_on ? what_follows(bytes.substr(end)) : Follows::kNothing;
    if (!ends_line && follows == Follows::kUnknown) return std::nullopt;
    if (!ends_line && follows == Follows::kNothing) {
      ++scan_;
      continue;
    }
    if (begin > 0 && bytes[begin - 1] == '\n') {
      --begin;
      if (begin > 0 && bytes[begin - 1] == '\r') {
        --begin;
      }
    }
    return Delimiter{begin, ends_line ? end + 1 : end};
  }
}

void MultipartScanner::begin_part(std::size_t delimiter_end) {
  drop_front(delimiter_end);
  scan_ = 0;
  part_ = MultipartPart{};
  part_.first_byte_s = arrival_s_;
  stamp_next_byte_ = pending_bytes() == 0;
  header_bytes_ = 0;
  header_lines_ = 0;
  content_length_.reset();
  state_ = State::kHeaders;
}

bool MultipartScanner::skip_to_delimiter() {
  if (const std::optional<Delimiter> delimiter = find_delimiter()) {
    begin_part(delimiter->end);
    return true;
  }
  // Bytes before scan_ are useless, except the dashes and the line end before a boundary.
  const std::size_t kept = std::min(scan_, kMaxDelimiterTail);
  drop_front(scan_ - kept);
  return false;
}

bool MultipartScanner::read_header_line() {
  const std::string_view bytes = rest().substr(0, kMaxHeaders + 1);
  if (!bytes.empty() && bytes.front() == '\xFF') {  // a picture without the empty line before it
    state_ = State::kBody;
    return true;
  }
  const std::size_t end = bytes.find('\n');
  if (header_bytes_ + std::min(end, bytes.size()) > kMaxHeaders ||
      header_lines_ == kMaxHeaderLines) {
    ++discarded_;
    state_ = State::kSkip;
    return true;
  }
  if (end == std::string::npos) {
    return false;
  }
  const std::string line(stripped(bytes.substr(0, end), kHeaderBlanks));
  if (stripped(line, "-") == core_) {  // the part has no body
    begin_part(end + 1);
    return true;
  }
  header_bytes_ += end + 1;
  ++header_lines_;
  drop_front(end + 1);
  if (line.empty()) {
    scan_ = 0;
    state_ = State::kBody;
  } else {
    take_header(line);
  }
  return true;
}

void MultipartScanner::take_header(std::string_view line) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) {
    return;
  }
  const std::string name = lower(stripped(line.substr(0, colon), kHeaderBlanks));
  const std::string_view value = stripped(line.substr(colon + 1), kHeaderBlanks);
  if (name == "content-length") {
    content_length_ = parse_length(value, max_part_bytes_);
  } else if (name == "content-type") {
    part_.content_type = lower(stripped(value.substr(0, value.find(';')), kHeaderBlanks));
  } else if (name == "x-timestamp") {
    part_.timestamp_s = parse_seconds(value);
  }
}

bool MultipartScanner::read_body() {
  const std::optional<Delimiter> delimiter = find_delimiter();
  const std::size_t known_end = delimiter ? delimiter->begin : pending_bytes();
  if (content_length_ && *content_length_ <= known_end && jpeg_ends_at(rest(), *content_length_)) {
    lengths_hold_ = true;
    end_part(*content_length_);
    return true;
  }
  // Without a delimiter, the last bytes may be the start of one.
  const std::size_t not_body =
      delimiter ? 0 : kMaxDashes + core_.size() + kMaxDelimiterTail + kMaxName;
  if (known_end > max_part_bytes_ + not_body) {
    ++discarded_;
    state_ = State::kSkip;
    return true;
  }
  if (!delimiter) {
    return false;
  }
  lengths_hold_ = false;
  end_part(delimiter->begin);
  return true;
}

// The rest is skipped up to the delimiter.
void MultipartScanner::end_part(std::size_t body_end) {
  part_.body = rest().substr(0, body_end);
  drop_front(body_end);
  scan_ = 0;
  state_ = State::kSkip;
  if (!part_.body.empty()) {
    whole_.push_back(std::move(part_));
  }
}

}  // namespace alidade
