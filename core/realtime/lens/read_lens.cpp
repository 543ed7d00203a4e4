#include "core/realtime/lens/read_lens.h"

#include <cmath>

#include "core/realtime/lens/lens_track.h"

namespace alidade {

bool ReadLens::look_up(const ZoomCurve& curve, const ZoomReadings& readings, double readout_s,
                       FrameLens* lens) {
  if (!readings.lens(curve, time_s_, readout_s, lens)) return false;
  read_ = lens->calibration;
  if (!judge_.remembers(age_s())) found_focal_length_ = 0;
  if (!(found_focal_length_ > 0)) {
    judge_.forget();
    return true;
  }
  const double change = std::log(read_.camera.focal_length / found_focal_length_);
  const double sigma = relative_focal_length_sigma(read_);
  FrameLens found;
  if (judge_.belief(age_s(), change, sigma) != ReadingBelief::kBelieved && as_found(curve, &found))
    *lens = found;
  return true;
}

bool ReadLens::as_found(const ZoomCurve& curve, FrameLens* lens) const {
  const double age_s = this->age_s();
  if (!(found_focal_length_ > 0) || !judge_.remembers(age_s)) return false;
  if (!lens_of_focal_length(curve, found_focal_length_ * std::exp(found_rate_ * age_s), lens))
    return false;
  lens->rate = found_rate_;
  const double change =
      kZoomAcceleration * age_s * age_s / 2 * lens->calibration.camera.focal_length;
  const int f = index(Parameter::kFocalLength);
  lens->calibration.covariance(f, f) += change * change;
  return true;
}

void ReadLens::note_found(const Calibration& found, double rate) {
  found_focal_length_ = found.camera.focal_length;
  found_rate_ = rate;
  found_time_s_ = time_s_;
  judge_.forget();
}

void ReadLens::judge(const Calibration& found) {
  const double change = std::log(found_focal_length_ / read_.camera.focal_length);
  const double sigma =
      std::hypot(relative_focal_length_sigma(found), relative_focal_length_sigma(read_));
  judge_.judge(change, sigma);
}

void ReadLens::forget() {
  found_focal_length_ = 0;
  judge_.forget();
}

}  // namespace alidade
