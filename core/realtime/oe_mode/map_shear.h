#pragma once
// MapShear: how far all landmarks may be sheared together. The first frame's landmarks are placed
// with telemetry's rate. The rate's error times the row's time is in their directions and passes on
// to later landmarks. Neighbouring frames reveal it: a Kalman filter compares the derivatives of
// the curve through kCurve angles, in its middle, with the rate and acceleration that the map
// showed there (docs/oe_mode.md). State of each axis: covariance of the errors of (angle, rate,
// acceleration) in a frame that looks at tilt(), due to the shear. The angle's error counts from
// the map's beginning. Fixed memory; no allocation. One thread.

#include <array>
#include <cstddef>
#include <optional>

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/landmark_map.h"

namespace alidade {

struct MapShearOptions {
  double longest_s = 0.5;  // s, > 0; longest time between neighbouring frames
  // > 0; share of a surprise that counts as error of the curve. Derivatives that the polynomial
  // lacks cause a thirtieth of their surprise, a jerk between two frames up to several times as
  // much.
  double of_surprise = 1.0 / 6;
  double max_surprise = 25;  // chi-square, 2 degrees of freedom, > 0; gate of a correction
  double doubt = 2;  // >= 1; factor for the variance of rate and acceleration if it is rejected
  double crooked_px =
      0.2;  // px at the first and last row, > 0; a larger correction leaves the map crooked

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// Errors of the landmarks, as a frame that looks at `tilt` sees them: the excess of the rate and
// acceleration that this frame shows. A landmark's angle error is taken at the time of the row in
// which this frame sees the landmark's elevation.
struct ShearCorrection {
  Vector2<double> angle = Vector2<double>::Zero();         // rad, excess of the offset
  Vector2<double> rate = Vector2<double>::Zero();          // rad/s
  Vector2<double> acceleration = Vector2<double>::Zero();  // rad/s^2
  double tilt = 0;                                         // rad, map's frame
  double s_per_rad = 0;                                    // s/rad; row time per elevation, upwards
  double half_readout_s = 0;                               // s, >= 0
  bool crooked = false;  // so large that the corrected landmarks remain crooked

  // Error of an angle, t seconds after the middle row. Beyond the frame the part of the
  // acceleration stays as at the border: its small errors would be large when squared with the
  // distance.
  [[nodiscard]] Vector2<double> angle_error(double t) const;
  [[nodiscard]] double time_of(double elevation) const { return s_per_rad * (elevation - tilt); }

  // Subtracts the errors from what the map showed.
  void straighten(Vector2<double>* angles, Vector2<double>* rates,
                  Vector2<double>* accelerations) const;
  [[nodiscard]] FrameMotion<double> straightened(const FrameMotion<double>& motion) const;
  // Subtracts them from all landmarks. motion: of a frame that the map showed, not yet
  // straightened.
  void straighten(const Calibration& calibration, const FrameMotion<double>& motion,
                  LandmarkMap* map) const;
};

class MapShear {
 public:
  using Covariances = std::array<Matrix3<double>, 2>;  // of pan, of tilt

  // options: valid.
  explicit MapShear(const MapShearOptions& options) : options_(options) {}

  // Begins with a map without shear.
  void reset(const Calibration& calibration);
  // The same landmarks with another lens: a sheared row is as long, but is read out in another
  // time.
  void change_lens(const Calibration& calibration);
  // Begins with a map that comes with its shear.
  void set(const Covariances& covariances, double tilt);
  // Begins with a map made in a frame with this motion: the errors of its rates are the shear.
  void begin(const FrameMotion<double>& motion, const Matrix6& motion_covariance);
  // Landmarks of this frame replace this share of the map's: the errors of its motion enter the
  // shear.
  void inherit(double share, const Matrix6& motion_covariance);

  // From now on the state is for a frame that looks at this tilt: an acceleration error is another
  // rate error there.
  void move_to(double tilt);
  // Adds the covariance that the shear gives a motion in the map.
  void add_to(Matrix6* motion_covariance) const;
  // rad^2, of (pan, tilt).
  [[nodiscard]] Matrix2<double> angle_covariance() const;

  // Adds a frame that landmarks answered. If it is not later than the frame before, or by longest_s
  // or more, the curve begins anew. middle_row_time_s: s, image clock.
  void add_frame(double middle_row_time_s, const FrameMotion<double>& motion,
                 const Matrix6& motion_covariance);
  // Angles before and after this call are not on one curve.
  void begin_curve() { frame_count_ = 0; }
  // The correction to apply, with half_readout_s of the last frame; the state here already includes
  // it. Empty if there are too few frames, lenses that differ, or no rolling shutter. An axis
  // beyond max_surprise has the correction 0, and its variances of rate and acceleration grow by
  // `doubt`.
  [[nodiscard]] std::optional<ShearCorrection> correct();

  [[nodiscard]] const Covariances& covariances() const { return covariances_; }
  [[nodiscard]] double tilt() const { return tilt_; }

 private:
  static constexpr std::size_t kCurve = 5;  // successive angles: a polynomial of degree 4
  // Limit of the relative difference of s_per_rad: with other lenses shears have another size.
  static constexpr double kSameLens = 0.02;

  void take_lens(const Calibration& calibration);

  struct Frame {
    double time_s = 0;  // s, of the middle row
    Vector2<double> angle, rate, acceleration;
    Matrix6 covariance;
    Vector2<double> surprise;  // rad, distance from the curve through the earlier frames
    double s_per_rad = 0;      // s/rad, of its lens
  };

  MapShearOptions options_;
  // From the calibration.
  double s_per_rad_ = 0;       // s/rad
  double half_readout_s_ = 0;  // s
  double focal_length_ = 0;    // px
  double field_of_view_ = 0;   // rad

  Covariances covariances_{Matrix3<double>::Zero(), Matrix3<double>::Zero()};
  double tilt_ = 0;                       // rad, map's frame
  std::array<Frame, kCurve + 1> frames_;  // the latest, newest first
  std::size_t frame_count_ = 0;
};

}  // namespace alidade
