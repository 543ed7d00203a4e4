#pragma once
// SceneMapUpkeep: keeps a scene map up to date while it is used (Lisanti et al., section 3.3). It
// is shown each picture whose pose was found from the map, and returns a change of the map:
// landmarks that were seen (landmark_filter.h, descriptors by a running average), born or dead.
// Bounded: the sphere is divided into cells, in proportion to the landmarks' size, and each cell
// holds a limited number of landmarks. In a full cell or map a new landmark replaces the least
// useful landmark if the new one is worth more. Candidates for new landmarks are kept here, not in
// the map. Their number is bounded too; losing them at the end does no harm.
// Equal pictures give equal changes. Allocates; one thread at a time. Rules: docs/derivations.md.

#include <cstdint>
#include <vector>

#include "core/mapping/features.h"
#include "core/mapping/landmark_filter.h"
#include "core/mapping/map_change.h"

namespace alidade {

struct SceneMapUpkeepOptions {
  // Detection
  double sigma_px = 0.2;  // px; of a feature of scale 1.6 px, each coordinate; grows with the scale
  // Least sigma of a landmark's own direction, at the focal length with which it was seen. More
  // pictures do not make it smaller.
  double least_sigma_px = 0.03;
  double gate_sigmas = 4;         // largest innovation of a match, in its sigmas
  double wander_of_scale = 0.01;  // of a landmark, in its sizes per day: leaves, shadows, warmth
  double lasting_s = 600;         // > 0; how long a feature's error lasts: as long as the light
  // Appearance
  double forgetting = 0.1;  // weight of a new descriptor in the average, 0 to 1
  // Birth
  int birth_views = 20;  // consecutive pictures in which a new landmark must be seen
  // A new landmark must lie near the matched features: the area of the box around these over the
  // area of the box that also holds the new one, 0 to 1. 0: no check.
  double least_proximity = 0.6;
  double birth_gate_px = 2;        // of the place, from one picture to the next
  int most_descriptor_step = 150;  // distance of descriptors (of 512) from one picture to the next
  int most_candidates = 2000;
  // Death
  double patience_s = 2.5 * 86400;  // time without being seen after which a landmark dies
  int least_misses = 20;            // consecutive misses that its death needs, too
  // If less is found than this share of the usual number, the scene is taken to be hidden, and no
  // misses are counted. Only landmarks that were found in their latest look count.
  double fog_share = 0.5;
  double longest_fog_s = 5 * 86400;  // a landmark not seen for longer is gone, not hidden
  // Bounds
  double cell_scales = 20;       // side of a cell, in scales of its octave
  int cell_capacity = 3;         // landmarks
  int most_landmarks = 100'000;  // of the map
  // A landmark should be found if its scale in the picture, the ratio of the focal length to the
  // one with which it was seen, and its distance from the border lie within these limits.
  double least_scale_px = 1.6;
  double most_scale_px = 100;
  double most_zoom_ratio = 2;
  double border_px = 12;

  [[nodiscard]] double sigma_of(double scale_px) const;  // px, of a feature
  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

struct UpkeepMatch {
  int feature = 0;            // index into UpkeepView::features
  std::int64_t landmark = 0;  // id
};

// A picture whose pose was found from the map, with the landmarks' own covariances (find_pose()
// with cov_d = covariance).
struct UpkeepView {
  double time_utc_s = 0;
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();  // at the reference row
  double log_f = 0;                                                  // f in px
  Matrix4<double> covariance = Matrix4<double>::Zero();  // of (xi, log f), against the landmarks
  PictureMotion motion;
  const FeatureSet* features = nullptr;  // borrowed for the call
  // Matches that gave the pose; each feature and each landmark at most once.
  std::vector<UpkeepMatch> matches;
};

struct UpkeepCounts {
  int expected = 0;     // landmarks that should be found in this picture
  int updated = 0;      // matched landmarks that were moved
  int beyond_gate = 0;  // matched landmarks that were not moved: too far away, or not seen there
  int born = 0;
  int died = 0;
  int not_close = 0;        // not born only because of the proximity check
  bool all_hidden = false;  // no misses were counted
  bool refused = false;     // numbers or indices out of range: nothing was done
};

class SceneMapUpkeep {
 public:
  // If validate() refuses the options, show() refuses everything.
  explicit SceneMapUpkeep(const SceneMapUpkeepOptions& options = {})
      : options_(options), valid_(options.validate()) {}

  // The change of the map by a picture; apply() it before the next call. counts: may be null.
  [[nodiscard]] MapChange show(const UpkeepView& view, const SceneMap& map,
                               UpkeepCounts* counts = nullptr);

  [[nodiscard]] const SceneMapUpkeepOptions& options() const { return options_; }
  [[nodiscard]] int candidates() const { return static_cast<int>(candidates_.size()); }

 private:
  struct Candidate {
    SceneLandmark landmark;
    int views = 0;  // consecutive ones
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

  SceneMapUpkeepOptions options_;
  bool valid_;
  std::vector<Candidate> candidates_;
};

// How much a landmark is worth keeping, 0 to 1: the share of looks that found it, less if it was
// last seen long ago.
[[nodiscard]] double worth_of(const SceneLandmark& landmark, double now_utc_s, double patience_s);

// *average becomes (1 - weight) average + weight seen, scaled to a descriptor's length. weight: 0
// to 1. `salt` decides at random whether to round up or down, so that a difference below one step
// is not lost for ever.
void average_descriptor(const Descriptor& seen, double weight, std::uint64_t salt,
                        Descriptor* average);

}  // namespace alidade
