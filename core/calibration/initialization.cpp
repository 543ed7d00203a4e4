#include "core/calibration/initialization.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/calibration/median.h"

namespace alidade::internal {

void unwrap(std::vector<AdjustmentTelemetry>* telemetry) {
  constexpr std::size_t kMemory = 5;
  for (int axis = 0; axis < 2; ++axis) {
    for (std::size_t i = 1; i < telemetry->size(); ++i) {
      std::vector<double> recent;
      for (std::size_t j = i - std::min(i, kMemory); j < i; ++j) {
        recent.push_back((*telemetry)[j].measured[axis]);
      }
      const double near = median(std::move(recent));
      double& angle = (*telemetry)[i].measured[axis];
      angle = near + wrap_angle(angle - near);
    }
  }
}

std::optional<TrajectorySpline> fit_telemetry(const std::vector<AdjustmentTelemetry>& telemetry,
                                              double shift_s, double begin_s, double end_s,
                                              double spacing_s, double* sigma) {
  std::vector<const AdjustmentTelemetry*> inside;
  for (const auto& sample : telemetry) {
    const double time = sample.time_s - shift_s;
    if (time >= begin_s && time <= end_s) inside.push_back(&sample);
  }
  if (inside.size() < 8) return std::nullopt;
  // Segments without enough samples to hold them are joined.
  constexpr int kSamplesPerSegment = 2;
  const double length = end_s - begin_s;
  const int segments = std::max(1, static_cast<int>(std::ceil(length / spacing_s)));
  std::vector<int> population(static_cast<std::size_t>(segments), 0);
  for (const auto* sample : inside) {
    const double place = (sample->time_s - shift_s - begin_s) / length * segments;
    ++population[static_cast<std::size_t>(std::clamp(static_cast<int>(place), 0, segments - 1))];
  }
  std::vector<double> knots = {begin_s};
  int held = 0;
  for (int s = 0; s < segments; ++s) {
    held += population[static_cast<std::size_t>(s)];
    if (held < kSamplesPerSegment) continue;
    knots.push_back(begin_s + length * (s + 1) / segments);
    held = 0;
  }
  // The last knot found becomes the end, whatever follows it.
  if (knots.size() > 1) knots.pop_back();
  knots.push_back(end_s);

  TrajectorySpline spline(knots);
  const int points = spline.control_points();
  std::vector<double> weight(inside.size(), 1.0);
  std::vector<double> error(inside.size());
  for (int pass = 0; pass < 8; ++pass) {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(points, 2);
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const auto basis = spline.basis(inside[i]->time_s - shift_s);
      for (int a = 0; a < 4; ++a) {
        const double w = weight[i] * basis.weight[a];
        right.row(basis.segment + a) += w * inside[i]->measured.transpose();
        for (int b = 0; b <= a; ++b) {
          entries.emplace_back(basis.segment + a, basis.segment + b, w * basis.weight[b]);
        }
      }
    }
    // Keeps what few samples reach from swinging: a share of 1e-6 for small changes between neighbours.
    for (int a = 0; a < points; ++a) {
      entries.emplace_back(a, a, a == 0 || a == points - 1 ? 1e-6 : 2e-6);
      if (a > 0) entries.emplace_back(a, a - 1, -1e-6);
    }
    Eigen::SparseMatrix<double> H(points, points);
    H.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower,
                                Eigen::NaturalOrdering<int>>
        ldlt(H);
    if (ldlt.info() != Eigen::Success) return std::nullopt;
    const Eigen::MatrixXd solution = ldlt.solve(right);
    if (!solution.allFinite()) return std::nullopt;
    for (int a = 0; a < points; ++a) spline.control_point(a) = solution.row(a).transpose();
    for (std::size_t i = 0; i < inside.size(); ++i) {
      error[i] =
          (inside[i]->measured - spline.position(inside[i]->time_s - shift_s).vector()).norm();
    }
    // The median length of a 2-vector of unit noise is sqrt(2 ln 2).
    const double scale = std::max(median(error) / std::sqrt(2 * std::log(2.0)), 1e-12);
    if (sigma != nullptr) *sigma = scale;
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const double x = error[i] / (3 * scale);
      weight[i] = 1 / ((1 + x * x) * (1 + x * x));
    }
  }
  return spline;
}

