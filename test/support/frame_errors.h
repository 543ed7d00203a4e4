#pragma once
// How far the directions that a frame's orientation gives to its pixels are from the virtual camera's, px.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <optional>

#include "core/realtime/frame_orientation.h"
#include "test/simulator/camera_model.h"

namespace alidade::test {

// Where the direction that the frame gives to u truly is, less u.
inline Vector2<double> pixel_error(const simulator::CameraModel& truth, double time_s,
                                   const FrameOrientation& frame, const Vector2<double>& u) {
  Vector3<double> d;
  EXPECT_EQ(frame.direction(u, &d), ProjectionStatus::kOk);
  const std::optional<Eigen::Vector2d> true_u = truth.project_rolling(d, time_s);
  EXPECT_TRUE(true_u.has_value());
  return true_u.value_or(u) - u;
}

// The largest error, px, and the largest of its squares by covariance, 2 degrees of freedom, at the
// centre and near the corners.
inline void judge_frame(const simulator::CameraModel& truth, double time_s,
                        const FrameOrientation& frame, double* px, double* square) {
  *px = 0;
  *square = 0;
  const Vector2<double> size(frame.calibration.camera.width, frame.calibration.camera.height);
  for (const Vector2<double>& at :
       {Vector2<double>(0.5, 0.5), Vector2<double>(0.05, 0.05), Vector2<double>(0.95, 0.05),
        Vector2<double>(0.05, 0.95), Vector2<double>(0.95, 0.95)}) {
    const Vector2<double> u = at.cwiseProduct(size);
    Vector3<double> d;
    ASSERT_EQ(frame.direction(u, &d), ProjectionStatus::kOk);
    Vector2<double> back;
    Matrix2<double> covariance;
    ASSERT_EQ(frame.pixel(d, &back, &covariance), ProjectionStatus::kOk);
    const Vector2<double> e = pixel_error(truth, time_s, frame, u);
    *px = std::max(*px, e.norm());
    *square = std::max(*square, e.dot(covariance.inverse() * e));
  }
}

}  // namespace alidade::test
