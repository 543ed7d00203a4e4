#pragma once
// The image's motion against the head's, with nominal axes and small distortion at the centre.
//
// Over about 0.3 s the image's centre moves by f p, p = (-cos(tilt) dpan, dtilt): the scene to the left when the camera
// turns right, down when it turns up. With m the motions seen in the video, px, and p those of the head at a clock
// offset d, for an axis a of the image
//   s_a(d)   = sum(m_a p_a) / sum(p_a^2)                scale: f, or -f where the sign of the axis is wrong
//   e_a(d)   = sum(m_a p_a)^2 / sum(p_a^2)              what of sum(m_a^2) it explains
// Radians, seconds, px. Pure; allocates.

#include <array>
#include <cstddef>
#include <vector>

#include "core/model/linear_algebra.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

// The image's motion between two frames that follow each other.
struct TimedShift {
  double from_s = 0;  // image clock
  double to_s = 0;
  Vector2<double> shift = Vector2<double>::Zero();  // px
};

// Angles without turns, at the middles of the samples' intervals; what is not finite, or not later than the sample
// before, is passed over.
class HeadPath {
 public:
  explicit HeadPath(const std::vector<PanTiltSample>& samples);
  // Pan and tilt, between two samples not too far apart. False: there are none.
  [[nodiscard]] bool at(double time_s, Vector2<double>* angle) const;
  [[nodiscard]] std::size_t samples() const { return times_.size(); }
  // rad, the larger of the two axes' ranges. Needs a sample.
  [[nodiscard]] double range() const;

 private:
  std::vector<double> times_;
  std::vector<Vector2<double>> angles_;
};

// Motions over the baseline, along shifts that join; each begins where the one before began its second half, so that
// about half of them are independent.
[[nodiscard]] std::vector<TimedShift> over_baseline(const std::vector<TimedShift>& shifts);

// How far the image's centre came from where it began, px, along shifts that join.
[[nodiscard]] double image_range(const std::vector<TimedShift>& shifts);

// MotionSums of one axis of the image with one axis of the head, over all motions.
struct MotionSums {
  double mp = 0;
  double pp = 0;
  [[nodiscard]] double explained() const { return pp > 0 ? mp * mp / pp : 0; }
};

// At one clock offset.
struct MotionFit {
  std::array<MotionSums, 2> own;    // u with pan, v with tilt
  std::array<MotionSums, 2> other;  // u with tilt, v with pan
  std::array<double, 2> mm{};       // of each axis of the image
  std::size_t used = 0;             // motions that the head's path covers
};

// Part of a whole; 0 of none.
[[nodiscard]] double share(double part, double whole);
// Share of the image's motion that is explained if the axes have these signs; 0: either, whichever fits.
[[nodiscard]] double explained(const MotionFit& fit, const std::array<int, 2>& signs);
// The same with each axis of the image against the other axis of the head: an image turned by a quarter.
[[nodiscard]] double crossed(const MotionFit& fit);

// Fits at clock offsets around one: a second to both sides, and twice as far each time as long as none explains the motion
// well, or the best lies at an end. As calibrate() does, but that one looks at the ends only.
struct MotionSearch {
  // Offsets at which less than half of the motions, or fewer than least_times baselines without overlap, are covered
  // are left out.
  MotionSearch(const std::vector<TimedShift>& motions, const HeadPath& head, double around_s,
               double least_times);

  std::vector<double> offsets;  // s, ascending
  std::vector<MotionFit> fits;
  bool sure =
      false;  // the motion is explained well, and not at an end, beyond which it may be explained better

  // Index of the best; the first of equals.
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
