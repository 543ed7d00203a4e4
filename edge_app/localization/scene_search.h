#pragma once
// SceneSearch: finds where one picture looks in a scene map. It tries few features first, and more
// features if the few do not suffice (core/mapping/localization.h). Batch work: allocates. One
// thread at a time.

#include <optional>
#include <string>

#include "core/mapping/features.h"
#include "core/mapping/localization.h"
#include "core/mapping/scene_map.h"
#include "core/model/calibration.h"
#include "core/model/lens/zoom_curve.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

class SceneSearch {
 public:
  // Builds the index of the map, which need not outlive this object.
  explicit SceneSearch(const SceneMap& map);

  // image: of the map's size. *seen: the features of the last search, whether it found the picture
  // or not.
  [[nodiscard]] Localization find(const ImageView& image, const LocalizationHint& hint,
                                  FeatureSet* seen) const;

 private:
  Localizer localizer_;
  FeatureDetector quick_;
  FeatureDetector thorough_;
};

// The prior for a picture that is assumed to be at this calibration's zoom.
[[nodiscard]] FocalLengthPrior focal_length_of(const Calibration& calibration);

// The focal lengths of a zoom curve, px.
struct CurveRange {
  double least_px = 0;
  double most_px = 0;
};
// Empty for an empty curve.
[[nodiscard]] std::optional<CurveRange> range_of(const ZoomCurve& curve);

// One line if a result (kOk) contradicts the lens of a camera without telemetry: the range of its
// zoom curve or, without a curve, the one zoom of its calibration. Else empty. picture: its name in
// the line.
[[nodiscard]] std::string another_lens(const Localization& found, const Calibration& calibration,
                                       const std::optional<CurveRange>& range,
                                       const std::string& picture);

}  // namespace alidade
