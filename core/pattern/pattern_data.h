#pragma once
// Input of the calibration by a known pattern: where its points were seen, in which frame.

#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

struct PatternObservation {
  int point = 0;      // index into PatternData::points_m
  Vector2<double> u;  // px, the centre of the top-left pixel is at (0.5, 0.5)
  // For a circle: u is the centroid of its image minus `beside` (px), the shift by perspective and
  // lens; radius_m is its radius as measured. radius_m 0: not a circle.
  Vector2<double> beside = Vector2<double>::Zero();
  double radius_m = 0;
};

struct PatternFrame {
  double time_s = 0;                             // of row 0, on a steady clock; increasing
  std::vector<PatternObservation> observations;  // by increasing point
};

struct PatternData {
  int width = 0;   // px
  int height = 0;  // px
  // Pattern frame: x right, y down, z away from the viewer; z = 0 on a plane.
  std::vector<Vector3<double>> points_m;
  std::vector<PatternFrame> frames;
};

}  // namespace alidade
