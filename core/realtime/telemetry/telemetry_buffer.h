#pragma once
// TelemetryBuffer: the latest pan/tilt samples in order of time. Gives the mount's angle, rate and
// covariance at a time (PTCEE 22 to 25; see telemetry_interpolation.h).
// Times are seconds of the telemetry clock: an image taken at image time t is looked up at t +
// clock_offset. Angles are rad as measured, any turn. Differences go the short way round, so
// neighbouring samples must be less than half a turn apart. Late samples are inserted in order. A
// query up to max_extrapolation_s beyond the samples extrapolates the nearest ones at constant
// rate, with growing covariance; a query farther beyond is refused. Stale repeats: see repeat().
// Fixed memory, trivially copyable, no allocation. For one thread: the owner's.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

struct TelemetrySample {
  double time_s = 0;        // telemetry clock
  double time_sigma_s = 0;  // s
  double pan = 0;           // rad, measured
  double tilt = 0;          // rad, measured
};

struct TelemetryLimits {
  double max_gap_s = 0.5;             // no answer between samples farther apart
  double max_extrapolation_s = 0.25;  // before the oldest and after the newest trusted angle
  double max_repeat_s = 0.1;  // longest time between two measurements of the device; 0: each is new

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const {
    const auto not_negative = [](double v) { return std::isfinite(v) && v >= 0; };
    const char* problem = nullptr;
    if (!not_negative(max_gap_s) || max_gap_s == 0) problem = "max_gap_s must be positive";
    if (!not_negative(max_extrapolation_s)) problem = "max_extrapolation_s must not be negative";
    if (!not_negative(max_repeat_s)) problem = "max_repeat_s must not be negative";
    if (error != nullptr && problem != nullptr) *error = problem;
    return problem == nullptr;
  }
};

enum class PushStatus {
  kStored,
  kOutOfOrderStored,  // older than the newest; inserted in order
  kStaleRepeat,       // the newest value again, too soon or too late to show a mount at rest
  kDuplicateTime,     // a sample of this time exists and stays
  kOlderThanBuffer,   // older than all samples of a full buffer
  kNotFinite          // a value is not finite, or time_sigma_s is negative
};

enum class QueryStatus {
  kOk,
  kExtrapolated,  // has a result, but beyond the samples
  kEmpty,
  kOneSample,        // no rate
  kBeforeTelemetry,  // farther before the oldest sample than max_extrapolation_s
  kTelemetryTooOld,  // farther after the newest trusted angle than max_extrapolation_s
  kGap,              // the samples around this time are too far apart
  kNotFinite         // time or sigma invalid, or the result cannot be represented
};

[[nodiscard]] constexpr bool has_result(QueryStatus status) {
  return status == QueryStatus::kOk || status == QueryStatus::kExtrapolated;
}

[[nodiscard]] constexpr const char* to_string(QueryStatus status) {
  switch (status) {
    case QueryStatus::kOk:
      return "ok";
    case QueryStatus::kExtrapolated:
      return "extrapolated";
    case QueryStatus::kEmpty:
      return "no telemetry sample yet";
    case QueryStatus::kOneSample:
      return "only one telemetry sample yet";
    case QueryStatus::kBeforeTelemetry:
      return "older than the oldest telemetry sample";
    case QueryStatus::kTelemetryTooOld:
      return "too far beyond the newest trusted angle of telemetry";
    case QueryStatus::kGap:
      return "in a gap of the telemetry";
    case QueryStatus::kNotFinite:
      return "not finite";
  }
  return "unknown status";
}

// Number of pushes by status.
struct TelemetryCounters {
  std::int64_t stored = 0;
  std::int64_t out_of_order_stored = 0;
  std::int64_t stale_repeats = 0;
  std::int64_t duplicate_times = 0;
  std::int64_t older_than_kept = 0;  // of a full buffer
  std::int64_t not_finite = 0;
};

template <std::size_t Capacity>
class TelemetryBuffer {
  static_assert(Capacity >= kInterpolationWindow && (Capacity & (Capacity - 1)) == 0,
                "a power of two");

 public:
  // noise, limits: validate() must accept them.
  explicit TelemetryBuffer(const TelemetryNoise& noise = {}, const TelemetryLimits& limits = {})
      : noise_(noise), limits_(limits) {}

  [[nodiscard]] PushStatus push(const TelemetrySample& sample) {
    const PushStatus status = insert(sample);
    ++counter(status);
    return status;
  }

