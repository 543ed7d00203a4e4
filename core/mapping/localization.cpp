#include "core/mapping/localization.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/mapping/feature_matching.h"
#include "core/mapping/map_projection.h"
#include "core/model/direction.h"

namespace alidade {
namespace {

constexpr double kLogFMargin = 0.1;  // beyond the lens's range

// px; sigma of a feature's place by its size, as found when maps are made. A picture with more
// noise shows it in its residuals.
double place_sigma_px(double scale_px) { return std::max(0.15, 0.06 * scale_px); }

// Where a direction is seen, in its own row. False: nowhere.
bool seen_at(const Camera<double>& camera, const PictureMotion& motion,
             const Matrix3<double>& R_base_from_camera, const Vector3<double>& d_b,
             Vector2<double>* u) {
  const bool moves = motion.zoom_rate != 0 || !motion.angular_velocity.isZero(0);
  double row = motion.reference_row;
  for (int step = 0; step < (moves ? 3 : 1); ++step) {
    if (pixel_from_map(camera, motion, R_base_from_camera, row, d_b, u) != ProjectionStatus::kOk) {
      return false;
    }
    row = u->y();
  }
  return true;
}

}  // namespace

const char* to_string(LocalizationStatus status) {
  switch (status) {
    case LocalizationStatus::kOk:
      return "ok";
    case LocalizationStatus::kNotInMap:
      return "not in the map";
    case LocalizationStatus::kAmbiguous:
      return "ambiguous";
    case LocalizationStatus::kNoUsablePicture:
      return "no usable picture";
  }
  return "unknown status";
}

FeatureOptions localization_features(bool with_hint) {
  FeatureOptions out;
  out.shrink = with_hint ? 4 : 2;
  out.max_features = with_hint ? 300 : 500;
  out.contrast_threshold = with_hint ? 0.006 : 0.008;  // noise falls with shrinking
  return out;
}

struct Localizer::State {
  struct Place {
    Matrix3<double> R_base_from_camera;
    double log_f = 0;
  };
  struct Landmark {
    std::int64_t id = 0;
    Vector3<double> d_b;
    Matrix2<double> covariance;
    double scale_rad = 0;
    std::vector<int> keyframes;  // indices
  };
  struct Keyframe {
    std::int64_t id = 0;
    Place place;
    Matrix4<double> covariance;
    std::vector<int> landmarks;
  };

  LocalizationOptions options;
  LensCurve lens;
  std::optional<Mechanics<double>> mechanics;
  double line_delay = 0;
  double reference_row = 0;
  std::vector<Landmark> landmarks;
  std::vector<Descriptor> descriptors;
  std::vector<Keyframe> keyframes;
  std::optional<FeatureIndex> index;

  [[nodiscard]] const Landmark& landmark(int i) const {
    return landmarks[static_cast<std::size_t>(i)];
  }

  // Whether two landmarks are one thing, seen at several zooms and not recognised as the same.
  [[nodiscard]] bool is_same(int a, int b) const {
    const Landmark& la = landmark(a);
    const Landmark& lb = landmark(b);
    return (la.d_b - lb.d_b).norm() < 2 * std::max(la.scale_rad, lb.scale_rad);
  }

  [[nodiscard]] PoseMatch pose_match(const Feature& feature, int i) const {
    PoseMatch m;
    m.u = feature.u;
    m.sigma_px = place_sigma_px(feature.scale);
    m.d_b = landmark(i).d_b;
    m.cov_d = landmark(i).covariance;
    return m;
  }

  // Matches of features with these landmarks.
  [[nodiscard]] std::vector<FeatureMatch> match(const FeatureSet& features,
                                                const std::vector<int>& among) const {
    std::vector<Descriptor> indexed;
    indexed.reserve(among.size());
    for (const int i : among) indexed.push_back(descriptors[static_cast<std::size_t>(i)]);
    std::vector<FeatureMatch> matches = believed_matches(
        nearest_features(features.descriptors, indexed), options.ratio, [&](int a, int b) {
          return is_same(among[static_cast<std::size_t>(a)], among[static_cast<std::size_t>(b)]);
        });
    for (FeatureMatch& m : matches) m.indexed = among[static_cast<std::size_t>(m.indexed)];
    return matches;
  }

