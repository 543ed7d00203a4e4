#include "test/simulator/path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "test/simulator/path_table.h"
#include "test/simulator/played_path.h"
#include "test/simulator/random.h"
#include "test/simulator/zoom.h"

namespace alidade::simulator {
namespace {

// From 0 to 1 with no velocity and no acceleration at either end.
double smooth_step(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10 - 15 * x + 6 * x * x);
}

double phase(double time, double period) { return time - period * std::floor(time / period); }

class TripleCosine : public Path {
 public:
  TripleCosine(const PathConfig& config, double field) : config_(config), field_(field) {}

  Angles at(double time_s) const override {
    const double scale = config_.amplitude * field_ / kTwoPi;
    const double angle = kTwoPi * time_s / config_.period;
    return {config_.pan + 9 * scale * std::sin(angle),
            config_.tilt - 3 * scale * std::cos(3 * angle)};
  }
  double period_s() const override { return config_.period; }

 private:
  PathConfig config_;
  double field_;
};

// Moves from point to point, each within its share of the period, then rests until the next.
class Moves : public Path {
 public:
  struct Move {
    double start, duration;  // s
    Angles from, to;
  };

  Moves(std::vector<Move> moves, double period) : moves_(std::move(moves)), period_(period) {}

  Angles at(double time_s) const override {
    const double time = phase(time_s, period_);
    const auto next = std::upper_bound(moves_.begin(), moves_.end(), time,
                                       [](double t, const Move& move) { return t < move.start; });
    const Move& move = next == moves_.begin() ? moves_.front() : *std::prev(next);
    const double part = smooth_step((time - move.start) / move.duration);
    return {move.from.pan + part * (move.to.pan - move.from.pan),
            move.from.tilt + part * (move.to.tilt - move.from.tilt)};
  }
  double period_s() const override { return period_; }

 private:
  std::vector<Move> moves_;
  double period_;
};

std::unique_ptr<Path> make_sweep(const PathConfig& config, double field) {
  const double pan = 1.5 * config.amplitude * field;
  const double tilt = 0.5 * config.amplitude * field;
  const std::array<Angles, 5> corners{{{config.pan - pan, config.tilt - tilt},
                                       {config.pan + pan, config.tilt - tilt},
                                       {config.pan + pan, config.tilt + tilt},
                                       {config.pan - pan, config.tilt + tilt},
                                       {config.pan - pan, config.tilt - tilt}}};
  std::vector<Moves::Move> moves;
  const double quarter = config.period / 4;
  for (std::size_t i = 0; i < 4; ++i) {
    moves.push_back({static_cast<double>(i) * quarter, quarter - config.stop, corners.at(i),
                     corners.at(i + 1)});
  }
  return std::make_unique<Moves>(std::move(moves), config.period);
}

std::unique_ptr<Path> make_jerky(const PathConfig& config, double field, std::uint64_t seed) {
  std::mt19937_64 generator = make_generator(seed, Stream::kPath);
  std::uniform_real_distribution<double> point(-1, 1);
  std::uniform_real_distribution<double> share(0.5, 0.9);
  const int count = std::max(2, static_cast<int>(config.period / 0.8));
  const double step = config.period / count;
  std::vector<Moves::Move> moves;
  const Angles home{config.pan, config.tilt};
  Angles from = home;
  for (int i = 0; i < count; ++i) {
    Angles to{config.pan + 1.5 * config.amplitude * field * point(generator),
              config.tilt + 0.5 * config.amplitude * field * point(generator)};
    if (i == count - 1) to = home;
    moves.push_back({i * step, share(generator) * step, from, to});
    from = to;
  }
  return std::make_unique<Moves>(std::move(moves), config.period);
}

// Cubic Hermite through the points, tangents from the neighbours; at rest before and after.
class Sampled : public Path {
 public:
  explicit Sampled(const std::filesystem::path& file) {
    for (const std::vector<double>& row :
         read_path_table(file, {"time_s", "pan_rad", "tilt_rad"})) {
      Angles point{row[1], row[2]};
      if (!points_.empty()) {
        // The shorter way round: a truth.csv wraps its angles.
        point.pan = points_.back().pan + std::remainder(point.pan - points_.back().pan, kTwoPi);
        point.tilt = points_.back().tilt + std::remainder(point.tilt - points_.back().tilt, kTwoPi);
      }
      times_.push_back(row[0]);
      points_.push_back(point);
    }
  }

