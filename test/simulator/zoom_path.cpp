#include "test/simulator/zoom_path.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

#include "test/simulator/config.h"
#include "test/simulator/path_table.h"
#include "test/simulator/zoom_curve.h"

namespace alidade::simulator {
namespace {

constexpr double kMotorPi = 3.14159265358979323846;
// A movement at the motor's own limits is not beyond them.
constexpr double kRounding = 1e-9;

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

// A ramp that rises as sin^2 is steepest in its middle: pi / 2 times its mean.
double ramp_of(double speed, const ZoomConfig& motor) {
  return kMotorPi * speed / (2 * motor.acceleration);
}

MotorMove move_at(double distance, double speed, const ZoomConfig& motor) {
  // Where there is no way to get up to it: ramp up, ramp down.
  const double reached = std::sqrt(2 * motor.acceleration * distance / kMotorPi);
  speed = std::min(speed, reached);
  return {distance, speed, ramp_of(speed, motor)};
}

MotorMove move_lasting(double distance, double duration, const ZoomConfig& motor) {
  // distance / speed + ramp(speed) = duration: the slower of the two speeds.
  const double half = duration * motor.acceleration / kMotorPi;
  const double square = half * half - 2 * motor.acceleration * distance / kMotorPi;
  const double speed = square < 0 ? 0 : half - std::sqrt(square);
  if (square < 0 || speed > motor.speed * (1 + kRounding)) {
    throw std::invalid_argument("path: a sweep_s of " + short_number(duration) +
                                " is too short for the motor, which needs " +
                                short_number(move_at(distance, motor.speed, motor).duration()));
  }
  return {distance, speed, ramp_of(speed, motor)};
}

// log f of a reading that a path names.
double place_of(double reading, const ZoomCurve& curve, const ZoomConfig& config) {
  const double part = curve.part(reading);
  if (part < -kRounding || part > 1 + kRounding) {
    throw std::invalid_argument("path: zoom " + short_number(reading) + " is not between " +
                                short_number(config.reading.wide) + " and " +
                                short_number(config.reading.tele));
  }
  return curve.log_focal_length(std::clamp(part, 0.0, 1.0));
}

double place_at(double focal_length, const ZoomConfig& config) {
  const double slack = 1 + kRounding;
  if (focal_length * slack < config.focal_length.wide ||
      focal_length > config.focal_length.tele * slack) {
    throw std::invalid_argument("path: a focal length of " + short_number(focal_length) +
                                " px is not between " + short_number(config.focal_length.wide) +
                                " and " + short_number(config.focal_length.tele));
  }
  return std::log(focal_length);
}

class ZoomMoves : public ZoomPath {
 public:
  struct Leg {
    double start;  // s
    double from, to;
    MotorMove move;
  };

  // Without legs: at rest. The last leg must lead to where the first begins.
  ZoomMoves(double place, std::vector<Leg> legs, double period)
      : place_(place), legs_(std::move(legs)), period_(period) {}

  ZoomPosition at(double time_s) const override {
    if (legs_.empty()) return {place_, -1, 1};
    const double cycle = std::floor(time_s / period_);
    const double time = time_s - cycle * period_;
    const auto next = std::upper_bound(legs_.begin(), legs_.end(), time,
                                       [](double t, const Leg& leg) { return t < leg.start; });
    const auto first = static_cast<std::int64_t>(cycle) * static_cast<std::int64_t>(legs_.size());
    const std::int64_t number = first + (next - legs_.begin()) - 1;
    if (next == legs_.begin()) return {legs_.front().from, number, 1};
    const Leg& leg = *std::prev(next);
    const double since = time - leg.start;
    if (since >= leg.move.duration()) return {leg.to, number, 1};
    const double done = leg.move.covered(since) / leg.move.distance;
    return {leg.from + done * (leg.to - leg.from), number, done};
  }

  double period_s() const override { return period_; }
  bool moves() const override { return !legs_.empty(); }
  std::int64_t movements_per_round() const override {
    return static_cast<std::int64_t>(legs_.size());
  }

  int direction(std::int64_t movement) const override {
    if (legs_.empty()) return 1;
    const auto count = static_cast<std::int64_t>(legs_.size());
    const Leg& leg = legs_[static_cast<std::size_t>((movement % count + count) % count)];
    return leg.to > leg.from ? 1 : -1;
  }

