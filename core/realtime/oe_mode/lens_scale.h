#pragma once
// LensScale: phi, the difference of log f from the map's calibration, as a lens does not return
// exactly to its zoom curve (zoom_curve.h). phi is learnt together with the map's offset g, as
// telemetry correlates the two. Landmarks and motions are stored at phi = 0.
//   the camera at phi: zoomed by phi (zoom_law.h); an exact distortion stays the same
//   d / d phi = S a of all that has a Sensitivity S;  a: by_zoom() of the camera, 0 where exact
// The calibration's error is a phi + e, e of covariance `others`. The noises of g, phi and
// measurements are independent of e. Once the lens has moved (lens_track.h), phi is the scale of
// the map's directions, and a frame has its own f times exp(phi): LensColumns. Plain values.

#include "core/model/calibration.h"
#include "core/model/lens/zoom_law.h"
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

  // Kalman update of phi and of the map's offset with measurement = phi + noise. information: 1 /
  // variance. Does nothing if phi is not learnt or information is 0.
  void learn(double measurement, double information, const Sensitivity<1>& its_sensitivity,
             Vector2<double>* offset, Matrix2<double>* offset_covariance,
             Sensitivity<2>* offset_sensitivity);

  // The calibration at `phi`, with the covariance for phi's variance and sensitivity.
  [[nodiscard]] Calibration at(const Calibration& calibration, double phi, double phi_variance,
                               const Sensitivity<1>& phi_sensitivity) const;
  [[nodiscard]] Calibration at_value(const Calibration& calibration) const {
    return at(calibration, value, variance, sensitivity);
  }

  // Replaces the column of f so that S a = 0: the change with phi is kept apart.
  template <int kRows>
  void make_independent(Sensitivity<kRows>* sensitivity_of_it) const {
    constexpr int f = camera_column::kFocalLength;
    Matrix<double, kRows, 1> column = Matrix<double, kRows, 1>::Zero();
    for (int k = camera_column::kDistortion; k < camera_column::kCentreU; ++k) {
      column -= (direction[k] / direction[f]) * sensitivity_of_it->col(k);
    }
    sensitivity_of_it->col(f) = column;
  }
  // Moves the calibration to `phi`, without its covariance. phi then counts from there.
  void move_calibration(double phi, Calibration* calibration);

 private:
  // Returns the direction a there.
  [[nodiscard]] ParameterDirection move(double phi, Camera<double>* camera) const;
};

// Converts columns by the frame's camera to columns by the map's, and back.
//   a step of log f at constant kappa    changes the frame's camera by `along`, the map's by a
//   a step of one kappa                  changes the frame's term by of_map times the map's change
// All other columns are the same for both. d / d phi stays S a, by the map's columns.
struct LensColumns {
  // camera: the frame's.
  LensColumns(const LensScale& lens, const Camera<double>& camera);

  template <int kRows>
  void to_map(Sensitivity<kRows>* S) const {
    constexpr int f = camera_column::kFocalLength;
    Matrix<double, kRows, 1> column = S->col(f) * along[f];
    for (int i = 0; i < kDistortionCount; ++i) {
      const int k = camera_column::kDistortion + i;
      column += S->col(k) * (along[k] - of_map[i] * map_along[k]);
      S->col(k) *= of_map[i];
    }
    S->col(f) = column / map_along[f];
  }
  template <int kRows>
  void to_frame(Sensitivity<kRows>* S) const {
    constexpr int f = camera_column::kFocalLength;
    Matrix<double, kRows, 1> column = S->col(f) * map_along[f];
    for (int i = 0; i < kDistortionCount; ++i) {
      const int k = camera_column::kDistortion + i;
      S->col(k) /= of_map[i];
      column -= S->col(k) * (along[k] - of_map[i] * map_along[k]);
    }
    S->col(f) = column / along[f];
  }
  void to_frame(ParameterCovariance<double>* covariance) const;

  // d y / d phi, from y's columns in the map's lens.
  template <int kRows>
  [[nodiscard]] Matrix<double, kRows, 1> by_map_zoom(const Sensitivity<kRows>& J) const {
    constexpr int f = camera_column::kFocalLength;
    Matrix<double, kRows, 1> out = J.col(f) * map_along[f];
    for (int k = camera_column::kDistortion; k < camera_column::kCentreU; ++k) {
      out += J.col(k) * map_along[k];
    }
    return out;
  }

  CameraColumn<double> along;       // of the frame's lens: d camera / d log f
  CameraColumn<double> map_along;   // a
  CornerDistortion<double> of_map;  // what a term is multiplied by from the map's f to the frame's
};

}  // namespace alidade
