#include "core/tracking/target_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "test/support/allocation_guard.h"
#include "test/support/target_scene.h"

namespace alidade {
namespace {

constexpr double kDt = 0.04;
constexpr double kNow = 1e6;

// Places on the plane, measured there, 0.1 m; the view is 100 m wide about the origin.
struct Look {
  TargetFrame frame;
  std::vector<TargetMeasurement> detections;

  explicit Look(double time_s, const std::vector<Vector2<double>>& places = {}) {
    for (const auto& place : places)
      detections.push_back({place, 0.01 * Matrix2<double>::Identity()});
    frame.time_s = time_s;
    frame.false_alarm_density = 1e-4;
    frame.view = picture_region(100, 100);
    frame.view.edges[0].z() = 50;
    frame.view.edges[1].z() = 50;
    frame.view.edges[2].z() = 50;
    frame.view.edges[3].z() = 50;
  }
};

FrameAnswer add(Look look, TargetTracker* tracker, double now_s = kNow) {
  look.frame.detections = look.detections.data();
  look.frame.count = static_cast<int>(look.detections.size());
  return tracker->add(look.frame, now_s);
}

int confirmed(const TargetTracker& tracker) {
  return static_cast<int>(std::count_if(tracker.targets().begin(), tracker.targets().end(),
                                        [](const Target& t) { return t.identity != 0; }));
}

Look look_at(const test::SceneFrame& scene) {
  Look look(scene.time_s);
  for (const auto& detection : scene.detections) {
    look.detections.push_back({detection.pixel, 4 * Matrix2<double>::Identity()});
  }
  look.frame.view = picture_region(test::kSceneWidth, test::kSceneHeight);
  look.frame.H_measured_from_world = scene.H_picture_from_plane();
  look.frame.false_alarm_density = 0.1 / (test::kSceneWidth * test::kSceneHeight);
  return look;
}

bool same(const std::vector<Target>& a, const std::vector<Target>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].identity != b[i].identity || a[i].state.mean != b[i].state.mean ||
        a[i].state.cov != b[i].state.cov || a[i].detection != b[i].detection) {
      return false;
    }
  }
  return true;
}

TEST(ViewRegion, HoldsAPlaceAsLikelyAsItsCovarianceSays) {
  const ViewRegion region = picture_region(1000, 500);
  Matrix2<double> cov;
  cov << 100, 30, 30, 25;
  EXPECT_NEAR(probability_in_view(region, {500, 250}, cov), 1, 1e-12);
  EXPECT_NEAR(probability_in_view(region, {0, 250}, cov), 0.5, 1e-12);
  EXPECT_NEAR(probability_in_view(region, {1000, 500}, cov), 0.25, 1e-12);
  // One sigma outside, by x and by y.
  EXPECT_NEAR(probability_in_view(region, {1010, 250}, cov), 0.158655, 1e-6);
  EXPECT_NEAR(probability_in_view(region, {500, -5}, cov), 0.158655, 1e-6);
  EXPECT_EQ(probability_in_view({}, {1e9, 1e9}, cov), 1);
}

TEST(TargetTracker, BearsATargetFromThreeLooksOfFive) {
  TargetTracker tracker({});
  EXPECT_EQ(add(Look(0, {{1, 2}}), &tracker).status, FrameStatus::kTaken);
  (void)add(Look(kDt), &tracker);
  (void)add(Look(2 * kDt, {{1, 2}}), &tracker);
  EXPECT_EQ(confirmed(tracker), 0);
  (void)add(Look(3 * kDt, {{1, 2}}), &tracker);
  ASSERT_EQ(confirmed(tracker), 1);
  EXPECT_EQ(tracker.targets()[0].identity, 1U);
  EXPECT_LT((tracker.targets()[0].state.mean.head<2>() - Vector2<double>(1, 2)).norm(), 0.1);
}

TEST(TargetTracker, TakesNoFalseAlarmForATarget) {
  TargetTracker tracker({});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-40, 40);
  for (int k = 0; k < 500; ++k)
    (void)add(Look(k * kDt, {{place(random), place(random)}}), &tracker);
  EXPECT_EQ(confirmed(tracker), 0);
}

