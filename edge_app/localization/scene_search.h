#pragma once
// SceneSearch: asks a scene map where one picture looks, by few features first, and by more of them where those do not tell
// (core/mapping/localization.h). Batch work: allocates. One thread at a time.

#include <optional>
#include <string>

#include "core/mapping/features.h"
#include "core/mapping/localization.h"
#include "core/mapping/scene_map.h"
#include "core/model/calibration.h"
#include "core/model/zoom_curve.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

class SceneSearch {
 public:
  // Makes the index of the map, which need not outlive this.
  explicit SceneSearch(const SceneMap& map);

  // image: of the map's size. *seen: what it was found by, or looked for last.
  [[nodiscard]] Localization find(const ImageView& image, const LocalizationHint& hint,
                                  FeatureSet* seen) const;

 private:
  Localizer localizer_;
  FeatureDetector quick_;
  FeatureDetector thorough_;
};

// That of a picture that is taken to be of this calibration's zoom.
[[nodiscard]] FocalLengthPrior focal_length_of(const Calibration& calibration);

// Focal lengths of a zoom curve, px.
struct CurveRange {
  double least_px = 0;
  double most_px = 0;
};
// None for an empty curve.
[[nodiscard]] std::optional<CurveRange> range_of(const ZoomCurve& curve);

// One line where what was found, kOk, contradicts the lens of a camera without telemetry: its zoom curve's range or, where there is
// none, the one zoom that the calibration is for; else empty. picture: which.
[[nodiscard]] std::string another_lens(const Localization& found, const Calibration& calibration,
                                       const std::optional<CurveRange>& range,
                                       const std::string& picture);

}  // namespace alidade