std::vector<ImageMotion> image_motion(const AdjustmentData& data, double baseline_s) {
  struct Seen {
    int landmark;
    Vector2<double> u;
  };
  const std::size_t frames = data.frame_time_s.size();
  std::vector<std::vector<Seen>> seen(frames);
  for (const auto& o : data.observations) {  // by landmark, so each frame's list is sorted
    seen[static_cast<std::size_t>(o.frame)].push_back({o.landmark, o.u});
  }
  constexpr std::size_t kMinShared = 3;
  std::vector<Vector2<double>> position(frames, Vector2<double>::Zero());
  std::vector<int> chain(frames, 0);
  std::vector<double> du;
  std::vector<double> dv;
  // A frame in which nothing was looked for says nothing of the motion, not even that it broke off.
  std::size_t before = 0;
  for (std::size_t i = 1; i < frames; ++i) {
    if (seen[i].empty()) continue;
    du.clear();
    dv.clear();
    auto a = seen[before].begin();
    for (const Seen& b : seen[i]) {
      while (a != seen[before].end() && a->landmark < b.landmark) ++a;
      if (a == seen[before].end()) break;
      if (a->landmark != b.landmark) continue;
      du.push_back(b.u.x() - a->u.x());
      dv.push_back(b.u.y() - a->u.y());
    }
    const bool linked = du.size() >= kMinShared;
    chain[i] = chain[before] + (linked ? 0 : 1);
    if (linked) position[i] = position[before] + Vector2<double>(median(du), median(dv));
    before = i;
  }
  std::vector<ImageMotion> motion;
  std::size_t to = 0;
  for (std::size_t from = 0; from < frames; ++from) {
    while (to < frames && data.frame_time_s[to] < data.frame_time_s[from] + baseline_s) ++to;
    if (to == frames) break;
    if (seen[from].empty() || seen[to].empty() || chain[from] != chain[to]) continue;
    motion.push_back(
        {data.frame_time_s[from], data.frame_time_s[to], position[to] - position[from]});
  }
  return motion;
}

MotionMatch match_motion(const std::vector<ImageMotion>& motion, const TrajectorySpline& telemetry,
                         double centre_s, double half_range_s) {
  // The telemetry on a grid: every candidate needs it at all frames.
  constexpr double kGridStep = 2e-3;
  const int grid_size = static_cast<int>((telemetry.end_s() - telemetry.begin_s()) / kGridStep) + 1;
  std::vector<Vector2<double>> grid;
  grid.reserve(static_cast<std::size_t>(grid_size));
  int segment = 0;
  for (int i = 0; i < grid_size; ++i) {
    const auto basis = telemetry.basis(telemetry.begin_s() + i * kGridStep, segment);
    segment = basis.segment;
    grid.push_back(telemetry.position(basis).vector());
  }
  const auto look_up = [&](double time, Vector2<double>* angle) {
    const double place = (time - telemetry.begin_s()) / kGridStep;
    if (!(place >= 0) || place >= grid_size - 1) return false;
    const auto i = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(i);
    *angle = (1 - share) * grid[i] + share * grid[i + 1];
    return true;
  };
  const auto evaluate = [&](double shift) {
    MotionMatch match;
    match.shift_s = shift;
    Vector2<double> mp = Vector2<double>::Zero();
    Vector2<double> mm = Vector2<double>::Zero();
    Vector2<double> pp = Vector2<double>::Zero();
    std::size_t used = 0;
    for (const ImageMotion& m : motion) {
      Vector2<double> from;
      Vector2<double> to;
      if (!look_up(m.from_s + shift, &from) || !look_up(m.to_s + shift, &to)) continue;
      const Vector2<double> p(-std::cos(0.5 * (from[1] + to[1])) * (to[0] - from[0]),
                              to[1] - from[1]);
      mp += m.shift.cwiseProduct(p);
      mm += m.shift.cwiseAbs2();
      pp += p.cwiseAbs2();
      ++used;
    }
    // A candidate that leaves most of the video without telemetry is no match.
    if (2 * used < motion.size()) return match;
    const auto normalised = [](double ab, double aa, double bb) {
      return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0.0;
    };
    match.correlation = normalised(mp.sum(), mm.sum(), pp.sum());
    match.focal_length = pp.sum() > 0 ? mp.sum() / pp.sum() : 0;
    return match;
  };

  MotionMatch best;
  const auto search = [&](double centre, double half_range, int steps) {
    int best_step = 0;
    for (int i = -steps; i <= steps; ++i) {
      const MotionMatch match = evaluate(centre + half_range * i / steps);
      if (match.correlation <= best.correlation) continue;
      best = match;
      best_step = i;
    }
    return best_step;
  };
  const int steps = std::max(10, static_cast<int>(half_range_s / 0.02));
  const int at = search(centre_s, half_range_s, steps);
  best.at_edge = std::abs(at) == steps;
  for (double range = half_range_s / steps; range > 1e-4; range /= 5)
    search(best.shift_s, range, 5);
  return best;
}

double angle_quantum(const std::vector<AdjustmentTelemetry>& telemetry) {
  // Steps of a rounding in the file, or of the arithmetic, are none of the device's.
  constexpr double kSmallest = 2e-7;  // rad
  double quantum = 0;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> angles;
    for (const auto& sample : telemetry) angles.push_back(sample.measured[axis]);
    std::sort(angles.begin(), angles.end());
    std::vector<double> steps;
    for (std::size_t i = 1; i < angles.size(); ++i) {
      const double step = angles[i] - angles[i - 1];
      if (step > 1e-3 * kSmallest) steps.push_back(step);
    }
    if (steps.empty()) continue;
    const double smallest = *std::min_element(steps.begin(), steps.end());
    if (smallest < kSmallest) continue;
    const auto whole = [smallest](double step) {
      return std::abs(step / smallest - std::round(step / smallest)) < 0.02;
    };
    if (std::all_of(steps.begin(), steps.end(), whole)) quantum = std::max(quantum, smallest);
  }
  return quantum;
}

