#include "core/tracking/target_tracker.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>

namespace alidade {

namespace {

// Identities given while frames are repeated, until they are matched with the earlier ones.
constexpr std::uint64_t kProvisional = std::uint64_t{1} << 63;
constexpr double kLeastWeightOfSeen = 0.3;
constexpr double kClaimed = 0.5;
constexpr double kOutsideSigmas = 5;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

bool positive(double v) { return std::isfinite(v) && v > 0; }

// The larger standard deviation of the place.
double worst_sigma(const TargetState& state) {
  const double mean = 0.5 * (state.cov(0, 0) + state.cov(1, 1));
  const double half = 0.5 * (state.cov(0, 0) - state.cov(1, 1));
  return std::sqrt(mean + std::hypot(half, state.cov(0, 1)));
}

double distance_squared(TargetSpace space, const TargetState& a, const TargetState& b) {
  Vector2<double> difference = b.mean.head<2>() - a.mean.head<2>();
  if (space == TargetSpace::kSphere) {
    const Vector3<double> d = a.R_base_from_chart.transpose() * target_direction(b);
    if (d.x() <= 0) return std::numeric_limits<double>::infinity();
    difference << d.y(), -d.z();
  }
  const Matrix2<double> cov = a.cov.topLeftCorner<2, 2>() + b.cov.topLeftCorner<2, 2>();
  return difference.dot(cov.inverse() * difference);
}

}  // namespace

bool TargetTrackerOptions::validate(const char** error) const {
  const char* problem = nullptr;
  const auto probability = [](double p) { return p > 0 && p < 1; };
  if (!positive(acceleration_density)) problem = "acceleration_density must be positive";
  if (!positive(sigma_first_velocity)) problem = "sigma_first_velocity must be positive";
  if (!probability(detection_probability))
    problem = "detection_probability must be above 0 and below 1";
  if (!probability(gate_probability)) problem = "gate_probability must be above 0 and below 1";
  if (birth_hits < 1 || birth_looks < birth_hits) {
    problem = "birth_hits must be at least 1 and at most birth_looks";
  }
  if (!positive(lose_after_s)) problem = "lose_after_s must be positive";
  if (!positive(forget_after_s)) problem = "forget_after_s must be positive";
  if (forget_after_s < lose_after_s) problem = "forget_after_s must be at least lose_after_s";
  if (!positive(most_sigma)) problem = "most_sigma must be positive";
  if (!(std::isfinite(most_ahead_s) && most_ahead_s >= 0)) {
    problem = "most_ahead_s must not be negative";
  }
  if (!(std::isfinite(history_s) && history_s >= 0)) problem = "history_s must not be negative";
  if (history_frames < 1 || history_frames > 10000) {
    problem = "history_frames must be 1 to 10000";
  }
  if (max_targets < 1 || max_targets > 10000) problem = "max_targets must be 1 to 10000";
  if (max_detections < 1 || max_detections > 10000) problem = "max_detections must be 1 to 10000";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

const char* to_string(FrameStatus status) {
  switch (status) {
    case FrameStatus::kTaken:
      return "taken";
    case FrameStatus::kTakenLate:
      return "taken late";
    case FrameStatus::kTooLate:
      return "too late";
    case FrameStatus::kInTheFuture:
      return "in the future";
    case FrameStatus::kBadFrame:
      return "time, homography, view or density is not valid";
    case FrameStatus::kTooManyDetections:
      return "too many detections";
    case FrameStatus::kDetectionNotFinite:
      return "a detection is not finite";
    case FrameStatus::kDetectionCovariance:
      return "a detection's covariance is not positive definite";
    case FrameStatus::kDetectionOutside:
      return "a detection is outside the view";
  }
  return "?";
}

TargetTracker::TargetTracker(const TargetTrackerOptions& options)
    : options_(options),
      gate_(-2 * std::log(1 - options.gate_probability)),
      association_(options.max_targets, options.max_detections),
      history_(index(options.history_frames)),
      seen_(index(options.max_targets)),
      pairs_(index(options.max_targets) * index(options.max_detections)),
      innovations_(pairs_.size()),
      weights_(index(options.max_detections)),
      missed_(index(options.max_targets)),
      claimed_(index(options.max_detections)),
      taken_(index(options.max_detections)),
      by_x_(index(options.max_detections)) {
  targets_.reserve(index(options.max_targets));
  before_replay_.reserve(index(options.max_targets));
  order_.reserve(history_.size());
  free_.reserve(history_.size());
  for (std::size_t i = history_.size(); i-- > 0;) {
    history_[i].detections.reserve(index(options.max_detections));
    history_[i].after.reserve(index(options.max_targets));
    free_.push_back(i);
  }
}

FrameAnswer TargetTracker::check(const TargetFrame& frame, double now_s) const {
  FrameAnswer answer;
  answer.status = FrameStatus::kBadFrame;
  const Matrix3<double>& H = frame.H_measured_from_world;
  if (!std::isfinite(frame.time_s) || !std::isfinite(now_s) || !all_finite(H) ||
      !positive(frame.false_alarm_density) || frame.count < 0 || frame.view.count < 0 ||
      frame.view.count > ViewRegion::kMostEdges) {
    return answer;
  }
  for (int i = 0; i < frame.view.count; ++i) {
    if (!all_finite(frame.view.edges[index(i)])) return answer;
  }
  const double size = H.col(0).norm() * H.col(1).norm() * H.col(2).norm();
  if (!(std::abs(H.determinant()) > 1e-14 * size)) return answer;
  answer.status = FrameStatus::kInTheFuture;
  if (frame.time_s > now_s + options_.most_ahead_s) return answer;
  answer.status = FrameStatus::kTooLate;
  if (!order_.empty() && frame.time_s < time_s_) {
    if (time_s_ - frame.time_s > options_.history_s) return answer;
    // A full history loses its oldest frame to this one. The targets before its new oldest frame
    // are known only if no frame was lost.
    const bool full = order_.size() == history_.size();
    const std::size_t oldest = full ? 1 : 0;
    if (oldest == order_.size()) return answer;
    if ((forgotten_ || full) && frame.time_s < history_[order_[oldest]].frame.time_s) return answer;
  }
  answer.status = FrameStatus::kTooManyDetections;
  if (frame.count > options_.max_detections) return answer;
  for (int i = 0; i < frame.count; ++i) {
    answer.detection = i;
    const TargetMeasurement& detection = frame.detections[i];
    answer.status = FrameStatus::kDetectionNotFinite;
    if (!all_finite(detection.place) || !all_finite(detection.cov)) return answer;
    answer.status = FrameStatus::kDetectionCovariance;
    const Matrix2<double>& V = detection.cov;
    if (!(V(0, 0) > 0) || !(V.determinant() > 1e-14 * V(0, 0) * V(1, 1)) ||
        std::abs(V(0, 1) - V(1, 0)) > 1e-9 * std::sqrt(V(0, 0) * V(1, 1))) {
      return answer;
    }
    answer.status = FrameStatus::kDetectionOutside;
    for (int e = 0; e < frame.view.count; ++e) {
      const Vector3<double>& edge = frame.view.edges[index(e)];
      const double sigma = std::sqrt(edge.head<2>().dot(V * edge.head<2>()));
      if (edge.head<2>().dot(detection.place) + edge[2] < -kOutsideSigmas * sigma) return answer;
    }
  }
  answer.detection = -1;
  answer.status = FrameStatus::kTaken;
  return answer;
}

FrameAnswer TargetTracker::add(const TargetFrame& frame, double now_s) {
  FrameAnswer answer = check(frame, now_s);
  if (answer.status != FrameStatus::kTaken) return answer;
  if (order_.size() == history_.size()) {
    free_.push_back(order_.front());
    order_.erase(order_.begin());
    forgotten_ = true;
  }
  std::size_t position = order_.size();
  while (position > 0 && history_[order_[position - 1]].frame.time_s > frame.time_s) --position;
  keep(frame, position);
  if (position + 1 == order_.size()) {
    step(&history_[order_[position]]);
    answer.steps = 1;
    return answer;
  }

  before_replay_.assign(targets_.begin(), targets_.end());
  targets_.clear();
  if (position > 0) {
    const Kept& before = history_[order_[position - 1]];
    targets_.assign(before.after.begin(), before.after.end());
    time_s_ = before.frame.time_s;
  }
  replaying_ = true;
  for (std::size_t i = position; i < order_.size(); ++i) step(&history_[order_[i]]);
  replaying_ = false;
  name_replayed(position);
  answer.status = FrameStatus::kTakenLate;
  answer.steps = static_cast<int>(order_.size() - position);
  return answer;
}

void TargetTracker::keep(const TargetFrame& frame, std::size_t position) {
  const std::size_t slot = free_.back();
  free_.pop_back();
  order_.insert(order_.begin() + static_cast<std::ptrdiff_t>(position), slot);
  Kept& kept = history_[slot];
  kept.frame = frame;
  kept.detections.assign(frame.detections, frame.detections + frame.count);
  kept.frame.detections = kept.detections.data();
}

void TargetTracker::step(Kept* kept) {
  const double dt_s = targets_.empty() ? 0 : kept->frame.time_s - time_s_;
  predict(kept->frame.time_s, kept->frame);
  gate(*kept);
  associate();
  update();
  count_looks(kept->frame, dt_s);
  bear(*kept);
  kept->after.assign(targets_.begin(), targets_.end());
}

void TargetTracker::predict(double time_s, const TargetFrame& frame) {
  for (Target& target : targets_) {
    predict_target(options_.space, time_s - time_s_, options_.acceleration_density, &target.state);
  }
  time_s_ = time_s;
  targets_.erase(std::remove_if(targets_.begin(), targets_.end(),
                                [&](const Target& target) { return gives_up(target, time_s); }),
                 targets_.end());
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    Target& target = targets_[t];
    const std::optional<ExpectedPlace> place =
        expected_place(options_.space, target.state, frame.H_measured_from_world);
    seen_[t].in_front = place.has_value();
    target.in_view = 0;
    if (place) {
      seen_[t].place = *place;
      target.in_view = probability_in_view(frame.view, place->place, place->cov);
    }
    missed_[t] = 1 - options_.detection_probability * options_.gate_probability * target.in_view;
  }
}

void TargetTracker::gate(const Kept& kept) {
  const auto last = by_x_.begin() + kept.frame.count;
  std::iota(by_x_.begin(), last, 0);
  const auto x_of = [&](int d) { return kept.detections[index(d)].place.x(); };
  std::sort(by_x_.begin(), last,
            [&](int a, int b) { return x_of(a) != x_of(b) ? x_of(a) < x_of(b) : a < b; });
  double most_variance = 0;
  for (const TargetMeasurement& detection : kept.detections) {
    most_variance = std::max(most_variance, detection.cov(0, 0));
  }
  int pairs = 0;
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    Seen& seen = seen_[t];
    seen.first_pair = pairs;
    if (seen.in_front) {
      const double x = seen.place.place.x();
      const double reach = std::sqrt(gate_ * (seen.place.cov(0, 0) + most_variance));
      auto d = std::lower_bound(by_x_.begin(), last, x - reach,
                                [&](int i, double from) { return x_of(i) < from; });
      for (; d != last && x_of(*d) <= x + reach; ++d) {
        const Innovation innovation = innovation_of(seen.place, kept.detections[index(*d)]);
        if (!(innovation.distance_squared <= gate_)) continue;
        innovations_[index(pairs)] = innovation;
        pairs_[index(pairs)] = {
            static_cast<int>(t), *d,
            options_.detection_probability * innovation.density / kept.frame.false_alarm_density,
            0};
        ++pairs;
      }
    }
    seen.pairs = pairs - seen.first_pair;
  }
}

