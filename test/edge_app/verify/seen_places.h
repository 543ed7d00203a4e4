#pragma once
// Frames and places as a camera with known errors would have them, without pictures: for tests of
// the statistics. Errors are drawn from the covariances that the frames and the calibration claim.

#include <Eigen/Cholesky>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "core/realtime/frame_orientation.h"
#include "edge_app/verify/place_pairs.h"

namespace alidade::test {

struct SeenPlaces {
  Calibration calibration;  // the one that is verified
  std::vector<SeenFrame> frames;
  std::vector<PlacePair> pairs;
};

struct PlaceErrors {
  Eigen::Matrix<double, kParameterCount, 1> parameters =
      Eigen::Matrix<double, kParameterCount,
                    1>::Zero();  // truth minus calibration, and what is drawn
  double pan_gear_rad = 0;     // telemetry minus truth: times the sine of 3 periods over the range
  double tilt_play_rad = 0;    // b of an encoder on the motor
  double time_jitter_s = 0;    // RMS, of the telemetry's time at each frame
  double angle_noise_rad = 0;  // RMS, of each angle, beyond what is claimed
  double shared_px = 0;  // RMS of an error that all places of a pair share, of each coordinate
  double centre_error_px = 0;      // what the calibration claims, of each coordinate
  bool is_wide = false;            // a field of view of 65 degrees
  double rate_sigma_rad_s = 1e-3;  // claimed, and drawn
  double growth = 1;               // of the frames' errors against their covariance
  // Each other frame is taken at 1.2 times f, whose calibration has errors of its own, larger ones.
  bool two_zooms = false;
};

inline Calibration verified_calibration() {
  Calibration out;
  out.camera.focal_length = 4000;
  out.camera.width = 640;
  out.camera.height = 360;
  out.camera.distortion.only_term() = 5;
  out.line_delay = 4e-5;
  const auto sigma = [&out](Parameter parameter, double value) {
    out.covariance(index(parameter), index(parameter)) = value * value;
  };
  sigma(Parameter::kFocalLength, 0.4);
  sigma(Parameter::kRadialDistortion, 0.05);
  sigma(Parameter::kLineDelay, 5e-8);
  for (const Parameter axis :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1})
    sigma(axis, 1e-4);
  sigma(Parameter::kClockOffset, 1e-4);
  return out;
}

inline Calibration wide_calibration() {
  Calibration out = verified_calibration();
  out.camera.focal_length = 500;
  out.camera.distortion.only_term() = -0.05;
  out.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)) = 0.05 * 0.05;
  return out;
}

inline Calibration moved(const Calibration& from,
                         const Eigen::Matrix<double, kParameterCount, 1>& by) {
  Calibration out = from;
  out.camera.focal_length += by[index(Parameter::kFocalLength)];
  out.camera.distortion.only_term() += by[index(Parameter::kRadialDistortion)];
  out.camera.centre_u += by[index(Parameter::kCentreU)];
  out.camera.centre_v += by[index(Parameter::kCentreV)];
  out.line_delay += by[index(Parameter::kLineDelay)];
  out.mechanics.pan_axis = direction_plus(
      out.mechanics.pan_axis, {by[index(Parameter::kPanAxis0)], by[index(Parameter::kPanAxis1)]});
  out.mechanics.tilt_axis =
      direction_plus(out.mechanics.tilt_axis,
                     {by[index(Parameter::kTiltAxis0)], by[index(Parameter::kTiltAxis1)]});
  return out;
}

