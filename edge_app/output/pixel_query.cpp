#include "edge_app/output/pixel_query.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/model/direction.h"
#include "edge_app/output/json_query.h"
#include "edge_app/output/plane_json.h"
#include "edge_app/record/frame_geometry.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kDeepest = 3;  // {"pixels": [[u, v]]}
constexpr double kLargestSigma_px = 1e3;
constexpr double kLargestDistance_m = 1e9;

// An array of 1 to kMaxQueryItems arrays of n finite numbers.
template <int n>
bool parse_vectors(const Json& object, const char* key,
                   std::vector<Eigen::Matrix<double, n, 1>>* out, std::string* error) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array() || found->empty() ||
      found->size() > kMaxQueryItems) {
    *error = fmt::format("{} must be an array of 1 to {} items", key, kMaxQueryItems);
    return false;
  }
  for (const Json& item : *found) {
    Eigen::Matrix<double, n, 1> vector;
    bool good = item.is_array() && item.size() == static_cast<std::size_t>(n);
    for (int i = 0; good && i < n; ++i) {
      const Json& number = item[static_cast<std::size_t>(i)];
      good = number.is_number() && std::isfinite(number.get<double>());
      if (good) vector[i] = number.get<double>();
    }
    if (!good) {
      *error = fmt::format("{}: each item must be an array of {} numbers; item {} is not", key, n,
                           out->size());
      return false;
    }
    out->push_back(vector);
  }
  return true;
}

Json as_json(const Matrix2<double>& m) {
  // Rounding may make the two halves differ in the last bit.
  const double off_diagonal = (m(0, 1) + m(1, 0)) / 2;
  return {{m(0, 0), off_diagonal}, {off_diagonal, m(1, 1)}};
}

Json as_json(const Vector2<double>& v) { return {v.x(), v.y()}; }
Json as_json(const Vector3<double>& v) { return {v.x(), v.y(), v.z()}; }

Json head(const OrientationRecord& record) {
  return {{"frame", *record.frame},
          {"time_s", *record.time_s},
          {"mode", to_string(record.mode)},
          {"calibrated", record.calibrated}};
}

Matrix2<double> pixel_noise(const FrameOrientation& frame, const Vector2<double>& u,
                            const Vector3<double>& d_b, double sigma_px) {
  Vector3<double> again;
  Matrix<double, 3, 2> J_d_u;
  if (rolling_shutter_unproject(frame.calibration.camera, frame.calibration.mechanics,
                                frame.calibration.line_delay, frame.motion(), u, &again,
                                &J_d_u) != ProjectionStatus::kOk)
    return Matrix2<double>::Zero();
  const Matrix2<double> J = sigma_px * tangent_basis(d_b).transpose() * J_d_u;
  return J * J.transpose();
}

// *d_b: from seen by the pupil to seen from the axes; what that leaves open is added to *cov. False
// if the thing is nearer than the pupil.
bool correct_for_distance(const FrameOrientation& frame, const Vector2<double>& u,
                          const Pupil& pupil, double scene_nearness, double distance_m,
                          Vector3<double>* d_b, Matrix2<double>* cov) {
  const Mechanics<double>& mechanics = frame.calibration.mechanics;
  const Matrix3<double> R = R_base_from_camera(
      mechanics, angle_at_row(frame.motion(), frame.calibration.line_delay, u.y()));
  const Vector3<double> before = *d_b;
  Matrix2<double> of_pupil;
  const Vector3<double> seen = seen_by_pupil(R, before, scene_nearness);
  if (!direction_from_axes(pupil, R, seen, distance_m, 0, d_b, &of_pupil)) return false;
  const Matrix2<double> turn = tangent_basis(*d_b).transpose() * tangent_basis(before);
  *cov = turn * *cov * turn.transpose() + of_pupil;
  return true;
}

bool is_inside(const Camera<double>& camera, const Vector2<double>& u) {
  return u.x() >= 0 && u.x() <= camera.width && u.y() >= 0 && u.y() <= camera.height;
}

}  // namespace

