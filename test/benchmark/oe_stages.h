#pragma once
// OeStages: what OeMode::process() is made of, one stage after the other, by the same public functions, on
// the map that an OeMode has made. All patches are prepared, and landmarks projected, once, where process() does
// so before and after coarse alignment: the stages' sum is a little less than the whole.
//
//   pyramid  six octaves of the picture
//   project  the map's landmarks that are in view
//   coarse   alignment over pan and tilt by the coarse octaves
//   align    each fine landmark in the picture
//   solve    the motion's correction

#include <functional>
#include <utility>
#include <vector>

#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/coarse_alignment.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/oe_mode/view_projection.h"

namespace alidade::benchmarks {

// OE mode for pictures of a size with so many landmarks used: the map has some more than are used.
[[nodiscard]] OeOptions measured_options(const Camera<double>& camera, int points);

class OeStages {
 public:
  // Calls the work once, and measures it under that name.
  using Measure = std::function<void(const char* stage, const std::function<void()>& work)>;

  // mode: borrowed; its map and the map's offset are used as they are.
  OeStages(const Calibration& calibration, const OeMode* mode, int points, Measure measure);

  // telemetry: of the middle row. Returns how many landmarks agreed.
  int run(const ImageView& picture, const InterpolatedPanTilt& telemetry);

 private:
  struct Seen {
    const Landmark* landmark;
    Vector2<double> u;
  };

  void find_visible(const ViewProjection& view);
  void prepare_patches(const ViewProjection& view);
  void align_landmarks(const ViewProjection& view);

  Calibration calibration_;
  const OeMode& mode_;
  Measure measure_;
  Pyramid pyramid_;
  std::vector<int> slots_;
  std::size_t points_;
  std::vector<Seen> seen_;
  std::vector<ReferencePatch> patches_;
  std::vector<CoarsePatch> coarse_;
  std::vector<std::pair<const Landmark*, const ReferencePatch*>> fine_;
  std::vector<FoundLandmark> found_;
};

}  // namespace alidade::benchmarks