void TargetTracker::associate() {
  const int targets = static_cast<int>(targets_.size());
  const int pairs =
      targets == 0 ? 0 : seen_[index(targets - 1)].first_pair + seen_[index(targets - 1)].pairs;
  association_.weigh(options_.association, missed_.data(), targets, pairs_.data(), pairs);
  std::fill(claimed_.begin(), claimed_.end(), 0.0);
  std::fill(taken_.begin(), taken_.end(), char{0});
  for (int i = 0; i < pairs; ++i) {
    claimed_[index(pairs_[index(i)].detection)] += pairs_[index(i)].weight;
  }

  // Elder targets first: of two on one target, which share its detection's weight, the younger goes
  // unseen.
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    targets_[t].detection = -1;
    double best = kLeastWeightOfSeen;
    for (int i = 0; i < seen_[t].pairs; ++i) {
      const GatedPair& pair = pairs_[index(seen_[t].first_pair + i)];
      if (pair.weight < best || taken_[index(pair.detection)]) continue;
      best = pair.weight;
      targets_[t].detection = pair.detection;
    }
    if (targets_[t].detection >= 0) taken_[index(targets_[t].detection)] = 1;
  }
  // A detection in the gate of an unseen target is rather that target, turning, than a new one.
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    if (targets_[t].identity == 0 || targets_[t].detection >= 0) continue;
    for (int i = 0; i < seen_[t].pairs; ++i) {
      taken_[index(pairs_[index(seen_[t].first_pair + i)].detection)] = 1;
    }
  }
}

