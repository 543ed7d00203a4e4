#include "core/mapping/map_building.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "core/mapping/feature_tracks.h"
#include "core/mapping/map_making.h"
#include "core/mapping/map_projection.h"
#include "core/mapping/match_graph.h"
#include "core/mapping/place_noise.h"

namespace alidade {
namespace {

// Sigma of log f if a common focal length was searched in steps.
constexpr double kSearchedLogSigma = 0.15;

class Building {
 public:
  Building(const MapBuildOptions& options, const std::vector<MapView>& views,
           const std::vector<FeatureSet>& features, const MapProgress& progress)
      : options_(options), views_(views), progress_(progress) {
    for (std::size_t i = 0; i < views.size(); ++i) {
      LinkedPicture picture;
      picture.features = features[i];
      picture.motion = {views[i].angular_velocity, views[i].zoom_rate, options.line_delay,
                        options.height / 2.0};
      picture.log_f = views[i].log_f.value_or(0);
      picture.log_f_sigma = options.log_f_sigma;
      if (views[i].log_f) place(views[i], &picture);
      pictures_.push_back(std::move(picture));
    }
  }

  MapBuild run() {
    keep_textured();
    if (kept_.size() < 2) return refused(MapBuildStatus::kNoTexture);
    compare();
    if (!find_focal_lengths()) return refused(MapBuildStatus::kNoFocalLength);
    check_links();
    if (!keep_linked()) return refused(MapBuildStatus::kNotConnected);
    const auto start = start_orientations(pictures_, links_);
    for (const int i : kept_) R_.push_back(start[static_cast<std::size_t>(i)].value());
    MapOptions adjustment = options_.adjustment;
    adjustment.lens = lens_;
    adjustment.level_sigma.tail<2>().setConstant(options_.centre_share * options_.width);
    if (searched_) {
      adjustment.level_sigma[0] = std::max(adjustment.level_sigma[0], kSearchedLogSigma);
    }
    say(0.5, "first adjustment");
    if (!adjust(adjustment, options_.first_features, false)) return failed();
    learn_noise();
    adjustment.start = found_.lens;
    say(0.7, "adjustment");
    if (!adjust(adjustment, 0, true)) return failed();
    say(0.95, "landmarks");
    out_.status = MapBuildStatus::kOk;
    MapMaterial material{options_, found_, evidence_, tracks_, noise_, {}, {}};
    for (const int i : kept_) {
      material.views.push_back(&views_[static_cast<std::size_t>(i)]);
      material.pictures.push_back(&pictures_[static_cast<std::size_t>(i)]);
    }
    make_scene_map(material, &out_);
    out_.of_keyframe = kept_;
    return std::move(out_);
  }

 private:
  void say(double done, const char* what) const {
    if (progress_) progress_(done, what);
  }
  MapBuild refused(MapBuildStatus status) {
    out_.status = status;
    return std::move(out_);
  }
  MapBuild failed() {
    out_.adjustment = found_.status;
    return refused(found_.status == MapStatus::kNotConnected ? MapBuildStatus::kNotConnected
                                                             : MapBuildStatus::kNotDetermined);
  }

  void place(const MapView& view, LinkedPicture* picture) const {
    if (!view.telemetry || !options_.mechanics) return;
    picture->R_base_from_camera = R_base_from_camera(
        *options_.mechanics, true_from_measured(*options_.mechanics, *view.telemetry));
    picture->R_sigma = view.angle_sigma;
  }

  [[nodiscard]] const LinkedPicture& kept(std::size_t i) const {
    return pictures_[static_cast<std::size_t>(kept_[i])];
  }
  [[nodiscard]] const Feature& feature(const PictureFeature& f) const {
    return kept(static_cast<std::size_t>(f.picture))
        .features.features[static_cast<std::size_t>(f.feature)];
  }

  void keep_textured() {
    for (std::size_t i = 0; i < pictures_.size(); ++i) {
      const bool has_texture =
          static_cast<int>(pictures_[i].features.size()) >= options_.least_features;
      (has_texture ? kept_ : out_.without_texture).push_back(static_cast<int>(i));
      if (!has_texture) pictures_[i].features = {};
    }
  }

  void compare() {
    const auto pairs = pairs_to_compare(pictures_, options_.width, options_.height, options_.links);
    for (const auto& [a, b] : pairs) {
      say(0.3 * static_cast<double>(links_.size()) / static_cast<double>(pairs.size()), "matches");
      links_.push_back(match_pair(pictures_, a, b, options_.links));
    }
    out_.compared = static_cast<int>(links_.size());
  }