  [[nodiscard]] std::vector<PoseMatch> pose_matches(
      const FeatureSet& features, const std::vector<FeatureMatch>& matches) const {
    std::vector<PoseMatch> out;
    out.reserve(matches.size());
    for (const FeatureMatch& m : matches) {
      out.push_back(pose_match(features.features[static_cast<std::size_t>(m.query)], m.indexed));
    }
    return out;
  }

  // Landmarks that should be seen from a place, at a size that features have, and where.
  struct Visible {
    int landmark = 0;
    Vector2<double> u;
    double scale_px = 0;
  };
  [[nodiscard]] std::vector<Visible> visible(const Place& place, const PictureMotion& motion,
                                             double margin_px) const {
    constexpr double kLeastScale_px = 1.5;
    const Camera<double> camera = lens.camera_of(place.log_f);
    const double f = camera.focal_length;
    const double most_scale_px = camera.height / 6.0;
    const double reach = std::hypot(camera.width, camera.height) / 2 + margin_px;
    const double least_cosine = std::cos(std::min(1.5, 1.2 * std::atan(reach / f)));
    const Vector3<double> axis = place.R_base_from_camera.col(2);
    std::vector<Visible> out;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const Landmark& l = landmarks[i];
      if (l.d_b.dot(axis) < least_cosine) continue;
      const double scale_px = l.scale_rad * f;
      if (scale_px < kLeastScale_px || scale_px > most_scale_px) continue;
      Vector2<double> seen;
      if (!seen_at(camera, motion, place.R_base_from_camera, l.d_b, &seen)) continue;
      const bool is_inside = seen.x() > -margin_px && seen.x() < camera.width + margin_px &&
                             seen.y() > -margin_px && seen.y() < camera.height + margin_px;
      if (is_inside) out.push_back({static_cast<int>(i), seen, scale_px});
    }
    return out;
  }

