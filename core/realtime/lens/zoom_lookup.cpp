#include "core/realtime/lens/zoom_lookup.h"

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

// 1/s, one standard deviation of log f's rate: the speed of motors, where nothing else tells it.
constexpr double kAnyRate = 1;

// From a step along the curve, to whichever side the curve continues.
void set_slopes(const ZoomCurve& curve, FrameLens* lens) {
  constexpr double kStep = 5e-3;  // of the range of readings
  const double step = kStep * (curve.last_reading() - curve.first_reading());
  const double reading = *lens->calibration.zoom;
  lens->corner_by_zoom.setZero();
  lens->centre_by_zoom.setZero();
  Calibration beside;
  if (!curve.at(reading + step, &beside) && !curve.at(reading - step, &beside)) return;
  const Camera<double>& from = lens->calibration.camera;
  const Camera<double>& to = beside.camera;
  const double change = std::log(to.focal_length / from.focal_length);
  // Smaller: the lens does not zoom there, or turns over.
  constexpr double kLeast = 1e-6;
  if (!(std::abs(change) > kLeast)) return;
  lens->corner_by_zoom = (corner_distortion(to) - corner_distortion(from)) / change;
  lens->centre_by_zoom = (to.centre_offset() - from.centre_offset()) / change;
}

}  // namespace

void ZoomLookup::add(double time_s, double zoom) {
  if (!std::isfinite(time_s) || !std::isfinite(zoom)) return;
  if (count_ > 0 && time_s <= reading(0).time_s) return;
  readings_[count_ % kKept] = {time_s, zoom};
  ++count_;
}

std::size_t ZoomLookup::newer_of(double time_s) const {
  const std::size_t kept = std::min(count_, kKept);
  std::size_t back = 0;
  while (back + 2 < kept && reading(back + 1).time_s > time_s) ++back;
  return back;
}

bool ZoomLookup::stands_at(double zoom, double tolerance, double time_s) const {
  if (count_ == 0) return false;
  const std::size_t newer = newer_of(time_s);
  const Reading& older = reading(count_ > 1 ? newer + 1 : newer);
  return std::abs(reading(newer).zoom - zoom) <= tolerance &&
         std::abs(older.zoom - zoom) <= tolerance;
}

ZoomLookup::Range ZoomLookup::range_about(double time_s) const {
  const std::size_t after = newer_of(time_s);
  const double newer = reading(after).zoom;
  const double older = reading(count_ > 1 ? after + 1 : after).zoom;
  const double next = reading(after > 0 ? after - 1 : after).zoom;
  return {std::min({newer, older, next}), std::max({newer, older, next})};
}

double ZoomLookup::change_about(const ZoomCurve& curve, double time_s) const {
  if (count_ == 0) return 0;
  const Range range = range_about(time_s);
  Calibration low;
  Calibration high;
  if (range.low == range.high || !curve.at(range.low, &low) || !curve.at(range.high, &high))
    return 0;
  return std::abs(std::log(high.camera.focal_length / low.camera.focal_length));
}

bool ZoomLookup::calibration(const ZoomCurve& curve, double time_s, double readout_s,
                             Calibration* calibration) const {
  if (count_ == 0) return false;
  // Share of the way between two readings: the motor starts or stops there.
  constexpr double kUneven = 0.15;
  // A movement is over when no reading has come for this long.
  constexpr double kLongest_s = 1;
  const std::size_t after = newer_of(time_s);
  const Reading& newer = reading(after);
  double zoom = newer.zoom;
  double spread = 0;
  if (count_ > 1 && newer.zoom != reading(after + 1).zoom) {
    const Reading& older = reading(after + 1);
    const double interval_s = newer.time_s - older.time_s;
    const double rate = (newer.zoom - older.zoom) / interval_s;
    const double after_s = std::clamp(time_s - newer.time_s, -interval_s, kLongest_s);
    zoom += rate * after_s;
    // Before the oldest reading the lens moved likewise, or did not move yet.
    const double beyond_s = std::max({after_s, older.time_s - time_s, 0.0});
    spread = std::abs(rate) * (std::min(beyond_s, kLongest_s) / 2 + readout_s / 4) +
             kUneven * std::abs(newer.zoom - older.zoom);
  }
  if (!curve.at(zoom, calibration)) {
    // The extrapolated zoom is off the curve.
    zoom = newer.zoom;
    if (!curve.at(zoom, calibration)) return false;
  }
  if (spread == 0) return true;
  // Either way from there, where the curve continues.
  Calibration moved;
  if (!curve.at(zoom + spread, &moved) && !curve.at(zoom - spread, &moved)) return false;
  const double change = moved.camera.focal_length - calibration->camera.focal_length;
  const int f = index(Parameter::kFocalLength);
  calibration->covariance(f, f) += change * change;
  return true;
}

