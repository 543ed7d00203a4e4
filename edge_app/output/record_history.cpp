#include "edge_app/output/record_history.h"

#include <algorithm>
#include <cmath>

#include "core/model/calibration.h"

namespace alidade {
namespace {

double largest_sigma(const OrientationRecord::Orientation& orientation) {
  return *std::max_element(orientation.sigma_rad.begin(), orientation.sigma_rad.end());
}

double clock_offset_sigma(const PlainCalibration& camera) {
  constexpr auto kRow = static_cast<std::size_t>(Parameter::kClockOffset);
  return std::sqrt(camera.covariance[kRow * (kParameterCount + 1)]);
}

}  // namespace

void RecordHistory::add(const OrientationRecord& record) {
  const double time_s = record.time_s.value_or(record.receive_time_s);
  if (!rows_.empty() && time_s < rows_.back().sample.time_s) rows_.clear();
  if (rows_.empty() || time_s >= rows_.back().sample.time_s + step_s_) {
    HistorySample& first = rows_.emplace_back().sample;
    first.time_s = time_s;
    first.mode = record.mode;
    if (record.orientation) {
      first.pan_rad = record.orientation->pan_rad;
      first.tilt_rad = record.orientation->tilt_rad;
    }
    first.landmarks = record.landmarks;
    first.residual_px = record.residual_px;
    while (rows_.front().sample.time_s < time_s - length_s_) rows_.pop_front();
  }
  Row& row = rows_.back();
  HistorySample& sample = row.sample;
  if (record.latency_s)
    sample.latency_s = std::max(sample.latency_s.value_or(*record.latency_s), *record.latency_s);
  if (record.orientation)
    sample.sigma_rad = std::max(sample.sigma_rad.value_or(0), largest_sigma(*record.orientation));
  if (record.calibrated) {
    sample.clock_offset_s = record.camera.clock_offset;
    sample.clock_offset_sigma_s = clock_offset_sigma(record.camera);
  }
  if (record.telemetry_error) {
    row.error_squares.pan += record.telemetry_error->pan * record.telemetry_error->pan;
    row.error_squares.tilt += record.telemetry_error->tilt * record.telemetry_error->tilt;
    ++row.errors;
    const auto count = static_cast<double>(row.errors);
    sample.telemetry_error = PanTilt<double>{std::sqrt(row.error_squares.pan / count),
                                             std::sqrt(row.error_squares.tilt / count)};
  }
}

std::vector<HistorySample> RecordHistory::samples() const {
  std::vector<HistorySample> out;
  out.reserve(rows_.size());
  for (const Row& row : rows_) out.push_back(row.sample);
  return out;
}

}  // namespace alidade
