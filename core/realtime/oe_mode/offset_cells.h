#pragma once
// OffsetAxisCells: what telemetry showed of the map's offset, kept by angle, as telemetry errs by
// angle: y = offset + g(angle) + noise, g of variance A^2 and length L. Cells of angle have mean
// and information I of their y's. Noise averages within a cell, g does not: a cell says of the
// offset I / (1 + A^2 I), less beside a neighbour that said it before, and all together no more
// than n independent lengths: n / A^2. A and L are told with the telemetry, or learnt: cells that
// scatter by more than their noise show them. Fixed memory; no allocation. One thread. Derivation:
// docs/oe_mode.md.

#include <array>
#include <cstddef>

#include "core/model/linear_algebra.h"
#include "core/model/trigonometry.h"

namespace alidade {

// The error of telemetry that goes with the angle, in one frame, true units.
struct AngleError {
  Vector2<double> angle = Vector2<double>::Zero();     // rad, telemetry's (pan, tilt)
  Vector2<double> variance = Vector2<double>::Zero();  // rad^2, A^2
  Vector2<double> length = Vector2<double>::Zero();    // rad, L; 0: unknown

  [[nodiscard]] bool exists() const { return variance[0] > 0 || variance[1] > 0; }
};

// How telemetry's angles count in one frame beside what was said near them before.
struct AngleErrorShare {
  Vector2<double> variance = Vector2<double>::Zero();  // rad^2, A^2
  Vector2<double> repeated = Vector2<double>::Zero();  // rad^2, to be added: what was said already
};

// One axis.
class OffsetAxisCells {
 public:
  static constexpr int kCells = 512;
  static constexpr double kCell_rad = 2 * kPi / kCells;
  static constexpr double kLargestError_rad = 2e-3;  // what is more is no error of a gear

  // Of one angle telemetry minus map.
  struct Seen {
    double angle = 0;                 // rad, true
    double offset = 0;                // rad
    double variance = 0;              // rad^2, > 0, of its noise
    double used = 0;                  // 1/rad^2, what the offset's estimate took of it
    double told_variance = 0;         // rad^2, of g there, as far as told
    double calibration_variance = 0;  // rad^2, of its difference from the offset, by the parameters
    double time_s = 0;
  };

  void clear();
  // drift: rad / sqrt(s), of the offset. Older means count less.
  void add(const Seen& seen, double drift);
  // For an offset that changes by this.
  void move(double by);

  // g at an angle as the cell says that knows most of it: weight (mean - offset), and a variance.
  struct Expected {
    double weight = 0;    // 0 to below 1
    double mean = 0;      // rad
    double variance = 0;  // rad^2, of g around that
  };
  // variance: A^2; length_rad: L, 0 if unknown.
  [[nodiscard]] Expected expected(double angle, double variance, double length_rad) const;

  // Type-II estimate of A^2 and L beyond what was told, from the scatter of the cells.
  struct Scatter {
    double variance = 0;  // rad^2
    double length = 0;    // rad
    int freedom = 0;      // degrees, 0: too few cells
  };
  [[nodiscard]] Scatter scatter() const;
  // This is the error from now on. offset_variance: rad^2, of the offset's estimate, which grows as
  // g is in it.
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
