#include "edge_app/output/target_lines.h"

#include <spdlog/spdlog.h>

#include "edge_app/output/targets_json.h"

namespace alidade {

void TargetLines::take(const TargetsState& state) {
  std::string line = targets_line(state);
  if (file_ != nullptr && !file_failed_ && !file_->write(line)) {
    // A failure here does not end the records.
    file_failed_ = true;
    spdlog::error("{}; no more targets are written there", file_->error());
  }
  line.pop_back();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    newest_ = {newest_.id + 1, std::make_shared<const std::string>(std::move(line))};
  }
  on_news_();
}

TargetLines::Newest TargetLines::newest() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return newest_;
}

}  // namespace alidade
