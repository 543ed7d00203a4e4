#include "core/realtime/oe_mode/landmark_search.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/model/direction.h"
#include "core/realtime/image/ask_ahead.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade {
namespace {

// Landmarks between the prefetched one and the present one.
constexpr std::size_t kLandmarksAhead = 2;
// Difference of two predicted positions that are accurate to a pixel.
constexpr double kSameView_px = 2;

// Factor on a warp: the zoom expected until the patch is prepared again.
float zoomed_ahead(const SearchedFrame& frame, float tolerance) {
  if (!frame.zooms) return 1;
  constexpr double kAhead_s = 0.1;  // of a slow zoom
  constexpr float kShare = 0.6F;    // of the tolerance, as elements of a warp are up to 1.4
  const float most = kShare * tolerance;
  return 1 - std::clamp(static_cast<float>(kAhead_s * frame.zoom_rate), -most, most);
}

}  // namespace

bool LandmarkSearchOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(wide_search_px >= 0)) problem = "wide_search_px must not be negative";
  if (!(coarse_reach_px > 0)) problem = "coarse_reach_px must be positive";
  if (!(search_sigmas > 0)) problem = "search_sigmas must be positive";
  if (!(cone_margin >= 1)) problem = "cone_margin must be at least 1";
  if (!(fine_warp_tolerance > 0) || !(coarse_warp_tolerance > 0) || !(zooming_warp_tolerance > 0) ||
      !(zooming_coarse_warp_tolerance > 0)) {
    problem = "warp tolerances must be positive";
  }
  if (coarse_patches < 1 || coarse_patches > kMaxCoarsePatches) {
    static_assert(kMaxCoarsePatches == 256, "as the message says");
    problem = "coarse_patches must be 1 to 256";
  }
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr && choice.validate(error);
}

LandmarkSearch::LandmarkSearch(const LandmarkSearchOptions& options, int capacity)
    : options_(options), visible_(capacity), choice_(options.choice, capacity) {
  prepared_.resize(static_cast<std::size_t>(capacity));
  const auto chosen = static_cast<std::size_t>(options_.choice.max_chosen);
  found_.reserve(chosen);
  observations_.reserve(chosen);
  J_tangent_.reserve(chosen);
  const auto most = static_cast<std::size_t>(options_.coarse_patches) * Pyramid::kMaxOctaves;
  coarse_.reserve(most);
  coarse_slots_.reserve(most);
}

void LandmarkSearch::reset(const Calibration& calibration) {
  visible_.reset(calibration, options_.cone_margin);
  clear();
}

void LandmarkSearch::clear() {
  knows_view_ = false;
  choice_.clear();
  coarse_.clear();
  coarse_slots_.clear();
  found_.clear();
  observations_.clear();
  J_tangent_.clear();
}

LandmarkSearch::Coarse LandmarkSearch::align_coarse(const SearchedFrame& frame,
                                                    const FrameMotion<double>& predicted,
                                                    double sigma_px) {
  const ViewProjection view(frame.calibration, predicted);
  find_visible(frame, view);
  prepare_coarse(frame, view);
  Coarse out;
  out.motion = predicted;
  Vector2<double> angle;
  out.aligned = fit_coarse(frame, sigma_px, &angle);
  knows_view_ = !out.aligned;
  if (!out.aligned) return out;
  out.motion.angle.pan += angle.x();
  out.motion.angle.tilt += angle.y();
  out.shift_px = angle.norm() * frame.calibration.camera.focal_length;
  knows_view_ = out.shift_px < kSameView_px;
  return out;
}

LandmarkSearch::Fine LandmarkSearch::align_fine(const SearchedFrame& frame,
                                                const FrameMotion<double>& motion) {
  const ViewProjection view(frame.calibration, motion);
  // With many zooms there are many landmarks. What coarse alignment saw of them is used again.
  if (!frame.zooms || !knows_view_) find_visible(frame, view);
  knows_view_ = false;
  choose_fine(frame);
  fit_fine(frame, view);
  return {choice_.fine_visible(), static_cast<int>(choice_.chosen().size()),
          static_cast<int>(found_.size())};
}