void TargetTracker::update() {
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    const Seen& seen = seen_[t];
    if (seen.pairs == 0) continue;
    for (int i = 0; i < seen.pairs; ++i) {
      weights_[index(i)] = pairs_[index(seen.first_pair + i)].weight;
    }
    update_target(options_.space, seen.place, &innovations_[index(seen.first_pair)],
                  weights_.data(), seen.pairs, &targets_[t].state);
  }
}

void TargetTracker::count_looks(const TargetFrame& frame, double dt_s) {
  for (Target& target : targets_) {
    const bool hit = target.detection >= 0;
    if (hit) {
      target.unseen_s = 0;
      target.seen_s = frame.time_s;
    } else {
      // A place that is as likely out of view gives no evidence: that the target is unseen then
      // says that it is out of view.
      target.unseen_s += dt_s * std::max(2 * target.in_view - 1, 0.0);
    }
    if (target.identity != 0) continue;
    target.hits += hit ? 1 : 0;
    target.looks += hit || target.in_view > 0.5 ? 1 : 0;
    if (target.hits >= options_.birth_hits) {
      target.identity = replaying_ ? kProvisional + ++last_provisional_ : ++last_identity_;
    }
  }
  targets_.erase(
      std::remove_if(targets_.begin(), targets_.end(),
                     [&](const Target& target) { return gives_up(target, frame.time_s); }),
      targets_.end());
}