bool parse_direction_query(const std::string& body, DirectionQuery* query, std::string* error) {
  Json object;
  if (!parse_json_object(body, kDeepest,
                         {"distance_m", "frame", "pixel_sigma_px", "pixels", "time_s"}, &object,
                         error) ||
      !parse_frame_choice(object, &query->which, error) ||
      !parse_vectors<2>(object, "pixels", &query->pixels, error))
    return false;
  const auto distance = object.find("distance_m");
  if (distance != object.end()) {
    if (!distance->is_number() || !(distance->get<double>() >= kNearestScene_m) ||
        !(distance->get<double>() <= kLargestDistance_m)) {
      *error = fmt::format("distance_m must be a number from {} to {}, from where the axes meet",
                           kNearestScene_m, kLargestDistance_m);
      return false;
    }
    query->distance_m = distance->get<double>();
  }
  const auto sigma = object.find("pixel_sigma_px");
  if (sigma == object.end()) return true;
  const bool good =
      sigma->is_number() && sigma->get<double>() >= 0 && sigma->get<double>() <= kLargestSigma_px;
  if (!good) {
    *error = fmt::format("pixel_sigma_px must be a number from 0 to {}", kLargestSigma_px);
    return false;
  }
  query->pixel_sigma_px = sigma->get<double>();
  return true;
}

bool parse_pixel_query(const std::string& body, PixelQuery* query, std::string* error) {
  Json object;
  if (!parse_json_object(body, kDeepest, {"directions", "frame", "time_s"}, &object, error) ||
      !parse_frame_choice(object, &query->which, error) ||
      !parse_vectors<3>(object, "directions", &query->directions, error))
    return false;
  for (Vector3<double>& direction : query->directions) {
    // Scale first: the square of a finite number may not be finite.
    const double largest = direction.cwiseAbs().maxCoeff();
    if (!(largest > std::numeric_limits<double>::min())) {
      *error = "directions: a direction must not be zero";
      return false;
    }
    direction = (direction / largest).normalized();
  }
  return true;
}

std::string direction_answer(const OrientationRecord& record, const DirectionQuery& query,
                             const PlaneEstimate* plane, const Pupil& pupil,
                             double scene_nearness) {
  const FrameOrientation frame = unpack(record.orientation->geometry, record.camera);
  Json directions = Json::array();
  for (const Vector2<double>& u : query.pixels) {
    Json item{{"pixel", as_json(u)}};
    Vector3<double> d_b;
    Matrix2<double> cov;
    const ProjectionStatus status = is_inside(frame.calibration.camera, u)
                                        ? frame.direction(u, &d_b, &cov)
                                        : ProjectionStatus::kOk;
    if (!is_inside(frame.calibration.camera, u)) {
      item["error"] = "outside the image";
    } else if (status != ProjectionStatus::kOk) {
      item["error"] = to_string(status);
    } else {
      if (query.pixel_sigma_px > 0) cov += pixel_noise(frame, u, d_b, query.pixel_sigma_px);
      if (query.distance_m &&
          !correct_for_distance(frame, u, pupil, scene_nearness, *query.distance_m, &d_b, &cov)) {
        item["error"] = "nearer than the pupil";
        directions.push_back(std::move(item));
        continue;
      }
      const Matrix<double, 3, 2> basis = tangent_basis(d_b);
      const double largest = Eigen::SelfAdjointEigenSolver<Matrix2<double>>()
                                 .computeDirect(cov, Eigen::EigenvaluesOnly)
                                 .eigenvalues()[1];
      item["time_s"] = *record.time_s + u.y() * record.camera.line_delay;
      item["direction"] = as_json(d_b);
      item["azimuth_rad"] = std::atan2(d_b.y(), d_b.x());
      item["elevation_rad"] = std::atan2(-d_b.z(), std::hypot(d_b.x(), d_b.y()));
      item["covariance"] = as_json(cov);
      item["basis"] = {as_json(Vector3<double>(basis.col(0))),
                       as_json(Vector3<double>(basis.col(1)))};
      item["sigma_rad"] = std::sqrt(std::max(largest, 0.0));
      if (plane != nullptr) item["plane"] = plane_point_json(*plane, d_b, cov);
    }
    directions.push_back(std::move(item));
  }
  Json out = head(record);
  out["directions"] = std::move(directions);
  return out.dump() + "\n";
}

std::string pixel_answer(const OrientationRecord& record, const PixelQuery& query) {
  const FrameOrientation frame = unpack(record.orientation->geometry, record.camera);
  Json pixels = Json::array();
  for (const Vector3<double>& d_b : query.directions) {
    Json item{{"direction", as_json(d_b)}};
    Vector2<double> u;
    Matrix2<double> cov;
    const ProjectionStatus status = frame.pixel(d_b, &u, &cov);
    if (status != ProjectionStatus::kOk) {
      item["error"] = to_string(status);
    } else {
      item["pixel"] = as_json(u);
      item["inside"] = is_inside(frame.calibration.camera, u);
      item["time_s"] = *record.time_s + u.y() * record.camera.line_delay;
      item["covariance_px2"] = as_json(cov);
    }
    pixels.push_back(std::move(item));
  }
  Json out = head(record);
  out["pixels"] = std::move(pixels);
  return out.dump() + "\n";
}

}  // namespace alidade