inline SeenPlaces see_places(std::uint64_t seed, const PlaceErrors& errors) {
  constexpr int kFrames = 48;
  constexpr int kPlaces = 8;
  constexpr double kPicture_px = 0.05;
  constexpr double kAngle_rad = 3e-5;
  constexpr double kReach_rad = 0.1;
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  SeenPlaces out;
  out.calibration = errors.is_wide ? wide_calibration() : verified_calibration();
  out.calibration.centre_error.diagonal().setConstant(errors.centre_error_px *
                                                      errors.centre_error_px);
  const auto draw_errors = [&](const Calibration& calibration) {
    Eigen::Matrix<double, kParameterCount, 1> off = errors.parameters;
    for (int i = 0; i < kParameterCount; ++i)
      off[i] += std::sqrt(calibration.covariance(i, i)) * normal(generator);
    return off;
  };
  std::vector<Calibration> calibrations = {out.calibration};
  std::vector<Eigen::Matrix<double, kParameterCount, 1>> offs = {draw_errors(out.calibration)};
  if (errors.two_zooms) {
    Calibration other = out.calibration;
    other.camera.focal_length *= 1.2;
    other.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)) = 16 * 16;
    calibrations.push_back(other);
    offs.push_back(draw_errors(other));
  }

  std::vector<FrameOrientation> true_frames;
  for (int i = 0; i < kFrames; ++i) {
    const double t = i * 0.25;
    const std::size_t zoom = static_cast<std::size_t>(i) % calibrations.size();
    FrameOrientation is;
    is.mode = OrientationMode::kPt;
    is.calibration = moved(calibrations[zoom], offs[zoom]);
    is.angle = {kReach_rad * std::sin(1.1 * t), 0.6 * kReach_rad * std::sin(1.7 * t + 1)};
    is.rate = {1.1 * kReach_rad * std::cos(1.1 * t), 1.02 * kReach_rad * std::cos(1.7 * t + 1)};
    true_frames.push_back(is);

    SeenFrame frame;
    frame.time_s = t;
    frame.heading = {is.rate.pan > 0 ? 1.0 : -1.0, is.rate.tilt > 0 ? 1.0 : -1.0};
    FrameOrientation& seen = frame.by_all_samples;
    seen = is;
    seen.calibration = calibrations[zoom];
    seen.motion_covariance.diagonal().head<2>().setConstant(kAngle_rad * kAngle_rad);
    seen.motion_covariance.diagonal().segment<2>(2).setConstant(errors.rate_sigma_rad_s *
                                                                errors.rate_sigma_rad_s);
    seen.motion_sensitivity = telemetry_sensitivity(seen.calibration.mechanics, is.motion());
    const Eigen::Matrix<double, 6, 1> by_parameters = seen.motion_sensitivity * offs[zoom];
    seen.angle.pan -= by_parameters[0] + errors.growth * kAngle_rad * normal(generator);
    seen.angle.tilt -= by_parameters[1] + errors.growth * kAngle_rad * normal(generator);
    seen.rate.pan -= by_parameters[2] + errors.growth * errors.rate_sigma_rad_s * normal(generator);
    seen.rate.tilt -=
        by_parameters[3] + errors.growth * errors.rate_sigma_rad_s * normal(generator);
    seen.angle.pan += errors.pan_gear_rad * std::sin(3 * kPi * is.angle.pan / kReach_rad);
    seen.angle.tilt += errors.tilt_play_rad / 2 * frame.heading.tilt;
    if (errors.time_jitter_s > 0) {
      const double late = errors.time_jitter_s * normal(generator);
      seen.angle.pan += late * is.rate.pan;
      seen.angle.tilt += late * is.rate.tilt;
    }
    if (errors.angle_noise_rad > 0) {
      seen.angle.pan += errors.angle_noise_rad * normal(generator);
      seen.angle.tilt += errors.angle_noise_rad * normal(generator);
    }
    frame.by_telemetry = seen;
    out.frames.push_back(frame);
  }
  std::uniform_real_distribution<double> u(20, 620);
  std::uniform_real_distribution<double> v(20, 340);
  for (std::size_t i = 0; i < true_frames.size(); ++i) {
    int partners = 0;
    for (std::size_t j = i + 4; j < true_frames.size() && partners < 4; j += 3) {
      PlacePair pair{i, j, {}};
      Vector2<double> shared = Vector2<double>::Zero();
      if (errors.shared_px > 0)
        shared = errors.shared_px * Vector2<double>(normal(generator), normal(generator));
      for (int attempt = 0; attempt < 4 * kPlaces; ++attempt) {
        PlaceMatch place;
        place.first = {u(generator), v(generator)};
        place.covariance = Matrix2<double>::Identity() * kPicture_px * kPicture_px;
        Vector3<double> d;
        if (true_frames[i].direction(place.first, &d) != ProjectionStatus::kOk) continue;
        if (true_frames[j].pixel(d, &place.second) != ProjectionStatus::kOk) continue;
        if (place.second.x() < 0 || place.second.x() > 640 || place.second.y() < 0 ||
            place.second.y() > 360) {
          continue;
        }
        place.second += shared;
        place.second += kPicture_px * Vector2<double>(normal(generator), normal(generator));
        if (pair.places.size() < kPlaces) pair.places.push_back(place);
      }
      if (pair.places.size() < kPlaces) continue;
      out.pairs.push_back(pair);
      ++partners;
    }
  }
  return out;
}

}  // namespace alidade::test
