#pragma once
// MessageList: lines for the log, until they are taken. Allocates. One thread.

#include <string>
#include <utility>
#include <vector>

namespace alidade {

struct CalibrationMessage {
  std::string text;         // one line
  bool is_warning = false;  // something is wrong, or a calibration is no longer what it was
};

class MessageList {
 public:
  void say(const std::string& line) { lines_.push_back({line, false}); }
  void warn(const std::string& line) { lines_.push_back({line, true}); }
  // Says the line unless it is the one that say_once() or warn_once() said last.
  void say_once(const std::string& line) {
    if (is_new(line)) say(line);
  }
  void warn_once(const std::string& line) {
    if (is_new(line)) warn(line);
  }
  // The next say_once() or warn_once() says its line in any case.
  void forget_said() { said_.clear(); }

  [[nodiscard]] std::vector<CalibrationMessage> take() { return std::exchange(lines_, {}); }

 private:
  bool is_new(const std::string& line) {
    if (line == said_) return false;
    said_ = line;
    return true;
  }

  std::vector<CalibrationMessage> lines_;
  std::string said_;
};

}  // namespace alidade
