#include "core/calibration/contradictions.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/calibration/chance.h"
#include "core/calibration/departure_score.h"

namespace alidade::internal {

namespace {

// Of all that is tried together, where nothing departs from the model.
constexpr double kFalseAlarm = 0.01;
// With fewer parts a variance is known too poorly.
constexpr double kLeastParts = 4;
// A parameter that the rows decide less than this is its prior's.
constexpr double kLeastShare = 0.01;
constexpr double kSample = 0.02;  // s, of the trajectory

Division by_time(double begin_s, double end_s, int parts) {
  return {"stretches of time", parts, [=](double t) {
            return static_cast<int>(std::clamp(
                std::floor((t - begin_s) / (end_s - begin_s) * parts), 0.0, parts - 1.0));
          }};
}

int samples_of(double begin_s, double end_s) {
  return static_cast<int>(std::ceil((end_s - begin_s) / kSample));
}

double angle_at(const TrajectorySpline& trajectory, int axis, double t) {
  return trajectory.position(t).vector()[axis];
}

// Cells of equal width.
Division by_angle(const TrajectorySpline& trajectory, double begin_s, double end_s, int axis,
                  int parts) {
  double least = angle_at(trajectory, axis, begin_s);
  double most = least;
  for (int i = 0; i < samples_of(begin_s, end_s); ++i) {
    const double t = begin_s + i * kSample;
    const double angle = angle_at(trajectory, axis, t);
    least = std::min(least, angle);
    most = std::max(most, angle);
  }
  const double width = std::max(most - least, 1e-9) / parts;
  return {axis == 0 ? "pan angles" : "tilt angles", parts,
          [&trajectory, axis, least, width, parts](double t) {
            const double cell = std::floor((angle_at(trajectory, axis, t) - least) / width);
            return static_cast<int>(std::clamp(cell, 0.0, parts - 1.0));
          }};
}

// A run goes on until the axis has come back by a twentieth of its range.
Division by_run(const TrajectorySpline& trajectory, double begin_s, double end_s, int axis) {
  double least = angle_at(trajectory, axis, begin_s);
  double most = least;
  for (int i = 0; i < samples_of(begin_s, end_s); ++i) {
    const double t = begin_s + i * kSample;
    least = std::min(least, angle_at(trajectory, axis, t));
    most = std::max(most, angle_at(trajectory, axis, t));
  }
  const double back = (most - least) / 20;
  std::vector<double> turns;
  double extreme = angle_at(trajectory, axis, begin_s);
  double extreme_time = begin_s;
  double direction = 0;
  for (int i = 0; i < samples_of(begin_s, end_s); ++i) {
    const double t = begin_s + i * kSample;
    const double angle = angle_at(trajectory, axis, t);
    if (direction == 0) {
      if (std::abs(angle - extreme) > back) direction = angle > extreme ? 1 : -1;
      if (direction == 0) continue;
    }
    if (direction * (angle - extreme) >= 0) {
      extreme = angle;
      extreme_time = t;
    } else if (direction * (extreme - angle) > back) {
      turns.push_back(extreme_time);
      direction = -direction;
      extreme = angle;
      extreme_time = t;
    }
  }
  return {
      axis == 0 ? "runs of pan" : "runs of tilt", static_cast<int>(turns.size()) + 1,
      [turns](double t) {
        return static_cast<int>(std::upper_bound(turns.begin(), turns.end(), t) - turns.begin());
      }};
}

// Change of the parameters with the error of one sample.
Influence influence_of(const TelemetryRow& row, const GlobalRows& inverse) {
  Influence of_angle = Influence::Zero();
  for (int k = 0; k < 4; ++k) {
    of_angle += row.basis.weight[k] * inverse.middleCols<2>(2 * (row.basis.segment + k));
  }
  return of_angle * row.slope.asDiagonal() +
         inverse.middleCols<4>(inverse.cols() - kGlobalCount + kObservedCount) * row.J.transpose();
}

}  // namespace

std::vector<Division> usual_divisions(const TrajectorySpline& trajectory, double begin_s,
                                      double end_s) {
  const double duration = end_s - begin_s;
  std::vector<Division> divisions;
  if (!(duration > 0)) return divisions;
  const int parts = static_cast<int>(std::clamp(duration, 8.0, 24.0));  // about a second each
  divisions.push_back(by_time(begin_s, end_s, parts));
  for (int axis = 0; axis < 2; ++axis) {
    divisions.push_back(by_angle(trajectory, begin_s, end_s, axis, 12));
    divisions.push_back(by_run(trajectory, begin_s, end_s, axis));
  }
  return divisions;
}

std::vector<std::vector<PartGrowth>> part_growth(const std::vector<Division>& divisions,
                                                 const Adjustment& adjustment,
                                                 const AdjustmentState& state,
                                                 const Linearisation& at,
                                                 const ReducedFactor& factor) {
  const GlobalRows& inverse = adjustment.global_rows();
  const std::vector<Influence> influences = adjustment.influences(state, at);
  std::vector<int> first;
  std::vector<DepartureScore> parts;
  for (const Division& division : divisions) {
    first.push_back(static_cast<int>(parts.size()));
    parts.insert(parts.end(), static_cast<std::size_t>(division.parts),
                 DepartureScore(kGlobalCount, at));
  }
  const auto add = [&](const auto& row, const Influence& influence) {
    for (std::size_t d = 0; d < divisions.size(); ++d) {
      const int part = divisions[d].part_at(row.time_s);
      parts[static_cast<std::size_t>(first[d] + part)].add(row, 0, influence.transpose());
    }
  };
  adjustment.visit(
      state, at, [&](const ObservationRow& row) { add(row, influences[row.index]); },
      [&](const TelemetryRow& row) { add(row, influence_of(row, inverse)); });
  DepartureScore::finish(factor, adjustment, &parts);

  std::vector<std::vector<PartGrowth>> growth;
  for (std::size_t d = 0; d < divisions.size(); ++d) {
    GlobalVector square = GlobalVector::Zero();
    GlobalVector sum = GlobalVector::Zero();
    GlobalVector sum_of_squares = GlobalVector::Zero();
    GlobalVector decided = GlobalVector::Zero();
    for (int c = 0; c < divisions[d].parts; ++c) {
      const DepartureScore& part = parts[static_cast<std::size_t>(first[d] + c)];
      const GlobalVector variance = part.information().diagonal().cwiseMax(0.0);
      square += GlobalVector(part.score()).cwiseAbs2();
      sum += variance;
      sum_of_squares += variance.cwiseAbs2();
      decided += part.full_information().diagonal();
    }
    std::vector<PartGrowth>& of_division = growth.emplace_back(kGlobalCount);
    for (int p = 0; p < kGlobalCount; ++p) {
      PartGrowth& of_p = of_division[static_cast<std::size_t>(p)];
      const double variance = inverse(p, inverse.cols() - kGlobalCount + p);
      if (!(sum[p] > 0) || !(variance > 0)) continue;
      of_p.ratio = square[p] / sum[p];
      of_p.freedom = sum[p] * sum[p] / sum_of_squares[p];
      of_p.share = decided[p] / variance;
    }
  }
  return growth;
}

ContradictionCheck check_contradictions(const std::vector<Division>& divisions,
                                        const Adjustment& adjustment, const AdjustmentState& state,
                                        const Linearisation& at, const ReducedFactor& factor) {
  const std::vector<std::vector<PartGrowth>> all =
      part_growth(divisions, adjustment, state, at, factor);
  int tried = 0;
  const auto counts = [](const PartGrowth& growth) {
    return growth.freedom >= kLeastParts && growth.share >= kLeastShare;
  };
  for (const auto& of_division : all) {
    tried += static_cast<int>(std::count_if(of_division.begin(), of_division.end(), counts));
  }
  ContradictionCheck check;
  double least = std::log(kFalseAlarm / std::max(1, tried));
  for (std::size_t d = 0; d < all.size(); ++d) {
    for (int p = 0; p < kGlobalCount; ++p) {
      const PartGrowth& growth = all[d][static_cast<std::size_t>(p)];
      if (!counts(growth)) continue;
      const double n = growth.freedom;
      const double chance = log_chance(growth.ratio * n, n);
      if (chance >= std::log(kFalseAlarm / tried)) continue;
      // A variance that n squares tell: the mean of 1 / ratio is n / (n - 2).
      const double grown = growth.ratio * n / (n - 2);
      check.growth[p] = std::max(check.growth[p], 1 + growth.share * (grown - 1));
      if (chance < least) {
        least = chance;
        check.worst = {p, divisions[d].name, std::sqrt(growth.ratio)};
      }
    }
  }
  return check;
}

}  // namespace alidade::internal
