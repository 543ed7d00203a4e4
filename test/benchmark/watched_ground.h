#pragma once
// What is tracked before a TurningCamera: ground, and boxes that stand.

#include <cmath>
#include <memory>

#include "core/ground/plane_estimate.h"
#include "edge_app/tracking/detected_frame.h"
#include "edge_app/tracking/frame_view.h"

namespace alidade::benchmarks {

// The camera looks down by 20 degrees on ground 20 m below: people are some 110 px tall (of 720 lines) all over the picture.
inline std::shared_ptr<const PlaneEstimate> watched_ground() {
  PlaneEstimate out;
  out.plane.R_base_from_world = R_base_from_world_of(0, -0.35, 0);
  out.plane.position = {0, 0, 20};
  return std::make_shared<const PlaneEstimate>(out);
}

// Boxes of 8 px about directions of a grid about straight ahead, 18 mrad apart: those in the picture. The frame's record has an orientation.
inline void add_standing_boxes(int columns, int rows, DetectedFrame* frame) {
  constexpr double kStep = 0.018;  // rad
  constexpr double kSize = 8;      // px
  const FrameView view(frame->record);
  for (int i = 0; i < columns * rows; ++i) {
    const double azimuth = kStep * (i % columns - 0.5 * (columns - 1));
    const double elevation = kStep * (i / columns - 0.5 * (rows - 1));
    const Vector3<double> d_b(std::cos(elevation) * std::cos(azimuth),
                              std::cos(elevation) * std::sin(azimuth), -std::sin(elevation));
    Vector2<double> u;
    if (view.frame().pixel(d_b, &u) != ProjectionStatus::kOk || !view.contains(u)) continue;
    DetectionBox box;
    box.u = u.x() - kSize / 2;
    box.v = u.y() - kSize / 2;
    box.width = box.height = kSize;
    box.score = 0.9;
    frame->boxes.push_back(box);
  }
}

}  // namespace alidade::benchmarks
