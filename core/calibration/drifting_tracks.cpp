#include "core/calibration/drifting_tracks.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/calibration/drift_fit.h"
#include "core/model/median.h"

namespace alidade::internal {

namespace {

class DriftFinder {
 public:
  static constexpr int kMostControlPoints = 600;  // some minutes

  DriftFinder(AdjustmentData* data, const AdjustmentState& state, double resolution_rad,
              Adjustment* adjustment)
      : fit_(data, state, adjustment),
        pixel_rad_(1 / state.camera.focal_length),
        resolution_rad_(resolution_rad) {}

  DriftingTracks find();

 private:
  using Track = DriftFit::Track;

  static constexpr double kWindow_s = 3;
  static constexpr double kLeastLife_s = 0.4;  // of a track that shows its rate
  static constexpr int kLeastObservations = 5;
  static constexpr std::size_t kLeastGroup = 8;   // tracks
  static constexpr double kLeastShare = 0.1;      // of a window's tracks
  static constexpr std::size_t kMostGroups = 4;   // of a window
  static constexpr double kGate = 13.8;           // 99.9 % of chi-square, two degrees of freedom
  static constexpr double kTold = 9;              // difference of chi-squares of rest and drift
  static constexpr double kSteadiness = 0.2;      // of a group's rate
  static constexpr double kUnmodelled_px = 0.05;  // over a track's life, in its place
  static constexpr double kPerFreeTrack = 6;      // what freeing a track costs, of its two unknowns
  static constexpr double kSure = 50;             // difference of sums of squares
  static constexpr double kLeastDrift_px_s = 0.1;  // less is no drift of the picture
  // With less than this, nothing is refused: a lens that is not as stated does as much.
  static constexpr double kHarmful_px_s = 0.5;

  struct Hypothesis {
    bool holds = false;
    std::vector<TrackMotion> motions;
    Vector2<double> shared_rate = Vector2<double>::Zero();
    double cost = std::numeric_limits<double>::infinity();  // with what free tracks cost
    std::vector<Vector2<double>> rates;
    std::vector<Matrix2<double>> covariances;
  };
  struct Group {
    Vector2<double> rate = Vector2<double>::Zero();
    std::vector<std::size_t> tracks;
  };
  struct Window {
    std::vector<std::size_t> tracks;
    std::vector<Group> groups;  // the largest first
  };

  [[nodiscard]] Matrix2<double> covariance_of(const Track& track) const {
    const double life = std::max(1e-3, track.end_s - track.begin_s);
    const double unmodelled = kUnmodelled_px * pixel_rad_ / life;
    return track.covariance + unmodelled * unmodelled * Matrix2<double>::Identity();
  }
  [[nodiscard]] bool shows_rate(const Track& track) const {
    return track.observations >= kLeastObservations && track.end_s - track.begin_s >= kLeastLife_s;
  }
  void find_windows();
  void find_groups(Window* window) const;
  // chi-square of the track's rate less this one. slack: of that, one standard deviation.
  [[nodiscard]] double square_from(const Vector2<double>& rate, double slack,
                                   const Track& track) const;
  // By what the track's rate is now.
  [[nodiscard]] TrackMotion motion_of(const Track& track, bool grouped,
                                      const Vector2<double>& shared_rate) const;
  // grouped: some move as one.
  [[nodiscard]] Hypothesis settle(std::vector<TrackMotion> motions, bool grouped,
                                  Vector2<double> shared_rate);
  template <class Choose>
  [[nodiscard]] std::vector<TrackMotion> chosen(Choose choose) const;
  [[nodiscard]] std::vector<TrackMotion> consistent(const Vector2<double>& shared_rate) const;
  [[nodiscard]] bool all_drift(Vector2<double>* rate) const;
  [[nodiscard]] Group coherent(const Hypothesis& hypothesis) const;
  void mark(const Hypothesis& hypothesis, DriftingTracks* out) const;