TEST(TargetTracker, GivesUpWhatIsInViewAndNotSeen) {
  TargetTracker tracker({});
  for (int k = 0; k < 10; ++k) (void)add(Look(k * kDt, {{1, 2}}), &tracker);
  int k = 10;
  for (; k < 32; ++k) (void)add(Look(k * kDt), &tracker);
  EXPECT_EQ(confirmed(tracker), 1);
  for (; k < 40; ++k) (void)add(Look(k * kDt), &tracker);
  EXPECT_EQ(confirmed(tracker), 0);
}

// The gate is as wide as the detection's own noise makes it.
TEST(TargetTracker, TakesADetectionThatIsAsFarOffAsItMayBe) {
  TargetTracker tracker({});
  for (int k = 0; k < 10; ++k) (void)add(Look(k * kDt, {{1, 2}}), &tracker);
  for (const double offset : {-10.0, 10.0}) {
    TargetTracker copy = tracker;
    Look look(10 * kDt, {{1 + offset, 2}});
    look.detections[0].cov = 100 * Matrix2<double>::Identity();
    (void)add(look, &copy);
    ASSERT_EQ(copy.targets().size(), 1U);
    EXPECT_EQ(copy.targets()[0].detection, 0) << offset;
  }
}

TEST(TargetTracker, WaitsForWhatIsOutOfViewAndKnowsItAgain) {
  TargetTracker tracker({});
  const auto place = [](int k) { return Vector2<double>(48 + 0.04 * k, 2); };  // 1 m/s
  const auto back = [&](int k) { return Vector2<double>(52 - 0.04 * (k - 200), 2); };
  for (int k = 0; k < 50; ++k) (void)add(Look(k * kDt, {place(k)}), &tracker);
  ASSERT_EQ(confirmed(tracker), 1);
  const double sigma = std::sqrt(tracker.targets()[0].state.cov(0, 0));
  for (int k = 50; k < 250; ++k) (void)add(Look(k * kDt), &tracker);
  ASSERT_EQ(confirmed(tracker), 1);
  EXPECT_GT(std::sqrt(tracker.targets()[0].state.cov(0, 0)), 20 * sigma);
  for (int k = 250; k < 275; ++k) (void)add(Look(k * kDt, {back(k)}), &tracker);
  ASSERT_EQ(confirmed(tracker), 1);
  EXPECT_EQ(tracker.targets()[0].identity, 1U);
  EXPECT_LT((tracker.targets()[0].state.mean.head<2>() - back(274)).norm(), 0.3);
}

TEST(TargetTracker, HandsOverBetweenZooms) {
  TargetTracker tracker({});
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  double sigma_wide = 0;
  for (int k = 0; k < 150; ++k) {
    // Ten times as far in, from one frame to the next, and back.
    const double f = k >= 50 && k < 100 ? 500 : 50;
    const Vector2<double> place(0.04 * k - 3, 0.3);
    Look look(k * kDt, {f * place + 2 * Vector2<double>(normal(random), normal(random))});
    look.detections[0].cov = 4 * Matrix2<double>::Identity();
    look.frame.H_measured_from_world = Vector3<double>(f, f, 1).asDiagonal();
    look.frame.view.count = 0;
    look.frame.false_alarm_density = 1e-7;
    ASSERT_EQ(add(look, &tracker).status, FrameStatus::kTaken);
    if (k < 3) continue;
    ASSERT_EQ(confirmed(tracker), 1) << k;
    EXPECT_EQ(tracker.targets()[0].identity, 1U);
    const double sigma = std::sqrt(tracker.targets()[0].state.cov(0, 0));
    if (k == 49) sigma_wide = sigma;
    if (k == 99) {
      EXPECT_LT(sigma, sigma_wide / 4);
    }
  }
}

TEST(TargetTracker, ForgetsWhatIsAwayForLong) {
  TargetTrackerOptions options;
  options.forget_after_s = 3;
  TargetTracker tracker(options);
  for (int k = 0; k < 50; ++k) (void)add(Look(k * kDt, {{48 + 0.04 * k, 2}}), &tracker);
  (void)add(Look(4.8), &tracker);
  EXPECT_EQ(confirmed(tracker), 1);
  (void)add(Look(5.2), &tracker);
  EXPECT_EQ(confirmed(tracker), 0);
}

