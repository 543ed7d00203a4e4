#pragma once
// What the lens does at a zoom reading: its focal length, distortion and optical centre as curves of their own.
//
// With w = 0 at the wide end and 1 at the tele end, linear in the reading,
//   log f  = log f_wide + log(f_tele / f_wide) g(w), where with the shape b and the ripple a
//            g(w) = (1 - a) w / (w + b (1 - w))  +  a (w - sin(2 pi w) / (2 pi)):
//            it rises everywhere, at the wide end about b times flatter than at the mean, at the tele end b times steeper
//   k      = (2 f / width)^2 times the distortion at the border, which goes from that of the wide to that of the tele end as
//            (1 - cos(pi w)) / 2
//   centre = the image's + the offset at the wide end + the wander times ((1 - cos(1.1 pi w)) / 2, 0.6 sin(1.3 pi w))
// Thread-safe, no allocation.

#include <Eigen/Core>

#include "test/simulator/zoom_config.h"

namespace alidade::simulator {

class ZoomCurve {
 public:
  explicit ZoomCurve(const ZoomConfig& config);

  // w of a reading, and back.
  [[nodiscard]] double part(double reading) const;
  [[nodiscard]] double reading(double part) const;

  [[nodiscard]] double log_focal_length(double part) const;
  // w at which log f is this, in [0, 1].
  [[nodiscard]] double part_at(double log_focal_length) const;
  // k r^2 where r is half the image's width over the focal length.
  [[nodiscard]] double distortion(double part) const;
  // px, from the image's centre.
  [[nodiscard]] Eigen::Vector2d centre_offset(double part) const;

 private:
  ZoomConfig config_;
  double log_wide_, log_range_;
};

}  // namespace alidade::simulator
