#include "edge_app/localization/scene_search.h"

#include <fmt/format.h>

#include <cmath>

namespace alidade {
namespace {

// What is not known of a picture's lens beside the calibration's own sigma: of log f.
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
  const Localization found = localizer_.find(*seen, hint);
  if (found.status == LocalizationStatus::kOk) return found;
  *seen = features_in(thorough_, image);
  return localizer_.find(*seen, hint);
}

FocalLengthPrior focal_length_of(const Calibration& calibration) {
  return {std::log(calibration.camera.focal_length),
          std::hypot(kFocalLengthSigma, relative_focal_length_sigma(calibration))};
}

std::string another_zoom(const Localization& found, const Calibration& calibration,
                         const std::string& picture) {
  const FocalLengthPrior prior = focal_length_of(calibration);
  constexpr double kExcluded = 4;  // standard deviations
  if (std::abs(found.pose.log_f - prior.log_f) < kExcluded * prior.sigma) return "";
  return fmt::format(
      "{} was taken with a focal length of {:.0f} px, but the calibration is for {:.0f} px; "
      "without "
      "telemetry the lens stays at one zoom: put it back there",
      picture, std::exp(found.pose.log_f), calibration.camera.focal_length);
}

}  // namespace alidade
