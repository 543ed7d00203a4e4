#pragma once
// KeyframeChoice: the pictures of a camera that turns and zooms which a map keeps: slow ones, none
// near another. The distance of two pictures is the largest of their differences in pan times
// cos(tilt), in tilt and in log f, each divided by its step. A step of pan or tilt is a share of
// the field of view at the longer of the two focal lengths; half a field leaves half of the view in
// common. Pure; allocates when a picture is kept.

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/model/angle.h"
#include "core/model/recording_needs.h"

namespace alidade {

struct KeyframeChoiceOptions {
  double step_fields = 0.35;               // of pan and tilt, in fields of view
  double step_log_f = 0.35;                // of log f
  double most_motion_px = kSlowMotion_px;  // of the image, during the read-out of all rows
  double most_log_f_change = 0.002;        // during the read-out of all rows

  [[nodiscard]] bool validate(const char** error = nullptr) const {
    const char* what = nullptr;  // *error, if not null, is set only when the result is false
    if (!(step_fields > 0 && step_fields <= 1)) what = "step_fields must be above 0 and at most 1";
    if (!(step_log_f > 0)) what = "step_log_f must be above 0";
    if (!(most_motion_px > 0)) what = "most_motion_px must be above 0";
    if (!(most_log_f_change > 0)) what = "most_log_f_change must be above 0";
    if (what != nullptr && error != nullptr) *error = what;
    return what == nullptr;
  }
};

// Estimated direction and zoom of a picture.
struct SeenPlace {
  PanTilt<double> angle;  // rad
  double log_f = 0;       // f in px
};

class KeyframeChoice {
 public:
  // width, height: of the image, px. options: valid.
  KeyframeChoice(int width, int height, const KeyframeChoiceOptions& options = {})
      : width_(width), height_(height), options_(options) {}

  // turn_rate: rad/s. zoom_rate: d log f / dt, 1/s. readout_s: of the whole image.
  [[nodiscard]] bool is_slow(double log_f, double turn_rate, double zoom_rate,
                             double readout_s) const {
    return haste(log_f, turn_rate, zoom_rate, readout_s) <= 1;
  }
  // The picture's motion divided by the limit of a slow picture's: above 1 it is not slow.
  [[nodiscard]] double haste(double log_f, double turn_rate, double zoom_rate,
                             double readout_s) const {
    return std::max(std::abs(turn_rate) * std::exp(log_f) * readout_s / options_.most_motion_px,
                    std::abs(zoom_rate) * readout_s / options_.most_log_f_change);
  }
  // Whether no kept picture is near.
  [[nodiscard]] bool is_new(const SeenPlace& place) const {
    return std::all_of(kept_.begin(), kept_.end(),
                       [&](const SeenPlace& other) { return apart(place, other) >= 1; });
  }
  void keep(const SeenPlace& place) { kept_.push_back(place); }

 private:
  [[nodiscard]] double apart(const SeenPlace& a, const SeenPlace& b) const {
    const double f = std::exp(std::max(a.log_f, b.log_f));
    const Vector2<double> off = minus(a.angle, b.angle);
    const double across = 2 * std::atan(width_ / (2 * f)) * options_.step_fields;
    const double down = 2 * std::atan(height_ / (2 * f)) * options_.step_fields;
    return std::max({std::abs(off.x()) * std::cos(a.angle.tilt) / across, std::abs(off.y()) / down,
                     std::abs(a.log_f - b.log_f) / options_.step_log_f});
  }

  int width_, height_;
  KeyframeChoiceOptions options_;
  std::vector<SeenPlace> kept_;
};

}  // namespace alidade
