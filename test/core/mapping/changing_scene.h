#pragma once
// A scene over weeks, and a camera that visits the same places of it again and again, by a forward model of its own (the virtual camera's
// lens): what it would find in each picture, without pictures.
//   things       corners and blobs on the sphere; a share of them vanishes within the month, others appear instead
//   light        the sun turns once a day: descriptors change, blobs move by a part of a pixel, some things are there for hours only
//   cars         groups of things that stand for hours in one half of a view
//   trees        things in the right half that sway together, slowly; with `bare` nothing lasting stands there
//   shadows      things that move by pixels in a minute, along the same path every day; with the
//                season each hour's place moves along it
//   season       the sun of an hour comes earlier from day to day
//   fog          hours in which next to nothing is seen
// Matches with the map are found by descriptors, near the place that telemetry predicts.
// find_pose() gives the poses.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <vector>

#include "core/mapping/picture_pose.h"
#include "core/mapping/scene_map_upkeep.h"
#include "test/simulator/lens.h"

namespace alidade::test {

struct ChangingSceneOptions {
  std::uint64_t seed = 1;
  double days = 30;
  int places = 4;
  double round_s = 7200;  // between two visits
  int views = 22;         // of a visit, a second apart
  int things = 110;       // in a view
  double replaced = 0.4;
  double light = 1;         // 0: none
  int cars = 2;             // groups of 20 at a time in a view
  double shadows = 0.1;     // share of things that wander
  double season_px = 0;     // that shadows fall further along their way, in 30 days
  double season_hours = 0;  // by which the same light comes earlier, in 30 days
  bool fog = true;
  int trees = 0;      // things in a view
  bool bare = false;  // the right 60 % of each view hold trees and nothing else
};

class ChangingScene {
 public:
  static constexpr double kBegin_utc_s = 1.7e9;
  static constexpr double kDay_s = 86400;
  static constexpr double kFocalLength = 1500;
  static constexpr int kWidth = 1280, kHeight = 720;

  explicit ChangingScene(const ChangingSceneOptions& options)
      : options_(options), random_(options.seed) {
    lens_.focal_length = kFocalLength;
    lens_.radial_distortion = -0.02;
    lens_.centre = Eigen::Vector2d(kWidth, kHeight) / 2;
    for (int place = 0; place < options_.places; ++place) {
      for (int i = 0; i < options_.things; ++i) add_lasting(place);
      for (int i = 0; i < options_.cars; ++i) add_cars(place);
      const int shadows = static_cast<int>(options_.shadows * options_.things);
      for (int i = 0; i < shadows; ++i) add_shadow(place);
      for (int i = 0; i < options_.trees; ++i) add_tree(place);
    }
    std::uniform_real_distribution<double> day(0, options_.days);
    for (int i = 0; options_.fog && i < options_.days / 2; ++i)
      fog_from_s_.push_back(day(random_) * kDay_s);
    for (int i = 0; i <= options_.days; ++i) weather_.push_back(0.5 + part());
  }

  [[nodiscard]] const ChangingSceneOptions& options() const { return options_; }

  // Where it looks at a place, in the visit's view.
  [[nodiscard]] Eigen::Matrix3d base_from_camera(int place, double jitter_pan,
                                                 double jitter_tilt) const {
    Eigen::Matrix3d base_from_rdf;
    base_from_rdf << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    const double pan = kStep * place + jitter_pan;
    return Eigen::AngleAxisd(pan, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
           Eigen::AngleAxisd(jitter_tilt, Eigen::Vector3d::UnitY()).toRotationMatrix() *
           base_from_rdf;
  }

  [[nodiscard]] LensCurve lens() const {
    return LensCurve::of({kFocalLength, 1, {lens_.radial_distortion}, kWidth, kHeight, 0, 0});
  }
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Matrix3d& base_from_camera,
                                                       const Eigen::Vector3d& d) const {
    const auto u = lens_.project(base_from_camera.transpose() * d);
    if (!u || u->x() < 0 || u->x() > kWidth || u->y() < 0 || u->y() > kHeight) return std::nullopt;
    return u;
  }

  // What is found in a picture at t_s from the beginning.
  [[nodiscard]] FeatureSet see(const Eigen::Matrix3d& R, double t_s) {
    FeatureSet out;
    const double found = in_fog(t_s) ? 0.06 : 0.85;
    for (const Thing& thing : things_) {
      if (t_s < thing.from_s || t_s > thing.until_s || !lit(thing, t_s)) continue;
      const auto at = project(R, direction_of(thing, t_s));
      if (!at || part() > found) continue;
      Feature feature;
      feature.scale = thing.scale_px * std::exp(0.03 * normal());
      const double sigma = 0.12 * thing.scale_px / 1.6;
      feature.u = *at + sigma * Eigen::Vector2d(normal(), normal());
      out.features.push_back(feature);
      out.descriptors.push_back(descriptor_of(thing, t_s));
    }
    return out;
  }

  // The map as it was built on the first day: lasting things, each off by own_px, all of a place by common_px.
  [[nodiscard]] SceneMap first_map(double own_px, double common_px) {
    SceneMap map;
    map.lens = lens();
    const double own = own_px / kFocalLength, common = common_px / kFocalLength;
    std::vector<Eigen::Vector3d> turn;
    for (int i = 0; i < options_.places; ++i) {
      turn.emplace_back(common * normal(), common * normal(), common * normal());
    }
    for (const Thing& thing : things_) {
      if (thing.from_s > 0 || thing.wander_px_per_s != 0 || thing.sway_px != 0 || !lit(thing, 0))
        continue;
      SceneLandmark landmark;
      landmark.id = map.next_landmark++;
      const Eigen::Vector3d d = direction_of(thing, 0);
      landmark.d_b = direction_plus<double>(d, own * Vector2<double>(normal(), normal()));
      landmark.d_b = exp_so3(turn[static_cast<std::size_t>(thing.place)]) * landmark.d_b;
      landmark.d_b.normalize();
      landmark.covariance = own * own * Matrix2<double>::Identity();
      landmark.shared_covariance = common * common * Matrix2<double>::Identity();
      landmark.scale_rad = thing.scale_px / kFocalLength;
      landmark.focal_length_px = kFocalLength;
      landmark.descriptor = descriptor_of(thing, 0);
      landmark.life.born_utc_s = landmark.life.last_seen_utc_s = kBegin_utc_s;
      map.landmarks.push_back(landmark);
    }
    return map;
  }

  double part() { return uniform_(random_); }
  double normal() { return normal_(random_); }

 private:
  using Histogram = std::array<float, kDescriptorSize>;
  struct Thing {
    Eigen::Vector3d d;
    int place = 0;
    double scale_px = 2;
    double from_s = -1, until_s = 1e12;
    double lit_from = 0, lit_hours = 24;  // of the day
    double wander_px_per_s = 0;
    double sway_px = 0;
    Eigen::Vector3d wander_to;
    double phase = 0;  // of what light does to its place
    Histogram base{}, cosine{}, sine{};
  };
  static constexpr double kStep = 0.6;  // rad, from place to place