  bool find_focal_lengths() {
    const auto known = std::count_if(views_.begin(), views_.end(),
                                     [](const MapView& view) { return view.log_f.has_value(); });
    if (known == 0) {
      const auto log_f =
          common_focal_length(pictures_, links_, options_.width, options_.height, options_.links);
      if (!log_f) return false;
      searched_ = true;
      for (std::size_t i = 0; i < pictures_.size(); ++i) {
        pictures_[i].log_f = *log_f;
        pictures_[i].log_f_sigma = 0.01;
        place(views_[i], &pictures_[i]);
      }
    } else if (known != static_cast<std::ptrdiff_t>(views_.size())) {
      return false;
    }
    const auto [least, most] = std::minmax_element(
        pictures_.begin(), pictures_.end(),
        [](const LinkedPicture& a, const LinkedPicture& b) { return a.log_f < b.log_f; });
    if (options_.lens) {
      lens_ = *options_.lens;
      return lens_.begin_s() <= least->log_f && most->log_f <= lens_.end_s();
    }
    Camera<double> camera;
    camera.focal_length = std::exp(least->log_f);
    camera.width = options_.width;
    camera.height = options_.height;
    lens_ = LensCurve(camera, least->log_f - 0.02, most->log_f + 0.02, options_.lens_spacing);
    return true;
  }

  void check_links() {
    for (std::size_t i = 0; i < links_.size(); ++i) {
      say(0.3 + 0.2 * static_cast<double>(i) / static_cast<double>(links_.size()), "links");
      check_link(pictures_, lens_, options_.links, &links_[i]);
      if (links_[i].status == PoseStatus::kOk) ++out_.linked;
    }
  }

  // Keeps the largest group (indices into kept_) if the others are small.
  bool keep_largest(const std::vector<std::vector<int>>& groups) {
    const bool all_but_one_small =
        groups.size() < 2 || static_cast<int>(groups[1].size()) < options_.least_group;
    if (groups.empty() || groups[0].size() < 2 || !(all_but_one_small || options_.largest_part)) {
      for (const auto& group : groups) {
        out_.groups.emplace_back();
        for (const int i : group) out_.groups.back().push_back(kept_[static_cast<std::size_t>(i)]);
      }
      return false;
    }
    std::vector<int> remaining;
    std::vector<Matrix3<double>> R;
    for (const int i : groups[0]) {
      remaining.push_back(kept_[static_cast<std::size_t>(i)]);
      if (!R_.empty()) R.push_back(R_[static_cast<std::size_t>(i)]);
    }
    for (std::size_t g = 1; g < groups.size(); ++g) {
      for (const int i : groups[g]) {
        out_.not_connected.push_back(kept_[static_cast<std::size_t>(i)]);
      }
    }
    std::sort(out_.not_connected.begin(), out_.not_connected.end());
    kept_ = std::move(remaining);
    R_ = std::move(R);
    return true;
  }

  bool keep_linked() {
    std::vector<SeenIn> seen;
    std::vector<int> place(pictures_.size(), -1);
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      place[static_cast<std::size_t>(kept_[i])] = static_cast<int>(i);
    }
    for (std::size_t i = 0; i < links_.size(); ++i) {
      if (links_[i].status != PoseStatus::kOk) continue;
      seen.emplace_back(place[static_cast<std::size_t>(links_[i].a)], static_cast<int>(i));
      seen.emplace_back(place[static_cast<std::size_t>(links_[i].b)], static_cast<int>(i));
    }
    return keep_largest(connected_pictures(static_cast<int>(kept_.size()), seen, 1));
  }

  // Matches whose directions agree after an adjustment.
  void add_agreeing(const PictureLink& link, int a, int b, std::vector<TrackMatch>* out) const {
    const auto at_a = static_cast<std::size_t>(a);
    const auto at_b = static_cast<std::size_t>(b);
    const AdjustedPicture& pose_a = found_.pictures[at_a];
    const AdjustedPicture& pose_b = found_.pictures[at_b];
    for (const FeatureMatch& match : link.matches) {
      const PictureFeature of_a{a, match.indexed};
      const PictureFeature of_b{b, match.query};
      Vector3<double> d;
      MapProjection seen;
      const Vector2<double> u = feature(of_b).u;
      if (unproject_to_map(pose_a.camera, pose_a.motion, pose_a.R_base_from_camera, feature(of_a).u,
                           &d) != ProjectionStatus::kOk ||
          project_from_map(pose_b.camera, pose_b.motion, pose_b.R_base_from_camera, u.y(), d,
                           &seen) != ProjectionStatus::kOk) {
        continue;
      }
      const double ratio = pose_b.camera.focal_length / pose_a.camera.focal_length;
      const double sigma = std::hypot(ratio * noise_.sigma_px(feature(of_a).scale),
                                      noise_.sigma_px(feature(of_b).scale));
      const double gate =
          std::max(options_.gate_px * std::max(1.0, ratio), options_.gate_sigmas * sigma);
      if ((seen.u - u).norm() < gate) out->push_back({of_a, of_b, match.ratio});
    }
  }

