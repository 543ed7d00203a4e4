#pragma once
// A tracker's input for one frame: time, the map from the world to measured coordinates, the region
// in view, detections. The caller knows the camera; the tracker only gets a homography
// (target_filter.h).
// The part of the measured coordinates that is in view: edge . (x, y, 1) > 0 for all edges. For
// detections in pixels it is the image; for detections on the plane it is the part of the plane
// that the image shows. Hidden parts are cut off by edges, too.

#include <array>
#include <cmath>

#include "core/model/linear_algebra.h"
#include "core/tracking/target_filter.h"

namespace alidade {

struct ViewRegion {
  static constexpr int kMostEdges = 6;
  std::array<Vector3<double>, kMostEdges> edges{};
  int count = 0;  // 0: no limit
};

// An image of this size, for detections in pixels.
[[nodiscard]] inline ViewRegion picture_region(double width_px, double height_px) {
  ViewRegion region;
  region.edges[0] = {1, 0, 0};
  region.edges[1] = {-1, 0, width_px};
  region.edges[2] = {0, 1, 0};
  region.edges[3] = {0, -1, height_px};
  region.count = 4;
  return region;
}

// Probability that a place is in the region; the distances to the edges are treated as independent.
// place, cov: in measured coordinates; cov positive definite.
[[nodiscard]] inline double probability_in_view(const ViewRegion& region,
                                                const Vector2<double>& place,
                                                const Matrix2<double>& cov) {
  double probability = 1;
  for (int i = 0; i < region.count; ++i) {
    const Vector3<double>& edge = region.edges[static_cast<std::size_t>(i)];
    const double distance = edge.head<2>().dot(place) + edge[2];
    const double variance = edge.head<2>().dot(cov * edge.head<2>());
    probability *= 0.5 * std::erfc(-distance / std::sqrt(2 * variance));
  }
  return probability;
}

struct TargetFrame {
  double time_s = 0;  // s, of exposure; any one clock for all frames
  Matrix3<double> H_measured_from_world = Matrix3<double>::Identity();
  ViewRegion view;
  double false_alarm_density = 1e-7;  // false alarms of one frame per unit of measured area, > 0
  const TargetMeasurement* detections = nullptr;  // borrowed for the call
  int count = 0;                                  // of detections
};

}  // namespace alidade
