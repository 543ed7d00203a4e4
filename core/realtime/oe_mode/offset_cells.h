#pragma once
// OffsetAxisCells: what telemetry showed of the map's offset on one axis, kept by angle, because a
// part g of telemetry's error depends on the angle:
//   y = offset + g(angle) + noise          g: variance A^2, correlation length L
// Each cell of angle keeps the mean of its y's and their information I from noise. Noise averages
// out within a cell, g does not: one cell's information on the offset is I / (1 + A^2 I), and the
// information of n independent lengths is at most n / A^2. An angle counts less if a neighbouring
// cell was seen before. Telemetry states A and L, or they are learnt from cells that scatter by
// more than their noise. Fixed memory; no allocation. One thread. Derivation: docs/oe_mode.md.

#include <array>
#include <cstddef>

#include "core/model/linear_algebra.h"
#include "core/model/trigonometry.h"

namespace alidade {

// The part of telemetry's error that depends on the angle, in one frame, true units.
struct AngleError {
  Vector2<double> angle = Vector2<double>::Zero();     // rad, telemetry's (pan, tilt)
  Vector2<double> variance = Vector2<double>::Zero();  // rad^2, A^2
  Vector2<double> length = Vector2<double>::Zero();    // rad, L; 0: unknown

  [[nodiscard]] bool exists() const { return variance[0] > 0 || variance[1] > 0; }
};

// How telemetry's angles count in one frame, after what was seen near them before.
struct AngleErrorShare {
  Vector2<double> variance = Vector2<double>::Zero();  // rad^2, A^2
  Vector2<double> repeated = Vector2<double>::Zero();  // rad^2, to add, as much is known already
};

// One axis.
class OffsetAxisCells {
 public:
  static constexpr int kCells = 512;
  static constexpr double kCell_rad = 2 * kPi / kCells;
  static constexpr double kLargestError_rad = 2e-3;  // a larger error is not a gear's

  // Telemetry minus map at one angle.
  struct Seen {
    double angle = 0;                 // rad, true
    double offset = 0;                // rad
    double variance = 0;              // rad^2, > 0, of its noise
    double used = 0;                  // 1/rad^2, information that the offset's estimate gained
    double told_variance = 0;         // rad^2, of g there, as telemetry states it
    double calibration_variance = 0;  // rad^2, that the calibration's errors give `offset`
    double time_s = 0;
  };

  void clear();
  // drift: rad / sqrt(s), of the offset. Older means count less.
  void add(const Seen& seen, double drift);
  // The offset has changed by this, rad.
  void move(double by);

  // g at an angle, predicted by the cell that knows it best: weight (mean - offset), and its
  // variance.
  struct Expected {
    double weight = 0;    // 0 to below 1
    double mean = 0;      // rad
    double variance = 0;  // rad^2, of g around that
  };
  // variance: A^2; length_rad: L, 0 if unknown.
  [[nodiscard]] Expected expected(double angle, double variance, double length_rad) const;

  // A^2 and L beyond those stated, estimated from the scatter of the cells (DerSimonian and Laird).
  struct Scatter {
    double variance = 0;  // rad^2; 0: the cells scatter no more than by chance
    double length = 0;    // rad; with a variance
    int freedom = 0;      // degrees, 0: too few cells
  };
  [[nodiscard]] Scatter scatter() const;
  // Takes this error from now on. *offset_variance: rad^2, of the offset's estimate. It grows, as g
  // is part of the estimate.
  void take_error(const Scatter& error, double* offset_variance);
  void forget_error() { error_ = {}; }
  [[nodiscard]] double learnt_variance() const { return error_.variance; }  // rad^2, A^2
  [[nodiscard]] double learnt_length() const { return error_.length; }      // rad

 private:
  struct Cell {
    double information = 0;  // 0: nothing was seen
    double angle = 0;        // rad, mean, from the cell's middle
    double mean = 0;
    double used = 0;
    double told_variance = 0;
    double calibration_variance = 0;
    double time_s = 0;
  };

  [[nodiscard]] static int cell_of(double angle);
  [[nodiscard]] double scatter_length(double variance) const;
  // Variance of the offset's estimate per unit of A^2.
  [[nodiscard]] double share_of_error(double length_rad) const;

  std::array<Cell, kCells> cells_{};
  Scatter error_;  // as learnt
};

}  // namespace alidade
