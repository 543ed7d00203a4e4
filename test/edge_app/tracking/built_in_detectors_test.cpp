#include "edge_app/tracking/built_in_detectors.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "test/core/detection/panning_camera.h"

namespace alidade {
namespace {

DetectableFrame panned_frame(const FrameOrientation& orientation, std::int64_t number,
                             const ImageView& image) {
  DetectableFrame frame;
  frame.record.frame = number;
  frame.record.time_s = orientation.time_s;
  frame.record.mode = RecordMode::kOe;
  frame.record.calibrated = true;
  frame.record.camera = pack(orientation.calibration);
  frame.record.orientation = orientation_of(orientation);
  frame.image = image;
  return frame;
}

TEST(BuiltInDetectors, TellTheFeedWhatMovesAndNothingOfPicturesThatTheyCannotJudge) {
  constexpr int kFrames = 12;
  TargetFeed feed(default_target_options(TargetSpace::kSphere), nullptr);
  BuiltInDetectorOptions options;
  options.motion.emplace();
  options.motion->exposure_s = 0.001;
  BuiltInDetectors detectors(options, nullptr, nullptr, feed);
  test::PanningCamera camera;
  camera.disc.emplace();
  camera.disc->velocity = {90, 40};
  for (int i = 0; i < kFrames; ++i) {
    const FrameOrientation orientation = camera.orientation(i);
    const test::Pixels image = camera.image(orientation);
    detectors.look(panned_frame(orientation, i, image.view));
  }
  const DetectorsReport report = detectors.report();
  EXPECT_FALSE(report.counters[DetectorKind::kPeople]);
  ASSERT_TRUE(report.counters[DetectorKind::kMotion]);
  EXPECT_EQ(report.counters[DetectorKind::kMotion]->pictures, kFrames);
  // Two pictures before it are what one is compared with.
  EXPECT_EQ(report.counters[DetectorKind::kMotion]->unjudged, 2);
  EXPECT_GT(report.counters[DetectorKind::kMotion]->boxes, 0);
  EXPECT_EQ(feed.snapshot().waiting, static_cast<std::size_t>(kFrames - 2));
}

TEST(BuiltInDetectors, APictureTooSmallIsNotJudged) {
  TargetFeed feed(default_target_options(TargetSpace::kSphere), nullptr);
  BuiltInDetectorOptions options;
  options.motion.emplace();
  BuiltInDetectors detectors(options, nullptr, nullptr, feed);
  const std::vector<std::uint8_t> luma(32 * 32);
  detectors.look(
      panned_frame(test::PanningCamera().orientation(0), 0, ImageView{luma.data(), 32, 32, 32}));
  EXPECT_EQ(detectors.report().counters[DetectorKind::kMotion]->unjudged, 1);
  EXPECT_EQ(feed.snapshot().waiting, 0U);
}

// Its answer is known: test/data/make_networks.py.
TEST(BuiltInDetectors, WhatANetworkFindsIsNoMoverAgain) {
  TargetFeed feed(default_target_options(TargetSpace::kSphere), nullptr);
  BuiltInDetectorOptions options;
  options.motion.emplace();
  options.motion->exposure_s = 0.001;
  options.onnx.emplace();
  options.onnx->options.width_px = options.onnx->options.height_px = 64;
  options.onnx->options.threshold = 0.9;
  options.onnx->options.labels = {"bright", "dark"};
  std::ifstream file(std::string(ALIDADE_TEST_DATA) + "/bright_cells_v8.onnx", std::ios::binary);
  std::ostringstream model;
  model << file.rdbuf();
  std::string error;
  auto network = NetworkDetector::load(model.str(), options.onnx->options, &error);
  ASSERT_TRUE(network) << error;
  BuiltInDetectors detectors(options, nullptr, std::move(network), feed);
  test::PanningCamera camera(0);
  camera.disc.emplace();
  camera.disc->size_px = 140;
  camera.disc->brighter = 200;
  camera.disc->velocity = {200, 0};
  constexpr int kFrames = 12;
  std::int64_t handed_over = 0;
  for (int i = 0; i < kFrames; ++i) {
    const FrameOrientation orientation = camera.orientation(i);
    const test::Pixels image = camera.image(orientation);
    detectors.look(panned_frame(orientation, i, image.view));
    handed_over += static_cast<std::int64_t>(detectors.boxes().size());
    // The network's come first, and have names.
    for (const DetectionBox& mover : detectors.boxes()) {
      for (const DetectionBox& known : detectors.boxes()) {
        if (!mover.name.empty() || known.name.empty()) continue;
        const Vector2<double> from_corner = mover.middle() - Vector2<double>(known.u, known.v);
        EXPECT_FALSE(from_corner.x() >= 0 && from_corner.x() <= known.width &&
                     from_corner.y() >= 0 && from_corner.y() <= known.height)
            << i;
      }
    }
  }
  const DetectorsReport report = detectors.report();
  ASSERT_TRUE(report.counters[DetectorKind::kOnnx] && report.counters[DetectorKind::kMotion]);
  EXPECT_LT(handed_over, report.counters[DetectorKind::kOnnx]->boxes +
                             report.counters[DetectorKind::kMotion]->boxes);
  EXPECT_EQ(report.counters[DetectorKind::kOnnx]->pictures, kFrames);
  EXPECT_EQ(report.counters[DetectorKind::kOnnx]->unjudged, 0);
  EXPECT_GT(report.counters[DetectorKind::kOnnx]->boxes, 0);
  // The network could judge those, too, that motion could not.
  EXPECT_EQ(feed.snapshot().waiting, static_cast<std::size_t>(kFrames));
}

}  // namespace
}  // namespace alidade