  ZoomConfig::Ends extent() const override {
    ZoomConfig::Ends ends{place_, place_};
    for (const Leg& leg : legs_) {
      ends.wide = std::min(ends.wide, leg.to);
      ends.tele = std::max(ends.tele, leg.to);
    }
    return ends;
  }

 private:
  double place_;
  std::vector<Leg> legs_;
  double period_;
};

std::shared_ptr<const ZoomPath> make_dwell(const ZoomConfig& config, const ZoomCurve& curve) {
  std::vector<double> places;
  for (const ZoomPathConfig::Stop& stop : config.path.stops) {
    places.push_back(stop.reading ? place_of(*stop.reading, curve, config)
                                  : place_at(stop.focal_length.value(), config));
  }
  std::vector<ZoomMoves::Leg> legs;
  double time = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    time += config.path.stops[i].rest;
    const double from = places[i];
    const double to = places[(i + 1) % places.size()];
    if (from == to) continue;
    legs.push_back({time, from, to, move_at(std::abs(to - from), config.speed, config)});
    time += legs.back().move.duration();
  }
  if (config.path.round > 0 && config.path.round < time) {
    throw std::invalid_argument("path: a round_s of " + short_number(config.path.round) +
                                " is too short for stops and movements, which take " +
                                short_number(time));
  }
  return std::make_shared<ZoomMoves>(places.front(), std::move(legs),
                                     std::max(time, config.path.round));
}

// There and back, a rest after each.
std::shared_ptr<const ZoomPath> make_strokes(const ZoomConfig& config, const ZoomCurve& curve) {
  const ZoomPathConfig& path = config.path;
  const double from = place_of(path.reading.value_or(config.reading.wide), curve, config);
  const double to = place_at(std::exp(from) * path.factor, config);
  const double distance = std::abs(to - from);
  if (distance == 0) throw std::invalid_argument("path: a factor of 1 moves nothing");
  if (path.type == ZoomPathConfig::Type::kCreep && path.rate > config.speed) {
    throw std::invalid_argument("path: rate_per_s is more than the motor's speed_per_s, " +
                                short_number(config.speed));
  }
  const MotorMove move = path.type == ZoomPathConfig::Type::kSweep
                             ? move_lasting(distance, path.duration, config)
                             : move_at(distance, path.rate, config);
  const double stroke = move.duration() + path.stop;
  return std::make_shared<ZoomMoves>(
      from, std::vector<ZoomMoves::Leg>{{0, from, to, move}, {stroke, to, from, move}}, 2 * stroke);
}

class SampledZoom : public ZoomPath {
 public:
  SampledZoom(const ZoomConfig& config, const ZoomCurve& curve) {
    const std::filesystem::path& file = config.path.file;
    for (const std::vector<double>& row : read_path_table(file, {"time_s", "zoom"})) {
      times_.push_back(row[0]);
      const std::string where = file.string() + ":" + std::to_string(times_.size() + 1) + ": ";
      try {
        places_.push_back(place_of(row[1], curve, config));
      } catch (const std::invalid_argument& error) {
        throw ConfigError(where + error.what());
      }
    }
    find_tangents();
    find_movements();
    for (std::size_t i = 0; i + 1 < times_.size(); ++i) check_motor(i, config);
  }

  ZoomPosition at(double time_s) const override {
    if (time_s <= times_.front()) return {places_.front(), -1, 1};
    if (time_s >= times_.back()) return {places_.back(), count() - 1, 1};
    const auto next = std::upper_bound(times_.begin(), times_.end(), time_s);
    const auto i = static_cast<std::size_t>(next - times_.begin()) - 1;
    const double step = times_[i + 1] - times_[i];
    const double x = (time_s - times_[i]) / step;
    const double place =
        places_[i] * ((1 + 2 * x) * (1 - x) * (1 - x)) + places_[i + 1] * (x * x * (3 - 2 * x)) +
        step * (tangents_[i] * (x * (1 - x) * (1 - x)) - tangents_[i + 1] * (x * x * (1 - x)));
    const auto after = std::upper_bound(
        movements_.begin(), movements_.end(), i,
        [](std::size_t segment, const Movement& movement) { return segment < movement.first; });
    const auto number = after - movements_.begin() - 1;
    if (number < 0 || i >= std::prev(after)->last) return {place, number, 1};
    const double from = places_[std::prev(after)->first];
    const double to = places_[std::prev(after)->last];
    return {place, number, (place - from) / (to - from)};
  }

  double period_s() const override { return 0; }
  bool moves() const override { return !movements_.empty(); }
  std::int64_t movements_per_round() const override { return 0; }

