#pragma once
// SseParser: Server-Sent Events out of a stream of bytes, as the HTML standard defines them.
//
// Lines end in LF, CR LF or CR, and may be cut anywhere between two calls. Several `data` lines of one
// event are joined by line feeds; comments, unknown fields and events without data are left out. An
// event that the stream's end cut off never comes out. Pure: bytes in, events out. Holds at most
// kMaxEventBytes.

#include <cstddef>
#include <functional>
#include <string>

namespace alidade_ros {

struct SseEvent {
  std::string type = "message";
  std::string data;
  std::string id;  // of this event or the last one before that had one
};

class SseParser {
 public:
  static constexpr std::size_t kMaxEventBytes = 1 << 20;

  explicit SseParser(std::function<void(const SseEvent&)> on_event);

  // False: an event is larger than kMaxEventBytes; the connection is of no use any more.
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
