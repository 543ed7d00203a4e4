#include "platform/video/rtsp_message.h"

#include <algorithm>
#include <cstdlib>

namespace alidade {
namespace {

std::string_view without_blanks(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// The next of `what` up to the separator, which goes, too.
std::string take(std::string_view* what, char separator) {
  const std::size_t end = std::min(what->find(separator), what->size());
  const std::string taken(without_blanks(what->substr(0, end)));
  what->remove_prefix(std::min(end + 1, what->size()));
  return taken;
}

}  // namespace

bool RtspMessage::parse(std::string_view text) {
  std::string_view first = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(first.size() + 1, text.size()));
  const std::string word = take(&first, ' ');
  if (word.rfind("RTSP/", 0) == 0) {
    const int code = std::atoi(take(&first, ' ').c_str());
    const std::string reason(without_blanks(first));
    if (code < 100 || code > 999) return false;
    gst_rtsp_message_init_response(cleared(), static_cast<GstRTSPStatusCode>(code), reason.c_str(),
                                   nullptr);
  } else {
    const GstRTSPMethod method = gst_rtsp_find_method(word.c_str());
    if (method == GST_RTSP_INVALID) return false;
    gst_rtsp_message_init_request(cleared(), method, take(&first, ' ').c_str());
  }
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (without_blanks(line).empty()) return true;
    if (line.find(':') == std::string_view::npos) continue;
    const std::string name = take(&line, ':');
    const std::string value(without_blanks(line));
    gst_rtsp_message_add_header_by_name(get(), name.c_str(), value.c_str());
  }
  return true;
}

}  // namespace alidade
