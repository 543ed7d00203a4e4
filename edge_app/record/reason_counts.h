#pragma once
// ReasonCounts: counts, by status, the records that are not in OE mode or, if OE mode is not asked
// for, those without orientation. Fixed size; add() allocates nothing.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "edge_app/record/orientation_record.h"
#include "edge_app/record/record_status.h"

namespace alidade {

class ReasonCounts {
 public:
  // wants_landmarks: OE mode is asked for.
  explicit ReasonCounts(bool wants_landmarks = true) : wants_landmarks_(wants_landmarks) {}

  void add(const OrientationRecord& record);
  [[nodiscard]] std::int64_t of(RecordStatus status) const {
    return counts_[static_cast<std::size_t>(status)];
  }
  // "not in OE mode: 12 records 'not calibrated', 3 'too few landmarks'", the most frequent first.
  // Names the zoom readings that had no calibration. Empty if there were no such records.
  [[nodiscard]] std::string line() const;

 private:
  struct Range {
    double low = 0;
    double high = 0;
  };

  bool wants_landmarks_;
  std::array<std::int64_t, kRecordStatuses.size()> counts_{};
  std::optional<Range> zooms_;  // readings without a calibration
};

}  // namespace alidade