  // Tracks of kept pictures. adjusted: from all matches that agree with the adjustment; otherwise
  // from the links' inliers.
  [[nodiscard]] std::vector<std::vector<PictureFeature>> tracks(bool adjusted) const {
    std::vector<int> place(pictures_.size(), -1);
    std::vector<int> counts;
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      place[static_cast<std::size_t>(kept_[i])] = static_cast<int>(i);
      counts.push_back(static_cast<int>(kept(i).features.size()));
    }
    std::vector<TrackMatch> matches;
    for (const PictureLink& link : links_) {
      const int a = place[static_cast<std::size_t>(link.a)];
      const int b = place[static_cast<std::size_t>(link.b)];
      if (a < 0 || b < 0) continue;
      if (adjusted) {
        add_agreeing(link, a, b, &matches);
        continue;
      }
      for (const int i : link.inliers) {
        const FeatureMatch& match = link.matches[static_cast<std::size_t>(i)];
        matches.push_back({{a, match.indexed}, {b, match.query}, match.ratio});
      }
    }
    return feature_tracks(counts, std::move(matches));
  }

  // Keeps the longest tracks until each picture has `most` of them; 0: all.
  void thin(int most, std::vector<std::vector<PictureFeature>>* all) const {
    if (most == 0) return;
    std::stable_sort(all->begin(), all->end(),
                     [](const auto& a, const auto& b) { return a.size() > b.size(); });
    std::vector<int> count(kept_.size(), 0);
    const auto is_full = [&](const PictureFeature& f) {
      return count[static_cast<std::size_t>(f.picture)] >= most;
    };
    std::vector<std::vector<PictureFeature>> some;
    for (auto& track : *all) {
      if (std::all_of(track.begin(), track.end(), is_full)) continue;
      for (const PictureFeature& f : track) ++count[static_cast<std::size_t>(f.picture)];
      some.push_back(std::move(track));
    }
    *all = std::move(some);
  }

  bool adjust(const MapOptions& options, int most_features, bool adjusted) {
    for (;;) {
      tracks_ = tracks(adjusted);
      thin(most_features, &tracks_);
      fill_evidence(adjusted);
      MapAdjustment found = adjust_map(evidence_, options);
      const bool is_apart = found.status == MapStatus::kNotConnected;
      out_.steps += found.steps;
      if (found.status != MapStatus::kOk && !is_apart) {
        found_ = std::move(found);
        return false;
      }
      if (is_apart) {
        const auto before = kept_.size();
        keep_adjusted(found.groups.empty() ? std::vector<int>{} : found.groups[0]);
        if (!keep_largest(found.groups) || kept_.size() == before) {
          found_ = std::move(found);
          return false;
        }
        continue;
      }
      found_ = std::move(found);
      for (std::size_t i = 0; i < kept_.size(); ++i) {
        R_[i] = found_.pictures[i].R_base_from_camera;
      }
      return true;
    }
  }

  void keep_adjusted(const std::vector<int>& places) {
    if (found_.pictures.empty()) return;
    std::vector<AdjustedPicture> some;
    some.reserve(places.size());
    for (const int i : places) some.push_back(found_.pictures[static_cast<std::size_t>(i)]);
    found_.pictures = std::move(some);
  }

