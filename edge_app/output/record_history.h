#pragma once
// RecordHistory: what plots need of the records of the last length_s, in rows of at least step_s. A
// row begins with the first record that comes step_s or more after the row before began. A record
// counts at its time_s, or at its receive_time_s if it has none. If time goes back, all is
// forgotten. Memory is bounded by length_s / step_s rows. For one thread.

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/model/angle.h"
#include "edge_app/record/orientation_record.h"

namespace alidade {

struct HistorySample {
  // The row's first record:
  double time_s = 0;
  RecordMode mode = RecordMode::kNone;
  std::optional<double> pan_rad;
  std::optional<double> tilt_rad;
  int landmarks = 0;
  std::optional<double> residual_px;
  // All records of the row:
  std::optional<double> latency_s;                 // the longest
  std::optional<double> sigma_rad;                 // the largest about any of the camera's axes
  std::optional<PanTilt<double>> telemetry_error;  // rad, root mean square
  // The row's last record with a calibration:
  std::optional<double> clock_offset_s;
  std::optional<double> clock_offset_sigma_s;
};

class RecordHistory {
 public:
  // s, both > 0.
  RecordHistory(double length_s, double step_s) : length_s_(length_s), step_s_(step_s) {}

  void add(const OrientationRecord& record);
  // Oldest first.
  [[nodiscard]] std::vector<HistorySample> samples() const;

 private:
  struct Row {
    HistorySample sample;
    PanTilt<double> error_squares;  // rad^2, sums
    std::int64_t errors = 0;
  };

  const double length_s_;
  const double step_s_;
  std::deque<Row> rows_;
};

}  // namespace alidade