  int direction(std::int64_t movement) const override {
    if (movements_.empty()) return 1;
    const auto number = static_cast<std::size_t>(std::max<std::int64_t>(movement, 0));
    const Movement& its = movements_[number];
    return places_[its.last] > places_[its.first] ? 1 : -1;
  }

  ZoomConfig::Ends extent() const override {
    const auto [least, most] = std::minmax_element(places_.begin(), places_.end());
    return {*least, *most};
  }

 private:
  struct Movement {
    std::size_t first, last;  // points, between which log f only rises or only falls
  };

  std::int64_t count() const { return static_cast<std::int64_t>(movements_.size()); }

  double secant(std::size_t i) const {
    return (places_[i + 1] - places_[i]) / (times_[i + 1] - times_[i]);
  }

  // Of the parabola through the neighbours; at most three times either secant keeps the cubic monotone.
  void find_tangents() {
    tangents_.assign(times_.size(), 0);
    for (std::size_t i = 1; i + 1 < times_.size(); ++i) {
      const double before = secant(i - 1);
      const double after = secant(i);
      if (before * after <= 0) continue;
      const double part = (times_[i] - times_[i - 1]) / (times_[i + 1] - times_[i - 1]);
      const double most = 3 * std::min(std::abs(before), std::abs(after));
      tangents_[i] = std::clamp(before + part * (after - before), -most, most);
    }
  }

  void find_movements() {
    for (std::size_t i = 0; i + 1 < times_.size(); ++i) {
      const double slope = secant(i);
      if (slope == 0) continue;
      if (i > 0 && secant(i - 1) * slope > 0) {
        movements_.back().last = i + 1;
      } else {
        movements_.push_back({i, i + 1});
      }
    }
  }

  void check_motor(std::size_t i, const ZoomConfig& config) const {
    const double step = times_[i + 1] - times_[i];
    const double a = tangents_[i];
    const double b = tangents_[i + 1];
    const double mean = secant(i);
    // The rate is a + x (6 mean - 4 a - 2 b) + x^2 (3 a + 3 b - 6 mean), x = 0 to 1.
    const double linear = 6 * mean - 4 * a - 2 * b;
    const double square = 3 * a + 3 * b - 6 * mean;
    double speed = std::max(std::abs(a), std::abs(b));
    const double peak = square == 0 ? -1 : -linear / (2 * square);
    if (peak > 0 && peak < 1) {
      speed = std::max(speed, std::abs(a + peak * linear + peak * peak * square));
    }
    const double acceleration = std::max(std::abs(linear), std::abs(linear + 2 * square)) / step;
    const std::string where = config.path.file.string() + ":" + std::to_string(i + 3) + ": ";
    if (speed > config.speed * (1 + kRounding)) {
      throw ConfigError(where + "this point needs a zoom of " + short_number(speed) +
                        " in log f a second, more than speed_per_s " + short_number(config.speed));
    }
    if (acceleration > config.acceleration * (1 + kRounding)) {
      throw ConfigError(where + "this point needs an acceleration of " +
                        short_number(acceleration) + ", more than acceleration_per_s2 " +
                        short_number(config.acceleration));
    }
  }

  std::vector<double> times_, places_, tangents_;
  std::vector<Movement> movements_;
};

}  // namespace

double MotorMove::covered(double time) const {
  if (time <= 0) return 0;
  if (time >= duration()) return distance;
  if (time > duration() / 2) return distance - covered(duration() - time);
  if (time >= ramp) return speed * (time - ramp / 2);
  return speed * (time / 2 - ramp / (2 * kMotorPi) * std::sin(kMotorPi * time / ramp));
}

std::shared_ptr<const ZoomPath> make_zoom_path(const ZoomConfig& config) {
  const ZoomCurve curve(config);
  switch (config.path.type) {
    case ZoomPathConfig::Type::kStill:
      return std::make_shared<ZoomMoves>(
          place_of(config.path.reading.value_or(config.reading.wide), curve, config),
          std::vector<ZoomMoves::Leg>{}, 0);
    case ZoomPathConfig::Type::kDwell:
      return make_dwell(config, curve);
    case ZoomPathConfig::Type::kSweep:
    case ZoomPathConfig::Type::kCreep:
      return make_strokes(config, curve);
    case ZoomPathConfig::Type::kCsv:
      return std::make_shared<SampledZoom>(config, curve);
  }
  throw std::logic_error("unknown zoom path");
}

}  // namespace alidade::simulator