  void fill_evidence(bool adjusted) {
    evidence_ = {};
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      const LinkedPicture& picture = kept(i);
      MapPicture p;
      p.position = picture.log_f;
      const MapView& view = views_[static_cast<std::size_t>(kept_[i])];
      p.eps_sigma = std::max(options_.repeatability, view.log_f_sigma);
      p.motion = picture.motion;
      p.motion_sigma = view.motion_sigma;
      p.R_start = adjusted ? found_.pictures[i].R_base_from_camera : R_[i];
      if (picture.R_base_from_camera) {
        p.telemetry =
            OrientationPrior{*picture.R_base_from_camera,
                             Matrix3<double>::Identity() * picture.R_sigma * picture.R_sigma};
      }
      evidence_.pictures.push_back(p);
    }
    evidence_.landmarks = static_cast<int>(tracks_.size());
    for (std::size_t j = 0; j < tracks_.size(); ++j) {
      for (const PictureFeature& f : tracks_[j]) {
        evidence_.observations.push_back(
            {f.picture, static_cast<int>(j), feature(f).u, noise_.sigma_px(feature(f).scale)});
      }
    }
  }

  void learn_noise() {
    const auto errors = errors_px(evidence_, found_);
    std::vector<int> seen_by(tracks_.size(), 0);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (errors[i]) ++seen_by[static_cast<std::size_t>(evidence_.observations[i].landmark)];
    }
    std::vector<std::pair<double, double>> scale_and_error;
    std::size_t i = 0;
    for (std::size_t j = 0; j < tracks_.size(); ++j) {
      for (const PictureFeature& f : tracks_[j]) {
        const auto& error = errors[i++];
        const int n = seen_by[j];
        // The landmark absorbs one of n observations.
        if (error && n > 1) {
          scale_and_error.emplace_back(feature(f).scale, *error * std::sqrt(n / (n - 1.0)));
        }
      }
    }
    noise_.learn(scale_and_error);
  }

  const MapBuildOptions& options_;
  const std::vector<MapView>& views_;
  const MapProgress& progress_;
  std::vector<LinkedPicture> pictures_;
  std::vector<PictureLink> links_;
  bool searched_ = false;  // whether a common focal length was searched
  LensCurve lens_;         // start value
  // Indices of pictures and their start orientations. The adjustment counts these.
  std::vector<int> kept_;
  std::vector<Matrix3<double>> R_;
  PlaceNoise noise_;
  std::vector<std::vector<PictureFeature>> tracks_;
  MapEvidence evidence_;
  MapAdjustment found_;
  MapBuild out_;
};

}  // namespace

const char* to_string(MapBuildStatus status) {
  switch (status) {
    case MapBuildStatus::kOk:
      return "ok";
    case MapBuildStatus::kBadInput:
      return "options out of range, or fewer than two pictures";
    case MapBuildStatus::kNoTexture:
      return "fewer than two pictures have enough texture";
    case MapBuildStatus::kNoFocalLength:
      return "no focal length fits the pictures";
    case MapBuildStatus::kNotConnected:
      return "some pictures share too little with the others";
    case MapBuildStatus::kNotDetermined:
      return "the adjustment of all pictures finds no minimum";
  }
  return "unknown status";
}

bool MapBuildOptions::validate(const char** error) const {
  const char* what = nullptr;
  if (width < FeatureDetector::kLeastImage_px || height < FeatureDetector::kLeastImage_px ||
      width > SceneMap::kMostImageSide || height > SceneMap::kMostImageSide) {
    what = "width and height must be 16 to 16384 px";
  } else if (!std::isfinite(line_delay)) {
    what = "line_delay must be finite";
  } else if (lens && (lens->width() != width || lens->height() != height)) {
    what = "the lens is for another image size";
  } else if (!(log_f_sigma > 0) || !(repeatability > 0) || !(lens_spacing > 0)) {
    what = "log_f_sigma, repeatability and lens_spacing must be above 0";
  } else if (first_features < 20 || least_features < 1 || least_group < 1) {
    what = "first_features must be at least 20, least_features and least_group at least 1";
  } else if (!(gate_px > 0) || !(gate_sigmas > 0)) {
    what = "gate_px and gate_sigmas must be above 0";
  }
  if (what != nullptr && error != nullptr) *error = what;
  return what == nullptr;
}

void MapBuilder::add(MapView view, FeatureSet features, std::vector<std::uint8_t> picture) {
  views_.push_back(std::move(view));
  features_.push_back(std::move(features));
  pictures_.push_back(std::move(picture));
}

MapBuild MapBuilder::build(const MapProgress& progress) const {
  if (!options_.validate() || views_.size() < 2) return {};
  MapBuild out = Building(options_, views_, features_, progress).run();
  for (std::size_t i = 0; i < out.map.keyframes.size(); ++i) {
    out.map.keyframes[i].picture = pictures_[static_cast<std::size_t>(out.of_keyframe[i])];
  }
  return out;
}

}  // namespace alidade
