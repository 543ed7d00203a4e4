#pragma once
// Localizer: where a picture looks, and with which f, by a scene map. If a hint has orientation and
// focal length, features are compared with the landmarks predicted near them. Without such a hint,
// or if it leads to no pose, k-d trees over all landmarks' descriptors retrieve keyframes.
// picture_pose.h finds the pose; a second pass uses all landmarks that should be seen in this pose.
// The pose holds for the map's reference row. Details: docs/derivations.md. It refuses what could
// be wrong: too few matches, too few that agree, two places that fit. Repeated texture fails the
// ratio test or has a rival. Batch work: allocates. One thread at a time.

#include <memory>
#include <optional>
#include <vector>

#include "core/mapping/features.h"
#include "core/mapping/picture_pose.h"
#include "core/mapping/scene_map.h"

namespace alidade {

enum class LocalizationStatus {
  kOk,
  kNotInMap,        // no pose that can be trusted
  kAmbiguous,       // two places fit
  kNoUsablePicture  // fewer than least_features
};

// The name in records and commands: "ok", "not in the map", "ambiguous", "no usable picture".
[[nodiscard]] const char* to_string(LocalizationStatus status);

// Options of the features to localize with. They are found fast: the picture is shrunk by 2, with a
// hint by 4. Low contrast counts too, as the picture may be dark.
[[nodiscard]] FeatureOptions localization_features(bool with_hint);

struct LocalizationOptions {
  int least_features = 20;    // of a usable picture
  double ratio = 0.85;        // as MatchOptions::ratio
  int asking_features = 300;  // used for retrieval
  int checks = 48;            // leaves of the trees, for each feature
  int tried_keyframes = 4;    // the most like the picture, one after another
  double threshold_px = 6;    // of an inlier of the first pose
  int least_inliers = 15;     // matches that agree on the pose
  // Least share of the matches near their landmarks' predicted places that must agree on the pose.
  double least_share = 0.25;
  double near_px = 6;  // search radius around a landmark's place by the first pose
  // Largest distance of two descriptors of one thing; the largest possible distance is 512.
  double most_distance = 260;
  // How far the lens may depart from its curve between the zooms of the keyframes, for each unit of
  // log f from the nearest one: sigma of log f, and of the optical axis.
  double between_log_f = 2e-3;
  double between_px = 2;
  // Least ratio of a feature's size to the size that its landmark should have there; the inverse is
  // the largest ratio.
  double least_size = 0.5;
};

// Prior knowledge of the picture. Orientation and focal length together make a hint; a focal length
// alone still is a prior of the pose.
struct LocalizationHint {
  std::optional<Matrix3<double>> R_base_from_camera;
  double R_sigma = 0;  // rad
  std::optional<FocalLengthPrior> focal_length;
  // Motion of the camera during the read-out, and its uncertainty; unknown by default.
  Vector3<double> angular_velocity = Vector3<double>::Zero();  // camera frame, rad/s
  double zoom_rate = 0;                                        // d log f / dt, 1/s
  MotionDoubt motion_doubt = kUnknownMotion;
  std::optional<double> line_delay;  // s/row; empty: the map's
};

struct LocalizedFeature {
  int feature = 0;            // index into the picture's FeatureSet
  std::int64_t landmark = 0;  // id
};

struct Localization {
  LocalizationStatus status = LocalizationStatus::kNoUsablePicture;
  PicturePose pose;  // with kOk; its covariance includes the map's
  int matches = 0;   // number that agree on the pose
  // Set with kOk: these matches, and the pose's covariance against their landmarks alone, without
  // the landmarks' common errors.
  std::vector<LocalizedFeature> matched;
  Matrix4<double> covariance_in_map = Matrix4<double>::Zero();
  int expected = 0;           // landmarks that should be seen
  std::int64_t keyframe = 0;  // id of the retrieved keyframe that led to the pose; 0: none, by hint
  bool by_hint = false;       // the hint led to the pose
};

class Localizer {
 public:
  // map: valid (is_valid()). Copies what it needs of the map.
  explicit Localizer(const SceneMap& map, const LocalizationOptions& options = {});
  ~Localizer();
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;

  // features: of a picture of the map's size.
  [[nodiscard]] Localization find(const FeatureSet& features,
                                  const LocalizationHint& hint = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade
