#pragma once
// OeStages: OeMode::process() one stage after the other, by the same classes, on the map that an OeMode has
// made: the same landmarks are visible, chosen, found and solved for. Each stage is run once, where process()
// finds the visible landmarks before and after coarse alignment, and may look twice: the stages' sum is a
// little less than the whole.
//
//   pyramid  octaves of the image
//   project  which landmarks of the map are visible
//   coarse   alignment over pan and tilt by the coarse octaves, their patches included
//   align    which fine landmarks are chosen; each of them in the image
//   solve    the motion's correction

#include <functional>

#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/landmark_search.h"
#include "core/realtime/oe_mode/motion_prediction.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/oe_mode/orientation_solve.h"

namespace alidade::benchmarks {

// OE mode for images of a size with so many landmarks chosen: the map has some more than that in view.
[[nodiscard]] OeOptions measured_options(const Camera<double>& camera, int points);

class OeStages {
 public:
  // Calls the work once, and measures it under that name.
  using Measure = std::function<void(const char* stage, const std::function<void()>& work)>;

  // mode: borrowed, made with measured_options(camera, points); its map and the map's offset are used as they
  // are.
  OeStages(const Calibration& calibration, const OeMode* mode, int points, Measure measure);

  // telemetry: of the middle row. Returns how many landmarks agreed.
  int run(const ImageView& image, const InterpolatedPanTilt& telemetry);

 private:
  Calibration calibration_;
  const OeMode& mode_;
  Measure measure_;
  OeOptions options_;
  Octaves octaves_;
  Pyramid pyramid_;
  MotionPrediction prediction_;
  LandmarkSearch search_;
};

}  // namespace alidade::benchmarks