TEST(TargetTracker, LetsTheYoungerOfTwoOnOneTargetGo) {
  TargetTracker tracker({});
  // Two that come together and of which one is left.
  for (int k = 0; k < 50; ++k) {
    (void)add(Look(k * kDt, {{-2 + 0.04 * k, 0}, {2 - 0.04 * k, 0.02}}), &tracker);
  }
  EXPECT_EQ(confirmed(tracker), 2);
  for (int k = 50; k < 150; ++k) (void)add(Look(k * kDt, {{0, 0}}), &tracker);
  EXPECT_EQ(confirmed(tracker), 1);
}

class LateFrames : public testing::Test {
 protected:
  LateFrames() {
    test::TargetSceneOptions options;
    options.duration_s = 12;
    options.seed = 4;
    for (const auto& frame : test::simulate_targets(options)) looks_.push_back(look_at(frame));
  }
  std::vector<Look> looks_;
};

TEST_F(LateFrames, GiveWhatTheRightOrderGives) {
  TargetTracker in_order({});
  TargetTracker late({});
  for (std::size_t k = 0; k < looks_.size(); ++k) {
    (void)add(looks_[k], &in_order);
    // Every 40th frame comes 1.4 s late.
    if (k % 40 != 3) {
      EXPECT_EQ(add(looks_[k], &late).status, FrameStatus::kTaken);
    }
    if (k >= 38 && k % 40 == 38) {
      const FrameAnswer answer = add(looks_[k - 35], &late);
      EXPECT_EQ(answer.status, FrameStatus::kTakenLate);
      EXPECT_EQ(answer.steps, 36);
      EXPECT_TRUE(same(in_order.targets(), late.targets())) << k;
    }
  }
  EXPECT_GE(confirmed(late), 2);
}

TEST_F(LateFrames, MayBeTheFirst) {
  TargetTracker in_order({});
  TargetTracker late({});
  for (const std::size_t k : {0U, 1U, 2U, 3U, 4U, 5U}) (void)add(looks_[k], &in_order);
  for (const std::size_t k : {1U, 2U, 4U, 0U, 5U, 3U}) (void)add(looks_[k], &late);
  EXPECT_GE(confirmed(late), 2);
  // But for the identities, which had been given out before the first frame came.
  std::vector<Target> targets = late.targets();
  ASSERT_EQ(targets.size(), in_order.targets().size());
  for (std::size_t i = 0; i < targets.size(); ++i) {
    EXPECT_EQ(targets[i].identity == 0, in_order.targets()[i].identity == 0);
    targets[i].identity = in_order.targets()[i].identity;
  }
  EXPECT_TRUE(same(in_order.targets(), targets));
}

TEST_F(LateFrames, ChangeNoIdentity) {
  TargetTracker tracker({});
  std::mt19937 random(6);
  // Two detectors: one at once, one up to 1.5 s late in any order; births are done again many times.
  std::multimap<std::size_t, std::size_t> later;
  std::map<std::uint64_t, Vector2<double>> places;
  std::uint64_t most = 0;
  int taken_late = 0;
  for (std::size_t k = 0; k < looks_.size(); ++k) {
    if (k % 2 == 0) {
      (void)add(looks_[k], &tracker);
    } else {
      later.emplace(k + 1 + random() % 37, k);
    }
    for (auto i = later.begin(); i != later.end() && i->first <= k; i = later.erase(i)) {
      taken_late += add(looks_[i->second], &tracker).status == FrameStatus::kTakenLate ? 1 : 0;
    }
    std::set<std::uint64_t> seen;
    for (const Target& target : tracker.targets()) {
      if (target.identity == 0) continue;
      EXPECT_TRUE(seen.insert(target.identity).second);
      const Vector2<double> place = target.state.mean.head<2>();
      const auto before = places.find(target.identity);
      if (before != places.end()) {
        EXPECT_LT((place - before->second).norm(), 0.6);
      }
      places[target.identity] = place;
      most = std::max(most, target.identity);
    }
  }
  EXPECT_GT(taken_late, 100);
  EXPECT_LE(most, 4U);
}

