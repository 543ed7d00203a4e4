#include "test/simulator/played_path.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace alidade::simulator {
namespace {

constexpr double kPlayStep_s = 1e-3;
constexpr double kMostStates = 4e6;

Angles dragged(const Angles& state, const Angles& driven, const PlayConfig& play) {
  return {std::clamp(state.pan, driven.pan - play.pan / 2, driven.pan + play.pan / 2),
          std::clamp(state.tilt, driven.tilt - play.tilt / 2, driven.tilt + play.tilt / 2)};
}

}  // namespace

PlayedPath::PlayedPath(std::unique_ptr<Path> driven, const PlayConfig& play)
    : driven_(std::move(driven)), play_(play) {
  const double period = driven_->period_s();
  const Path::Span moving = period > 0 ? Path::Span{0, period} : driven_->moving();
  const double count =
      std::clamp(std::ceil((moving.to - moving.from) / kPlayStep_s), 1.0, kMostStates);
  begin_ = moving.from;
  step_ = (moving.to - moving.from) / count;
  Angles state = driven_->at(begin_);
  const auto states = static_cast<std::size_t>(count);
  const auto go_round = [&](bool keep) {
    for (std::size_t i = 0; i < states; ++i) {
      state = dragged(state, driven_->at(begin_ + static_cast<double>(i) * step_), play_);
      if (keep) states_.push_back(state);
    }
  };
  // After one round the state repeats.
  if (period > 0) go_round(false);
  states_.reserve(states + 1);
  go_round(true);
  states_.push_back(dragged(state, driven_->at(moving.to), play_));
}

Angles PlayedPath::dragged_at(double time_s) const {
  const double period = driven_->period_s();
  double since = time_s - begin_;
  if (period > 0) since -= period * std::floor(since / period);
  const double place = step_ > 0 ? since / step_ : 0;
  const auto last = static_cast<double>(states_.size() - 1);
  const auto i = static_cast<std::size_t>(std::clamp(std::floor(place), 0.0, last));
  return dragged(states_[i], driven_->at(time_s), play_);
}

Angles PlayedPath::at(double time_s) const {
  return play_.encoder == PlayConfig::Encoder::kMotor ? dragged_at(time_s) : driven_->at(time_s);
}

Angles PlayedPath::encoder_at(double time_s) const {
  return play_.encoder == PlayConfig::Encoder::kMotor ? driven_->at(time_s) : dragged_at(time_s);
}

}  // namespace alidade::simulator
