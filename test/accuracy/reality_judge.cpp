#include "test/accuracy/reality_judge.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/model/direction.h"
#include "test/simulator/zoom.h"

namespace alidade::test {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kChance = 0.999;
constexpr double kLeastNees = 0.1;
constexpr double kMostNees = 1.5;
constexpr double kMostWorst = 16;
constexpr double kMostSigmaOverError = 3;

Vector3d vector3(const YAML::Node& node) {
  return {node[0].as<double>(), node[1].as<double>(), node[2].as<double>()};
}

FoundCalibration found_in(const YAML::Node& root) {
  FoundCalibration found;
  found.focal_length = root["focal_length"]["value"].as<double>();
  found.aspect = root["aspect"]["value"].as<double>(1);
  found.radial_distortion = root["radial_distortion"]["value"].as<double>();
  found.line_delay = root["line_delay"]["value"].as<double>();
  found.clock_offset = root["clock_offset"]["value"].as<double>();
  found.pan_axis = vector3(root["pan_axis"]["value"]).normalized();
  found.tilt_axis = vector3(root["tilt_axis"]["value"]).normalized();
  if (const YAML::Node centre = root["centre_offset"]) {
    found.centre_offset = {centre["value"][0].as<double>(), centre["value"][1].as<double>()};
    const YAML::Node sigma = centre["sigma"];
    found.centre_estimated = sigma && sigma[0].as<double>() > 0 && sigma[1].as<double>() > 0;
  }
  const YAML::Node covariance = root["covariance"];
  const auto names = covariance["names"].as<std::vector<std::string>>();
  std::array<std::size_t, kJudged.size()> column{};
  for (std::size_t i = 0; i < kJudged.size(); ++i) {
    const auto at = std::find(names.begin(), names.end(), kJudged[i]);
    if (at == names.end()) throw std::runtime_error(std::string("no covariance of ") + kJudged[i]);
    column[i] = static_cast<std::size_t>(at - names.begin());
  }
  for (int i = 0; i < kJudgedCount; ++i) {
    const YAML::Node row = covariance["matrix"][column[static_cast<std::size_t>(i)]];
    for (int j = 0; j < kJudgedCount; ++j) {
      found.covariance(i, j) = row[column[static_cast<std::size_t>(j)]].as<double>();
    }
  }
  return found;
}

// e' C^-1 e, by correlations: the units differ by many orders.
template <int n>
double squared(const Eigen::Matrix<double, n, 1>& error, const Eigen::Matrix<double, n, n>& cov) {
  const Eigen::Matrix<double, n, 1> sigma = cov.diagonal().cwiseSqrt();
  const Eigen::Matrix<double, n, 1> z = error.cwiseQuotient(sigma);
  const Eigen::Matrix<double, n, n> correlation =
      sigma.cwiseInverse().asDiagonal() * cov * sigma.cwiseInverse().asDiagonal();
  return z.dot(correlation.ldlt().solve(z));
}

// Right, down and forward, each in forward-right-down.
Matrix3d base_from_camera_at_zero() {
  Matrix3d R;
  R << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return R;
}

}  // namespace

