#pragma once
// MotionPrediction: how the camera moves in a frame, before its image is looked at: by telemetry, or, where
// there is none, by the frame before, carried on.
//
// By telemetry: its angles and rates in true units, less the map's offset. By the frame before: angle and rate
// carried on; that the mount accelerates meanwhile is in the covariance. Accelerations are known where
// somebody knows them (InterpolatedPanTilt::acceleration_sigma), else to acceleration_fields.
// No allocation. One thread.

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/map_offset_filter.h"
#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

struct MotionPredictionOptions {
  // Fields of view per s^2, of either axis, one standard deviation: weak knowledge, for frames with few
  // landmarks. > 0
  double acceleration_fields = 10;
  double longest_s = 0.5;  // s, > 0: from a frame to the next without telemetry

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

struct PredictedMotion {
  FrameMotion<double> motion;                           // map's frame, about the middle row
  Matrix6 covariance = Matrix6::Zero();                 // of motion, apart from the map's offset
  Sensitivity<6> sensitivity = Sensitivity<6>::Zero();  // of motion
  Matrix2<double> offset_covariance =
      Matrix2<double>::Zero();  // rad^2, what the map's offset adds to angles
  Matrix2<double> angle_covariance = Matrix2<double>::Zero();  // rad^2, of angles, all together
  // For the solution, relative to `motion`; its offset_covariance is left to the caller.
  MotionPrior prior;
};

// At a constant acceleration for t seconds; what it is later, nobody knows.
[[nodiscard]] FrameMotion<double> carried_on(const FrameMotion<double>& from, double t);

class MotionPrediction {
 public:
  // options: valid.
  explicit MotionPrediction(const MotionPredictionOptions& options) : options_(options) {}

  void reset(const Calibration& calibration);
  // The calibration has another lens.
  void change_lens(const Calibration& calibration);
  // No frame before.
  void forget() { has_last_ = false; }

  // inflation: of the variance of telemetry's angles, see MapOffsetFilter::inflation().
  [[nodiscard]] PredictedMotion by_telemetry(const Calibration& calibration,
                                             const InterpolatedPanTilt& telemetry,
                                             const MapOffset& offset, double inflation) const;
  // follows(frame_time_s)
  [[nodiscard]] PredictedMotion by_last_frame(double frame_time_s) const;

  [[nodiscard]] bool has_last() const { return has_last_; }
  // Whether the frame before is recent enough to be carried on.
  [[nodiscard]] bool follows(double frame_time_s) const {
    return has_last_ && since_last_s(frame_time_s) < options_.longest_s;
  }
  // s, in either direction of time; 0 without a frame before.
  [[nodiscard]] double since_last_s(double frame_time_s) const;
  // The frame before, carried on to this one with its acceleration; follows(frame_time_s).
  [[nodiscard]] FrameMotion<double> last_carried_on(double frame_time_s) const;

  // covariance: of motion, by the frame's own noise; shared_covariance: rad^2, of its angles, by what the
  // landmarks share.
  void remember(double frame_time_s, const FrameMotion<double>& motion, const Matrix6& covariance,
                const Matrix2<double>& shared_covariance, const Sensitivity<6>& sensitivity);
  // The same motion, as the corrected map shows it.
  void correct(const FrameMotion<double>& motion) { last_motion_ = motion; }
  // As it comes out by parameters that are `change` times this direction away.
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
