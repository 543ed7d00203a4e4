#pragma once
// Localizer: where a picture looks, and with which f, by a scene map, with or without a hint from telemetry.
//   with a hint     features are compared with the landmarks that should lie near them
//   without         retrieval: k-d trees over all landmarks' descriptors, each near one a vote for the keyframes that saw it; the
//                   keyframes with most votes are tried, the picture's features against their landmarks
//   pose            picture_pose.h; then again with all landmarks that should be seen there; it holds for the map's reference row, its middle one
//   motion          of the camera while the picture is read out: what the hint does not tell is found with the pose
// A rival of the nearest landmark is only what lies elsewhere: the same thing may stand in the map for several zooms. What the
// keyframe of the nearest focal length does not know, of base and lens, is added to the pose's covariance. Refused is what could be wrong: too few matches, too few of those that should be
// there, two places that fit. Repeated texture fails the ratio test, or has a rival.
// Batch work: allocates. One thread at a time.

#include <memory>
#include <optional>
#include <vector>

#include "core/mapping/features.h"
#include "core/mapping/picture_pose.h"
#include "core/mapping/scene_map.h"

namespace alidade {

enum class LocalizationStatus { kOk, kNotInMap, kAmbiguous, kNoUsablePicture };

// As records and commands name it: "ok", "not in the map", "ambiguous", "no usable picture".
[[nodiscard]] const char* to_string(LocalizationStatus status);

// Features to ask with: fast, from a picture shrunk by 2, or with a hint by 4, down to little contrast, as it may be dark.
[[nodiscard]] FeatureOptions localization_features(bool with_hint);

struct LocalizationOptions {
  int least_features = 20;  // of a picture that can be used
  double ratio = 0.85;
  int asking_features = 300;  // that retrieval asks with
  int checks = 48;            // leaves of the trees, of each
  int tried_keyframes = 4;
  double threshold_px = 6;  // of the first pose
  int least_inliers = 15;
  double least_share =
      0.25;            // of the matches near their landmarks' places that must agree on the pose
  double near_px = 6;  // where a landmark is looked for about its place by the first pose
  double most_distance =
      260;  // of descriptors, of 512 for the most unlike, of two that are one thing
  // What the lens may do between the zooms of the keyframes that its curve does not follow, for each unit of log f from the nearest:
  // sigma of log f, and of the optical axis.
  double between_log_f = 2e-3;
  double between_px = 2;
  double least_size =
      0.5;  // of a feature over what its landmark's should be, and its inverse at most
};

// What is known of the picture beforehand.
struct LocalizationHint {
  std::optional<Matrix3<double>> R_base_from_camera;
  double R_sigma = 0;  // rad
  std::optional<FocalLengthPrior> focal_length;
  // What the camera does while it is read out, and what is not known of that: by itself nothing is.
  Vector3<double> angular_velocity = Vector3<double>::Zero();  // camera frame, rad/s
  double zoom_rate = 0;                                        // d log f / dt, 1/s
  MotionDoubt motion_doubt = kUnknownMotion;
  std::optional<double> line_delay;  // s/row; none: the map's
};

struct LocalizedFeature {
  int feature = 0;
  std::int64_t landmark = 0;  // id
};

struct Localization {
  LocalizationStatus status = LocalizationStatus::kNoUsablePicture;
  PicturePose pose;  // with kOk; its covariance holds the map's own
  int matches = 0;   // that agree on it
  // With kOk: those, as indices of the features and ids of landmarks; and the pose's covariance against these landmarks alone.
  std::vector<LocalizedFeature> matched;
  Matrix4<double> covariance_in_map = Matrix4<double>::Zero();
  int expected = 0;           // landmarks that should be seen there
  std::int64_t keyframe = 0;  // id: that looks most alike
  bool by_hint = false;
};

class Localizer {
 public:
  explicit Localizer(const SceneMap& map, const LocalizationOptions& options = {});
  ~Localizer();
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;

  // Of a picture of the map's size.
  [[nodiscard]] Localization find(const FeatureSet& features,
                                  const LocalizationHint& hint = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade
