#include "core/mapping/map_making.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/mapping/map_projection.h"
#include "core/model/direction.h"
#include "core/model/linear_algebra.h"

namespace alidade {
namespace {

class MapMaking {
 public:
  MapMaking(const MapMaterial& material, MapBuild* out)
      : material_(material), found_(material.found), tracks_(material.tracks), out_(*out) {}

  void run() {
    SceneMap& map = out_.map;
    map.lens = found_.lens;
    map.line_delay = material_.options.line_delay;
    map.reference_row = material_.options.height / 2.0;
    map.mechanics = material_.options.mechanics;
    const auto errors = errors_px(material_.evidence, found_);
    std::vector<double> squares(material_.pictures.size(), 0);
    std::vector<int> counts(material_.pictures.size(), 0);
    std::vector<std::vector<bool>> taken;
    for (std::size_t i = 0; i < material_.pictures.size(); ++i)
      taken.emplace_back(picture(i).features.size());
    std::size_t at = 0;
    double sum = 0;
    for (std::size_t j = 0; j < tracks_.size(); ++j) {
      std::vector<PictureFeature> seen_as;
      for (const PictureFeature& f : tracks_[j]) {
        const auto& error = errors[at++];
        if (!error) continue;
        const auto by = static_cast<std::size_t>(f.picture);
        seen_as.push_back(f);
        taken[by][static_cast<std::size_t>(f.feature)] = true;
        squares[by] += *error * *error;
        ++counts[by];
        sum += *error * *error;
        ++out_.observations;
      }
      if (seen_as.size() < 2) continue;
      add_landmark(found_.landmarks[j], seen_as);
      ++out_.tracks;
    }
    for (std::size_t i = 0; i < material_.pictures.size(); ++i) {
      const AdjustedPicture& pose = found_.pictures[i];
      for (std::size_t k = 0; k < taken[i].size(); ++k) {
        if (taken[i][k]) continue;
        const PictureFeature f{static_cast<int>(i), static_cast<int>(k)};
        Vector3<double> d;
        if (unproject_to_map(pose.camera, pose.motion, pose.R_base_from_camera, feature(f).u, &d) ==
            ProjectionStatus::kOk) {
          add_landmark(d, {f});
        }
      }
      map.keyframes.push_back(keyframe(i));
      map.keyframes.back().residual_px = counts[i] > 0 ? std::sqrt(squares[i] / counts[i]) : 0;
    }
    out_.residual_px = out_.observations > 0 ? std::sqrt(sum / out_.observations) : 0;
    out_.noise_scale = found_.noise_scale;
    out_.hold_sigma = found_.hold_sigma;
  }

 private:
  [[nodiscard]] const LinkedPicture& picture(std::size_t i) const { return *material_.pictures[i]; }
  [[nodiscard]] const Feature& feature(const PictureFeature& f) const {
    return picture(static_cast<std::size_t>(f.picture))
        .features.features[static_cast<std::size_t>(f.feature)];
  }

  // Covariance that a keyframe's pose gives the direction of a pixel, in tangent_basis(d_b).
  [[nodiscard]] Matrix2<double> pose_part(std::size_t at, const Vector2<double>& u,
                                          const Vector3<double>& d_b) const {
    const AdjustedPicture& pose = found_.pictures[at];
    MapProjection seen;
    CameraColumn<double> J_camera_log;
    (void)found_.lens.camera_of(std::log(pose.camera.focal_length), &J_camera_log);
    if (project_from_map(pose.camera, pose.motion, pose.R_base_from_camera, u.y(), d_b, &seen) !=
        ProjectionStatus::kOk) {
      return Matrix2<double>::Identity();
    }
    const Matrix2<double> J_u_tangent = seen.J_u_d * tangent_basis(d_b);
    Matrix<double, 2, 4> J_u_pose;
    J_u_pose << seen.J_u_xi, seen.J_u_camera * J_camera_log;
    const Matrix<double, 2, 4> J = J_u_tangent.inverse() * J_u_pose;
    return symmetric<2>(J * found_.covariance_of(static_cast<int>(at)) * J.transpose());
  }

