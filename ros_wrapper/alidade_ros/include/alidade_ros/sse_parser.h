#pragma once
// SseParser: extracts Server-Sent Events from a byte stream, as defined by the HTML standard. Lines
// end in LF, CR LF or CR, and may be cut anywhere between two calls. Several `data` lines of an
// event are joined by line feeds. Comments, unknown fields and events without data are skipped. An
// event cut off by the end of the stream is never returned. No I/O. Holds at most kMaxEventBytes.

#include <cstddef>
#include <functional>
#include <string>

namespace alidade_ros {

struct SseEvent {
  std::string type = "message";
  std::string data;
  std::string id;  // of this event, or of the last one that had an id
};

class SseParser {
 public:
  static constexpr std::size_t kMaxEventBytes = 1 << 20;

  explicit SseParser(std::function<void(const SseEvent&)> on_event);

  // False: an event is larger than kMaxEventBytes; the connection must be closed.
  [[nodiscard]] bool feed(const char* bytes, std::size_t size);

 private:
  void end_line();
  void dispatch();

  std::function<void(const SseEvent&)> on_event_;
  std::string line_;
  std::string type_;
  std::string data_;
  std::string id_;
  bool first_line_ = true;
  bool after_cr_ = false;
};

}  // namespace alidade_ros
