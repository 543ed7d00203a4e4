#pragma once
// TargetLines: makes one line of JSON of the targets after each frame. Event streams get the newest
// line, a file gets all. The targets' thread calls take(), which waits for no reader.

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
    std::int64_t id = 0;                      // from 1; 0: none yet
    std::shared_ptr<const std::string> json;  // without line feed
  };

  // Does not own `file`; null: no file. If a line cannot be written, that is logged, and the file
  // gets no more.
  explicit TargetLines(LineWriter* file) : file_(file) {}

  void take(const TargetsState& state);
  [[nodiscard]] Newest newest() const;

  // Must be called before the first line. take() calls on_news for each new line; on_news must not
  // wait.
  void set_on_news(std::function<void()> on_news) { on_news_ = std::move(on_news); }

 private:
  LineWriter* file_;
  bool file_failed_ = false;
  std::function<void()> on_news_ = [] {};
  mutable std::mutex mutex_;
  Newest newest_;
};

}  // namespace alidade
