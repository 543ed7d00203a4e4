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

// Takes the text up to the separator, and removes both from *what.
std::string take(std::string_view* what, char separator) {
  const std::size_t end = std::min(what->find(separator), what->size());
  std::string taken(without_blanks(what->substr(0, end)));
  what->remove_prefix(std::min(end + 1, what->size()));
  return taken;
}

std::string_view take_line(std::string_view* text) {
  const std::string_view line = text->substr(0, text->find('\n'));
  text->remove_prefix(std::min(line.size() + 1, text->size()));
  return line;
}

}  // namespace

bool RtspMessage::parse(std::string_view text) {
  std::string_view first = take_line(&text);
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
    std::string_view line = take_line(&text);
    if (without_blanks(line).empty()) break;
    if (line.find(':') == std::string_view::npos) continue;
    const std::string name = take(&line, ':');
    std::string value(without_blanks(line));
    // A header continues in the following lines that start with a blank.
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) {
      const std::string_view more = without_blanks(take_line(&text));
      if (!more.empty()) value.append(" ").append(more);
    }
    gst_rtsp_message_add_header_by_name(get(), name.c_str(), value.c_str());
  }
  gst_rtsp_message_set_body(get(), reinterpret_cast<const guint8*>(text.data()),
                            static_cast<guint>(text.size()));
  return true;
}

std::string RtspMessage::text() {
  std::string first;
  if (type() == GST_RTSP_MESSAGE_REQUEST) {
    const auto& request = message_.type_data.request;
    first = std::string(gst_rtsp_method_as_text(request.method)) + " " + request.uri + " RTSP/1.0";
  } else {
    first = "RTSP/1.0 " + std::to_string(status()) + " " + reason();
  }
  GString* headers = g_string_new(nullptr);
  gst_rtsp_message_append_headers(get(), headers);
  std::string all = first + "\r\n" + headers->str + "\r\n";
  g_string_free(headers, TRUE);
  return all;
}

}  // namespace alidade