  // Matches of features with the landmarks predicted within `radius_px`.
  [[nodiscard]] std::vector<FeatureMatch> match_near(const FeatureSet& features,
                                                     std::vector<Visible> there,
                                                     double radius_px) const {
    std::sort(there.begin(), there.end(), [](const Visible& a, const Visible& b) {
      return a.u.y() != b.u.y() ? a.u.y() < b.u.y() : a.landmark < b.landmark;
    });
    const auto most = static_cast<float>(options.most_distance * options.most_distance);
    std::vector<NearFeatures> near(features.size());
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Feature& f = features.features[i];
      const auto first =
          std::lower_bound(there.begin(), there.end(), f.u.y() - radius_px,
                           [](const Visible& v, double top) { return v.u.y() < top; });
      std::vector<Descriptor> some;
      std::vector<int> which;
      for (auto v = first; v != there.end() && v->u.y() <= f.u.y() + radius_px; ++v) {
        const double size = f.scale / v->scale_px;
        if (std::abs(v->u.x() - f.u.x()) > radius_px || size < options.least_size ||
            size > 1 / options.least_size) {
          continue;
        }
        some.push_back(descriptors[static_cast<std::size_t>(v->landmark)]);
        which.push_back(v->landmark);
      }
      near[i] = nearest_features({features.descriptors[i]}, some).front();
      for (NearFeature& n : near[i]) {
        if (n.indexed >= 0) n.indexed = which[static_cast<std::size_t>(n.indexed)];
      }
      if (near[i][0].square > most) near[i] = {};
      // If nothing else is near, a descriptor that is too unlike takes the second place.
      for (NearFeature& n : near[i]) {
        if (near[i][0].indexed >= 0 && n.indexed < 0) {
          n = {static_cast<int>(landmarks.size()), 2 * most};
          break;
        }
      }
    }
    return believed_matches(near, options.ratio, [&](int a, int b) {
      const auto none = static_cast<int>(landmarks.size());
      return a != none && b != none && is_same(a, b);
    });
  }

  [[nodiscard]] PoseKnowledge knowledge(const LocalizationHint& hint) const {
    PoseKnowledge out;
    out.lens = lens;
    out.motion = {hint.angular_velocity, hint.zoom_rate, hint.line_delay.value_or(line_delay),
                  reference_row};
    out.motion_doubt = hint.motion_doubt;
    out.turned_by = mechanics;
    out.focal_length = hint.focal_length;
    out.least_log_f = lens.begin_s() - kLogFMargin;
    out.most_log_f = lens.end_s() + kLogFMargin;
    return out;
  }

  // Localizes again with all landmarks around the places that the first pose predicts.
  [[nodiscard]] bool refine(const FeatureSet& features, PoseKnowledge knowledge,
                            Localization* out) const {
    const Place place{out->pose.R_base_from_camera, out->pose.log_f};
    knowledge.motion_start = out->pose.motion;
    std::vector<Visible> there = visible(place, out->pose.motion, 0);
    out->expected = static_cast<int>(there.size());
    const auto matches = match_near(features, std::move(there), options.near_px);
    PoseOptions pose_options;
    pose_options.threshold_px = options.near_px / 2;
    pose_options.least_inliers = options.least_inliers;
    pose_options.max_trials = 200;
    const std::vector<PoseMatch> all = pose_matches(features, matches);
    const PicturePose pose = find_pose(all, knowledge, pose_options);
    if (pose.status != PoseStatus::kOk) {
      out->status = pose.status == PoseStatus::kRival ? LocalizationStatus::kAmbiguous
                                                      : LocalizationStatus::kNotInMap;
      return false;
    }
    if (static_cast<double>(pose.inliers.size()) <
        options.least_share * static_cast<double>(all.size())) {
      out->status = LocalizationStatus::kNotInMap;
      return false;
    }
    out->pose = pose;
    out->matches = static_cast<int>(pose.inliers.size());
    out->covariance_in_map = pose.covariance;
    out->matched.clear();
    for (const int i : pose.inliers) {
      const FeatureMatch& m = matches[static_cast<std::size_t>(i)];
      out->matched.push_back({m.query, landmark(m.indexed).id});
    }
    add_common_error(out);
    out->status = LocalizationStatus::kOk;
    return true;
  }

  // The keyframe of the nearest focal length shares lens and base with the picture, so its
  // uncertainty in both is the picture's too. An error of the optical centre, for one, is a
  // rotation in the camera's own frame.
  void add_common_error(Localization* out) const {
    const auto off = [&](const Keyframe& k) { return std::abs(k.place.log_f - out->pose.log_f); };
    const auto nearest =
        std::min_element(keyframes.begin(), keyframes.end(),
                         [&](const Keyframe& a, const Keyframe& b) { return off(a) < off(b); });
    if (nearest == keyframes.end()) return;
    out->pose.covariance += nearest->covariance;
    const double axis = options.between_px * off(*nearest) / out->pose.camera.focal_length;
    const double log_f = options.between_log_f * off(*nearest);
    out->pose.covariance(0, 0) += axis * axis;
    out->pose.covariance(1, 1) += axis * axis;
    out->pose.covariance(3, 3) += log_f * log_f;
  }

  [[nodiscard]] Localization by_hint(const FeatureSet& features, const LocalizationHint& hint,
                                     const PoseKnowledge& knowledge) const {
    Localization out;
    out.status = LocalizationStatus::kNotInMap;
    const FocalLengthPrior& f = *hint.focal_length;
    const double half = std::hypot(lens.width(), lens.height()) / 2;
    const double radius_px = 3 * (hint.R_sigma * std::exp(f.log_f) + f.sigma * half +
                                  motion_reach_px(knowledge, f.log_f)) +
                             options.near_px;
    if (radius_px > lens.width() / 4.0) return out;
    const auto matches = match_near(
        features, visible({*hint.R_base_from_camera, f.log_f}, knowledge.motion, radius_px),
        radius_px);
    PoseOptions pose_options;
    pose_options.threshold_px = std::min(options.threshold_px, radius_px / 2);
    pose_options.least_inliers = options.least_inliers;
    out.pose = find_pose(pose_matches(features, matches), knowledge, pose_options);
    if (out.pose.status == PoseStatus::kRival) out.status = LocalizationStatus::kAmbiguous;
    if (out.pose.status != PoseStatus::kOk) return out;
    out.by_hint = true;
    (void)refine(features, knowledge, &out);
    return out;
  }

  // Indices of keyframes, most likely first.
  [[nodiscard]] std::vector<int> retrieved(const FeatureSet& features) const {
    const std::size_t asking =
        std::min(static_cast<std::size_t>(options.asking_features), features.size());
    const std::vector<Descriptor> queries(
        features.descriptors.begin(),
        features.descriptors.begin() + static_cast<std::ptrdiff_t>(asking));
    std::vector<std::pair<double, int>> votes;
    for (std::size_t k = 0; k < keyframes.size(); ++k) votes.emplace_back(0, static_cast<int>(k));
    for (const NearFeatures& near : index->nearest(queries, options.checks)) {
      const double furthest = near.back().square;
      if (near.back().indexed < 0 || !(furthest > 0)) continue;
      for (const NearFeature& n : near) {
        const double weight = 1 - n.square / furthest;
        for (const int k : landmark(n.indexed).keyframes) {
          votes[static_cast<std::size_t>(k)].first -= weight;
        }
      }
    }
    std::sort(votes.begin(), votes.end());
    std::vector<int> out;
    for (const auto& [vote, k] : votes) {
      if (static_cast<int>(out.size()) >= options.tried_keyframes || !(vote < 0)) break;
      out.push_back(k);
    }
    return out;
  }

  [[nodiscard]] Localization by_retrieval(const FeatureSet& features,
                                          const PoseKnowledge& knowledge) const {
    Localization best;
    best.status = LocalizationStatus::kNotInMap;
    PoseOptions pose_options;
    pose_options.threshold_px = options.threshold_px;
    pose_options.least_inliers = options.least_inliers;
    for (const int k : retrieved(features)) {
      const Keyframe& keyframe = keyframes[static_cast<std::size_t>(k)];
      Localization found;
      found.keyframe = keyframe.id;
      found.pose = find_pose(pose_matches(features, match(features, keyframe.landmarks)), knowledge,
                             pose_options);
      if (found.pose.status == PoseStatus::kRival) best.status = LocalizationStatus::kAmbiguous;
      if (found.pose.status != PoseStatus::kOk) continue;
      if (refine(features, knowledge, &found)) return found;
      if (found.status == LocalizationStatus::kAmbiguous) best.status = found.status;
    }
    return best;
  }
};

