#pragma once
// TargetLines: targets after each frame as a line of JSON, made once: the newest for the event streams, all for a file.
// take() is called on the thread of the targets and waits for no reader.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "edge_app/output/line_writer.h"
#include "edge_app/tracking/target_state.h"

namespace alidade {

class TargetLines {
 public:
  struct Newest {
    std::int64_t id = 0;                      // counted from 1; 0: there is none
    std::shared_ptr<const std::string> json;  // without line feed
  };

  // file: borrowed; null: none.
  explicit TargetLines(LineWriter* file) : file_(file) {}

  void take(const TargetsState& state);
  [[nodiscard]] Newest newest() const;

  // Before the first line. Called by take() when there is something new; must not wait.
  void set_on_news(std::function<void()> on_news) { on_news_ = std::move(on_news); }

 private:
  LineWriter* file_;
  bool file_failed_ = false;
  std::function<void()> on_news_ = [] {};
  mutable std::mutex mutex_;
  Newest newest_;
};

}  // namespace alidade