void set_telemetry_sigma(double white_sigma, double quantum, double stamp_sigma_s,
                         const TrajectorySpline& smooth,
                         std::vector<AdjustmentTelemetry>* telemetry) {
  for (auto& sample : *telemetry) {
    const Vector2<double> stamp = stamp_sigma_s * smooth.rate(sample.time_s).vector();
    const double variance = white_sigma * white_sigma + quantum * quantum / 12;
    sample.sigma = (stamp.array().square() + variance).sqrt();
  }
}

std::vector<AdjustmentTelemetry> quantum_crossings(
    const std::vector<AdjustmentTelemetry>& telemetry, double quantum, double white_sigma,
    const TrajectorySpline& trajectory, double shift_s, std::vector<std::size_t>* source) {
  constexpr double kDither = 0.25;
  // Share of a quantum below which no device rounds evenly.
  constexpr double kUnevenness = 0.02;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<AdjustmentTelemetry> items;
  source->clear();
  const std::size_t count = telemetry.size();
  // Steps from sample i to the next, in quanta.
  const auto step = [&](std::size_t i, int axis) {
    return std::abs(
        std::round((telemetry[i + 1].measured[axis] - telemetry[i].measured[axis]) / quantum));
  };
  std::array<bool, 2> steps_singly{};
  for (int axis = 0; axis < 2; ++axis) {
    for (std::size_t i = 0; quantum > 0 && white_sigma < kDither * quantum && i + 1 < count; ++i) {
      auto& singly = steps_singly[static_cast<std::size_t>(axis)];
      singly = singly || step(i, axis) == 1;
    }
  }
  std::array<std::size_t, 2> run_end{};  // of the equal readings that sample i belongs to
  std::array<double, 2> run_sigma{};
  for (std::size_t i = 0; i < count; ++i) {
    AdjustmentTelemetry reading = telemetry[i];
    AdjustmentTelemetry crossing = telemetry[i];
    crossing.sigma.setConstant(kNone);
    crossing.is_noise = {false, false};
    for (int axis = 0; axis < 2; ++axis) {
      if (!steps_singly[static_cast<std::size_t>(axis)]) continue;
      const bool slow = (i > 0 && step(i - 1, axis) < 2) || (i + 1 < count && step(i, axis) < 2);
      const auto a = static_cast<std::size_t>(axis);
      if (i == run_end[a]) {
        while (run_end[a] + 1 < count && step(run_end[a], axis) == 0) ++run_end[a];
        ++run_end[a];
        run_sigma[a] = quantum * std::sqrt(static_cast<double>(run_end[a] - i));
      }
      if (slow) {
        reading.sigma[axis] = run_sigma[a];
        reading.is_noise[a] = false;
      }
      if (i + 1 == count || step(i, axis) != 1) continue;
      const double interval = telemetry[i + 1].time_s - telemetry[i].time_s;
      crossing.time_s = telemetry[i].time_s + 0.5 * interval;
      const double moved = std::min(
          quantum, interval * std::abs(trajectory.rate(crossing.time_s - shift_s).vector()[axis]));
      crossing.measured[axis] =
          0.5 * (telemetry[i].measured[axis] + telemetry[i + 1].measured[axis]);
      crossing.sigma[axis] =
          std::hypot(white_sigma, moved / std::sqrt(12.0), kUnevenness * quantum);
      crossing.is_noise[a] = true;
    }
    items.push_back(reading);
    source->push_back(i);
    if (std::isinf(crossing.sigma.minCoeff())) continue;
    items.push_back(crossing);
    source->push_back(i);
  }
  return items;
}

void initialise_landmarks(const AdjustmentData& data, AdjustmentState* state) {
  const Camera<double> camera = state->physical_camera();
  const Matrix3<double> R_anchor_from_base =
      R_base_from_camera(state->mechanics, state->anchor).transpose();
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> z;
  std::size_t next = 0;
  for (std::size_t l = 0; l < state->landmarks.size(); ++l) {
    x.clear();
    y.clear();
    z.clear();
    for (;
         next < data.observations.size() && data.observations[next].landmark == static_cast<int>(l);
         ++next) {
      const auto& o = data.observations[next];
      Vector3<double> d_c;
      if (unproject(camera, o.u, &d_c) != ProjectionStatus::kOk) continue;
      const double time =
          data.frame_time_s[static_cast<std::size_t>(o.frame)] + o.u.y() * state->line_delay();
      const Vector3<double> d =
          R_anchor_from_base *
          (R_base_from_camera(state->mechanics, state->trajectory.position(time)) * d_c);
      x.push_back(d.x());
      y.push_back(d.y());
      z.push_back(d.z());
    }
    Vector3<double> d = Vector3<double>::UnitX();
    if (!x.empty()) d = Vector3<double>(median(x), median(y), median(z));
    state->landmarks[l] = d.norm() > 0 ? Vector3<double>(d.normalized()) : Vector3<double>::UnitX();
  }
}

}  // namespace alidade::internal
