// The real-time calls of core/realtime use no heap.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/pt_mode.h"
#include "core/realtime/start_up/start_up_tracker.h"
#include "test/core/realtime/image/analytic_image.h"
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
  calibration.camera = {32008, 1, {55.4}, 1920, 1080};
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

TEST(RealtimeAllocation, LookingAtImagesAllocatesNothing) {
  std::mt19937_64 random(1);
  const AnalyticImage texture(&random, 10);
  const Pixels pixels = make_pixels(320, 200, texture, 2, &random);
  Pyramid pyramid(320, 200, 3);
  FastGrid grid(320, 200, 32);
  std::array<FastCorner, 100> corners;
  ReferencePatch reference;
  Alignment alignment;
  Matrix2<double> A = Matrix2<double>::Identity();
  int found = 0;
  const AllocationGuard guard;
  for (int i = 0; i < 20; ++i) {
    (void)pyramid.build(pixels.view, 3);
    const FastResult result = grid.detect(pyramid.octave(i % 3), 5, corners.data(), 100);
    A(0, 1) = 0.01 * (i % 2);
    for (int j = 0; j < result.count; ++j) {
      const FastCorner& corner = corners[static_cast<std::size_t>(j)];
      const Vector2<double> centre(corner.u + 0.5, corner.v + 0.5);
      if (!is_usable(prepare(pyramid.octave(i % 3), centre, A, 2, &reference))) continue;
      found += align(reference, pyramid.octave(i % 3), centre + Vector2<double>(0.5, 0.3), {},
                     &alignment) == AlignmentStatus::kConverged;
    }
  }
  EXPECT_EQ(guard.count(), 0);
  EXPECT_GT(found, 200);
}

TEST(RealtimeAllocation, LandmarkMapAllocatesNothing) {
  LandmarkMap map(100, 0.01);
  Landmark landmark;
  std::array<int, 100> slots;
  int found = 0;
  const AllocationGuard guard;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const double angle = 0.011 * i;
    landmark.d = {std::cos(angle), std::sin(angle), 0};
    int slot = 0;
    if (map.insert(landmark, 10 * i, &slot) == InsertStatus::kOk) {
      map.refine(slot, landmark.d, landmark.covariance);
    }
    if (i % 5 == 0) map.retire(slot);
    found += map.find(landmark.d, 0.9, slots.data(), 100);
    if (i == 1000) map.clear(0.02);
  }
  EXPECT_EQ(guard.count(), 0);
  EXPECT_GT(map.replaced(), 100);
  EXPECT_GT(found, 2000);
}

// An image that moves, a lost one now and then, and one of nothing.
TEST(RealtimeAllocation, TrackingFromTheStartAllocatesNothing) {
  std::mt19937_64 random(1);
  const AnalyticImage texture(&random, 10);
  std::vector<Pixels> images;
  for (int i = 0; i < 8; ++i) {
    const Vector2<double> shift(3.2 * i, 1.7 * (i % 3));
    images.push_back(make_pixels(
        320, 200, [&](const Vector2<double>& at) { return texture(at + shift); }, 2, &random));
  }
  const Pixels blank = make_pixels(
      320, 200, [](const Vector2<double>&) { return 50.0; }, 0, &random);
  StartUpTracker tracker({320, 200});
  int observations = 0;
  int lost = 0;
  const AllocationGuard guard;
  for (std::size_t i = 0; i < 200; ++i) {
    const bool is_blank = i % 20 == 7 || i % 50 > 47;
    const StartUpStatus status = tracker.process(is_blank ? blank.view : images[i % 8].view);
    observations += tracker.observation_count();
    lost += status == StartUpStatus::kLost;
  }
  EXPECT_EQ(guard.count(), 0);
  EXPECT_GT(observations, 5000);
  EXPECT_GT(lost, 5);
}

