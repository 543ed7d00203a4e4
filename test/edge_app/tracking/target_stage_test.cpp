#include "edge_app/tracking/target_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include "edge_app/tracking/target_report.h"
#include "test/edge_app/tracking/detected_scene.h"

namespace alidade {
namespace {

using test::box_about;
using test::box_with_foot;
using test::detected;
using test::foot_of;
using test::kFramePeriod;
using test::mast;
using test::mast_plane;
using test::place_in_view;
using test::swinging_frame;

TargetOptions plane_options() { return default_target_options(TargetSpace::kPlane); }
TargetOptions sphere_options() { return default_target_options(TargetSpace::kSphere); }

// Somebody who walks through the view.
Vector2<double> walker_at(std::int64_t number) {
  static const Vector2<double> begin =
      place_in_view(mast(), swinging_frame(test::watching_calibration(), 0));
  return begin + kFramePeriod * static_cast<double>(number) * Vector2<double>(0.9, -0.7);
}

DetectedFrame walker_seen(std::int64_t number) {
  const FrameOrientation frame = swinging_frame(test::watching_calibration(), number);
  return detected(number, frame, {box_with_foot(foot_of(mast(), frame, walker_at(number)))});
}

TEST(TargetStage, FollowsAWalkerOnThePlaneWhileTheCameraTurns) {
  TargetStage stage(plane_options(), mast_plane());
  EXPECT_EQ(stage.state().updates, 0);
  for (std::int64_t i = 0; i < 100; ++i) {
    const DetectionAnswer answer = stage.add(walker_seen(i));
    ASSERT_EQ(answer.status, DetectionStatus::kTaken) << to_string(answer.status);
  }
  const TargetsState state = stage.state();
  EXPECT_EQ(state.updates, 100);
  EXPECT_EQ(state.counters.boxes_taken, 100);
  ASSERT_EQ(state.targets.size(), 1U);
  const auto reports = report_targets(state, state.record);
  ASSERT_EQ(reports.size(), 1U);
  const TargetReport& walker = reports[0];
  EXPECT_EQ(walker.identity, 1U);
  EXPECT_EQ(walker.name, "person");
  ASSERT_TRUE(walker.state && walker.pixel && walker.box);
  EXPECT_LT((walker.state->head<2>() - walker_at(99)).norm(), 0.05);
  EXPECT_LT((walker.state->tail<2>() - Vector2<double>(0.9, -0.7)).norm(), 0.1);
  EXPECT_LT((*walker.pixel - walker_seen(99).boxes[0].foot()).norm(), 1);
  EXPECT_NEAR(walker.box->height, 60, 0.5);
  EXPECT_NEAR(walker.seen_s, state.time_s, 1e-9);
  EXPECT_FALSE(walker.on_earth);
}

// Errors of plane and lens are one draw for a whole run, those of the telemetry and of the detector one for each frame.
TEST(TargetStage, ItsCovarianceHoldsWhatIsUncertainOfPlaneLensMotionAndBoxes) {
  constexpr int kRuns = 60;
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  const Calibration told = test::watching_calibration();
  TargetOptions options = plane_options();
  options.tracker.acceleration_density = 1e-4;  // who walks straight
  double with_shared = 0;
  double without = 0;
  for (int run = 0; run < kRuns; ++run) {
    Matrix<double, kPlaneParameterCount, 1> of_plane;
    for (int i = 0; i < kPlaneParameterCount; ++i) of_plane[i] = normal(random);
    const WorldPlane true_plane = plane_plus(mast(), mast().covariance.llt().matrixL() * of_plane);
    Calibration true_lens = told;
    true_lens.camera.focal_length += 2 * normal(random);
    TargetStage stage(options, mast_plane());
    for (std::int64_t i = 0; i < 50; ++i) {
      const FrameOrientation frame = swinging_frame(told, i);
      FrameOrientation seen_by = frame;
      seen_by.calibration = true_lens;
      seen_by.angle.pan += 1e-4 * normal(random);
      seen_by.angle.tilt += 1e-4 * normal(random);
      const Vector2<double> noise(2 * normal(random), 2 * normal(random));
      ASSERT_EQ(
          stage
              .add(detected(i, frame,
                            {box_with_foot(foot_of(true_plane, seen_by, walker_at(i)) + noise)}))
              .status,
          DetectionStatus::kTaken);
    }
    const TargetsState state = stage.state();
    const auto reports = report_targets(state, state.record);
    ASSERT_EQ(reports.size(), 1U);
    const Vector2<double> error = reports[0].state->head<2>() - walker_at(49);
    with_shared += error.dot(reports[0].cov.topLeftCorner<2, 2>().inverse() * error);
    without += error.dot(state.targets[0].target.state.cov.topLeftCorner<2, 2>().inverse() * error);
  }
  RecordProperty("errors_squared", std::to_string(with_shared));
  RecordProperty("errors_squared_without_shared_part", std::to_string(without));
  // chi-square of 120: 95 % lies between 91.6 and 152.2.
  EXPECT_GT(with_shared, 91.6);
  EXPECT_LT(with_shared, 152.2);
  EXPECT_GT(without, 152.2);
}

TEST(TargetStage, FollowsADroneOnTheSphere) {
  TargetStage stage(sphere_options(), nullptr);
  const Calibration calibration = test::watching_calibration();
  const auto direction_at = [](std::int64_t i) {
    const double azimuth = 0.02 + 0.01 * kFramePeriod * static_cast<double>(i);
    const double elevation = -0.19;
    return Vector3<double>(std::cos(elevation) * std::cos(azimuth),
                           std::cos(elevation) * std::sin(azimuth), -std::sin(elevation));
  };
  for (std::int64_t i = 0; i < 100; ++i) {
    const FrameOrientation frame = swinging_frame(calibration, i);
    Vector2<double> u;
    ASSERT_EQ(frame.pixel(direction_at(i), &u), ProjectionStatus::kOk);
    ASSERT_EQ(stage.add(detected(i, frame, {box_about(u)})).status, DetectionStatus::kTaken);
  }
  const TargetsState state = stage.state();
  const auto reports = report_targets(state, state.record);
  ASSERT_EQ(reports.size(), 1U);
  ASSERT_TRUE(reports[0].state && reports[0].box);
  const Vector4<double> expected(0.02 + 0.01 * kFramePeriod * 99, -0.19, 0.01, 0);
  EXPECT_LT((*reports[0].state - expected).head<2>().norm(), 1e-4);
  EXPECT_LT((*reports[0].state - expected).tail<2>().norm(), 1e-3);
  EXPECT_LT(reports[0].d_b.cross(direction_at(99)).norm(), 1e-4);
  EXPECT_NEAR(reports[0].box->height, 20, 0.1);
  // The pixel's covariance is the direction's, in pixels: both are of the filter.
  const Matrix2<double> cov_place = state.targets[0].target.state.cov.topLeftCorner<2, 2>();
  EXPECT_NEAR(reports[0].cov_px.determinant() / std::pow(2000, 4) / cov_place.determinant(), 1,
              0.1);
  // What calibration leaves open comes on top of it.
  EXPECT_GT(reports[0].cov(1, 1), state.targets[0].target.state.cov(1, 1) + 1e-10);
}

// Of a picture of 1920x1080 px, beside one that is right.
TEST(TargetStage, LeavesOutTheBoxThatIsOfNoUseAndTakesTheOthers) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const struct {
    DetectionBox box;
    BoxFault fault;
  } bad[] = {{{kNan, 500, 20, 60, 1, ""}, BoxFault::kNotFinite},
             {{900, 500, 20, kInfinite, 1, ""}, BoxFault::kNotFinite},
             {{900, 500, 20, 60, kNan, ""}, BoxFault::kNotFinite},
             {{900, 500, 20, 60, 1.01, ""}, BoxFault::kBadScore},
             {{900, 500, 20, 60, -0.1, ""}, BoxFault::kBadScore},
             {{1911, 500, 20, 60, 1, ""}, BoxFault::kOutside},
             {{900, -61, 20, 60, 1, ""}, BoxFault::kOutside},
             {{900, 500, 0, 60, 1, ""}, BoxFault::kNoSize},
             {{900, 500, 20, -4, 1, ""}, BoxFault::kNoSize},
             {{-1e300, 0, 2e300, 10, 1, ""}, BoxFault::kTooLarge}};
  TargetStage stage(plane_options(), mast_plane());
  TargetStage quiet(plane_options(), mast_plane());
  std::int64_t number = 0;
  for (int round = 0; round < 3; ++round) {
    for (const auto& one : bad) {
      DetectedFrame frame = walker_seen(number);
      ASSERT_EQ(quiet.add(frame).status, DetectionStatus::kTaken);
      const bool first = number % 2 == 0;
      frame.boxes.insert(first ? frame.boxes.begin() : frame.boxes.end(), one.box);
      const DetectionAnswer answer = stage.add(frame);
      ASSERT_EQ(answer.status, DetectionStatus::kTaken);
      ASSERT_EQ(answer.left_out.size(), 1U);
      EXPECT_EQ(answer.left_out[0].box, first ? 0U : 1U);
      EXPECT_EQ(answer.left_out[0].fault, one.fault) << to_string(one.fault);
      ++number;
    }
  }
  const TargetsState state = stage.state();
  EXPECT_EQ(state.counters.of(DetectionStatus::kTaken), 30);
  EXPECT_EQ(state.counters.boxes_taken, 30);
  EXPECT_EQ(state.counters.of(BoxFault::kNotFinite), 9);
  EXPECT_EQ(state.counters.of(BoxFault::kOutside), 6);
  EXPECT_THAT(detections_text(state.counters),
              testing::HasSubstr("30 frames of detections; boxes left out: 9 (a number of it is"));
  ASSERT_EQ(state.targets.size(), 1U);
  EXPECT_EQ(state.targets[0].target.state.mean, quiet.state().targets.at(0).target.state.mean);
  EXPECT_EQ(state.targets[0].target.state.cov, quiet.state().targets.at(0).target.state.cov);
  // As one in which nothing was found.
  DetectedFrame nothing = walker_seen(number);
  nothing.boxes = {bad[0].box, bad[5].box};
  EXPECT_EQ(stage.add(nothing).status, DetectionStatus::kTaken);
}

TEST(TargetStage, RefusesAWholeFrameWithTheReasonAndTracksGoOn) {
  TargetOptions options = plane_options();
  options.tracker.max_detections = 3;
  TargetStage stage(options, mast_plane());
  TargetStage quiet(options, mast_plane());
  for (std::int64_t i = 0; i < 20; ++i) {
    ASSERT_EQ(stage.add(walker_seen(i)).status, DetectionStatus::kTaken);
    ASSERT_EQ(quiet.add(walker_seen(i)).status, DetectionStatus::kTaken);
    const DetectionBox good = box_with_foot({960, 700});
    DetectedFrame frame = walker_seen(i + 1000);
    frame.boxes = {good};
    const auto refused = [&](auto spoil, DetectionStatus status) {
      DetectedFrame bad = frame;
      bad.boxes.push_back(good);
      spoil(&bad);
      const DetectionAnswer answer = stage.add(bad);
      EXPECT_EQ(answer.status, status) << to_string(answer.status);
    };
    using Frame = DetectedFrame*;
    for (const std::size_t many : {std::size_t{4}, std::size_t{10'000}}) {
      refused([&](Frame f) { f->boxes.resize(many, good); }, DetectionStatus::kTooManyBoxes);
    }
    refused([](Frame f) { f->record.orientation.reset(); }, DetectionStatus::kNoOrientation);
    refused([](Frame f) { f->record.time_s.reset(); }, DetectionStatus::kNoOrientation);
    DetectedFrame again = walker_seen(i);
    again.boxes.clear();
    EXPECT_EQ(stage.add(again).status, DetectionStatus::kRepeated);
  }
  const TargetsState state = stage.state();
  EXPECT_EQ(state.counters.of(DetectionStatus::kNoOrientation), 40);
  EXPECT_EQ(state.counters.of(DetectionStatus::kTaken), 20);
  EXPECT_EQ(state.counters.boxes_taken, 20);
  ASSERT_EQ(state.targets.size(), 1U);
  EXPECT_EQ(state.targets[0].target.state.mean, quiet.state().targets.at(0).target.state.mean);
  EXPECT_EQ(state.targets[0].target.state.cov, quiet.state().targets.at(0).target.state.cov);
}

TEST(TargetStage, LeavesOutBoxesThatTellNoPlace) {
  TargetOptions options = plane_options();
  options.least_score = 0.5;
  TargetStage stage(options, mast_plane());
  Calibration calibration = test::watching_calibration();
  // The horizon is in the middle of the picture.
  const FrameOrientation frame = test::watching_frame(calibration, 0.1, 0, 0, 0);
  DetectionBox doubtful = box_with_foot({900, 900});
  doubtful.score = 0.4;
  // On the ground, and so far away that 2 px are a fifth of it and more.
  const Vector2<double> near = place_in_view(mast(), frame, {960, 800});
  const Vector2<double> below = mast().position.head<2>();
  const Vector2<double> far = below + 5000 * (near - below).normalized();
  ASSERT_EQ(stage
                .add(detected(1, frame,
                              {box_with_foot({900, 900}), doubtful, box_with_foot({400, 1079.5}),
                               box_with_foot({1000, 1100}), box_with_foot({1000, 100}),
                               box_with_foot(foot_of(mast(), frame, far))}))
                .status,
            DetectionStatus::kTaken);
  const TargetCounters counters = stage.state().counters;
  EXPECT_EQ(counters.boxes_taken, 1);
  EXPECT_EQ(counters.boxes_below_score, 1);
  EXPECT_EQ(counters.boxes_cut_off, 2);
  EXPECT_EQ(counters.boxes_without_place, 2);
}

TEST(TargetStage, LateFramesGiveWhatTheRightOrderHadGiven) {
  TargetStage late(plane_options(), mast_plane());
  TargetStage in_order(plane_options(), mast_plane());
  for (std::int64_t i = 0; i < 80; ++i) {
    ASSERT_EQ(in_order.add(walker_seen(i)).status, DetectionStatus::kTaken);
    if (i != 35) {
      ASSERT_EQ(late.add(walker_seen(i)).status, DetectionStatus::kTaken);
    }
  }
  EXPECT_EQ(late.add(walker_seen(35)).status, DetectionStatus::kTakenLate);
  const TargetsState a = late.state();
  const TargetsState b = in_order.state();
  ASSERT_EQ(a.targets.size(), 1U);
  EXPECT_EQ(a.targets[0].target.identity, b.targets.at(0).target.identity);
  EXPECT_EQ(a.targets[0].target.state.mean, b.targets[0].target.state.mean);
  EXPECT_EQ(a.targets[0].target.state.cov, b.targets[0].target.state.cov);
  EXPECT_EQ(*a.record.frame, 79);
  EXPECT_EQ(late.add(walker_seen(28)).status, DetectionStatus::kRepeated);
  // 2 s back. Nothing of it is counted.
  DetectedFrame too_late = walker_seen(-1);
  too_late.boxes.push_back(box_with_foot({400, 1079.5}));
  EXPECT_EQ(late.add(too_late).status, DetectionStatus::kTooLate);
  EXPECT_EQ(late.state().counters.boxes_cut_off, 0);
  EXPECT_EQ(late.state().counters.of(DetectionStatus::kTakenLate), 1);
}

TEST(TargetStage, ATargetHasTheClassThatMostOfItsDetectionsHave) {
  TargetStage stage(plane_options(), mast_plane());
  for (std::int64_t i = 0; i < 40; ++i) {
    DetectedFrame frame = walker_seen(i);
    frame.boxes[0].name = i % 3 == 2 ? "bicycle" : "person";
    ASSERT_EQ(stage.add(frame).status, DetectionStatus::kTaken);
    const auto targets = stage.state().targets;
    if (i > 5) {
      EXPECT_EQ(targets.at(0).look.name, "person") << i;
    }
  }
  for (std::int64_t i = 40; i < 60; ++i) {
    DetectedFrame frame = walker_seen(i);
    frame.boxes[0].name = "bicycle";
    ASSERT_EQ(stage.add(frame).status, DetectionStatus::kTaken);
  }
  EXPECT_EQ(stage.state().targets.at(0).look.name, "bicycle");
}

TEST(TargetReport, MovesToAnotherFrameAndItsLens) {
  TargetStage stage(plane_options(), mast_plane());
  for (std::int64_t i = 0; i < 100; ++i) static_cast<void>(stage.add(walker_seen(i)));
  const TargetsState state = stage.state();
  Calibration zoomed = test::watching_calibration(2200);
  for (const std::int64_t number : {80, 99, 112}) {
    const FrameOrientation frame = swinging_frame(zoomed, number);
    const auto reports = report_targets(state, test::record_of(number, frame));
    ASSERT_EQ(reports.size(), 1U);
    EXPECT_LT((reports[0].state->head<2>() - walker_at(number)).norm(), 0.1) << number;
    ASSERT_TRUE(reports[0].pixel && reports[0].box);
    EXPECT_LT((*reports[0].pixel - foot_of(mast(), frame, walker_at(number))).norm(), 4);
    EXPECT_NEAR(reports[0].box->height, 66, 1);
    EXPECT_NEAR(reports[0].box->foot().y(), reports[0].pixel->y(), 1e-9);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix4<double>>(reports[0].cov).eigenvalues()[0], 0);
    if (number != 99) {
      EXPECT_GT(reports[0].cov.trace(), report_targets(state, state.record)[0].cov.trace());
    }
  }
  // Turned away: its place is known, its pixel is none.
  const FrameOrientation away = test::watching_frame(zoomed, 2.5, -0.2);
  const auto reports = report_targets(state, test::record_of(100, away));
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_FALSE(reports[0].pixel || reports[0].box);
  EXPECT_TRUE(reports[0].state);
}

// Without noise it is where it would have come from, and the other way round.
TEST(TargetReport, OfBeforeAndAfterHasTheCovarianceOfAStraightWay) {
  TargetStage stage(plane_options(), mast_plane());
  for (std::int64_t i = 0; i < 30; ++i) static_cast<void>(stage.add(walker_seen(i)));
  TargetsState state = stage.state();
  state.acceleration_density = 0;
  const Matrix4<double> cov = state.targets.at(0).target.state.cov;
  const Matrix2<double> of_velocity = cov.bottomRightCorner<2, 2>();
  for (const std::int64_t number : {10, 45}) {
    const double dt_s = static_cast<double>(number - 29) * kFramePeriod;
    const auto reports = report_targets(
        state, test::record_of(number, swinging_frame(test::watching_calibration(), number)));
    ASSERT_EQ(reports.size(), 1U);
    // What plane and lens are uncertain by is in the place's alone.
    const Matrix2<double> across = cov.topRightCorner<2, 2>() + dt_s * of_velocity;
    EXPECT_LT((reports[0].cov.topRightCorner<2, 2>() - across).norm(), 1e-6 * across.norm());
    EXPECT_LT((reports[0].cov.bottomRightCorner<2, 2>() - of_velocity).norm(), 1e-12);
  }
}

TEST(TargetReport, TellsWhereOnEarthATargetIs) {
  PlaneEstimate plane;
  plane.plane = mast();
  plane.origin = GeodeticPosition{0.8, 0.2, 500};
  TargetStage stage(plane_options(), std::make_shared<const PlaneEstimate>(plane));
  for (std::int64_t i = 0; i < 10; ++i) static_cast<void>(stage.add(walker_seen(i)));
  const TargetsState state = stage.state();
  const auto reports = report_targets(state, state.record);
  ASSERT_EQ(reports.size(), 1U);
  ASSERT_TRUE(reports[0].on_earth);
  const Vector3<double> back = LocalFrame(*plane.origin).local(*reports[0].on_earth);
  EXPECT_LT((back.head<2>() - reports[0].state->head<2>()).norm(), 1e-6);
  EXPECT_NEAR(back.z(), 0, 1e-6);
}

TEST(TargetOptions, AreChecked) {
  const char* problem = nullptr;
  EXPECT_TRUE(plane_options().validate(&problem));
  EXPECT_TRUE(sphere_options().validate(&problem));
  const auto refused = [&problem](auto spoil) {
    TargetOptions options = plane_options();
    spoil(&options);
    problem = nullptr;
    return !options.validate(&problem) && problem != nullptr;
  };
  EXPECT_TRUE(refused([](TargetOptions* o) { o->detection_sigma_px = 0; }));
  EXPECT_TRUE(refused([](TargetOptions* o) { o->false_alarms = 0; }));
  EXPECT_TRUE(refused([](TargetOptions* o) { o->least_score = 1.5; }));
  EXPECT_TRUE(refused([](TargetOptions* o) { o->tracker.birth_hits = 0; }));
}

}  // namespace
}  // namespace alidade