bool TargetTracker::gives_up(const Target& target, double time_s) const {
  if (target.identity == 0) {
    const int left = options_.birth_looks - target.looks;
    if (target.hits + left < options_.birth_hits) return true;
    if (time_s - target.seen_s > options_.lose_after_s) return true;
  }
  return target.unseen_s > options_.lose_after_s ||
         time_s - target.seen_s > options_.forget_after_s ||
         !(worst_sigma(target.state) <= options_.most_sigma);
}

void TargetTracker::bear(const Kept& kept) {
  for (int d = 0; d < kept.frame.count; ++d) {
    if (taken_[index(d)] || claimed_[index(d)] >= kClaimed) continue;
    const std::optional<TargetState> state =
        first_state(options_.space, kept.frame.H_measured_from_world, kept.detections[index(d)],
                    options_.sigma_first_velocity);
    if (!state || !(worst_sigma(*state) <= options_.most_sigma)) continue;
    if (static_cast<int>(targets_.size()) == options_.max_targets) {
      ++births_refused_;
      continue;
    }
    Target target;
    target.state = *state;
    target.born_s = kept.frame.time_s;
    target.seen_s = kept.frame.time_s;
    target.detection = d;
    target.looks = 1;
    target.hits = 1;
    if (options_.birth_hits == 1) {
      target.identity = replaying_ ? kProvisional + ++last_provisional_ : ++last_identity_;
    }
    targets_.push_back(target);
  }
}

// A target born again while frames were repeated gets the identity of the one at its place before,
// or a new one.
void TargetTracker::name_replayed(std::size_t position) {
  for (Target& target : targets_) {
    if (target.identity < kProvisional) continue;
    const std::uint64_t provisional = target.identity;
    double nearest = gate_;
    std::uint64_t name = 0;
    for (const Target& old : before_replay_) {
      if (old.identity == 0) continue;
      const bool present = std::any_of(targets_.begin(), targets_.end(), [&](const Target& other) {
        return other.identity == old.identity;
      });
      const double distance = distance_squared(options_.space, old.state, target.state);
      if (present || !(distance <= nearest)) continue;
      nearest = distance;
      name = old.identity;
    }
    target.identity = name != 0 ? name : ++last_identity_;
    for (std::size_t i = position; i < order_.size(); ++i) {
      for (Target& kept : history_[order_[i]].after) {
        if (kept.identity == provisional) kept.identity = target.identity;
      }
    }
  }
}

}  // namespace alidade