bool ZoomLookup::lens(const ZoomCurve& curve, double time_s, double readout_s, double tolerance,
                      FrameLens* lens) const {
  if (!calibration(curve, time_s, readout_s, &lens->calibration)) return false;
  set_slopes(curve, lens);
  const std::size_t after = newer_of(time_s);
  const Reading& newer = reading(after);
  const Reading& older = reading(count_ > 1 ? after + 1 : after);
  const Range range = range_about(time_s);
  lens->moves = range.high - range.low > tolerance;
  lens->rate = 0;
  lens->rate_sigma = 0;
  if (!lens->moves) return true;
  lens->rate_sigma = kAnyRate;
  Calibration from;
  Calibration to;
  if (newer.zoom == older.zoom || !curve.at(older.zoom, &from) || !curve.at(newer.zoom, &to))
    return true;
  const double change = std::log(to.camera.focal_length / from.camera.focal_length);
  lens->rate = change / (newer.time_s - older.time_s);
  // Between two readings as even as in calibration(); beyond them anything up to a stop.
  const bool beyond = time_s > newer.time_s || time_s < older.time_s;
  constexpr double kUneven = 0.3;
  // Each reading may be off by half of the tolerance.
  const double of_readings = tolerance / std::abs(newer.zoom - older.zoom) / std::sqrt(2.0);
  lens->rate_sigma = std::hypot(beyond ? 1 : kUneven, of_readings) * std::abs(lens->rate);
  return true;
}

// Regula falsi, as the curve is monotone and smooth (Illinois: the end that stays counts half).
bool lens_of_focal_length(const ZoomCurve& curve, double focal_length, FrameLens* lens) {
  if (curve.empty() || !(focal_length > 0)) return false;
  constexpr int kMaxSteps = 30;
  constexpr double kNear = 1e-4;  // of log f: distortion and centre hardly change
  const double wanted = std::log(focal_length);
  const auto log_at = [&](double reading, double* out) {
    if (!curve.at(reading, &lens->calibration)) return false;
    *out = std::log(lens->calibration.camera.focal_length) - wanted;
    return true;
  };
  double a = curve.first_reading();
  double b = curve.last_reading();
  double at_a = 0;
  double at_b = 0;
  if (!log_at(a, &at_a) || !log_at(b, &at_b)) return false;
  if (at_a * at_b > 0) {
    const bool near_a = std::abs(at_a) < std::abs(at_b);
    if (std::min(std::abs(at_a), std::abs(at_b)) > kBeyondEnds) return false;
    if (!curve.at(near_a ? a : b, &lens->calibration)) return false;
    set_slopes(curve, lens);
    lens->moves = true;
    lens->rate = 0;
    lens->rate_sigma = kAnyRate;
    return true;
  }
  lens->moves = true;
  lens->rate = 0;
  lens->rate_sigma = kAnyRate;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double middle = at_a == at_b ? a : (a * at_b - b * at_a) / (at_b - at_a);
    double at_middle = 0;
    if (!log_at(middle, &at_middle)) return false;
    if (std::abs(at_middle) < kNear) {
      set_slopes(curve, lens);
      return true;
    }
    if (at_middle * at_b < 0) {
      a = b;
      at_a = at_b;
    } else {
      at_a /= 2;
    }
    b = middle;
    at_b = at_middle;
  }
  return false;
}

}  // namespace alidade
