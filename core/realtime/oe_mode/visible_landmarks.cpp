#include "core/realtime/oe_mode/visible_landmarks.h"

#include <algorithm>
#include <cmath>

#include "core/model/lens/camera.h"
#include "core/realtime/image/ask_ahead.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade {

VisibleLandmarks::VisibleLandmarks(int capacity) {
  slots_.resize(static_cast<std::size_t>(capacity));
  visible_.reserve(slots_.size());
}

int octaves_larger(const Landmark& landmark, double focal_length) {
  const double made_square =
      std::ldexp(std::abs(landmark.J_pixel_tangent.determinant()), 2 * landmark.octave);
  // The rounded binary logarithm of the square's root, from exponents alone: it is needed for all
  // landmarks nearby.
  const int exponent = std::ilogb(2 * focal_length * focal_length / made_square);
  return (exponent - (exponent & 1)) / 2;
}

void VisibleLandmarks::reset(const Calibration& calibration, double cone_margin) {
  change_lens(calibration, cone_margin);
  visible_.clear();
}

void VisibleLandmarks::change_lens(const Calibration& calibration, double cone_margin) {
  const Camera<double>& camera = calibration.camera;
  const double w = camera.width;
  const double h = camera.height;
  double cone = 0;  // rad, from the optical axis to the farthest corner
  for (const Vector2<double>& corner : {Vector2<double>(0, 0), Vector2<double>(w, 0),
                                        Vector2<double>(0, h), Vector2<double>(w, h)}) {
    Vector3<double> d_c;
    // A corner beyond the distortion's limit sees nothing: any cone to it will do.
    const bool seen = unproject(camera, corner, &d_c) == ProjectionStatus::kOk;
    cone = std::max(cone, seen ? std::acos(std::min(1.0, d_c.z())) : kPi / 2);
  }
  cosine_of_cone_ = std::cos(std::min(kPi, cone_margin * cone));
}

const std::vector<VisibleLandmark>& VisibleLandmarks::find(const Calibration& calibration,
                                                           const LandmarkMap& map,
                                                           const ViewProjection& view, int octaves,
                                                           bool across_octaves) {
  visible_.clear();
  const int near = map.find(view.optical_axis(), cosine_of_cone_, slots_.data(), map.capacity());
  constexpr int kLandmarksAhead = 8;
  for (int i = 0; i < near; ++i) {
    if (i + kLandmarksAhead < near)
      ask_ahead(&map.at(slots_[static_cast<std::size_t>(i + kLandmarksAhead)]).d);
    const int slot = slots_[static_cast<std::size_t>(i)];
    const Landmark& landmark = map.at(slot);
    Vector2<double> u;
    int octave = landmark.octave;
    if (across_octaves) {
      octave += octaves_larger(landmark, calibration.camera.focal_length);
      if (octave < 0 || octave >= octaves) continue;
    }
    if (!view.project_roughly(landmark.d, &u) || !holds_patch(calibration.camera, u, octave)) {
      continue;
    }
    visible_.push_back({slot, octave, u});
  }
  return visible_;
}

std::size_t VisibleLandmarks::memory_bytes() const {
  return slots_.size() * sizeof(int) + visible_.capacity() * sizeof(VisibleLandmark);
}

}  // namespace alidade