  Angles at(double time_s) const override {
    if (time_s <= times_.front()) return points_.front();
    if (time_s >= times_.back()) return points_.back();
    const auto next = std::upper_bound(times_.begin(), times_.end(), time_s);
    const auto i = static_cast<std::size_t>(next - times_.begin()) - 1;
    const double step = times_[i + 1] - times_[i];
    const double x = (time_s - times_[i]) / step;
    const auto value = [&](double Angles::*axis) {
      return points_[i].*axis * ((1 + 2 * x) * (1 - x) * (1 - x)) +
             points_[i + 1].*axis * (x * x * (3 - 2 * x)) +
             step * (tangent(i, axis) * (x * (1 - x) * (1 - x)) -
                     tangent(i + 1, axis) * (x * x * (1 - x)));
    };
    return {value(&Angles::pan), value(&Angles::tilt)};
  }
  double period_s() const override { return 0; }
  Span moving() const override { return {times_.front(), times_.back()}; }

 private:
  double tangent(std::size_t i, double Angles::*axis) const {
    if (i == 0 || i + 1 == times_.size()) return 0;
    return (points_[i + 1].*axis - points_[i - 1].*axis) / (times_[i + 1] - times_[i - 1]);
  }

  std::vector<double> times_;
  std::vector<Angles> points_;
};

// A path whose unit, the field of view, is that of the present zoom.
class FollowsZoom : public Path {
 public:
  // `path` is drawn with one field of view, horizontal_field_of_view(config).
  FollowsZoom(std::unique_ptr<Path> path, const Config& config)
      : path_(std::move(path)),
        zoom_(config),
        image_(config.image),
        centre_{config.path.pan, config.path.tilt},
        field_(horizontal_field_of_view(config)),
        duration_(config.duration) {}

  Angles at(double time_s) const override {
    const double scale = field_of_view(image_, zoom_.lens(time_s).focal_length) / field_;
    const Angles drawn = path_->at(time_s);
    return {centre_.pan + scale * (drawn.pan - centre_.pan),
            centre_.tilt + scale * (drawn.tilt - centre_.tilt)};
  }
  double period_s() const override {
    if (!zoom_.path().moves()) return path_->period_s();
    const double turns = zoom_.period_s() / path_->period_s();
    return std::abs(turns - std::round(turns)) < 1e-9 ? zoom_.period_s() : 0;
  }
  // What does not repeat never rests, but nobody asks beyond the recording.
  Span moving() const override { return {-kMargin, duration_ + kMargin}; }

 private:
  static constexpr double kMargin = 10;  // s

  std::unique_ptr<Path> path_;
  Zoom zoom_;
  ImageConfig image_;
  Angles centre_;
  double field_;
  double duration_;
};

std::unique_ptr<Path> make_steady_path(const Config& config) {
  const double field = horizontal_field_of_view(config);
  switch (config.path.type) {
    case PathConfig::Type::kTripleCosine:
      return std::make_unique<TripleCosine>(config.path, field);
    case PathConfig::Type::kSweep:
      return make_sweep(config.path, field);
    case PathConfig::Type::kJerky:
      return make_jerky(config.path, field, config.seed);
    case PathConfig::Type::kCsv:
      return std::make_unique<Sampled>(config.path.file);
  }
  throw std::logic_error("unknown path type");
}

std::unique_ptr<Path> make_exact_path(const Config& config) {
  std::unique_ptr<Path> path = make_steady_path(config);
  if (!config.path.follows_zoom) return path;
  return std::make_unique<FollowsZoom>(std::move(path), config);
}

}  // namespace

std::unique_ptr<Path> make_path(const Config& config) {
  std::unique_ptr<Path> path = make_exact_path(config);
  const PlayConfig& play = config.telemetry.play;
  if (play.pan == 0 && play.tilt == 0) return path;
  return std::make_unique<PlayedPath>(std::move(path), play);
}

}  // namespace alidade::simulator