  Thing thing_at(int place, double u, double v) {
    Thing out;
    out.place = place;
    const Eigen::Vector2d slope = lens_.slope(u, v);
    out.d = (base_from_camera(place, 0, 0) * Eigen::Vector3d(slope.x(), slope.y(), 1)).normalized();
    out.scale_px = 1.7 * std::exp(std::abs(0.6 * normal()));
    out.phase = 2 * kPi * part();
    out.wander_to = out.d.cross(Eigen::Vector3d(normal(), normal(), normal())).normalized();
    double square = 0;
    for (std::size_t i = 0; i < out.base.size(); ++i) {
      const double x = std::max(0.0, normal());
      out.base[i] = static_cast<float>(x);
      square += x * x;
      out.cosine[i] = static_cast<float>(0.35 * normal());
      out.sine[i] = static_cast<float>(0.35 * normal());
    }
    for (float& x : out.base) x = static_cast<float>(x / std::sqrt(square / kDescriptorSize));
    return out;
  }
  void add_lasting(int place) {
    Thing thing = thing_at(place, lasting_width() * part(), kHeight * part());
    if (options_.light > 0 && part() < 0.2) {
      thing.lit_from = 24 * part();
      thing.lit_hours = 4 + 6 * part();
    }
    if (part() < options_.replaced) {
      thing.until_s = options_.days * kDay_s * part();
      Thing instead = thing_at(place, lasting_width() * part(), kHeight * part());
      instead.from_s = thing.until_s;
      things_.push_back(instead);
    }
    things_.push_back(thing);
  }
  void add_cars(int place) {
    // One car park, in the left or the right half; one group after the other.
    const double left = part() < 0.5 ? 40 : kWidth / 2.0 + 40;
    for (double t = 3600 * part(); t < options_.days * kDay_s; t += 3600) {
      const double until = t + 3600 * (1 + 8 * part());
      const double u = left + 300 * part(), v = 60 + 400 * part();
      for (int i = 0; i < 20; ++i) {
        Thing thing = thing_at(place, u + 200 * part(), v + 120 * part());
        thing.from_s = t;
        thing.until_s = until;
        things_.push_back(thing);
      }
      t = until;
    }
  }
  [[nodiscard]] double lasting_width() const { return options_.bare ? 0.4 * kWidth : kWidth; }
  void add_tree(int place) {
    Thing thing = thing_at(place, kWidth * (0.5 + 0.5 * part()), kHeight * part());
    thing.sway_px = 4;
    // All to one side.
    thing.wander_to = thing.d.cross(Eigen::Vector3d::UnitZ()).normalized();
    things_.push_back(thing);
  }
  void add_shadow(int place) {
    Thing thing = thing_at(place, kWidth * part(), kHeight * part());
    thing.wander_px_per_s = 0.02 * part();
    things_.push_back(thing);
  }

  [[nodiscard]] double hour(double t_s) const { return std::fmod(t_s / 3600, 24.0); }
  // In units of 30 days.
  [[nodiscard]] static double season(double t_s) { return t_s / (30 * kDay_s); }
  [[nodiscard]] double light_hour(double t_s) const {
    return hour(t_s) + options_.season_hours * season(t_s);
  }
  [[nodiscard]] bool lit(const Thing& thing, double t_s) const {
    return std::fmod(light_hour(t_s) - thing.lit_from + 48, 24.0) <= thing.lit_hours;
  }
  [[nodiscard]] bool in_fog(double t_s) const {
    return std::any_of(fog_from_s_.begin(), fog_from_s_.end(),
                       [&](double from) { return t_s >= from && t_s < from + 5 * 3600; });
  }
  [[nodiscard]] double light_at(double t_s) const {
    const double day = std::clamp(t_s / kDay_s, 0.0, options_.days - 1e-9);
    return options_.light * weather_[static_cast<std::size_t>(day)];
  }
  [[nodiscard]] Eigen::Vector3d direction_of(const Thing& thing, double t_s) const {
    // Light shifts a blob by up to a twentieth of its scale.
    const double seasonal = thing.wander_px_per_s != 0 ? options_.season_px * season(t_s) : 0;
    const double wandered = thing.wander_px_per_s * std::fmod(t_s, kDay_s) + seasonal;
    const double shifted = 0.05 * thing.scale_px * options_.light *
                           std::cos(2 * kPi * light_hour(t_s) / 24 + thing.phase);
    const double swayed = thing.sway_px * std::sin(2 * kPi * t_s / 9000);
    return (thing.d + (wandered + shifted + swayed) / kFocalLength * thing.wander_to).normalized();
  }
  [[nodiscard]] Descriptor descriptor_of(const Thing& thing, double t_s) {
    const double angle = 2 * kPi * light_hour(t_s) / 24, amount = light_at(t_s);
    const auto c = static_cast<float>(amount * std::cos(angle));
    const auto s = static_cast<float>(amount * std::sin(angle));
    std::array<double, kDescriptorSize> x{};
    double square = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] =
          std::max(0.0, thing.base[i] + c * thing.cosine[i] + s * thing.sine[i] + 0.12 * normal());
      square += x[i] * x[i];
    }
    Descriptor out{};
    for (std::size_t i = 0; i < x.size(); ++i) {
      out[i] =
          static_cast<std::uint8_t>(std::min(255.0, std::round(512 * x[i] / std::sqrt(square))));
    }
    return out;
  }

  ChangingSceneOptions options_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::normal_distribution<double> normal_;
  simulator::Lens lens_;
  std::vector<Thing> things_;
  std::vector<double> fog_from_s_, weather_;
};

