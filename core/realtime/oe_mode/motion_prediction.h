#pragma once
// MotionPrediction: the camera's motion in a frame before its image is used, from telemetry or,
// without it, from the previous frame.
// From telemetry: its angles and rates in true units, minus the map's offset, and its acceleration
// if InterpolatedPanTilt::acceleration_sigma is below acceleration_fields. From the previous frame:
// its angle and rate, extrapolated. The covariance allows for an error of the acceleration. Its
// sigma is the smaller of these two for telemetry, and acceleration_fields for the previous frame.
// No allocation. One thread.

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/map_offset_filter.h"
#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

struct MotionPredictionOptions {
  // Fields of view per s^2, > 0; sigma of each axis. A weak prior, for frames with few landmarks.
  double acceleration_fields = 10;
  double longest_s = 0.5;  // s, > 0; longest extrapolation without telemetry

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

struct PredictedMotion {
  FrameMotion<double> motion;                           // map's frame, about the middle row
  Matrix6 covariance = Matrix6::Zero();                 // of motion, without the map's offset
  Sensitivity<6> sensitivity = Sensitivity<6>::Zero();  // of motion
  Matrix2<double> offset_covariance =
      Matrix2<double>::Zero();  // rad^2, added to angles by the map's offset
  Matrix2<double> angle_covariance = Matrix2<double>::Zero();  // rad^2, of angles, in total
  // For the solution, relative to `motion`. The caller sets its offset_covariance.
  MotionPrior prior;
};

// The motion t seconds later, at constant acceleration. The acceleration after that is unknown: 0.
[[nodiscard]] FrameMotion<double> carried_on(const FrameMotion<double>& from, double t);

class MotionPrediction {
 public:
  // options: valid.
  explicit MotionPrediction(const MotionPredictionOptions& options) : options_(options) {}

  void reset(const Calibration& calibration);
  // For another lens of the calibration.
  void change_lens(const Calibration& calibration);
  // Forgets the previous frame.
  void forget() { has_last_ = false; }

  // inflation: of the variance of telemetry's angles, see MapOffsetFilter::inflation(). error:
  // see MapOffsetFilter::share().
  [[nodiscard]] PredictedMotion by_telemetry(const Calibration& calibration,
                                             const InterpolatedPanTilt& telemetry,
                                             const MapOffset& offset, double inflation,
                                             const AngleErrorShare& error = {}) const;
  // Needs follows(frame_time_s).
  [[nodiscard]] PredictedMotion by_last_frame(double frame_time_s) const;

  [[nodiscard]] bool has_last() const { return has_last_; }
  // True if the previous frame is recent enough to extrapolate.
  [[nodiscard]] bool follows(double frame_time_s) const {
    return has_last_ && since_last_s(frame_time_s) < options_.longest_s;
  }
  // s, >= 0; time between the previous frame and this one, whichever is first. 0 without a previous
  // frame.
  [[nodiscard]] double since_last_s(double frame_time_s) const;
  // The previous motion, extrapolated with its acceleration. Needs follows(frame_time_s).
  [[nodiscard]] FrameMotion<double> last_carried_on(double frame_time_s) const;

  // rad, of an angle of last_carried_on(): what an acceleration may have changed. Infinite unless
  // follows(frame_time_s).
  [[nodiscard]] double carried_on_sigma(double frame_time_s) const;

  // covariance: of motion, from the frame's own noise. shared_covariance: rad^2, of its angles,
  // from the landmarks' common error.
  void remember(double frame_time_s, const FrameMotion<double>& motion, const Matrix6& covariance,
                const Matrix2<double>& shared_covariance, const Sensitivity<6>& sensitivity);
  // Replaces the remembered motion by that of the corrected map.
  void correct(const FrameMotion<double>& motion) { last_motion_ = motion; }
  // Changes the remembered motion to parameters that are `change` * direction away.
  void move(double change, const ParameterDirection& direction);

 private:
  MotionPredictionOptions options_;
  double acceleration_sigma_ = 0;  // rad/s^2
  bool has_last_ = false;
  double last_time_s_ = 0;
  FrameMotion<double> last_motion_;
  Matrix6 last_covariance_ = Matrix6::Zero();
  Sensitivity<6> last_sensitivity_ = Sensitivity<6>::Zero();
};

}  // namespace alidade