  // State of the mount at time_s, whose standard deviation is time_sigma_s. *out is written if
  // has_result(status).
  [[nodiscard]] QueryStatus query(double time_s, double time_sigma_s,
                                  InterpolatedPanTilt* out) const {
    if (!std::isfinite(time_s) || !std::isfinite(time_sigma_s) || time_sigma_s < 0) {
      return QueryStatus::kNotFinite;
    }
    if (size_ == 0) return QueryStatus::kEmpty;
    if (size_ == 1) return QueryStatus::kOneSample;
    const double oldest = knot(0).time_s;
    const double newest = knot(size_ - 1).time_s;
    if (time_s < oldest - limits_.max_extrapolation_s) return QueryStatus::kBeforeTelemetry;
    if (time_s > newest + limits_.max_extrapolation_s) return QueryStatus::kTelemetryTooOld;

    const std::size_t before = segment(time_s);
    if (!connected(before) && !knot(before + 1).held) return QueryStatus::kGap;
    std::size_t first = before;
    std::size_t end = before + 2;
    while (end - first < kInterpolationWindow && !knot(before + 1).held) {
      const bool more_before = first > 0 && connected(first - 1);
      const bool more_after = end < size_ && connected(end - 1);
      if (!more_before && !more_after) break;
      if (more_before && (!more_after || before - first <= end - 2 - before)) {
        --first;
      } else {
        ++end;
      }
    }
    std::array<TelemetryKnot, kInterpolationWindow> window;
    for (std::size_t i = first; i < end; ++i) window[i - first] = knot(i);
    const bool beyond = time_s < oldest || time_s > newest;
    const Vector2<double> beyond_square =
        beyond ? expected_acceleration_square(time_s - newest) : Vector2<double>::Zero();
    if (!interpolate(noise_, window.data(), static_cast<int>(end - first),
                     static_cast<int>(before - first), time_s, time_sigma_s, beyond_square, out)) {
      return QueryStatus::kNotFinite;
    }
    return beyond ? QueryStatus::kExtrapolated : QueryStatus::kOk;
  }