Localizer::Localizer(const SceneMap& map, const LocalizationOptions& options) : state_(new State) {
  State& s = *state_;
  s.options = options;
  s.lens = map.lens;
  s.mechanics = map.mechanics;
  s.line_delay = map.line_delay;
  s.reference_row = map.reference_row;
  for (const SceneKeyframe& keyframe : map.keyframes) {
    State::Keyframe k;
    k.id = keyframe.id;
    k.place = {keyframe.R_base_from_camera.toRotationMatrix(),
               std::log(map.camera_of(keyframe).focal_length)};
    k.covariance = keyframe.covariance;
    s.keyframes.push_back(std::move(k));
  }
  for (const SceneLandmark& landmark : map.landmarks) {
    State::Landmark l;
    l.id = landmark.id;
    l.d_b = landmark.d_b;
    l.covariance = landmark.covariance;
    l.scale_rad = landmark.scale_rad;
    for (const SceneSighting& sighting : landmark.sightings) {
      const auto k = keyframe_index(map, sighting.keyframe);
      if (k < 0) continue;
      l.keyframes.push_back(static_cast<int>(k));
      s.keyframes[static_cast<std::size_t>(k)].landmarks.push_back(
          static_cast<int>(s.landmarks.size()));
    }
    s.landmarks.push_back(std::move(l));
    s.descriptors.push_back(landmark.descriptor);
  }
  s.index.emplace(s.descriptors);
}

Localizer::~Localizer() = default;
Localizer::Localizer(Localizer&&) noexcept = default;
Localizer& Localizer::operator=(Localizer&&) noexcept = default;

Localization Localizer::find(const FeatureSet& features, const LocalizationHint& hint) const {
  const State& s = *state_;
  if (static_cast<int>(features.size()) < s.options.least_features) return {};
  const PoseKnowledge knowledge = s.knowledge(hint);
  if (hint.R_base_from_camera && hint.focal_length) {
    Localization out = s.by_hint(features, hint, knowledge);
    if (out.status == LocalizationStatus::kOk) return out;
  }
  return s.by_retrieval(features, knowledge);
}

}  // namespace alidade