// Nearest descriptors among what lies near where telemetry has it, each once; the second nearest has to be further.
inline std::vector<UpkeepMatch> match_with_map(const ChangingScene& scene, const FeatureSet& seen,
                                               const SceneMap& map, const Eigen::Matrix3d& told) {
  constexpr double kRadius_px = 12, kRatio = 0.8;
  struct Near {
    std::size_t landmark = 0;
    Eigen::Vector2d u;
  };
  std::vector<Near> near;
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    if (const auto u = scene.project(told, map.landmarks[i].d_b)) near.push_back({i, *u});
  }
  const auto distance = [](const Descriptor& a, const Descriptor& b) {
    int sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const int step = int{a[i]} - int{b[i]};
      sum += step * step;
    }
    return std::sqrt(sum);
  };
  std::map<std::size_t, std::pair<double, int>> best_of;  // by landmark
  for (std::size_t f = 0; f < seen.size(); ++f) {
    double best = 300, second = 300 / kRatio;
    std::size_t landmark = map.landmarks.size();
    for (const Near& n : near) {
      if ((n.u - seen.features[f].u).squaredNorm() > kRadius_px * kRadius_px) continue;
      const double d = distance(seen.descriptors[f], map.landmarks[n.landmark].descriptor);
      if (d < best) {
        second = best;
        best = d;
        landmark = n.landmark;
      } else if (d < second) {
        second = d;
      }
    }
    if (landmark == map.landmarks.size() || best > kRatio * second) continue;
    const auto known = best_of.find(landmark);
    if (known == best_of.end() || best < known->second.first) {
      best_of[landmark] = {best, static_cast<int>(f)};
    }
  }
  std::vector<UpkeepMatch> out;
  for (const auto& [landmark, match] : best_of) {
    out.push_back({match.second, map.landmarks[landmark].id});
  }
  return out;
}

struct SceneDay {
  int views = 0;
  int refused = 0;
  double matches = 0;   // mean of those with a pose
  double error_px = 0;  // root mean square of the image centre's direction
  // The mean error of this day minus that of the first day, of the place where it is largest.
  double drift_px = 0;
  double sigma_px = 0;  // claimed: the pose's covariance with the common part of its landmarks
  int landmarks = 0;    // at the end
  int candidates = 0;   // to become landmarks, the most
  std::int64_t file_bytes = 0;  // at the end, where the map is kept in a file
  int born = 0, died = 0, not_close = 0;
  // Of each view, one after the other: rad, to the right and down in the picture; none: its pose was refused.
  std::vector<std::optional<Eigen::Vector2d>> errors;
};

struct SceneRunOptions {
  bool upkeep = true;
  SceneMapUpkeepOptions options;
  // Stores the map: called first with the whole map and no change, then with each change before it
  // is applied.
  // Returns the size of the store, bytes; none: it could not be stored, and the run ends.
  std::function<std::optional<std::int64_t>(const SceneMap& map, const MapChange& change)> keep;
};

