#pragma once
// What two ways without a followed lens make of the frames of a zoom, to be held against OE mode's: a calibration at each of
// some zooms, of which the nearest counts, with telemetry's orientation; and the homography to the nearest keyframe (third
// paper, 3.3), each with more than a camera would know: nodes and keyframes have the true focal length, keyframes their true
// orientation.

#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/realtime/frame_orientation.h"
#include "test/accuracy/matched_homography.h"
#include "test/support/zooming_camera.h"

namespace alidade::test {

// Of a picture of a camera that turns and zooms: from picture a to b, both in pinhole pixels of their optical centre.
struct TurnAndZoom {
  double focal_length_b = 0;  // px
  Matrix3<double> R_b_from_a = Matrix3<double>::Identity();
};
// H: of pixels of a to those of b, any factor. H ~ diag(f_b, f_b, 1) R diag(1 / f_a, 1 / f_a, 1), as least squares in pixels
// of b at these points of a, where H is known. Nothing where H is singular or not finite, or the points are too few.
[[nodiscard]] std::optional<TurnAndZoom> turn_and_zoom(
    const Matrix3<double>& H, double focal_length_a, const std::vector<Vector2<double>>& points_a);

// One answer about a frame, at its middle row.
struct ZoomAnswer {
  double focal_length = 0;  // px
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();
  std::function<Vector3<double>(const Vector2<double>&)> direction;  // of a pixel, base
};
struct ZoomAnswerErrors {
  double log_focal_length = 0;
  double rotation_rad = 0;
  double px =
      0;  // angles of directions times f, root mean square over the image, nothing taken out
};
[[nodiscard]] ZoomAnswer answer_of(const FrameOrientation& frame);
[[nodiscard]] ZoomAnswerErrors errors_of(const ZoomingCamera& camera, int k,
                                         const ZoomAnswer& answer);

// Calibrations at focal lengths that are evenly spaced in log f, PT mode with the nearest one by the reading.
class NearestNodes {
 public:
  // wide, tele: px; mechanics: the true one.
  NearestNodes(const ZoomingCamera& camera, double wide, double tele, int nodes,
               const Mechanics<double>& mechanics);
  [[nodiscard]] std::optional<ZoomAnswer> answer(int k, const InterpolatedPanTilt& telemetry) const;

 private:
  const ZoomingCamera& camera_;
  std::vector<Calibration> nodes_;
};

// Keyframes are every so many frames of the same film. The nearest by pan, tilt and log f, where that is another frame.
class KeyframeHomographies {
 public:
  KeyframeHomographies(const ZoomingCamera& camera, const std::vector<cv::Mat>& film,
                       int frames_between);
  [[nodiscard]] bool is_keyframe(int k) const { return k % frames_between_ == 0; }
  // Nothing where fewer than 25 features agree with a homography.
  [[nodiscard]] std::optional<ZoomAnswer> answer(int k) const;

 private:
  // In pinhole pixels, of the curve's lens there.
  [[nodiscard]] PlacedFeatures features_of(int k) const;

  const ZoomingCamera& camera_;
  const std::vector<cv::Mat>& film_;
  int frames_between_;
  std::vector<PlacedFeatures> keyframes_;
};

}  // namespace alidade::test
