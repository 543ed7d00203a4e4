#include "edge_app/localization/scene_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/realtime/lens/zoom_lookup.h"

namespace alidade {
namespace {

// Of log f: the uncertainty of a picture's lens beyond the calibration's own sigma.
constexpr double kFocalLengthSigma = 5e-3;

FeatureSet features_in(const FeatureDetector& detector, const ImageView& image) {
  return detector.find(image.luma, image.width, image.height, image.stride);
}

}  // namespace

SceneSearch::SceneSearch(const SceneMap& map)
    : localizer_(map),
      quick_(localization_features(true)),
      thorough_(localization_features(false)) {}

Localization SceneSearch::find(const ImageView& image, const LocalizationHint& hint,
                               FeatureSet* seen) const {
  *seen = features_in(quick_, image);
  Localization found = localizer_.find(*seen, hint);
  if (found.status == LocalizationStatus::kOk) return found;
  *seen = features_in(thorough_, image);
  return localizer_.find(*seen, hint);
}

FocalLengthPrior focal_length_of(const Calibration& calibration) {
  return {std::log(calibration.camera.focal_length),
          std::hypot(kFocalLengthSigma, relative_focal_length_sigma(calibration))};
}

std::optional<CurveRange> range_of(const ZoomCurve& curve) {
  Calibration first;
  Calibration last;
  if (curve.empty() || !curve.at(curve.first_reading(), &first) ||
      !curve.at(curve.last_reading(), &last)) {
    return std::nullopt;
  }
  const auto [least, most] = std::minmax(first.camera.focal_length, last.camera.focal_length);
  return CurveRange{least, most};
}

std::string another_lens(const Localization& found, const Calibration& calibration,
                         const std::optional<CurveRange>& range, const std::string& picture) {
  const double f = std::exp(found.pose.log_f);
  if (range) {
    const double beyond = std::exp(kBeyondEnds);
    if (f * beyond > range->least_px && f < range->most_px * beyond) return "";
    return fmt::format(
        "{} was taken with a focal length of {:.0f} px, but the calibration's zoom curve goes from "
        "{:.0f} to {:.0f} px: calibrate the lens there, too",
        picture, f, range->least_px, range->most_px);
  }
  const FocalLengthPrior prior = focal_length_of(calibration);
  constexpr double kExcluded = 4;  // standard deviations
  if (std::abs(found.pose.log_f - prior.log_f) < kExcluded * prior.sigma) return "";
  return fmt::format(
      "{} was taken with a focal length of {:.0f} px, but the calibration is for {:.0f} px; "
      "without "
      "telemetry the lens stays at one zoom: put it back there",
      picture, f, calibration.camera.focal_length);
}

}  // namespace alidade
