#include "core/realtime/oe_mode/map_upkeep.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/model/direction.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade {

bool MapUpkeepOptions::validate(const char** error) const {
  const char* problem = nullptr;
  const auto is_share = [](double v) { return v >= 0 && v <= 1; };
  if (contradictions_to_forget < 1 || lost_to_forget < 1 || missed_to_doubt < 1) {
    problem = "numbers of frames must be at least 1";
  }
  if (!is_share(least_covariance)) problem = "least_covariance must be 0 to 1";
  if (!is_share(alike)) problem = "alike must be 0 to 1";
  if (!is_share(memory)) problem = "memory must be 0 to 1";
  if (!is_share(least_matched)) problem = "least_matched must be 0 to 1";
  if (probation < 1) problem = "probation must be at least 1";
  if (max_misses < 1) problem = "max_misses must be at least 1";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

void MapUpkeep::reset() {
  contradictions_ = 0;
  lost_ = 0;
  missed_ = 0;
}

void MapUpkeep::note_lost(bool contradiction, bool missed) {
  contradictions_ = contradiction ? contradictions_ + 1 : 0;
  ++lost_;
  if (missed) ++missed_;
}

void MapUpkeep::mark(std::uint32_t frame, int slot, bool matched, double residual_square,
                     LandmarkMap* map) const {
  LandmarkStatistics& s = map->statistics(slot);
  ++s.looked_for;
  s.last_frame = frame;
  if (matched) {
    ++s.matched;
    s.missed_in_a_row = 0;
    s.residual_square += static_cast<float>(options_.memory) *
                         (static_cast<float>(residual_square) - s.residual_square);
  } else {
    ++s.missed_in_a_row;
  }
  const bool unreliable = s.looked_for >= static_cast<std::uint32_t>(options_.probation) &&
                          s.matched < options_.least_matched * s.looked_for;
  if (s.missed_in_a_row >= options_.max_misses || unreliable) map->retire(slot);
}

void MapUpkeep::refine(const ProcessedFrame& frame, const LandmarkSearch& search,
                       LandmarkMap* map) const {
  std::size_t next = 0;  // index of found(), a subset of chosen() in the same order
  for (const VisibleLandmark& chosen : search.chosen()) {
    const int slot = chosen.slot;
    if (next == search.found().size() || search.observations()[next].slot != slot) {
      mark(frame.frame, slot, false, 0, map);
      continue;
    }
    const OeObservation& observation = search.observations()[next];
    const FoundLandmark& f = search.found()[next];
    const Matrix2<double>& J_tangent = search.J_tangent()[next];
    ++next;
    if (observation.inlier) {
      const Landmark& landmark = map->at(slot);
      const Matrix2<double> to_tangent = J_tangent.inverse();
      Matrix2<double> seen =
          frame.inflation * observation.covariance +
          f.J_angle * frame.covariance.topLeftCorner<2, 2>() * f.J_angle.transpose();
      if (frame.lens.used) {
        seen += frame.lens.variance(f.time_s) * f.by_zoom * f.by_zoom.transpose();
      }
      const Matrix2<double> measured = to_tangent * seen * to_tangent.transpose();
      const Matrix2<double> gain = landmark.covariance * (landmark.covariance + measured).inverse();
      const Vector2<double> change = gain * (to_tangent * observation.residual);
      const Matrix2<double> covariance =
          symmetric<2>((Matrix2<double>::Identity() - gain) * landmark.covariance) +
          options_.least_covariance * measured;
      if (all_finite(change) && all_finite(covariance)) {
        Sensitivity<2> unexplained =
            f.sensitivity - f.J_angle * angle_at(frame.sensitivity, f.time_s);
        if (frame.lens.used) unexplained -= f.by_zoom * frame.lens.sensitivity_at(f.time_s);
        map->sensitivity(slot) += (gain * (to_tangent * unexplained)).cast<float>();
        map->refine(slot, direction_plus<double>(landmark.d, change), covariance);
      }
    }
    mark(frame.frame, slot, observation.inlier, f.normalised_square, map);
  }
}

void MapUpkeep::judge_coarse(const Calibration& calibration, const Pyramid& pyramid,
                             const ProcessedFrame& frame, const LandmarkSearch& search,
                             LandmarkMap* map) const {
  const ViewProjection view(calibration, frame.motion);
  for (std::size_t i = 0; i < search.coarse().size(); ++i) {
    const CoarsePatch& patch = search.coarse()[i];
    const int slot = search.coarse_slots()[i];
    Vector2<double> u;
    PatchStep step;
    // A landmark that has left the image was not missed.
    if (!view.project(map->at(slot).d, &u) ||
        !measure_step(*patch.reference, pyramid.octave(patch.octave),
                      std::ldexp(1.0, -patch.octave) * u, &step)) {
      continue;
    }
    constexpr double kExpectedSquare = 1;  // nothing was measured
    mark(frame.frame, slot, step.correlation >= options_.alike, kExpectedSquare, map);
  }
}

namespace {

bool is_unproven(const VisibleLandmark& visible, const LandmarkMap& map) {
  return map.at(visible.slot).statistics.last_frame == 0;
}

}  // namespace

bool MapUpkeep::has_unproven(const std::vector<VisibleLandmark>& visible,
                             const LandmarkMap& map) const {
  return std::any_of(visible.begin(), visible.end(),
                     [&](const VisibleLandmark& v) { return is_unproven(v, map); });
}

int MapUpkeep::retire_unproven(const std::vector<VisibleLandmark>& visible,
                               LandmarkMap* map) const {
  int retired = 0;
  for (const VisibleLandmark& v : visible) {
    if (!is_unproven(v, *map)) continue;
    map->retire(v.slot);
    ++retired;
  }
  return retired;
}

}  // namespace alidade
