#include "core/realtime/oe_mode/maintained_map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/model/direction.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade {

Vector3<double> moved_direction(const Landmark& landmark, double change,
                                const ParameterDirection& direction) {
  const Vector2<double> by_direction = landmark.sensitivity.cast<double>() * direction;
  return direction_plus<double>(landmark.d, change * by_direction);
}

MaintainedMap::MaintainedMap(const OeOptions& options)
    : cone_margin_(options.search.cone_margin),
      landmarks_(options.max_landmarks, LandmarkMap::kMaxCellSize),
      shear_(options.shear),
      upkeep_(options.upkeep),
      maker_(options.maker, options.octaves, options.max_width, options.max_height),
      in_view_(landmarks_.capacity()) {}

std::size_t MaintainedMap::memory_bytes() const {
  return landmarks_.memory_bytes() - sizeof(landmarks_) + maker_.memory_bytes() +
         in_view_.memory_bytes();
}

void MaintainedMap::clear(const Calibration& calibration) {
  const Camera<double>& camera = calibration.camera;
  cells_focal_length_ = camera.focal_length;
  landmarks_.clear(maker_.cell_size(camera), maker_.largest_cell_size(camera));
}

void MaintainedMap::begin(const Calibration& calibration) {
  clear(calibration);
  shear_.reset(calibration);
  upkeep_.reset();
}

bool MaintainedMap::take(const MapState& map, const Octaves& octaves) {
  constexpr std::uint32_t kHandedOver = 0;  // see LandmarkStatistics::last_frame
  for (const Landmark& landmark : map.landmarks) {
    int slot = 0;
    if (landmarks_.size() == landmarks_.capacity()) break;
    if (landmark.octave >= octaves.count() || !is_valid(landmark) ||
        landmarks_.insert(landmark, kHandedOver, &slot) != InsertStatus::kOk) {
      continue;
    }
    LandmarkStatistics& known = landmarks_.statistics(slot);
    known.matched = std::min(landmark.statistics.matched, landmark.statistics.looked_for);
    known.looked_for = landmark.statistics.looked_for;
  }
  if (empty()) return false;
  shear_.set(map.shear_covariance, map.shear_tilt);
  return true;
}

MapState MaintainedMap::state() const {
  MapState out;
  out.landmarks.reserve(static_cast<std::size_t>(landmarks_.size()));
  for (int slot = 0; slot < landmarks_.capacity(); ++slot) {
    if (landmarks_.occupied(slot)) out.landmarks.push_back(landmarks_.at(slot));
  }
  out.shear_covariance = shear_.covariances();
  out.shear_tilt = shear_.tilt();
  return out;
}

void MaintainedMap::move(double change, const ParameterDirection& direction) {
  for (int slot = 0; slot < landmarks_.capacity(); ++slot) {
    if (!landmarks_.occupied(slot)) continue;
    const Landmark& landmark = landmarks_.at(slot);
    landmarks_.refine(slot, moved_direction(landmark, change, direction), landmark.covariance);
  }
  shear_.begin_curve();
}

int MaintainedMap::zoom_of(double focal_length) const {
  return static_cast<int>(
      std::lround(LandmarkMap::kZoomsPerOctave * std::log2(focal_length / cells_focal_length_)));
}

const std::vector<VisibleLandmark>& MaintainedMap::find_in_view(const Calibration& calibration,
                                                                const ImageOctaves& image,
                                                                const ProcessedFrame& frame,
                                                                bool across_octaves) {
  const ViewProjection view(calibration, frame.motion);
  return in_view_.find(calibration, landmarks_, view, image.pyramid().octaves(), across_octaves);
}

std::optional<int> MaintainedMap::retire_unproven(const Calibration& calibration,
                                                  const ImageOctaves& image,
                                                  const ProcessedFrame& frame,
                                                  bool across_octaves) {
  const std::vector<VisibleLandmark>& visible =
      find_in_view(calibration, image, frame, across_octaves);
  if (!upkeep_.has_unproven(visible, landmarks_) ||
      !maker_.is_textured(image.pyramid(), image.octaves())) {
    return std::nullopt;
  }
  return static_cast<int>(visible.size()) - upkeep_.retire_unproven(visible, &landmarks_);
}

std::optional<ShearCorrection> MaintainedMap::refine(const Calibration& calibration,
                                                     const ProcessedFrame& frame,
                                                     const LandmarkSearch& search,
                                                     bool lens_moves) {
  upkeep_.refine(frame, search, &landmarks_);
  if (lens_moves) {
    shear_.begin_curve();
  } else {
    shear_.add_frame(frame.time_s + calibration.line_delay * frame.motion.reference_row,
                     frame.motion, frame.covariance);
  }
  // New landmarks inherit the errors of the frame they are made in.
  shear_.inherit(share_of_new_, frame.covariance);
  if (lens_moves) return std::nullopt;
  const std::optional<ShearCorrection> correction = shear_.correct();
  if (correction) correction->straighten(calibration, frame.motion, &landmarks_);
  return correction;
}

void MaintainedMap::forget_crooked(const Calibration& calibration, const ProcessedFrame& frame) {
  clear(calibration);
  shear_.inherit(1, frame.covariance);
}

double MaintainedMap::make(const Calibration& calibration, const ImageOctaves& image,
                           const ProcessedFrame& frame, const LensColumns* lens) {
  share_of_new_ =
      maker_.make(calibration, image.pyramid(), image.octaves(), frame,
                  find_in_view(calibration, image, frame, lens != nullptr), &landmarks_, lens);
  return share_of_new_;
}

}  // namespace alidade