FoundCalibration read_found_calibration(const std::filesystem::path& file) {
  try {
    return found_in(YAML::LoadFile(file.string()));
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

std::optional<FoundOrientation> read_found_orientation(const std::string& line) {
  const nlohmann::json record = nlohmann::json::parse(line);
  if (record.at("mode") == "none") return std::nullopt;
  FoundOrientation found;
  found.frame = record.at("frame").get<int>();
  found.oe = record.at("mode") == "OE";
  const auto q = record.at("q_base_from_camera").get<std::array<double, 4>>();
  found.R_base_from_camera = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
  const auto covariance = record.at("orientation_covariance_rad2").get<std::array<double, 9>>();
  found.covariance = Eigen::Map<const Matrix3d>(covariance.data());  // it is symmetric
  return found;
}

double FrameError::normalised_square() const { return squared<2>(px, covariance) / 2; }
double FrameError::sigma_px() const { return std::sqrt(covariance.trace()); }

RealityTruth::RealityTruth(const simulator::Config& config)
    : config_(config),
      path_(simulator::make_path(config)),
      camera_(config.camera, config.image, *path_, simulator::make_zoom(config)) {}

RealityTruth::Gauge RealityTruth::gauge_of(const FoundCalibration& found) const {
  if (found.centre_estimated) return {Matrix3d::Identity(), Matrix3d::Identity()};
  const Vector2d centre =
      Vector2d(config_.image.width, config_.image.height) / 2 + found.centre_offset;
  const Vector3d axis = camera_.slope(centre.x(), centre.y()).homogeneous().normalized();
  // Turns the truth's camera frame so that its z becomes that axis.
  const Matrix3d R_found_from_camera =
      Eigen::Quaterniond::FromTwoVectors(axis, Vector3d::UnitZ()).toRotationMatrix();
  const Matrix3d P = base_from_camera_at_zero();
  return {P * R_found_from_camera * P.transpose(), R_found_from_camera};
}

JudgedVector RealityTruth::calibration_error(const FoundCalibration& found) const {
  const Gauge gauge = gauge_of(found);
  const simulator::CameraConfig& camera = config_.camera;
  double focal_length = 0;
  const int frames = static_cast<int>(std::lround(config_.duration * config_.image.rate_hz));
  for (int i = 0; i < frames; ++i) {
    focal_length += camera_.lens_at(i / config_.image.rate_hz).focal_length / frames;
  }
  const auto axis = [&](const Vector3d& truth, const Vector3d& estimate) {
    return direction_minus<double>(gauge.base * truth, estimate);
  };
  JudgedVector error;
  error << focal_length - found.focal_length, camera.radial_distortion - found.radial_distortion,
      camera.line_delay - found.line_delay, axis(camera_.pan_axis(), found.pan_axis),
      axis(camera_.tilt_axis(), found.tilt_axis), camera.clock_offset - found.clock_offset;
  return error;
}

FrameError RealityTruth::frame_error(const FoundCalibration& found,
                                     const FoundOrientation& orientation) const {
  const Gauge gauge = gauge_of(found);
  const double time = orientation.frame / config_.image.rate_hz;
  const Vector2d middle(config_.image.width / 2.0, config_.image.height / 2.0);
  const Vector3d true_ray =
      camera_.slope_at(middle.x(), middle.y(), time).homogeneous().normalized();
  const Vector3d truth = gauge.base * (camera_.world_from_camera_at(time) * true_ray);
  // The estimate's lens at the picture's middle: distortion moves the ray by less than a part in a
  // million.
  const Vector2d slope(-found.centre_offset.x() / found.focal_length,
                       -found.centre_offset.y() / (found.focal_length * found.aspect));
  const Matrix3d& R = orientation.R_base_from_camera;
  const Vector3d seen = R.transpose() * truth;
  const double f = focal_length();
  FrameError error;
  error.frame = orientation.frame;
  error.oe = orientation.oe;
  error.px = f * (seen.head<2>() / seen.z() - slope);
  // A rotation w about the camera's axes moves what lies ahead by (w_y, -w_x).
  Eigen::Matrix<double, 2, 3> ahead;
  ahead << 0, f, 0, -f, 0, 0;
  error.covariance = ahead * orientation.covariance * ahead.transpose();
  error.J_rotation = ahead * R.transpose();
  return error;
}

std::vector<FrameError> without_common_rotation(std::vector<FrameError> errors) {
  Matrix3d information = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const FrameError& error : errors) {
    information += error.J_rotation.transpose() * error.J_rotation;
    right += error.J_rotation.transpose() * error.px;
  }
  const Vector3d rotation = information.completeOrthogonalDecomposition().solve(right);
  for (FrameError& error : errors) error.px -= error.J_rotation * rotation;
  return errors;
}

CalibrationStatistics calibration_statistics(const std::vector<SeedResult>& seeds) {
  CalibrationStatistics statistics;
  double sum = 0;
  for (const SeedResult& seed : seeds) {
    if (!seed.error) continue;
    ++statistics.seeds;
    sum += squared<kJudgedCount>(*seed.error, seed.covariance);
    for (int i = 0; i < kJudgedCount; ++i) {
      const double sigmas = std::abs((*seed.error)[i]) / std::sqrt(seed.covariance(i, i));
      statistics.beyond += sigmas > kBeyondSigmas ? 1 : 0;
      if (sigmas <= statistics.worst_sigmas) continue;
      statistics.worst_sigmas = sigmas;
      statistics.worst = kJudged[static_cast<std::size_t>(i)];
    }
  }
  if (statistics.seeds == 0) return statistics;
  const int values = kJudgedCount * statistics.seeds;
  statistics.anees = sum / values;
  statistics.chance = mean_square_interval(values, kChance);
  return statistics;
}

ReplayStatistics replay_statistics(const std::vector<SeedResult>& seeds) {
  ReplayStatistics statistics;
  std::vector<double> squares;
  std::vector<double> pt_squares;
  std::vector<double> lengths;
  std::vector<double> relative_lengths;
  std::vector<double> sigmas;
  for (const SeedResult& seed : seeds) {
    statistics.frames += seed.frames;
    statistics.answered += static_cast<int>(seed.frame_errors.size());
    std::vector<FrameError> oe;
    for (const FrameError& error : seed.frame_errors) {
      const double square = error.normalised_square();
      statistics.worst = std::max(statistics.worst, square);
      (error.oe ? squares : pt_squares).push_back(square);
      if (error.oe) oe.push_back(error);
    }
    for (const FrameError& error : oe) {
      lengths.push_back(error.px.norm());
      sigmas.push_back(error.sigma_px());
    }
    for (const FrameError& error : without_common_rotation(oe)) {
      relative_lengths.push_back(error.px.norm());
    }
  }
  statistics.oe = static_cast<int>(squares.size());
  statistics.nees = mean(squares);
  statistics.pt_nees = mean(pt_squares);
  statistics.rms_px = root_mean_square(lengths);
  statistics.relative_px = root_mean_square(relative_lengths);
  if (statistics.rms_px > 0) statistics.sigma_over_error = median(sigmas) / statistics.rms_px;
  return statistics;
}

std::vector<std::string> missed_marks(const CalibrationStatistics& calibration,
                                      const ReplayStatistics& replay,
                                      std::optional<double> most_relative) {
  std::vector<std::string> missed;
  if (calibration.seeds > 0 && !calibration.chance.contains(calibration.anees)) {
    missed.push_back(fmt::format("calibration: {:.3g}, not in {:.2f} to {:.2f}", calibration.anees,
                                 calibration.chance.low, calibration.chance.high));
  }
  if (replay.answered > 0 && replay.worst > kMostWorst) {
    missed.push_back(fmt::format("worst frame: {:.3g}, above {:g}", replay.worst, kMostWorst));
  }
  if (replay.oe == 0) return missed;
  if (replay.nees < kLeastNees || replay.nees > kMostNees) {
    missed.push_back(
        fmt::format("OE: {:.3g}, not in {:g} to {:g}", replay.nees, kLeastNees, kMostNees));
  }
  if (replay.sigma_over_error > kMostSigmaOverError) {
    missed.push_back(fmt::format("OE sigma / error: {:.3g}, above {:g}", replay.sigma_over_error,
                                 kMostSigmaOverError));
  }
  if (most_relative && replay.relative_px > *most_relative) {
    missed.push_back(
        fmt::format("OE relative: {:.3g} px, above {:g}", replay.relative_px, *most_relative));
  }
  return missed;
}

namespace {

bool near(double a, double b) { return std::abs(a - b) <= 1e-6 * std::abs(b); }

// Errors that are a root of the covariance times ones of either sign: e' C^-1 e / n is 1.
SeedResult seed_at_one_sigma() {
  SeedResult seed;
  JudgedVector sigma;
  sigma << 0.7, 1e-2, 1e-8, 3e-5, 1e-5, 4e-5, 2e-5, 3e-5;
  JudgedMatrix root = JudgedMatrix::Identity();
  root(1, 0) = -0.9;
  root(7, 2) = 0.5;
  const JudgedMatrix scaled = sigma.asDiagonal() * root;
  JudgedVector z = JudgedVector::Ones();
  z[3] = -1;
  seed.error = scaled * z;
  seed.covariance = scaled * scaled.transpose();
  return seed;
}

}  // namespace

std::string yardsticks_fault() {
  SeedResult seed = seed_at_one_sigma();
  if (!near(calibration_statistics({seed}).anees, 1)) return "a calibration's error is misjudged";
  seed.covariance /= 4;
  if (!near(calibration_statistics({seed}).anees, 4)) return "sigmas of half the size are not seen";

  // A camera that looks elsewhere by a known angle, the same in each frame.
  constexpr double kFocalLength = 10670;
  simulator::Config config;
  config.duration = 4;
  config.image = {640, 360, 25};
  config.camera.focal_length = kFocalLength;
  const RealityTruth truth(config);
  FoundCalibration found;
  found.focal_length = kFocalLength;
  const Vector3d angle(3e-5, -4e-5, 0);  // 5e-5 rad
  const auto path = simulator::make_path(config);
  const simulator::CameraModel camera(config.camera, config.image, *path);
  SeedResult off;
  for (off.frames = 0; off.frames < 100; ++off.frames) {
    FoundOrientation orientation;
    orientation.frame = off.frames;
    orientation.oe = true;
    const Matrix3d base = Eigen::AngleAxisd(angle.norm(), angle.normalized()).toRotationMatrix();
    const Matrix3d true_orientation = camera.base_from_camera_at(off.frames / config.image.rate_hz);
    // The camera's axes at zero are the base's: right is y, down is z.
    orientation.R_base_from_camera = base_from_camera_at_zero() * base *
                                     base_from_camera_at_zero().transpose() * true_orientation;
    orientation.covariance = Matrix3d::Identity() * angle.squaredNorm() / 2;
    off.frame_errors.push_back(truth.frame_error(found, orientation));
  }
  const ReplayStatistics replay = replay_statistics({off});
  const double px = kFocalLength * angle.norm();
  // Off the axis by up to 0.1 rad, a rotation about it turns a direction by less.
  if (std::abs(replay.rms_px / px - 1) > 0.01 || std::abs(replay.nees - 1) > 0.02) {
    return "a known error of directions is misjudged";
  }
  if (!(replay.relative_px < 1e-4 * px)) return "a common rotation is not taken out";
  return {};
}

}  // namespace alidade::test
