#pragma once
// Remarks: notes of a source on its stream, other than losses, each kind once. Thread-safe.

#include <cstdio>
#include <deque>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace alidade {

class Remarks {
 public:
  void say(int kind, std::string text) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (said_.insert(kind).second) new_.push_back(std::move(text));
  }

  // The next note not taken yet; empty: none.
  [[nodiscard]] std::string take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (new_.empty()) return "";
    std::string text = std::move(new_.front());
    new_.pop_front();
    return text;
  }

 private:
  std::mutex mutex_;
  std::set<int> said_;
  std::deque<std::string> new_;
};

// The remark on a time stamp that cannot be true, as it is off by off_s.
[[nodiscard]] inline std::string bad_stamp_remark(double off_s) {
  char text[192];
  std::snprintf(text, sizeof text,
                "a picture's time stamp cannot be true: it is %+.3g s off the others; such stamps "
                "are counted and left out: a fault of the camera's clock",
                off_s);
  return text;
}

}  // namespace alidade
