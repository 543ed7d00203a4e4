#pragma once
// LensScale: phi, by how much log f differs from the calibration that the map is made with: a lens does not come back exactly to
// where a zoom curve has it (zoom_curve.h). Learnt together with the map's offset g, which telemetry ties to it.
//   f(phi) = f exp(phi),   k(phi) = k exp(2 phi)   the distortion in the corner stays; a k that is exact stays itself
//   d / d phi = S a of all that has a Sensitivity S,   a = (f, 2 k or 0) at the parameters f and k, else 0
// Errors: of the calibration a phi + e, with e, of covariance `others`, independent of what follows; of (g, phi) their own noise plus
// their sensitivity times e. Landmarks and motions are kept as they come out at phi = 0; what they make of phi is S a.
// Where the lens has moved since (lens_track.h) all this stays the map's: phi is then the scale of the map's directions, and a frame's
// own camera has f exp(phi) of its own f. Columns of its parameters become the map's by LensColumns.
// Plain values; no allocation.

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/covariance.h"

namespace alidade {

using ParameterDirection = Matrix<double, kParameterCount, 1>;

// Not learnt: phi is 0, and what f errs by is the calibration's covariance, as of any other parameter.
struct LensScale {
  bool learnt = false;
  double value = 0;                                                  // phi
  double variance = 0;                                               // of its own noise
  Vector2<double> covariance_with_offset = Vector2<double>::Zero();  // rad, of their noise
  Sensitivity<1> sensitivity = Sensitivity<1>::Zero();               // to e
  ParameterDirection direction = ParameterDirection::Zero();         // a
  ParameterCovariance<double> others = ParameterCovariance<double>::Zero();

  // As this calibration's covariance has it. Not learnt where that takes f as exact, or is none.
  [[nodiscard]] static LensScale begin(const Calibration& calibration);

  // What measurement = phi + noise adds, by its information (1/variance, may be 0) and its sensitivity (Kalman).
  void learn(double measurement, double information, const Sensitivity<1>& its_sensitivity,
             Vector2<double>* offset, Matrix2<double>* offset_covariance,
             Sensitivity<2>* offset_sensitivity);

  // The calibration at `phi`, with the covariance that follows where phi is known to this variance and sensitivity.
  [[nodiscard]] Calibration at(const Calibration& calibration, double phi, double phi_variance,
                               const Sensitivity<1>& phi_sensitivity) const;
  [[nodiscard]] Calibration at_value(const Calibration& calibration) const {
    return at(calibration, value, variance, sensitivity);
  }

  // A sensitivity that leaves its column of f out of d / d phi.
  template <int kRows>
  void make_independent(Sensitivity<kRows>* sensitivity_of_it) const {
    const int f = index(Parameter::kFocalLength);
    const int k = index(Parameter::kRadialDistortion);
    sensitivity_of_it->col(f) = -(direction[k] / direction[f]) * sensitivity_of_it->col(k);
  }
  // The calibration at `phi`, without its covariance; what phi is counted from moves along.
  void move_calibration(double phi, Calibration* calibration);

 private:
  // Returns the direction there.
  [[nodiscard]] ParameterDirection move(double phi, Camera<double>* camera) const;
};

// Parameters of a frame's own lens in terms of the map's, by f and k at the map's lens, a = (f_a, a_k):
//   change of log f, the distortion in the corner as it is    f_a: in the column of f
//   change of the distortion in the corner                    k (f_a / f)^2: in the column of k
// All others are the same for both. d / d phi stays S a.
struct LensColumns {
  // camera: of the frame.
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