  DriftFit fit_;
  double pixel_rad_;
  double resolution_rad_;
  double span_s_ = 0;  // from the first track's begin to the last one's end
  std::vector<Window> windows_;
};

void DriftFinder::find_windows() {
  double begin = std::numeric_limits<double>::infinity();
  double end = -begin;
  for (const Track& track : fit_.tracks()) {
    if (!shows_rate(track)) continue;
    begin = std::min(begin, track.begin_s);
    end = std::max(end, track.end_s);
  }
  if (!(begin < end)) return;
  span_s_ = end - begin;
  const int count = std::max(1, static_cast<int>(2 * (end - begin) / kWindow_s) - 1);
  for (int i = 0; i < count; ++i) {
    const double from = begin + 0.5 * i * kWindow_s;
    const double to = i + 1 == count ? end : from + kWindow_s;
    Window window;
    for (std::size_t l = 0; l < fit_.tracks().size(); ++l) {
      const Track& track = fit_.tracks()[l];
      if (shows_rate(track) && track.middle_s >= from && track.middle_s <= to) {
        window.tracks.push_back(l);
      }
    }
    find_groups(&window);
    if (!window.groups.empty()) windows_.push_back(std::move(window));
  }
}

// The track with the most others at its rate, with these, is a group; then those left, likewise.
void DriftFinder::find_groups(Window* window) const {
  std::vector<std::size_t> left = window->tracks;
  const std::size_t least =
      std::max(kLeastGroup,
               static_cast<std::size_t>(kLeastShare * static_cast<double>(window->tracks.size())));
  const auto agree = [&](std::size_t a, const Vector2<double>& rate, const Matrix2<double>& of) {
    const Track& track = fit_.tracks()[a];
    const Vector2<double> apart = track.rate - rate;
    return apart.dot((covariance_of(track) + of).inverse() * apart) < kGate;
  };
  while (left.size() >= least && window->groups.size() < kMostGroups) {
    std::size_t best = 0;
    std::size_t most = 0;
    for (const std::size_t a : left) {
      const Matrix2<double> covariance = covariance_of(fit_.tracks()[a]);
      std::size_t count = 0;
      for (const std::size_t b : left) {
        count += agree(b, fit_.tracks()[a].rate, covariance) ? 1U : 0U;
      }
      // A track that knows its rate badly agrees with all.
      if (count <= most) continue;
      most = count;
      best = a;
    }
    Group group;
    group.rate = fit_.tracks()[best].rate;
    Matrix2<double> covariance = covariance_of(fit_.tracks()[best]);
    for (int round = 0; round < 3; ++round) {
      group.tracks.clear();
      Matrix2<double> information = Matrix2<double>::Zero();
      Vector2<double> sum = Vector2<double>::Zero();
      for (const std::size_t l : left) {
        if (!agree(l, group.rate, covariance)) continue;
        group.tracks.push_back(l);
        const Matrix2<double> own = covariance_of(fit_.tracks()[l]).inverse();
        information += own;
        sum += own * fit_.tracks()[l].rate;
      }
      if (group.tracks.empty()) break;
      covariance = information.inverse();
      group.rate = covariance * sum;
    }
    if (group.tracks.size() < least) break;
    left.erase(std::remove_if(left.begin(), left.end(),
                              [&](std::size_t l) {
                                return std::binary_search(group.tracks.begin(), group.tracks.end(),
                                                          l);
                              }),
               left.end());
    window->groups.push_back(std::move(group));
  }
}

template <class Choose>
std::vector<TrackMotion> DriftFinder::chosen(Choose choose) const {
  std::vector<TrackMotion> motions(fit_.tracks().size(), TrackMotion::kFree);
  for (const Window& window : windows_) {
    for (const std::size_t l : window.groups[choose(window)].tracks) {
      motions[l] = TrackMotion::kAtRest;
    }
  }
  return motions;
}

// In each window at most one group is at rest, and the others have that rate, as nearly as may be:
// where clouds are all that is in view, they drift there, too.
std::vector<TrackMotion> DriftFinder::consistent(const Vector2<double>& shared_rate) const {
  std::vector<TrackMotion> motions(fit_.tracks().size(), TrackMotion::kFree);
  const double most = shared_rate.squaredNorm();
  for (const Window& window : windows_) {
    const auto misfit = [&](std::size_t at_rest) {
      double sum = 0;
      for (std::size_t g = 0; g < window.groups.size(); ++g) {
        const Vector2<double>& rate = window.groups[g].rate;
        sum +=
            g == at_rest ? rate.squaredNorm() : std::min(most, (rate - shared_rate).squaredNorm());
      }
      return sum;
    };
    std::size_t best = window.groups.size();  // none
    for (std::size_t g = 0; g < window.groups.size(); ++g) {
      if (misfit(g) < misfit(best)) best = g;
    }
    for (std::size_t g = 0; g < window.groups.size(); ++g) {
      const Vector2<double> apart = window.groups[g].rate - shared_rate;
      if (g != best && apart.squaredNorm() > 0.25 * most) continue;
      for (const std::size_t l : window.groups[g].tracks) {
        motions[l] = g == best ? TrackMotion::kAtRest : TrackMotion::kShared;
      }
    }
  }
  return motions;
}

double DriftFinder::square_from(const Vector2<double>& rate, double slack,
                                const Track& track) const {
  const Matrix2<double> covariance =
      covariance_of(track) + slack * slack * Matrix2<double>::Identity();
  const Vector2<double> apart = track.rate - rate;
  return apart.dot(covariance.inverse() * apart);
}

TrackMotion DriftFinder::motion_of(const Track& track, bool grouped,
                                   const Vector2<double>& shared_rate) const {
  const double of_rest =
      track.observations < kLeastObservations ? 0 : square_from(Vector2<double>::Zero(), 0, track);
  if (!grouped) return of_rest < kGate ? TrackMotion::kAtRest : TrackMotion::kFree;
  const double of_drift = square_from(shared_rate, kSteadiness * shared_rate.norm(), track);
  if (std::min(of_rest, of_drift) >= kGate) return TrackMotion::kFree;
  return of_rest < of_drift ? TrackMotion::kAtRest : TrackMotion::kShared;
}

// What is at rest with the others is at rest; until that stays.
DriftFinder::Hypothesis DriftFinder::settle(std::vector<TrackMotion> motions, bool grouped,
                                            Vector2<double> shared_rate) {
  constexpr int kRounds = 6;
  Hypothesis out;
  for (int round = 0; round < kRounds; ++round) {
    double cost = 0;
    if (!fit_.solve(motions, shared_rate, &cost)) return {};
    out.motions = motions;
    out.shared_rate = shared_rate;
    out.cost = cost;
    out.rates.clear();
    out.covariances.clear();
    int rest = 0;
    bool changed = false;
    Matrix2<double> information = Matrix2<double>::Zero();
    Vector2<double> sum = Vector2<double>::Zero();
    for (std::size_t l = 0; l < motions.size(); ++l) {
      const Track& track = fit_.tracks()[l];
      const Matrix2<double> covariance = covariance_of(track);
      out.rates.push_back(track.rate);
      out.covariances.push_back(covariance);
      const TrackMotion motion = motion_of(track, grouped, shared_rate);
      out.cost += motions[l] == TrackMotion::kFree ? kPerFreeTrack : 0;
      rest += motion == TrackMotion::kAtRest ? 1 : 0;
      changed = changed || motion != motions[l];
      motions[l] = motion;
      if (motion != TrackMotion::kShared || !shows_rate(track)) continue;
      information += covariance.inverse();
      sum += covariance.inverse() * track.rate;
    }
    if (rest < static_cast<int>(kLeastGroup)) return {};
    if (information(0, 0) > 0) shared_rate = information.inverse() * sum;
    if (!changed) break;
  }
  out.holds = true;
  return out;
}

// The most tracks of one rate among those that are not at rest.
DriftFinder::Group DriftFinder::coherent(const Hypothesis& hypothesis) const {
  std::vector<std::size_t> moving;
  for (std::size_t l = 0; l < fit_.tracks().size(); ++l) {
    if (hypothesis.motions[l] != TrackMotion::kAtRest && shows_rate(fit_.tracks()[l]))
      moving.push_back(l);
  }
  Group group;
  if (moving.size() < kLeastGroup) return group;
  std::vector<double> pan;
  std::vector<double> tilt;
  for (const std::size_t l : moving) {
    pan.push_back(hypothesis.rates[l].x());
    tilt.push_back(hypothesis.rates[l].y());
  }
  group.rate = {median(pan), median(tilt)};
  const double slack = kSteadiness * group.rate.norm();
  for (const std::size_t l : moving) {
    const Vector2<double> apart = hypothesis.rates[l] - group.rate;
    const Matrix2<double> covariance =
        hypothesis.covariances[l] + slack * slack * Matrix2<double>::Identity();
    if (apart.dot(covariance.inverse() * apart) < kGate) group.tracks.push_back(l);
  }
  return group;
}

// A drift of all is steady, and goes beyond what it scatters by from time to time.
bool DriftFinder::all_drift(Vector2<double>* rate) const {
  constexpr std::size_t kLeastWindows = 4;
  constexpr double kMuch = 6;
  std::vector<Vector2<double>> rates;
  for (const Window& window : windows_) {
    if (2 * window.groups.front().tracks.size() > window.tracks.size()) {
      rates.push_back(window.groups.front().rate);
    }
  }
  if (rates.size() < kLeastWindows) return false;
  const auto count = static_cast<double>(rates.size());
  Vector2<double> mean = Vector2<double>::Zero();
  for (const auto& r : rates) mean += r / count;
  double square = 0;
  for (const auto& r : rates) square += (r - mean).squaredNorm() / (count - 1);
  *rate = mean;
  // Windows overlap by half.
  return mean.norm() > kHarmful_px_s * pixel_rad_ && mean.norm() * span_s_ > 2 * resolution_rad_ &&
         mean.norm() > kMuch * std::sqrt(2 * square / count);
}

// Left out is what is not at rest, and what may as well drift with the group.
void DriftFinder::mark(const Hypothesis& hypothesis, DriftingTracks* out) const {
  const double slack = kSteadiness * hypothesis.shared_rate.norm();
  for (std::size_t l = 0; l < fit_.tracks().size(); ++l) {
    const Track& track = fit_.tracks()[l];
    const double of_rest = square_from(Vector2<double>::Zero(), 0, track);
    const bool rests = hypothesis.motions[l] == TrackMotion::kAtRest &&
                       track.observations >= kLeastObservations &&
                       square_from(hypothesis.shared_rate, slack, track) - of_rest > kTold;
    out->drifts[l] = rests ? 0 : 1;
    out->count += out->drifts[l];
  }
}

DriftingTracks DriftFinder::find() {
  DriftingTracks out;
  out.drifts.assign(fit_.tracks().size(), 0);
  double cost = 0;
  const std::vector<TrackMotion> free(fit_.tracks().size(), TrackMotion::kFree);
  if (!fit_.solve(free, Vector2<double>::Zero(), &cost)) return out;
  find_windows();
  if (windows_.empty()) return out;
  const bool split = std::any_of(windows_.begin(), windows_.end(),
                                 [](const Window& w) { return w.groups.size() > 1; });
  const auto largest = [](const Window&) { return std::size_t{0}; };
  const auto second = [](const Window& w) { return w.groups.size() > 1 ? 1U : std::size_t{0}; };
  const auto slowest = [](const Window& w) {
    std::size_t best = 0;
    for (std::size_t g = 1; g < w.groups.size(); ++g) {
      if (w.groups[g].rate.norm() < w.groups[best].rate.norm()) best = g;
    }
    return best;
  };
  if (!split) {
    if (all_drift(&out.rate)) out.finding = DriftFinding::kAll;
    return out;
  }
  Hypothesis best;
  for (const auto& start : {chosen(largest), chosen(second), chosen(slowest)}) {
    Hypothesis hypothesis = settle(start, false, Vector2<double>::Zero());
    if (hypothesis.holds && hypothesis.cost < best.cost) best = std::move(hypothesis);
  }
  if (!best.holds) return out;
  const Group group = coherent(best);
  std::size_t shown = 0;
  std::size_t moving = 0;
  for (std::size_t l = 0; l < fit_.tracks().size(); ++l) {
    if (!shows_rate(fit_.tracks()[l])) continue;
    ++shown;
    moving += best.motions[l] != TrackMotion::kAtRest ? 1 : 0;
  }
  const bool is_group =
      group.tracks.size() >= kLeastGroup && 2 * group.tracks.size() > moving &&
      static_cast<double>(group.tracks.size()) > kLeastShare * static_cast<double>(shown) &&
      group.rate.norm() > kLeastDrift_px_s * pixel_rad_;
  if (!is_group) return out;
  // Would the group be at rest?
  std::vector<TrackMotion> other(fit_.tracks().size(), TrackMotion::kFree);
  for (const std::size_t l : group.tracks) other[l] = TrackMotion::kAtRest;
  const Hypothesis against = settle(std::move(other), false, Vector2<double>::Zero());
  out.rate = group.rate;
  if (against.holds && against.motions != best.motions && against.cost - best.cost < kSure) {
    if (group.rate.norm() > kHarmful_px_s * pixel_rad_) out.finding = DriftFinding::kUndecided;
    return out;
  }
  // With the group's rate known, stretches of time in which clouds are all that is in view.
  best.shared_rate = group.rate;
  Hypothesis grouped = settle(consistent(group.rate), true, group.rate);
  if (grouped.holds && grouped.cost < best.cost) best = std::move(grouped);
  // Rates are those of the latest solution.
  if (!fit_.solve(best.motions, best.shared_rate, &cost)) return out;
  out.finding = DriftFinding::kGroup;
  out.rate = best.shared_rate;
  mark(best, &out);
  return out;
}

}  // namespace

DriftingTracks find_drifting_tracks(AdjustmentData* data, const AdjustmentState& state,
                                    double resolution_rad, Adjustment* adjustment) {
  if (state.trajectory.control_points() > DriftFinder::kMostControlPoints) {
    DriftingTracks none;
    none.drifts.assign(state.landmarks.size(), 0);
    return none;
  }
  return DriftFinder(data, state, resolution_rad, adjustment).find();
}

}  // namespace alidade::internal
