#include "edge_app/self_calibration/keyframe_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "core/realtime/oe_mode/oe_mode.h"
#include "edge_app/step/orientation_step.h"

namespace alidade {
namespace {

// Errors of the trajectory at a keyframe, where the adjustment has too few knots for the motion.
constexpr double kSigma_px = 0.2;
constexpr double kRatePerAngle = 20;  // 1/s
constexpr double kAccelerationSigmaPxPerS2 = 80;

// The number of samples over which an error lasts: 1 + 2 sum of the autocorrelations, up to where
// pairs of them are no longer positive (Geyer). Beyond that there is only noise to add up.
double samples_worth_one(const std::vector<double>& errors) {
  const std::size_t count = errors.size();
  double mean = 0;
  for (const double error : errors) mean += error / static_cast<double>(count);
  const auto covariance = [&](std::size_t lag) {
    double sum = 0;
    for (std::size_t i = lag; i < count; ++i) sum += (errors[i] - mean) * (errors[i - lag] - mean);
    return sum / static_cast<double>(count);
  };
  const double variance = covariance(0);
  if (!(variance > 0)) return 1;
  double sum = 0;
  for (std::size_t lag = 1; lag + 1 < count; lag += 2) {
    const double pair = covariance(lag) + covariance(lag + 1);
    if (pair <= 0) break;
    sum += pair;
  }
  return 1 + 2 * sum / variance;
}

// False: the map was full.
bool see_all(const std::vector<Keyframe>& keyframes, const CalibrationResult& result,
             OeMode* mode) {
  const Camera<double>& camera = result.calibration.camera;
  const double to_middle_s = result.calibration.line_delay * camera.height / 2;
  bool has_room = true;
  std::vector<std::uint8_t> pixels;
  for (const Keyframe& keyframe : keyframes) {
    InterpolatedPanTilt prediction = predict(result, keyframe.time_s + to_middle_s, kSigma_px);
    prediction.acceleration_sigma = kAccelerationSigmaPxPerS2 / camera.focal_length;
    FrameOrientation orientation;
    const ImageView image =
        keyframe.image == nullptr ? ImageView{} : keyframe.image->unpack(&pixels);
    // Whatever the status: maintain() handles every kind of frame.
    static_cast<void>(mode->process(image, keyframe.time_s, &prediction, &orientation));
    mode->maintain();
    has_room = has_room && mode->map().size() < mode->map().capacity();
  }
  return has_room;
}

// A landmark takes 1.5 KB, so there is room first only for as many as keyframes usually show. If
// that fills up, all is done once more with the full room. The result is the same as long as some
// room is left.
MapState map_of_all(const std::vector<Keyframe>& keyframes, const CalibrationResult& result) {
  constexpr std::size_t kUsual = 240;  // of a keyframe
  OeOptions options = oe_options(result.calibration.camera);
  const int most = options.max_landmarks;
  options.maker.max_new = most;  // each view occurs only once
  const std::size_t usual = kUsual * std::max<std::size_t>(keyframes.size(), 1);
  options.max_landmarks = static_cast<int>(std::min(usual, static_cast<std::size_t>(most)));
  for (;; options.max_landmarks = most) {
    const std::unique_ptr<OeMode> mode = make_oe_mode(options);
    mode->reset(result.calibration);
    if (see_all(keyframes, result, mode.get()) || options.max_landmarks == most)
      return mode->map_state();
  }
}

}  // namespace

InterpolatedPanTilt predict(const CalibrationResult& result, double time_s, double sigma_px) {
  constexpr double kHalfSpan_s = 0.02;        // for the acceleration
  constexpr double kCorrelationTime_s = 0.5;  // about a segment of the trajectory
  const TrajectorySpline& trajectory = result.trajectory;
  const Mechanics<double>& mechanics = result.calibration.mechanics;
  const Vector2<double> scale(mechanics.pan_scale, mechanics.tilt_scale);
  const PanTilt<double> angle = trajectory.position(time_s);
  const PanTilt<double> rate = trajectory.rate(time_s);
  const PanTilt<double> before = trajectory.rate(time_s - kHalfSpan_s);
  const PanTilt<double> after = trajectory.rate(time_s + kHalfSpan_s);
  InterpolatedPanTilt out;
  out.angle = {wrap_angle(scale.x() * angle.pan), wrap_angle(scale.y() * angle.tilt)};
  out.rate = {scale.x() * rate.pan, scale.y() * rate.tilt};
  const double of_angle = sigma_px / result.calibration.camera.focal_length;
  const double of_rate = kRatePerAngle * of_angle;
  out.covariance.diagonal() << of_angle * of_angle, of_angle * of_angle, of_rate * of_rate,
      of_rate * of_rate;
  out.acceleration = {scale.x() * (after.pan - before.pan) / (2 * kHalfSpan_s),
                      scale.y() * (after.tilt - before.tilt) / (2 * kHalfSpan_s)};
  out.acceleration_square = out.acceleration.vector().cwiseAbs2().array() +
                            of_rate * of_rate / (kCorrelationTime_s * kCorrelationTime_s);
  out.samples = kInterpolationWindow;
  out.correlation_time_s = kCorrelationTime_s;
  return out;
}

Matrix2<double> tie_covariance(const CalibrationResult& result) {
  constexpr double kSafety = 2;
  Matrix2<double> covariance = Matrix2<double>::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> standardised;
    double information = 0;
    double square = 0;
    int count = 0;
    for (const TelemetryResidual& residual : result.telemetry_residuals) {
      const double error = residual.error_rad[axis];
      const double sigma = residual.sigma_rad[axis];
      if (residual.outlier || !std::isfinite(error)) continue;
      square += error * error;
      ++count;
      if (!std::isfinite(sigma) || !(sigma > 0)) continue;
      standardised.push_back(error / sigma);
      information += 1 / (sigma * sigma);
    }
    // If the errors are only rounding, all may be the same error.
    double variance = square / std::max(1, count);
    if (information > 0) {
      const double ratio = std::max(1.0, result.quality.telemetry_sigma_ratio);
      variance = ratio * ratio * samples_worth_one(standardised) / information;
    }
    covariance(axis, axis) = kSafety * variance;
  }
  return covariance;
}

MapState map_from_keyframes(const CalibrationResult& result,
                            const std::vector<Keyframe>& keyframes) {
  const Camera<double>& camera = result.calibration.camera;
  MapState map = map_of_all(keyframes, result);
  map.offset_covariance += tie_covariance(result);
  const double to_middle_s = result.calibration.line_delay * camera.height / 2;
  map.shear_tilt = 0;
  for (const Keyframe& keyframe : keyframes) {
    map.shear_tilt += result.trajectory.position(keyframe.time_s + to_middle_s).tilt /
                      static_cast<double>(keyframes.size());
  }
  const double rate_sigma = kRatePerAngle * kSigma_px / camera.focal_length;
  const double acceleration_sigma = kAccelerationSigmaPxPerS2 / camera.focal_length;
  for (Matrix3<double>& shear : map.shear_covariance) {
    shear.setZero();
    shear.diagonal() << 0, rate_sigma * rate_sigma, acceleration_sigma * acceleration_sigma;
  }
  return map;
}

}  // namespace alidade