// A narrow camera that goes round in a small circle for ever, its telemetry right.
TEST(RealtimeAllocation, OeModeAllocatesNothing) {
  constexpr int kWidth = 128;
  constexpr int kHeight = 128;
  constexpr int kImages = 20;
  constexpr double kFocalLength = 20000;  // px
  constexpr double kRadius = 8;           // px
  Calibration calibration;
  calibration.camera = {kFocalLength, 1, {0}, kWidth, kHeight};
  calibration.line_delay = 20e-6;
  std::mt19937_64 random(2);
  const AnalyticImage texture(&random, 8);
  std::vector<Pixels> images;
  const auto turn_of = [](int k) { return 2 * kPi * (k % kImages) / kImages; };
  for (int k = 0; k < kImages; ++k) {
    const Vector2<double> shift =
        kRadius * Vector2<double>(std::cos(turn_of(k)), std::sin(turn_of(k)));
    images.push_back(make_pixels(
        kWidth, kHeight, [&](const Vector2<double>& at) { return texture(at + shift); }, 2,
        &random));
  }
  OeOptions options;
  options.max_width = kWidth;
  options.max_height = kHeight;
  options.max_landmarks = 64;
  options.search.choice.max_chosen = 16;
  options.maker.cell_size_px = 16;
  OeMode oe(options);
  FrameOrientation frame;
  int in_oe = 0;
  int ties = 0;
  int without = 0;
  constexpr int kFrames = 10000;
  // A map that is taken over, and one that shows something else and is given up again.
  oe.reset(calibration);
  InterpolatedPanTilt first;
  first.angle = {kRadius / kFocalLength, 0};
  first.covariance.diagonal() << 1e-9, 1e-9, 1e-7, 1e-7;
  (void)oe.process(images[0].view, 0, &first, &frame);
  oe.maintain();
  const MapState good = oe.map_state();
  MapState bad = good;
  for (Landmark& landmark : bad.landmarks) {
    std::shuffle(landmark.pixels.begin(), landmark.pixels.end(), random);
  }
  ASSERT_GT(good.landmarks.size(), 10U);
  Calibration returned = calibration;
  returned.covariance(0, 0) = std::pow(2e-3 * kFocalLength, 2);
  const AllocationGuard guard;
  oe.reset(calibration);
  for (int k = 0; k < kFrames; ++k) {
    const double radius = kRadius / kFocalLength;
    const double rate = 2 * kPi * 25 / kImages;
    InterpolatedPanTilt telemetry;
    telemetry.time_s = k / 25.0;
    telemetry.angle = {radius * std::cos(turn_of(k)), -radius * std::sin(turn_of(k))};
    telemetry.rate = {-radius * rate * std::sin(turn_of(k)), -radius * rate * std::cos(turn_of(k))};
    telemetry.covariance.diagonal() << 1e-9, 1e-9, 1e-7, 1e-7;
    telemetry.extrapolated = k % 3 == 0;
    // Now and then no telemetry or no image.
    const ImageView image =
        k % 1000 == 500 ? ImageView{} : images[static_cast<std::size_t>(k % kImages)].view;
    const OeStatus status =
        oe.process(image, k / 25.0, k % 100 == 50 ? nullptr : &telemetry, &frame);
    in_oe += status == OeStatus::kOk ? 1 : 0;
    without += status != OeStatus::kOk ? 1 : 0;
    oe.maintain();
    telemetry.extrapolated = false;
    if (k % 6 == 0) {
      TelemetryLookUp look_up;
      while (oe.pending(k / 25.0, &look_up)) {
        oe.settle_pending(look_up.time_s == telemetry.time_s ? &telemetry : nullptr);
      }
    }
    // Now and then somebody knows where it looked.
    if (k % 50 == 20 && oe.ask_about_base()) {
      ties += oe.settle_base({{0, 0}, 1e-12 * Matrix2<double>::Identity(), k % 100 == 20}) ? 1 : 0;
    }
    if (k == kFrames / 4) oe.reset(calibration, good);
    if (k == kFrames / 2) oe.reset(calibration);
    if (k == kFrames * 5 / 8) oe.reset(returned, good, FocalLength::kLearnt);
    if (k == kFrames * 3 / 4) oe.reset(calibration, bad);
  }
  EXPECT_EQ(guard.count(), 0);
  EXPECT_GT(ties, 0);
  EXPECT_GT(in_oe, kFrames * 99 / 100);
  EXPECT_GE(without, 10);
  EXPECT_GT(oe.map().size(), 20);
  EXPECT_LE(oe.map().size(), oe.map().capacity());
}

TEST(RealtimeAllocation, OeModeOfFullHdFitsIntoThirtyTwoMebibytes) {
  OeOptions options;
  options.max_width = 1920;
  options.max_height = 1080;
  options.max_landmarks = 4096;
  EXPECT_LE(OeMode(options).memory_bytes(), std::size_t{32} << 20);
}

}  // namespace
}  // namespace alidade::test
