#pragma once
// LensScale: phi, the difference of log f from the map's calibration, as a lens does not return
// exactly to its zoom curve (zoom_curve.h). Learnt with the map's offset g, as telemetry ties the
// two.
//   f(phi) = f exp(phi),   k(phi) = k exp(2 phi): same distortion in the corner; an exact k stays
//   d / d phi = S a of all that has a Sensitivity S;  a = (f, 2 k or 0) at parameters f, k, else 0
// Errors: those of the calibration are a phi + e; e, of covariance `others`, is independent of what
// follows. (g, phi) have their own noise plus their sensitivity times e. Landmarks and motions are
// stored for phi = 0; S a is their change with phi.
// Once the lens has moved (lens_track.h), phi is the scale of the map's directions. A frame's
// camera then has its own f times exp(phi); see LensColumns. Plain values; no allocation.

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/covariance.h"

namespace alidade {

using ParameterDirection = Matrix<double, kParameterCount, 1>;

// Not learnt: phi is 0, and the error of f is in the calibration's covariance, like any other.
struct LensScale {
  bool learnt = false;
  double value = 0;                                                  // phi
  double variance = 0;                                               // of its own noise
  Vector2<double> covariance_with_offset = Vector2<double>::Zero();  // rad, of their noise
  Sensitivity<1> sensitivity = Sensitivity<1>::Zero();               // to e
  ParameterDirection direction = ParameterDirection::Zero();         // a
  ParameterCovariance<double> others = ParameterCovariance<double>::Zero();

  // From this calibration's covariance. Not learnt if f is exact or the covariance is invalid.
  [[nodiscard]] static LensScale begin(const Calibration& calibration);

  // Kalman update with measurement = phi + noise. information: 1 / variance, may be 0.
  void learn(double measurement, double information, const Sensitivity<1>& its_sensitivity,
             Vector2<double>* offset, Matrix2<double>* offset_covariance,
             Sensitivity<2>* offset_sensitivity);

  // The calibration at `phi`, with the covariance for phi's variance and sensitivity.
  [[nodiscard]] Calibration at(const Calibration& calibration, double phi, double phi_variance,
                               const Sensitivity<1>& phi_sensitivity) const;
  [[nodiscard]] Calibration at_value(const Calibration& calibration) const {
    return at(calibration, value, variance, sensitivity);
  }

  // Sets the column of f so that S a = 0: d / d phi is then not in the sensitivity.
  template <int kRows>
  void make_independent(Sensitivity<kRows>* sensitivity_of_it) const {
    const int f = index(Parameter::kFocalLength);
    const int k = index(Parameter::kRadialDistortion);
    sensitivity_of_it->col(f) = -(direction[k] / direction[f]) * sensitivity_of_it->col(k);
  }
  // Moves the calibration to `phi`, without its covariance. phi then counts from there.
  void move_calibration(double phi, Calibration* calibration);

 private:
  // Returns the direction a there.
  [[nodiscard]] ParameterDirection move(double phi, Camera<double>* camera) const;
};

// Converts parameter columns of a frame's own lens to the map's, with the map's lens a = (f_a,
// a_k):
//   change of log f at constant distortion in the corner    f_a: in the column of f
//   change of the distortion in the corner                  k (f_a / f)^2: in the column of k
// All other columns are the same for both. d / d phi stays S a.
struct LensColumns {
  // camera: the frame's.
  LensColumns(const LensScale& lens, const Camera<double>& camera);

  template <int kRows>
  void to_map(Sensitivity<kRows>* S) const {
    const int f = index(Parameter::kFocalLength);
    const int k = index(Parameter::kRadialDistortion);
    S->col(f) =
        (S->col(f) * focal_length + S->col(k) * (by_zoom - of_k * direction_k)) / direction_f;
    S->col(k) *= of_k;
  }
  template <int kRows>
  void to_frame(Sensitivity<kRows>* S) const {
    const int f = index(Parameter::kFocalLength);
    const int k = index(Parameter::kRadialDistortion);
    S->col(k) /= of_k;
    S->col(f) =
        (S->col(f) * direction_f - S->col(k) * (by_zoom - of_k * direction_k)) / focal_length;
  }
  void to_frame(ParameterCovariance<double>* covariance) const;

  double focal_length, by_zoom;     // of the frame's lens: f, d k / d log f
  double direction_f, direction_k;  // a
  double of_k;                      // (f / f_a)^2
};

}  // namespace alidade