TEST_F(LateFrames, AreRefusedWhereTheHistoryEnds) {
  TargetTrackerOptions options;
  options.history_frames = 10;
  TargetTracker tracker(options);
  for (std::size_t k = 0; k < 30; ++k) (void)add(looks_[k], &tracker);
  const std::vector<Target> before = tracker.targets();
  EXPECT_EQ(add(looks_[20], &tracker).status, FrameStatus::kTooLate);
  EXPECT_TRUE(same(before, tracker.targets()));
  EXPECT_EQ(add(looks_[21], &tracker).status, FrameStatus::kTakenLate);
  options.history_frames = 1;
  TargetTracker shortest(options);
  for (std::size_t k = 0; k < 30; ++k) (void)add(looks_[k], &shortest);
  EXPECT_EQ(add(looks_[28], &shortest).status, FrameStatus::kTooLate);
  TargetTracker long_one({});
  for (const Look& look : looks_) (void)add(look, &long_one);
  EXPECT_EQ(add(looks_[looks_.size() - 60], &long_one).status, FrameStatus::kTooLate);
}

TEST(TargetTracker, RefusesABadFrameAsAWholeAndKeepsItsTargets) {
  TargetTracker tracker({});
  for (int k = 0; k < 10; ++k) (void)add(Look(k * kDt, {{1, 2}, {-5, 3}}), &tracker);
  const std::vector<Target> before = tracker.targets();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const double t = 10 * kDt;
  const auto expect = [&](const Look& look, FrameStatus status, int detection) {
    const FrameAnswer answer = add(look, &tracker, t);
    EXPECT_EQ(answer.status, status) << to_string(answer.status);
    EXPECT_EQ(answer.detection, detection);
    EXPECT_TRUE(same(before, tracker.targets()));
  };
  expect(Look(t, {{1, 2}, {nan, 3}}), FrameStatus::kDetectionNotFinite, 1);
  expect(Look(t, {{1, inf}}), FrameStatus::kDetectionNotFinite, 0);
  expect(Look(t, {{1, 2}, {1, 2}, {1, 60}}), FrameStatus::kDetectionOutside, 2);
  expect(Look(t + 86400), FrameStatus::kInTheFuture, -1);
  expect(Look(-86400), FrameStatus::kTooLate, -1);
  expect(Look(nan), FrameStatus::kBadFrame, -1);
  expect(Look(t, std::vector<Vector2<double>>(10000, {1, 2})), FrameStatus::kTooManyDetections, -1);
  Look look(t, {{1, 2}});
  look.detections[0].cov(0, 1) = 1;
  expect(look, FrameStatus::kDetectionCovariance, 0);
  look.detections[0].cov << 0.01, 0.02, 0.02, 0.01;
  expect(look, FrameStatus::kDetectionCovariance, 0);
  look.detections[0].cov.setZero();
  expect(look, FrameStatus::kDetectionCovariance, 0);
  look = Look(t, {{1, 2}});
  look.frame.H_measured_from_world(2, 2) = 0;
  expect(look, FrameStatus::kBadFrame, -1);
  look = Look(t, {{1, 2}});
  look.frame.H_measured_from_world(0, 0) = nan;
  expect(look, FrameStatus::kBadFrame, -1);
  look = Look(t, {{1, 2}});
  look.frame.false_alarm_density = 0;
  expect(look, FrameStatus::kBadFrame, -1);
  EXPECT_EQ(add(Look(t, {{1, 2}, {-5, 3}}), &tracker, t).status, FrameStatus::kTaken);
}

TEST(TargetTracker, HoldsNoMoreTargetsThanItMayAndSaysSo) {
  TargetTrackerOptions options;
  options.max_targets = 5;
  TargetTracker tracker(options);
  std::vector<Vector2<double>> places;
  for (int i = 0; i < 20; ++i) places.emplace_back(4 * i - 40, 0);
  for (int k = 0; k < 5; ++k) (void)add(Look(k * kDt, places), &tracker);
  EXPECT_EQ(confirmed(tracker), 5);
  EXPECT_EQ(tracker.births_refused(), 75);
}