void LandmarkSearch::conclude(const Vector6& correction, const Vector2<double>& zoom) {
  for (std::size_t i = 0; i < found_.size(); ++i) {
    const FoundLandmark& f = found_[i];
    observations_[i].residual = f.residual - f.J_angle * angle_at(correction, f.time_s) -
                                (zoom[0] + f.time_s * zoom[1]) * f.by_zoom;
    observations_[i].inlier = f.inlier;
  }
}

void LandmarkSearch::find_visible(const SearchedFrame& frame, const ViewProjection& view) {
  visible_.find(frame.calibration, frame.map, view, frame.pyramid.octaves(), frame.lens != nullptr);
}

// Prefetches a landmark that is looked for soon. Its pixels are needed only if its patch is
// prepared again, which is rare.
void LandmarkSearch::ask_for(const SearchedFrame& frame, const VisibleLandmark& wanted) const {
  const Landmark& landmark = frame.map.at(wanted.slot);
  ask_ahead(&landmark, &landmark.pixels);
  const Prepared& prepared = prepared_[static_cast<std::size_t>(wanted.slot)];
  ask_ahead(&prepared, &prepared + 1);
  ask_for_patch(frame.pyramid.octave(wanted.octave), std::ldexp(1.0, -wanted.octave) * wanted.u);
}

float LandmarkSearch::warp_tolerance(const SearchedFrame& frame, int octave) const {
  if (frame.octaves.is_coarse(octave)) {
    return frame.zooms ? options_.zooming_coarse_warp_tolerance : options_.coarse_warp_tolerance;
  }
  return frame.zooms ? options_.zooming_warp_tolerance : options_.fine_warp_tolerance;
}

// The landmark's image as this frame should show it; null if it cannot.
const ReferencePatch* LandmarkSearch::reference(const SearchedFrame& frame, int slot, int octave,
                                                const SeenDirection& seen) {
  const Landmark& landmark = frame.map.at(slot);
  const Matrix2<double> J_octave = std::ldexp(1.0, -octave) * seen.J_d * tangent_basis(landmark.d);
  const Matrix2<double> A = landmark.J_pixel_tangent * J_octave.inverse();
  Prepared& prepared = prepared_[static_cast<std::size_t>(slot)];
  const float tolerance = warp_tolerance(frame, octave);
  const Matrix2<float> wanted = A.cast<float>();
  if (prepared.id != landmark.id || !((prepared.A - wanted).cwiseAbs().maxCoeff() <= tolerance)) {
    // Seen as it was made, it needs no resampling.
    const bool alike =
        (wanted - Matrix2<float>::Identity()).cwiseAbs().maxCoeff() <= 0.5F * tolerance;
    // As it will be seen after the lens has zoomed through half of the patch's useful range.
    prepared.A = zoomed_ahead(frame, tolerance) * wanted;
    if (alike) prepared.A.setIdentity();
    prepared.id = landmark.id;
    prepared.status =
        prepare(landmark.image(), Vector2<double>::Constant(kReferenceCentre),
                prepared.A.cast<double>(), frame.octaves.least_contrast(octave), &prepared.patch);
  }
  prepared.B = prepared.A.inverse() * (wanted - prepared.A);
  return is_usable(prepared.status) ? &prepared.patch : nullptr;
}

void LandmarkSearch::prepare_coarse(const SearchedFrame& frame, const ViewProjection& view) {
  coarse_.clear();
  coarse_slots_.clear();
  for (int octave = frame.pyramid.octaves() - 1; octave >= frame.octaves.first_coarse(); --octave) {
    int taken = 0;
    for (const VisibleLandmark& candidate : visible_.latest()) {
      if (taken == options_.coarse_patches) break;
      if (candidate.octave != octave) continue;
      SeenDirection seen;
      if (!view.project(frame.map.at(candidate.slot).d, &seen)) continue;
      const ReferencePatch* patch = reference(frame, candidate.slot, octave, seen);
      if (patch == nullptr) continue;
      coarse_.push_back({patch, octave, seen.u, seen.J_angle});
      coarse_slots_.push_back(candidate.slot);
      ++taken;
    }
  }
}

