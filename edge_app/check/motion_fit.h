#pragma once
// Fits the image's motion to the head's, with nominal axes and small distortion at the centre.
//
// Over about 0.3 s the image's centre moves by f p, p = (-cos(tilt) dpan, dtilt): the scene moves
// left when the camera turns right, and down when the camera turns up. m: motions in the video, px;
// p: motions of the head at a clock offset d. For an axis a of the image:
//   s_a(d) = sum(m_a p_a) / sum(p_a^2)      scale: f, or -f if the sign of the axis is wrong
//   e_a(d) = sum(m_a p_a)^2 / sum(p_a^2)    the part of sum(m_a^2) that the head explains
// Radians, seconds, px. Pure; allocates.

#include <array>
#include <cstddef>
#include <vector>

#include "core/model/linear_algebra.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

// The image's motion between two successive frames.
struct TimedShift {
  double from_s = 0;  // s, image clock
  double to_s = 0;
  Vector2<double> shift = Vector2<double>::Zero();  // px
};

// The head's angles, unwrapped, at the middles of the samples' intervals. Samples that are not
// finite, or not later than the one before, are skipped.
class HeadPath {
 public:
  explicit HeadPath(const std::vector<PanTiltSample>& samples);
  // Pan and tilt, interpolated, rad. False: no two samples, at most 0.5 s apart, enclose the time.
  [[nodiscard]] bool at(double time_s, Vector2<double>* angle) const;
  [[nodiscard]] std::size_t samples() const { return times_.size(); }
  // rad, the larger of the two axes' ranges; 0 without samples.
  [[nodiscard]] double range() const;

 private:
  std::vector<double> times_;
  std::vector<Vector2<double>> angles_;
};

// Motions over the baseline, from joined shifts. Each begins where the one before began its second
// half, so about half of them are independent.
[[nodiscard]] std::vector<TimedShift> over_baseline(const std::vector<TimedShift>& shifts);

// px; how far the image's centre came from its first place, over joined shifts.
[[nodiscard]] double image_range(const std::vector<TimedShift>& shifts);

// Sums over all motions, of one axis of the image with one axis of the head.
struct MotionSums {
  double mp = 0;
  double pp = 0;
  [[nodiscard]] double explained() const { return pp > 0 ? mp * mp / pp : 0; }
};

// At one clock offset.
struct MotionFit {
  std::array<MotionSums, 2> own;    // u with pan, v with tilt
  std::array<MotionSums, 2> other;  // u with tilt, v with pan
  std::array<double, 2> mm{};       // sum(m^2) of each axis of the image
  std::size_t used = 0;             // motions that the head's path covers
};

// part / whole; 0 if whole is 0.
[[nodiscard]] double share(double part, double whole);
// The share of the image's motion that is explained if the axes have these signs. 0: the sign that
// fits.
[[nodiscard]] double explained(const MotionFit& fit, const std::array<int, 2>& signs);
// The same with each axis of the image against the other axis of the head, as for an image turned
// by 90 degrees.
[[nodiscard]] double crossed(const MotionFit& fit);

// Fits at clock offsets around a given one, in steps of 10 ms. The range is one second to both
// sides at first. It is doubled until an offset that is not at an end explains 0.9 of the motion,
// or until a larger range adds no offset. calibrate() widens its search only if the best offset
// lies at an end.
struct MotionSearch {
  // Leaves out offsets at which the head's path covers less than half of the motions, or fewer than
  // least_times baselines without overlap. `offsets` and `fits` are empty if no offset is left.
  MotionSearch(const std::vector<TimedShift>& motions, const HeadPath& head, double around_s,
               double least_times);

  std::vector<double> offsets;  // s, ascending
  std::vector<MotionFit> fits;
  // The motion is explained well, by an offset that is not at an end of the search.
  bool sure = false;

  // Index of the best fit; the first of equals. `fits` must not be empty.
  template <typename Score>
  [[nodiscard]] std::size_t best(const Score& score) const {
    std::size_t at = 0;
    for (std::size_t i = 1; i < fits.size(); ++i) {
      if (score(fits[i]) > score(fits[at])) at = i;
    }
    return at;
  }
};

}  // namespace alidade