  // For a restart of the device or of its clock. Counters stay.
  void clear() {
    size_ = 0;
    repeated_ = false;
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  // s; time of the newest trusted angle: the newest sample with a new value or, if later,
  // max_repeat_s before its last repeat. Empty without samples.
  [[nodiscard]] std::optional<double> newest_time() const {
    if (size_ == 0) return std::nullopt;
    return knot(size_ - 1).time_s;
  }
  [[nodiscard]] const TelemetryCounters& counters() const { return counters_; }

 private:
  [[nodiscard]] const TelemetryKnot& knot(std::size_t i) const {
    return knots_[(first_ + i) & (Capacity - 1)];
  }
  [[nodiscard]] TelemetryKnot& knot(std::size_t i) { return knots_[(first_ + i) & (Capacity - 1)]; }

  // True if knots i and i + 1 belong to one motion.
  [[nodiscard]] bool connected(std::size_t i) const {
    return !knot(i + 1).held && knot(i + 1).time_s - knot(i).time_s <= limits_.max_gap_s;
  }

  // beyond_s after the newest knot. Negative before the oldest one, where all differences are used.
  [[nodiscard]] Vector2<double> expected_acceleration_square(double beyond_s) const {
    const TelemetryKnot& newest = knot(size_ - 1);
    ExpectedAcceleration expected(noise_, beyond_s);
    for (std::size_t i = size_; i > 0; --i) {
      const bool gap = i < size_ && !knot(i).held && !connected(i - 1);
      if (gap || newest.time_s - knot(i - 1).time_s > ExpectedAcceleration::kMemory) break;
      expected.add(knot(i - 1));
    }
    return expected.square();
  }

  // i such that time_s lies between knots i and i + 1, or beyond the end of the buffer that is one
  // of them. Needs two knots.
  [[nodiscard]] std::size_t segment(double time_s) const {
    std::size_t low = 0;           // not after time_s, or 0
    std::size_t high = size_ - 1;  // after time_s, or the newest
    while (high - low > 1) {
      const std::size_t middle = (low + high) / 2;
      (knot(middle).time_s <= time_s ? low : high) = middle;
    }
    return low;
  }

  PushStatus insert(const TelemetrySample& sample) {
    const double pan = wrap_angle(sample.pan);
    const double tilt = wrap_angle(sample.tilt);
    if (!std::isfinite(sample.time_s) || !std::isfinite(sample.time_sigma_s) ||
        sample.time_sigma_s < 0 || !(std::abs(pan) <= kPi) || !(std::abs(tilt) <= kPi)) {
      return PushStatus::kNotFinite;
    }
    const double time_variance = sample.time_sigma_s * sample.time_sigma_s;
    const double own_variance =
        std::min(time_variance, noise_.period_sigma_s * noise_.period_sigma_s / 2);
    TelemetryKnot added{sample.time_s, pan,  tilt, time_variance - own_variance,
                        own_variance,  false};
    if (size_ == 0) {
      first_ = 0;
      start_run(sample.time_s, pan, tilt);
      return append(added);
    }
    const double silence = sample.time_s - last_poll_s_;
    if (limits_.max_repeat_s > 0 && pan == run_pan_ && tilt == run_tilt_ &&
        silence <= limits_.max_gap_s) {
      return repeat(added);
    }
    if (sample.time_s <= knot(size_ - 1).time_s) return insert_late(added);
    if (repeated_ && silence > 0 && silence <= limits_.max_gap_s) {
      // Mean square of an age between 0 and the silence.
      added.own_variance += silence * silence / 3;
    }
    start_run(sample.time_s, pan, tilt);
    return append(added);
  }

  void start_run(double time_s, double pan, double tilt) {
    last_poll_s_ = time_s;
    run_pan_ = pan;
    run_tilt_ = tilt;
    repeated_ = false;
  }

  // A device that is polled faster than it measures repeats its value. It was true when it first
  // came, but need not be true now. So a run of equal values is trusted from its first stamp until
  // max_repeat_s before its last, and unknown after that. The value that ends a run may be as old
  // as the last repeat; insert() adds this to the variance of its time.
  PushStatus repeat(TelemetryKnot added) {
    if (added.time_s == last_poll_s_) return PushStatus::kDuplicateTime;
    if (added.time_s < last_poll_s_) return PushStatus::kStaleRepeat;
    last_poll_s_ = added.time_s;
    repeated_ = true;
    added.time_s -= limits_.max_repeat_s;
    added.held = true;
    TelemetryKnot& newest = knot(size_ - 1);
    if (added.time_s <= newest.time_s) return PushStatus::kStaleRepeat;
    if (!newest.held) return append(added);
    newest.time_s = added.time_s;
    return PushStatus::kStored;
  }

  PushStatus append(TelemetryKnot added) {
    if (size_ > 0) continue_from(knot(size_ - 1), &added);
    if (size_ == Capacity) {
      ++first_;
    } else {
      ++size_;
    }
    knot(size_ - 1) = added;
    return PushStatus::kStored;
  }

  PushStatus insert_late(TelemetryKnot added) {
    std::size_t place = size_;  // knots before it are older
    while (place > 0 && knot(place - 1).time_s >= added.time_s) --place;
    if (knot(place).time_s == added.time_s) return PushStatus::kDuplicateTime;
    if (size_ == Capacity) {
      if (place == 0) return PushStatus::kOlderThanBuffer;
      ++first_;
      --place;
    } else {
      ++size_;
    }
    for (std::size_t i = size_ - 1; i > place; --i) knot(i) = knot(i - 1);
    continue_from(place > 0 ? knot(place - 1) : knot(place + 1), &added);
    knot(place) = added;
    knot(place + 1).held = false;
    return PushStatus::kOutOfOrderStored;
  }

  // Shifts the angles of a knot by whole turns until they are next to a neighbour's.
  static void continue_from(const TelemetryKnot& neighbour, TelemetryKnot* added) {
    added->pan = neighbour.pan + wrap_angle(added->pan - neighbour.pan);
    added->tilt = neighbour.tilt + wrap_angle(added->tilt - neighbour.tilt);
  }

  std::int64_t& counter(PushStatus status) {
    switch (status) {
      case PushStatus::kStored:
        return counters_.stored;
      case PushStatus::kOutOfOrderStored:
        return counters_.out_of_order_stored;
      case PushStatus::kStaleRepeat:
        return counters_.stale_repeats;
      case PushStatus::kDuplicateTime:
        return counters_.duplicate_times;
      case PushStatus::kOlderThanBuffer:
        return counters_.older_than_kept;
      case PushStatus::kNotFinite:
        break;
    }
    return counters_.not_finite;
  }

  TelemetryNoise noise_;
  TelemetryLimits limits_;
  TelemetryCounters counters_;
  std::array<TelemetryKnot, Capacity> knots_{};
  std::size_t first_ = 0;  // index of the oldest knot, modulo Capacity
  std::size_t size_ = 0;
  // The run of equal values at the newest end: time of the last poll, value.
  double last_poll_s_ = 0;
  double run_pan_ = 0;
  double run_tilt_ = 0;
  bool repeated_ = false;
};

static_assert(std::is_trivially_copyable_v<TelemetrySample> &&
              std::is_trivially_copyable_v<TelemetryBuffer<kInterpolationWindow>>);

}  // namespace alidade
