// The real-time calls of core/realtime use no heap.

#include <gtest/gtest.h>

#include <cmath>

#include "core/realtime/pt_mode.h"
#include "test/support/allocation_guard.h"

namespace alidade::test {
namespace {

TEST(RealtimeAllocation, PushingAndLookingUpTelemetryAllocatesNothing) {
  TelemetryBuffer<64> buffer;
  InterpolatedPanTilt at;
  int results = 0;
  const AllocationGuard guard;
  for (int i = 0; i < 200; ++i) {
    const double time = 0.03 * (i - 3 * (i % 7 == 0));  // some late, some twice
    (void)buffer.push({time, 1e-3, std::sin(time), i % 5 == 0 ? NAN : 0.1 * std::cos(time)});
    results += has_result(buffer.query(time - 0.1, 1e-3, &at));
    results += has_result(buffer.query(time + 0.1, 1e-3, &at));
  }
  buffer.clear();
  EXPECT_EQ(guard.count(), 0);
  EXPECT_GT(results, 200);
}

TEST(RealtimeAllocation, PtModeAllocatesNothing) {
  Calibration calibration;
  calibration.camera = {32008, 1, 55.4, 1920, 1080};
  calibration.line_delay = -14.2e-6;
  calibration.covariance.diagonal().setConstant(1e-12);
  TelemetryBuffer<64> buffer;
  FrameOrientation frame;
  Vector3<double> d_b;
  Vector2<double> u;
  Matrix2<double> cov;
  int directions = 0;
  int pixels = 0;
  const AllocationGuard guard;
  for (int i = 0; i < 200; ++i) {
    const double time = 0.03 * i;
    (void)buffer.push({time, 1e-3, 0.1 * std::sin(time), 0.1 * std::cos(time)});
    if (!has_result(pt_orientation(calibration, buffer, time - 0.05, 1e-3, &frame))) continue;
    directions += frame.direction({10.0 * (i % 100), 700.0}, &d_b, &cov) == ProjectionStatus::kOk;
    pixels += frame.pixel(d_b, &u, &cov) == ProjectionStatus::kOk;
  }
  EXPECT_EQ(guard.count(), 0);
  EXPECT_GT(directions, 190);
  EXPECT_EQ(pixels, directions);
}

}  // namespace
}  // namespace alidade::test
