#include "core/calibration/recording_clocks.h"

#include <cmath>
#include <cstddef>
#include <vector>

namespace alidade::internal {

namespace {

// Fits the items' stamps and sequence numbers, given what is known of the stream.
template <class Item>
ClockLine fit_stream(const std::vector<Item>& items, const std::vector<std::size_t>& used,
                     StampNoise stamps, ClockInput clock) {
  for (const std::size_t i : used) {
    clock.stamp_s.push_back(items[i].stamp_s);
    clock.sequence.push_back(items[i].sequence);
  }
  clock.one_sided = stamps == StampNoise::kOneSided;
  clock.own_times = stamps == StampNoise::kOwnTimes;
  return fit_clock_line(clock);
}

}  // namespace

double RecordingClocks::stamps_variance() const {
  return std::pow(image.offset_sigma_s, 2) + std::pow(telemetry.offset_sigma_s, 2) +
         std::pow(telemetry_common_sigma_s, 2);
}

double period_variance(const ClockLine& clock) {
  return clock.steady ? std::pow(clock.period_sigma_s / clock.period_s, 2) : 0;
}

StreamTiming timing_of(const ClockLine& clock) {
  return {clock.steady,         clock.period_s,      clock.period_sigma_s,
          clock.offset_sigma_s, clock.stamp_sigma_s, clock.lost};
}

RecordingClocks fit_clocks(const CalibrationInput& input, const CalibrationOptions& options,
                           SelectedInput* selected) {
  const CalibrationNoise& noise = input.noise;
  RecordingClocks clocks;
  ClockInput image;
  image.stamp_sigma_s = noise.image_stamp_sigma_s;
  image.period_s = noise.image_period_s;
  image.period_sigma_s = noise.image_period_sigma_s;
  clocks.image = fit_stream(input.frames, selected->frame_index, options.image_stamps, image);
  ClockInput telemetry;
  telemetry.stamp_sigma_s = noise.telemetry_stamp_sigma_s;
  telemetry.period_s = noise.telemetry_period_s;
  telemetry.period_sigma_s = noise.telemetry_period_sigma_s;
  clocks.telemetry =
      fit_stream(input.telemetry, selected->telemetry_index, options.telemetry_stamps, telemetry);
  clocks.telemetry_common_sigma_s = noise.telemetry_common_sigma_s;

  AdjustmentData& data = selected->data;
  data.frame_time_s = clocks.image.time_s;
  data.reference_s = clocks.telemetry.middle_s;
  for (std::size_t i = 0; i < selected->telemetry_index.size(); ++i) {
    const auto& sample = input.telemetry[selected->telemetry_index[i]];
    data.telemetry.push_back({clocks.telemetry.time_s[i],
                              Vector2<double>(sample.pan_rad, sample.tilt_rad),
                              Vector2<double>::Ones()});
  }
  return clocks;
}

}  // namespace alidade::internal
