#include "alidade_ros/sse_parser.h"

#include <utility>

namespace alidade_ros {

SseParser::SseParser(std::function<void(const SseEvent&)> on_event)
    : on_event_(std::move(on_event)) {}

bool SseParser::feed(const char* bytes, std::size_t size) {
  for (const char* end = bytes + size; bytes != end; ++bytes) {
    const bool second_half_of_line_end = after_cr_ && *bytes == '\n';
    after_cr_ = *bytes == '\r';
    if (second_half_of_line_end) continue;
    if (*bytes == '\n' || *bytes == '\r') {
      end_line();
    } else {
      line_ += *bytes;
    }
    if (line_.size() + data_.size() > kMaxEventBytes) return false;
  }
  return true;
}

void SseParser::end_line() {
  std::string line = std::exchange(line_, {});
  if (std::exchange(first_line_, false) && line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);
  if (line.empty()) {
    dispatch();
    return;
  }
  const std::size_t colon = line.find(':');
  const std::string field = line.substr(0, colon);
  std::string value = colon == std::string::npos ? "" : line.substr(colon + 1);
  if (!value.empty() && value.front() == ' ') value.erase(0, 1);
  if (field == "event") {
    type_ = value;
  } else if (field == "data") {
    data_ += value + '\n';
  } else if (field == "id" && value.find('\0') == std::string::npos) {
    id_ = value;
  }
}

void SseParser::dispatch() {
  SseEvent event;
  if (!type_.empty()) event.type = std::exchange(type_, {});
  event.data = std::exchange(data_, {});
  event.id = id_;
  if (event.data.empty()) return;
  event.data.pop_back();
  on_event_(event);
}

}  // namespace alidade_ros