  void add_landmark(const Vector3<double>& d_b, const std::vector<PictureFeature>& seen_as) {
    SceneLandmark l;
    l.id = out_.map.next_landmark;
    l.d_b = d_b;
    Matrix2<double> information = Matrix2<double>::Zero();
    Matrix2<double> shared = Matrix2<double>::Identity();
    std::array<double, kDescriptorSize> sum{};
    double log_scale = 0;
    double log_f = 0;
    const double scale_of_noise = std::max(1.0, found_.noise_scale);
    for (const PictureFeature& f : seen_as) {
      const auto at = static_cast<std::size_t>(f.picture);
      const Feature& seen = feature(f);
      const AdjustedPicture& pose = found_.pictures[at];
      MapProjection there;
      if (project_from_map(pose.camera, pose.motion, pose.R_base_from_camera, seen.u.y(), d_b,
                           &there) != ProjectionStatus::kOk) {
        return;
      }
      const Matrix2<double> J = there.J_u_d * tangent_basis(d_b);
      const double sigma = material_.noise.sigma_px(seen.scale) * scale_of_noise;
      information += J.transpose() * J / (sigma * sigma);
      const Matrix2<double> of_pose = pose_part(at, seen.u, d_b);
      if (of_pose.trace() < shared.trace()) shared = of_pose;
      const Descriptor& descriptor =
          picture(at).features.descriptors[static_cast<std::size_t>(f.feature)];
      for (std::size_t n = 0; n < sum.size(); ++n) sum[n] += descriptor[n];
      log_scale += std::log(seen.scale / pose.camera.focal_length);
      log_f += std::log(pose.camera.focal_length);
      l.sightings.push_back({f.picture + 1, seen.u, seen.scale});
    }
    const auto count = static_cast<double>(seen_as.size());
    l.covariance = symmetric<2>(information.inverse());
    l.shared_covariance = shared;
    l.scale_rad = std::exp(log_scale / count);
    l.focal_length_px = std::exp(log_f / count);
    for (std::size_t n = 0; n < sum.size(); ++n) {
      l.descriptor[n] = static_cast<std::uint8_t>(std::lround(sum[n] / count));
    }
    const MapView& last = *material_.views[static_cast<std::size_t>(seen_as.back().picture)];
    const MapView& first = *material_.views[static_cast<std::size_t>(seen_as.front().picture)];
    l.life.born_utc_s = std::min(first.time_utc_s, last.time_utc_s);
    l.life.last_seen_utc_s = std::max(first.time_utc_s, last.time_utc_s);
    l.life.looked_for = static_cast<std::uint32_t>(seen_as.size());
    l.life.matched = l.life.looked_for;
    if (!is_valid(l)) return;
    ++out_.map.next_landmark;
    out_.map.landmarks.push_back(std::move(l));
  }

  [[nodiscard]] SceneKeyframe keyframe(std::size_t i) const {
    const MapView& view = *material_.views[i];
    const AdjustedPicture& pose = found_.pictures[i];
    SceneKeyframe k;
    k.id = static_cast<std::int64_t>(i) + 1;
    k.recording = view.recording;
    k.frame = view.frame;
    k.time_utc_s = view.time_utc_s;
    k.zoom = view.zoom;
    k.position = picture(i).log_f;
    k.telemetry = view.telemetry;
    k.R_base_from_camera = Eigen::Quaterniond(pose.R_base_from_camera).normalized();
    k.eps = pose.eps;
    k.covariance = symmetric(found_.covariance_of(static_cast<int>(i)));
    k.angular_velocity = pose.motion.angular_velocity;
    k.zoom_rate = pose.motion.zoom_rate;
    return k;
  }

  const MapMaterial& material_;
  const MapAdjustment& found_;
  const std::vector<std::vector<PictureFeature>>& tracks_;
  MapBuild& out_;
};

}  // namespace

std::vector<std::optional<double>> errors_px(const MapEvidence& evidence,
                                             const MapAdjustment& found) {
  std::vector<bool> used(evidence.observations.size(), true);
  for (const int i : found.left_out) used[static_cast<std::size_t>(i)] = false;
  std::vector<std::optional<double>> out(used.size());
  for (std::size_t i = 0; i < used.size(); ++i) {
    const MapObservation& seen = evidence.observations[i];
    const auto at = static_cast<std::size_t>(seen.picture);
    MapProjection there;
    if (used[i] && project_from_map(found.pictures[at].camera, found.pictures[at].motion,
                                    found.pictures[at].R_base_from_camera, seen.u.y(),
                                    found.landmarks[static_cast<std::size_t>(seen.landmark)],
                                    &there) == ProjectionStatus::kOk) {
      out[i] = (there.u - seen.u).norm();
    }
  }
  return out;
}

void make_scene_map(const MapMaterial& material, MapBuild* out) { MapMaking(material, out).run(); }

}  // namespace alidade