bool LandmarkSearch::fit_coarse(const SearchedFrame& frame, double sigma_px,
                                Vector2<double>* angle) const {
  const auto count = static_cast<int>(coarse_.size());
  CoarseOptions options;
  const double reach_px = std::ldexp(options_.coarse_reach_px, frame.pyramid.octaves() - 1);
  const double search_px = options_.search_sigmas * sigma_px;
  options.search_px = search_px > reach_px ? search_px : 0;
  CoarseAlignment aligned;
  bool ok = align_coarsely(frame.pyramid, coarse_.data(), count, options, &aligned);
  if (!ok && count > 0 && options.search_px < options_.wide_search_px) {
    options.search_px = options_.wide_search_px;
    ok = align_coarsely(frame.pyramid, coarse_.data(), count, options, &aligned);
  }
  *angle = aligned.angle;
  return ok;
}

void LandmarkSearch::choose_fine(const SearchedFrame& frame) {
  choice_.choose(visible_.latest(), frame.map, frame.octaves, frame.calibration.camera);
}

void LandmarkSearch::fit_fine(const SearchedFrame& frame, const ViewProjection& view) {
  found_.clear();
  observations_.clear();
  J_tangent_.clear();
  const std::vector<VisibleLandmark>& chosen = choice_.chosen();
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i + kLandmarksAhead < chosen.size()) ask_for(frame, chosen[i + kLandmarksAhead]);
    const VisibleLandmark& wanted = chosen[i];
    const Landmark& landmark = frame.map.at(wanted.slot);
    SeenDirection seen;
    Sensitivity<2> J_parameters;
    if (!view.project(landmark.d, &seen, &J_parameters)) continue;
    const ReferencePatch* patch = reference(frame, wanted.slot, wanted.octave, seen);
    if (patch == nullptr) continue;
    const double to_octave = std::ldexp(1.0, -wanted.octave);
    Alignment alignment;
    if (align(*patch, frame.pyramid.octave(wanted.octave), to_octave * seen.u, AlignmentLimits{},
              &alignment) != AlignmentStatus::kConverged) {
      continue;
    }
    const Matrix2<double> J = seen.J_d * tangent_basis(landmark.d);
    OeObservation& observation = observations_.emplace_back();
    observation.slot = wanted.slot;
    observation.id = landmark.id;
    observation.octave = wanted.octave;
    const Matrix2<float>& B = prepared_[static_cast<std::size_t>(wanted.slot)].B;
    observation.u = (alignment.position + warp_displacement(*patch, B)) / to_octave;
    observation.covariance = alignment.covariance / (to_octave * to_octave);
    FoundLandmark& f = found_.emplace_back();
    f.u = observation.u;
    f.residual = f.u - seen.u;
    f.J_angle = seen.J_angle;
    f.time_s = seen.time_s;
    f.covariance = observation.covariance + J * landmark.covariance * J.transpose();
    f.shared_covariance = landmark.shared_covariance;
    if (frame.lens != nullptr) {
      frame.lens->to_map(&J_parameters);
      f.by_zoom = frame.lens->by_map_zoom(J_parameters);
    }
    f.sensitivity = -J_parameters - J * landmark.sensitivity.cast<double>();
    J_tangent_.push_back(J);
  }
}

std::size_t LandmarkSearch::memory_bytes() const {
  const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return visible_.memory_bytes() + choice_.memory_bytes() + of(prepared_) + of(coarse_) +
         of(coarse_slots_) + of(found_) + of(observations_) + of(J_tangent_);
}

}  // namespace alidade
