#include "edge_app/record/reason_counts.h"
#include "platform/system/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace alidade {

void ReasonCounts::add(const OrientationRecord& record) {
  const bool counts =
      wants_landmarks_ ? record.mode != RecordMode::kOe : record.mode == RecordMode::kNone;
  if (!counts) return;
  ++counts_[static_cast<std::size_t>(record.status)];
  if (record.status != RecordStatus::kOtherZoom || !record.zoom) return;
  const double zoom = *record.zoom;
  if (!zooms_) zooms_ = {zoom, zoom};
  zooms_ = {std::min(zooms_->low, zoom), std::max(zooms_->high, zoom)};
}

std::string ReasonCounts::line() const {
  std::vector<RecordStatus> seen;
  for (const RecordStatus status : kRecordStatuses) {
    if (of(status) > 0) seen.push_back(status);
  }
  if (seen.empty()) return "";
  std::stable_sort(seen.begin(), seen.end(),
                   [this](RecordStatus a, RecordStatus b) { return of(a) > of(b); });
  std::string line = wants_landmarks_ ? "not in OE mode: " : "without orientation: ";
  for (const RecordStatus status : seen) {
    const bool first = status == seen.front();
    line += fmt::format("{} '{}'",
                        first ? counted(of(status), "record") : ", " + std::to_string(of(status)),
                        to_string(status));
    if (status != RecordStatus::kOtherZoom || !zooms_) continue;
    line += zooms_->low == zooms_->high
                ? fmt::format(" (zoom reading {})", zooms_->low)
                : fmt::format(" (zoom readings {} to {})", zooms_->low, zooms_->high);
  }
  return line;
}

}  // namespace alidade