TEST(TargetTracker, AllocatesNothingAfterItsConstruction) {
  test::TargetSceneOptions scene;
  scene.kind = test::SceneKind::kHockey;
  scene.targets = 12;
  scene.false_alarms = 5;
  scene.duration_s = 8;
  std::vector<Look> looks;
  for (const auto& frame : test::simulate_targets(scene)) looks.push_back(look_at(frame));
  for (const AssociationMethod method :
       {AssociationMethod::kExact, AssociationMethod::kCheap, AssociationMethod::kNearest}) {
    TargetTrackerOptions options;
    options.association = method;
    TargetTracker tracker(options);
    for (Look& look : looks) {
      look.frame.detections = look.detections.data();
      look.frame.count = static_cast<int>(look.detections.size());
    }
    const test::AllocationGuard guard;
    int late = 0;
    for (std::size_t k = 0; k < looks.size(); ++k) {
      // Every fifth frame comes 20 frames late.
      if (k % 5 != 0) (void)tracker.add(looks[k].frame, kNow);
      if (k >= 20 && k % 5 == 0) {
        late += tracker.add(looks[k - 20].frame, kNow).status == FrameStatus::kTakenLate ? 1 : 0;
      }
    }
    EXPECT_EQ(guard.count(), 0);
    EXPECT_GT(late, 30);
    EXPECT_GE(confirmed(tracker), 8);
    // The guard bites.
    const test::AllocationGuard second;
    TargetTracker other(options);
    EXPECT_GT(second.count(), 0);
  }
}

TEST(TargetTracker, FollowsADroneOverTheZenith) {
  TargetTrackerOptions options;
  options.space = TargetSpace::kSphere;
  options.acceleration_density = 1e-4;
  options.sigma_first_velocity = 0.2;
  options.most_sigma = 0.5;
  TargetTracker tracker(options);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 200; ++k) {
    // On a great circle that misses the zenith by a thousandth, 0.1 rad/s; the camera looks at it, f 1500 px.
    const double a = 0.1 * (k * kDt - 4);
    const Vector3<double> d(std::sin(a), 1e-3, -std::cos(a));
    const Vector3<double> forward = (d + Vector3<double>(0.05, 0.02, 0)).normalized();
    const Vector3<double> right = forward.cross(Vector3<double>::UnitX()).normalized();
    Matrix3<double> H;
    H << 1500 * right.transpose() + 640 * forward.transpose(),
        1500 * forward.cross(right).transpose() + 360 * forward.transpose(), forward.transpose();
    const Vector2<double> pixel = (H * d).hnormalized();
    Look look(k * kDt);
    look.frame.H_measured_from_world = H;
    look.frame.view = picture_region(1280, 720);
    look.frame.false_alarm_density = 1e-7;
    look.detections.push_back(
        {pixel + Vector2<double>(normal(random), normal(random)), Matrix2<double>::Identity()});
    ASSERT_EQ(add(look, &tracker).status, FrameStatus::kTaken);
    if (k > 20) {
      ASSERT_EQ(confirmed(tracker), 1);
      EXPECT_EQ(tracker.targets()[0].identity, 1U);
      EXPECT_LT((target_direction(tracker.targets()[0].state) - d.normalized()).norm(), 4.0 / 1500);
    }
  }
}

TEST(TargetTrackerOptions, AreChecked) {
  TargetTrackerOptions options;
  EXPECT_TRUE(options.validate());
  const char* error = nullptr;
  options.detection_probability = 1;
  EXPECT_FALSE(options.validate(&error));
  EXPECT_STREQ(error, "detection_probability must be above 0 and below 1");
  options = {};
  options.birth_looks = 2;
  EXPECT_FALSE(options.validate());
  options = {};
  options.forget_after_s = options.lose_after_s;
  EXPECT_TRUE(options.validate());
  options.forget_after_s = options.lose_after_s / 2;
  EXPECT_FALSE(options.validate());
  options = {};
  options.acceleration_density = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(options.validate());
}

}  // namespace
}  // namespace alidade
