#include "core/realtime/oe_mode/calibration_in_use.h"

namespace alidade {

void CalibrationInUse::reset(const Calibration& calibration, FocalLength focal_length) {
  lens_.begin(calibration.camera.focal_length);
  given_ = of_frame_ = of_answer_ = calibration;
  focal_length_ = focal_length;
  begun_elsewhere_ = false;
  moved_phi_ = 0;
}

bool CalibrationInUse::begin_map() {
  // The lens that the map began with is gone.
  const bool elsewhere = lens_.follows() && lens_.reading() != nullptr;
  if (elsewhere) {
    given_ = lens_.reading()->calibration;
    begun_elsewhere_ = true;
  }
  lens_.begin(given_.camera.focal_length);
  moved_phi_ = 0;
  of_frame_ = of_answer_ = given_;
  return elsewhere;
}

void CalibrationInUse::look_through(const LensScale& scale, const Camera<double>& camera) {
  of_frame_.camera = camera;
  lens_.look_through(scale, camera);
}

void CalibrationInUse::move(double phi, const Camera<double>& camera) {
  of_frame_.camera = camera;
  moved_phi_ += phi;
  lens_.move(phi);
}

}  // namespace alidade
