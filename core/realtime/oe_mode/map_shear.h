#pragma once
// MapShear: how far all landmarks together may be sheared, and what neighbouring frames tell of it.
//
// The first frame's landmarks are placed with telemetry's rate: its error times the row's time stands in their
// directions, every later frame shows the same wrong rate, and what it adds to the map is sheared alike.
// The angles of neighbouring frames know better: derivatives of the curve through kCurve of them, in its
// middle, are held against the rate and acceleration that the map showed there (Kalman). docs/oe_mode.md
// derives this.
//
// State, of each axis: covariance of the errors of (angle, rate, acceleration) that a frame which looks at
// tilt() shows because of the shear; of the angle only what has grown since the map began.
// Fixed memory; no allocation. One thread.

#include <array>
#include <cstddef>
#include <optional>

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/landmark_map.h"

namespace alidade {

struct MapShearOptions {
  double longest_s = 0.5;  // s, > 0: between neighbouring frames
  // Derivatives that the curve's polynomial lacks do a thirtieth of what they surprise by, a jerk between two
  // frames up to several times as much. > 0
  double of_surprise = 1.0 / 6;
  double max_surprise =
      25;            // chi-square, 2 degrees of freedom, > 0: of a correction that is believed
  double doubt = 2;  // >= 1: times the variance of rate and acceleration, where it is not
  double crooked_px =
      0.2;  // px at the first and last row, > 0: a larger correction leaves the map crooked

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// Errors that the landmarks carry, as a frame sees them that looks at `tilt`: rate and acceleration that it
// shows too much of. An error of a landmark's angle is that at the time of the row in which that frame sees
// the landmark's elevation.
struct ShearCorrection {
  Vector2<double> angle = Vector2<double>::Zero();         // rad, by which the offset is too large
  Vector2<double> rate = Vector2<double>::Zero();          // rad/s
  Vector2<double> acceleration = Vector2<double>::Zero();  // rad/s^2
  double tilt = 0;                                         // rad, map's frame
  double s_per_rad = 0;                                    // s/rad: row time by elevation, upwards
  double half_readout_s = 0;                               // s, >= 0
  bool crooked = false;  // so large that what this can correct leaves the landmarks crooked

  // Of an angle, t seconds after the middle row. Small errors of the acceleration are many, and squared with
  // the distance they would be large: beyond the frame it goes on as it is at the border.
  [[nodiscard]] Vector2<double> angle_error(double t) const;
  [[nodiscard]] double time_of(double elevation) const { return s_per_rad * (elevation - tilt); }

  // Takes the errors from what the map showed.
  void straighten(Vector2<double>* angles, Vector2<double>* rates,
                  Vector2<double>* accelerations) const;
  [[nodiscard]] FrameMotion<double> straightened(const FrameMotion<double>& motion) const;
  // ... and from all landmarks; motion: of a frame that the map showed, not yet straightened.
  void straighten(const Calibration& calibration, const FrameMotion<double>& motion,
                  LandmarkMap* map) const;
};

class MapShear {
 public:
  using Covariances = std::array<Matrix3<double>, 2>;  // of pan, of tilt

  // options: valid.
  explicit MapShear(const MapShearOptions& options) : options_(options) {}

  // A map without shear.
  void reset(const Calibration& calibration);
  // The same landmarks through another lens: a sheared row is as long, and is read out in another time.
  void change_lens(const Calibration& calibration);
  // A map that comes with its shear.
  void set(const Covariances& covariances, double tilt);
  // A map that begins in a frame with this motion: its rates' errors are the shear.
  void begin(const FrameMotion<double>& motion, const Matrix6& motion_covariance);
  // Landmarks of this frame replace share of the map's: the errors of its motion are in the shear.
  void inherit(double share, const Matrix6& motion_covariance);

  // From here on of a frame that looks at this tilt: a wrong acceleration is another wrong rate there.
  void move_to(double tilt);
  void add_to(Matrix6* motion_covariance) const;
  [[nodiscard]] Matrix2<double> angle_covariance() const;

  // A frame that landmarks answered; frames come in order of time, or the curve begins anew.
  // middle_row_time_s: s, image clock.
  void add_frame(double middle_row_time_s, const FrameMotion<double>& motion,
                 const Matrix6& motion_covariance);
  // Angles before and after this are not of one curve.
  void begin_curve() { frame_count_ = 0; }
  // What is to be corrected, with half the read-out of the frame added last: known here as done already. None:
  // too few frames, or no rolling shutter.
  [[nodiscard]] std::optional<ShearCorrection> correct();

  [[nodiscard]] const Covariances& covariances() const { return covariances_; }
  [[nodiscard]] double tilt() const { return tilt_; }

 private:
  static constexpr std::size_t kCurve = 5;  // angles in a row that give a polynomial of degree 4
  // Of s_per_rad: frames whose lenses differ by more show shears of different size.
  static constexpr double kSameLens = 0.02;

  void take_lens(const Calibration& calibration);

  struct Frame {
    double time_s = 0;  // middle row
    Vector2<double> angle, rate, acceleration;
    Matrix6 covariance;
    Vector2<double> surprise;  // rad, by which it missed the curve through those before
    double s_per_rad = 0;      // of its lens
  };

  MapShearOptions options_;
  // Of the calibration.
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
