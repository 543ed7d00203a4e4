#pragma once
// MessageList: lines for the log, until they are taken. Allocates. One thread.

#include <string>
#include <utility>
#include <vector>

namespace alidade {

class MessageList {
 public:
  void say(const std::string& line) { lines_.push_back(line); }
  // Says the line unless it is the one that say_once() said last.
  void say_once(const std::string& line) {
    if (line == said_) return;
    said_ = line;
    say(line);
  }
  // The next say_once() says its line in any case.
  void forget_said() { said_.clear(); }

  [[nodiscard]] std::vector<std::string> take() { return std::exchange(lines_, {}); }

 private:
  std::vector<std::string> lines_;
  std::string said_;
};

}  // namespace alidade