// Lives through all days; one row each.
inline std::vector<SceneDay> live_through(const ChangingSceneOptions& what,
                                          const SceneRunOptions& how) {
  ChangingScene scene(what);
  SceneMap map = scene.first_map(0.1, 0.05);
  SceneMapUpkeep upkeep(how.options);
  PoseKnowledge knowledge;
  knowledge.lens = map.lens;
  knowledge.least_log_f = std::log(1000.0);
  knowledge.most_log_f = std::log(2000.0);
  knowledge.focal_length = {std::log(ChangingScene::kFocalLength), 1e-3};
  const double f = ChangingScene::kFocalLength;
  std::vector<SceneDay> days;
  std::vector<Eigen::Vector2d> first;
  std::optional<std::int64_t> bytes = 0;
  if (how.keep) bytes = how.keep(map, {});
  if (!bytes) return {};
  const auto places = static_cast<std::size_t>(what.places);
  for (int day = 0; day < what.days; ++day) {
    SceneDay row;
    std::vector<Eigen::Vector2d> sum(places, {0, 0});
    std::vector<int> count(places, 0);
    double square = 0;
    for (double t = day * ChangingScene::kDay_s; t < (day + 1) * ChangingScene::kDay_s - 1;
         t += what.round_s) {
      for (int place = 0; place < what.places; ++place) {
        const double pan = 0.03 * scene.normal(), tilt = 0.02 * scene.normal();
        for (int i = 0; i < what.views; ++i) {
          const double now = t + 60 * place + i;
          const Eigen::Matrix3d R = scene.base_from_camera(place, pan, tilt);
          const Eigen::Matrix3d told = scene.base_from_camera(place, pan + 1e-3 * scene.normal(),
                                                              tilt + 1e-3 * scene.normal());
          const FeatureSet seen = scene.see(R, now);
          const std::vector<UpkeepMatch> matches = match_with_map(scene, seen, map, told);
          std::vector<PoseMatch> pose_matches;
          for (const UpkeepMatch& m : matches) {
            const Feature& feature = seen.features[static_cast<std::size_t>(m.feature)];
            const SceneLandmark& l =
                map.landmarks[static_cast<std::size_t>(landmark_index(map, m.landmark))];
            pose_matches.push_back(
                {feature.u, how.options.sigma_of(feature.scale), l.d_b, l.covariance});
          }
          const PicturePose pose = find_pose(pose_matches, knowledge);
          ++row.views;
          if (pose.status != PoseStatus::kOk) {
            ++row.refused;
            row.errors.emplace_back();
            continue;
          }
          row.matches += static_cast<double>(pose.inliers.size());
          const Eigen::Vector3d off = R.transpose() * pose.R_base_from_camera.col(2);
          const Eigen::Vector2d error = f * off.head<2>() / off.z();
          square += error.squaredNorm();
          row.errors.emplace_back(error / f);
          sum[static_cast<std::size_t>(place)] += error;
          ++count[static_cast<std::size_t>(place)];
          UpkeepView view;
          view.time_utc_s = ChangingScene::kBegin_utc_s + now;
          view.R_base_from_camera = pose.R_base_from_camera;
          view.log_f = pose.log_f;
          view.covariance = pose.covariance;
          view.features = &seen;
          double common = 0;
          for (const int inlier : pose.inliers) {
            view.matches.push_back(matches[static_cast<std::size_t>(inlier)]);
            const auto at =
                static_cast<std::size_t>(landmark_index(map, view.matches.back().landmark));
            common += map.landmarks[at].shared_covariance.trace() /
                      static_cast<double>(pose.inliers.size());
          }
          row.sigma_px +=
              f * std::sqrt((pose.covariance(0, 0) + pose.covariance(1, 1) + common) / 2);
          if (!how.upkeep) continue;
          UpkeepCounts counts;
          const MapChange change = upkeep.show(view, map, &counts);
          row.candidates = std::max(row.candidates, upkeep.candidates());
          if (how.keep) bytes = how.keep(map, change);
          if (!bytes) return {};
          std::string error_text;
          if (!apply(change, &map, &error_text)) {
            std::fprintf(stderr, "%s\n", error_text.c_str());
            return {};
          }
          row.born += counts.born;
          row.died += counts.died;
          row.not_close += counts.not_close;
        }
      }
    }
    const int posed = row.views - row.refused;
    if (posed > 0) {
      row.matches /= posed;
      row.sigma_px /= posed;
      row.error_px = std::sqrt(square / posed);
    }
    for (std::size_t i = 0; i < places; ++i) {
      const Eigen::Vector2d mean =
          count[i] > 0 ? Eigen::Vector2d(sum[i] / count[i]) : Eigen::Vector2d(0, 0);
      if (day == 0) first.push_back(mean);
      row.drift_px = std::max(row.drift_px, (mean - first[i]).norm());
    }
    row.landmarks = static_cast<int>(map.landmarks.size());
    row.file_bytes = bytes.value_or(0);
    days.push_back(row);
  }
  return days;
}

}  // namespace alidade::test
