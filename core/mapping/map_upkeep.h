#pragma once
// LandmarkUpkeep: keeps a scene map true while it is used (Lisanti et al., section 3.3). Each picture whose pose was found from the map is
// shown to it, and what becomes of the map is given back as one change:
//   seen       direction by the landmark's own filter (landmark_filter.h), descriptor by a running average with forgetting. Pictures that follow one
//              another say the same: else all landmarks would follow at once what a few that creep (shadows, with the season) make of the pose
//   born       a feature that no landmark explains, seen at one place in so many pictures running, if it stands close to the landmarks
//              that gave the pose: the proximity check (Fig. 3), area of their bounding box over that of the box with the new one in it
//   dead       not found for `patience_s`, and in so many pictures in which it should have been. A miss counts only where what was
//              found the last time is found again: that fog, night or a lorry hides all is no landmark's fault
// Bounded: the sphere is divided into cells of a size that goes with the landmark's, with so many landmarks each; where one is full, and
// when the map is, the least useful goes for a new one, if it is worth less.
// Deterministic: equal pictures give equal changes. Batch work: allocates; one thread at a time. What it remembers beside the map, features that may
// become landmarks, is bounded, and lost at the end without harm.

#include <cstdint>
#include <vector>

#include "core/mapping/features.h"
#include "core/mapping/landmark_filter.h"
#include "core/mapping/map_change.h"

namespace alidade {

struct UpkeepOptions {
  // Detection
  double sigma_px = 0.2;  // of a feature of scale 1.6 px, each coordinate; it grows with the scale
  double least_sigma_px =
      0.03;  // of a landmark's own direction, at the focal length it was seen with: what no number of pictures makes better
  double gate_sigmas = 4;
  double wander_of_scale = 0.01;  // of a landmark, in its size, in a day: leaves, shadows, warmth
  double lasting_s = 600;         // > 0: for so long a feature's error is the same, as the light is
  // Appearance
  double forgetting = 0.1;  // weight of a new descriptor
  // Birth
  int birth_views = 20;            // running, in which it has to be seen
  double least_proximity = 0.6;    // 0 to 1; 0: without the check
  double birth_gate_px = 2;        // of the place, from one picture to the next
  int most_descriptor_step = 150;  // distance of descriptors (of 512) from one picture to the next
  int most_candidates = 2000;
  // Death
  double patience_s = 2.5 * 86400;
  int least_misses = 20;
  double fog_share = 0.5;  // found of what was found the last time: with less, nobody is guilty
  double longest_fog_s = 5 * 86400;  // what was not seen for longer is gone, not hidden
  // Bounds
  double cell_scales = 20;  // side of a cell, in the scale of its octave
  int cell_capacity = 3;
  int most_landmarks = 100'000;
  // What should be found: scale in the picture, zoom against the one it was seen with, distance from the border
  double least_scale_px = 1.6;
  double most_scale_px = 100;
  double most_zoom_ratio = 2;
  double border_px = 12;

  [[nodiscard]] double sigma_of(double scale_px) const;  // px, of a feature
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

struct UpkeepMatch {
  int feature = 0;
  std::int64_t landmark = 0;  // id
};

// A picture with a pose that was found from the map: from the landmarks' own covariances (find_pose() with cov_d = covariance).
struct UpkeepView {
  double time_utc_s = 0;
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();
  double log_f = 0;
  Matrix4<double> covariance = Matrix4<double>::Zero();  // of (xi, log f), against the landmarks
  PictureMotion motion;
  const FeatureSet* features = nullptr;
  std::vector<UpkeepMatch>
      matches;  // those that the pose was found from; a feature and a landmark once each
};

struct UpkeepCounts {
  int expected = 0;  // landmarks that should be found in this picture
  int updated = 0;
  int beyond_gate = 0;
  int born = 0;
  int died = 0;
  int not_close = 0;        // would have been born but for the proximity check
  bool all_hidden = false;  // fog: no misses were counted
  bool refused = false;     // numbers or indices out of range: nothing was done
};

class LandmarkUpkeep {
 public:
  // Options that validate() refuses keep nothing up: show() refuses all.
  explicit LandmarkUpkeep(const UpkeepOptions& options = {})
      : options_(options), valid_(options.validate()) {}

  // What the picture changes in the map; apply() it before the next one.
  [[nodiscard]] MapChange show(const UpkeepView& view, const SceneMap& map,
                               UpkeepCounts* counts = nullptr);

  [[nodiscard]] const UpkeepOptions& options() const { return options_; }
  [[nodiscard]] int candidates() const { return static_cast<int>(candidates_.size()); }

 private:
  struct Candidate {
    SceneLandmark landmark;
    int views = 0;  // running
  };
  struct Picture;
  [[nodiscard]] bool look(const UpkeepView& view, const SceneMap& map, Picture* picture) const;
  [[nodiscard]] bool follow_one(const Feature& seen, const Descriptor& descriptor, double now_utc_s,
                                const Picture& picture, SceneLandmark* landmark) const;
  void follow(const UpkeepView& view, const SceneMap& map, Picture* picture, UpkeepCounts* counts);
  void judge(const UpkeepView& view, const SceneMap& map, Picture* picture, MapChange* change,
             UpkeepCounts* counts);
  void find_candidates(const UpkeepView& view, const SceneMap& map, Picture* picture,
                       UpkeepCounts* counts, std::vector<SceneLandmark>* ready);
  void give_birth(const std::vector<SceneLandmark>& ready, double now_utc_s, const SceneMap& map,
                  Picture* picture, MapChange* change, UpkeepCounts* counts);

  UpkeepOptions options_;
  bool valid_;
  std::vector<Candidate> candidates_;
};

// How much a landmark is worth keeping, 0 to 1: found when looked for, and not long ago.
[[nodiscard]] double worth_of(const SceneLandmark& landmark, double now_utc_s, double patience_s);

// (1 - weight) average + weight seen, of the same length as these; rounded up or down by chance, which `salt` decides, so that a
// difference of less than a step is not lost for ever.
void average_descriptor(const Descriptor& seen, double weight, std::uint64_t salt,
                        Descriptor* average);

}  // namespace alidade
