#include "edge_app/self_calibration/calibration_streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "edge_app/self_calibration/stale_repeats.h"

namespace alidade {
namespace {

using Counts = std::vector<std::optional<std::int64_t>>;

// Keeps only the longest part without a reconnection.
template <class Item>
void keep_longest_part(const char* stream, const char* unit, std::vector<Item>* items,
                       std::vector<std::string>* remarks) {
  std::size_t best_begin = 0;
  std::size_t best_end = 0;
  for (std::size_t begin = 0; begin < items->size();) {
    std::size_t end = begin + 1;
    while (end < items->size() && !(*items)[end].restarted) ++end;
    if (end - begin > best_end - best_begin) {
      best_begin = begin;
      best_end = end;
    }
    begin = end;
  }
  if (best_end - best_begin == items->size()) return;
  remarks->push_back(
      fmt::format("the connection of the {} was lost; the longest part without that is used, {} "
                  "of {} {}",
                  stream, best_end - best_begin, items->size(), unit));
  *items = std::vector<Item>(items->begin() + static_cast<std::ptrdiff_t>(best_begin),
                             items->begin() + static_cast<std::ptrdiff_t>(best_end));
}

// The index of each time on a steady grid of about this period; empty if they do not lie on one.
std::vector<std::int64_t> count_on_grid(const std::vector<double>& times, double period) {
  constexpr double kMaxDistance = 0.25;  // of the period
  // Counted from one item to the next, so an error of the period does no harm. Then checked on the
  // grid of the whole.
  std::vector<std::int64_t> counts = {0};
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double step = std::round((times[i] - times[i - 1]) / period);
    if (!(step >= 1) || step > 1e6) return {};
    counts.push_back(counts.back() + static_cast<std::int64_t>(step));
  }
  period = (times.back() - times.front()) / static_cast<double>(counts.back());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double expected = times.front() + period * static_cast<double>(counts[i]);
    if (std::abs(times[i] - expected) > kMaxDistance * period) return {};
  }
  return counts;
}

// The same with the usual step as period; else, if most items are missing, as on an overloaded
// machine, with the shortest step.
std::vector<std::int64_t> count_on_grid(const std::vector<double>& times) {
  if (times.size() < 3) return {};
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  std::sort(steps.begin(), steps.end());
  if (!(steps.front() > 0)) return {};
  std::vector<std::int64_t> counts = count_on_grid(times, steps[steps.size() / 2]);
  if (!counts.empty()) return counts;
  const auto single = std::upper_bound(steps.begin(), steps.end(), 1.5 * steps.front());
  const double period =
      std::accumulate(steps.begin(), single, 0.0) / static_cast<double>(single - steps.begin());
  return count_on_grid(times, period);
}

// Fills missing counts between two known ones, if as many are missing as fit between them.
void fill_counts(Counts* counts) {
  std::size_t before = counts->size();
  for (std::size_t i = 0; i < counts->size(); ++i) {
    if (!(*counts)[i]) continue;
    if (before < i) {
      const std::int64_t between = *(*counts)[i] - *(*counts)[before];
      const bool fits = between == static_cast<std::int64_t>(i - before);
      for (std::size_t k = before + 1; fits && k < i; ++k) (*counts)[k] = *(*counts)[k - 1] + 1;
    }
    before = i;
  }
}

// sequence(item) and sender_time(item) are optionals. A few items have no sender time, because it
// could not be true.
template <class Item, class Sequence, class SenderTime>
Counts count_items(const std::vector<Item>& items, Sequence sequence, SenderTime sender_time) {
  constexpr double kMostHave = 0.8;
  const auto all = [&items](auto has) { return std::all_of(items.begin(), items.end(), has); };
  Counts counts;
  if (all([&](const Item& item) { return sequence(item).has_value(); })) {
    for (const Item& item : items) counts.push_back(sequence(item));
    return counts;
  }
  std::vector<double> times;
  std::vector<std::size_t> timed;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!sender_time(items[i])) continue;
    times.push_back(*sender_time(items[i]));
    timed.push_back(i);
  }
  counts.resize(items.size());
  if (static_cast<double>(times.size()) < kMostHave * static_cast<double>(items.size()))
    return counts;
  const std::vector<std::int64_t> on_grid = count_on_grid(times);
  for (std::size_t k = 0; k < on_grid.size(); ++k) counts[timed[k]] = on_grid[k];
  fill_counts(&counts);
  return counts;
}

}  // namespace

void add_frames(std::vector<FrameStamp> stamps, CalibrationInput* input,
                CalibrationOptions* options, std::vector<std::string>* remarks) {
  keep_longest_part("video", "frames", &stamps, remarks);
  const Counts counts = count_items(
      stamps, [](const FrameStamp& stamp) { return stamp.sequence; },
      [](const FrameStamp& stamp) { return stamp.sender_time_s; });
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    input->frames.push_back({stamps[i].frame, stamps[i].receive_time_s, counts[i]});
  }
  options->image_stamps =
      input->noise.image_stamp_sigma_s ? StampNoise::kSymmetric : StampNoise::kOneSided;
}

bool is_polled(const std::vector<PanTiltSample>& samples) {
  return std::none_of(samples.begin(), samples.end(), [](const PanTiltSample& sample) {
    return sample.sequence.has_value() || sample.device_time_s.has_value();
  });
}

double stamp_of(const PanTiltSample& sample, bool polled) {
  const double width = sample.latest_time_s - sample.earliest_time_s;
  return polled ? sample.latest_time_s - width / 2 : sample.latest_time_s;
}

void add_telemetry(std::vector<PanTiltSample> samples, CalibrationInput* input,
                   CalibrationOptions* options, std::vector<std::string>* remarks) {
  const bool polled = is_polled(samples);
  // Polled samples have the host's times, which go on over a reconnection.
  if (!polled) keep_longest_part("telemetry", "samples", &samples, remarks);
  const Counts counts = count_items(
      samples, [](const PanTiltSample& sample) { return sample.sequence; },
      [](const PanTiltSample& sample) { return sample.device_time_s; });
  const std::vector<bool> stale = find_stale_repeats(samples);
  const auto stale_count = std::count(stale.begin(), stale.end(), true);
  if (stale_count > 0) {
    remarks->push_back(
        fmt::format("{} of {} samples of telemetry repeat an old angle while the head turns; "
                    "they are left out",
                    stale_count, samples.size()));
  }
  double square_widths = 0;
  std::vector<double> widths;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (stale[i]) continue;
    const PanTiltSample& sample = samples[i];
    const double width = sample.latest_time_s - sample.earliest_time_s;
    input->telemetry.push_back(
        {stamp_of(sample, polled), sample.pan_rad, sample.tilt_rad, counts[i]});
    square_widths += width * width;
    widths.push_back(width);
  }
  CalibrationNoise& noise = input->noise;
  if (polled && square_widths > 0 && !noise.telemetry_stamp_sigma_s) {
    noise.telemetry_stamp_sigma_s =
        std::sqrt(square_widths / static_cast<double>(widths.size()) / 12);
  }
  if (polled && square_widths > 0) {
    // A device answers at the same place of the interval in every poll.
    const auto middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
    std::nth_element(widths.begin(), middle, widths.end());
    noise.telemetry_common_sigma_s = *middle / std::sqrt(12.0);
  }
  // Only an interval distinguishes a poll from a stream whose device sends neither count nor time.
  options->telemetry_stamps = polled && square_widths > 0     ? StampNoise::kOwnTimes
                              : noise.telemetry_stamp_sigma_s ? StampNoise::kSymmetric
                                                              : StampNoise::kOneSided;
}

}  // namespace alidade
