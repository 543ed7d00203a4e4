// Self-calibration of a camera that zooms: dwells become nodes of a curve, which holds in between; what contradicts it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "core/calibration/calibration_difference.h"
#include "edge_app/storage/calibration_store.h"
#include "test/edge_app/self_calibration/fed_calibration.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kRepeatability = 0.002;

// A lens that doubles its focal length every 100 readings, with an optical centre that is not the image's.
test::Simulation zoomed(double reading, std::uint64_t seed = 3) {
  test::Simulation s = test::calibrated_camera();
  s.seed = seed;
  s.width = 1280;
  s.height = 720;
  s.focal_length = 1500 * std::exp2(reading / 100);
  s.optical_centre_offset_px = {9 - 0.01 * reading, -6};
  s.image_rate_hz = 15;
  s.telemetry_rate_hz = 30;
  s.duration_s = 9;
  return s;
}

class ZoomingCamera : public ::testing::Test {
 protected:
  explicit ZoomingCamera(CalibrationArchive* archive = nullptr)
      : calibration_(test::calibration_options(zoomed(0)), archive) {}

  // Stands at this reading and turns; what is published meanwhile.
  std::vector<test::Published> dwell(double reading, const test::Simulation& s,
                                     double duration_s = 9) {
    return dwell(&calibration_, reading, s, duration_s);
  }
  std::vector<test::Published> dwell(SelfCalibration* calibration, double reading,
                                     test::Simulation s, double duration_s = 9) {
    s.duration_s = duration_s;
    test::Feed how;
    how.zoom = reading;
    if (jitter_ > 0) {
      how.zoom_at = [this, reading](double) {
        return reading + jitter_ * std::normal_distribution<double>()(random_);
      };
    }
    how.from_s = from_s_;
    how.first_frame = first_frame_;
    if (contradicting_) {
      how.tracker = FrameTracks::Tracker::kOe;
      how.contradicting_from_s = 0;
    }
    from_s_ += duration_s + 4;
    first_frame_ += 1000;
    return test::feed(calibration, s, how);
  }
  static int nodes(const std::vector<test::Published>& published) {
    return published.back().calibration->zoom_curve.content().nodes;
  }
  static double focal_length_error(const Calibration& c, double reading) {
    return std::log(c.camera.focal_length / zoomed(reading).focal_length);
  }

  double jitter_ = 0;           // sigma of the readings
  bool contradicting_ = false;  // OE mode finds that landmarks contradict telemetry
  std::mt19937 random_{8};
  double from_s_ = 0;
  std::int64_t first_frame_ = 0;
  SelfCalibration calibration_;
};

TEST_F(ZoomingCamera, OneOfOneZoomHasNoNodeAndAnExactCentre) {
  const auto published = dwell(0, zoomed(0));
  ASSERT_FALSE(published.empty());
  EXPECT_EQ(nodes(published), 0);
  EXPECT_FALSE(published.back().calibration->calibration.has_centre());
}

// By a 10,000th of a lens that zooms 30 times: one zoom is one, two are two, and two that are half a per cent apart are.
TEST_F(ZoomingCamera, AReadingThatJittersIsOneZoom) {
  jitter_ = 0.05;
  const auto first = dwell(0, zoomed(0));
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(nodes(first), 0);
  EXPECT_FALSE(first.back().calibration->calibration.has_centre()) << "there is no other zoom";
  const auto messages = test::lines_of(calibration_);
  EXPECT_THAT(messages, Contains(HasSubstr("the zoom reading jitters by 0.05")));
  EXPECT_THAT(messages, Not(Contains(HasSubstr("glitch"))));
  const auto second = dwell(200, zoomed(200, 4));
  ASSERT_FALSE(second.empty());
  ASSERT_EQ(nodes(second), 2);
  const ZoomCurve& curve = second.back().calibration->zoom_curve;
  EXPECT_NEAR(*curve.node(0).zoom, 0, jitter_);
  EXPECT_NEAR(*curve.node(1).zoom, 200, jitter_);
  const auto beside = dwell(200.7, zoomed(200.7, 5));
  ASSERT_FALSE(beside.empty());
  EXPECT_EQ(nodes(beside), 3);
  EXPECT_NEAR(*beside.back().calibration->calibration.zoom, 200.7, jitter_);
}

// By the next reading, which differs by jitter, the withdrawn one is not used again.
TEST_F(ZoomingCamera, WhatIsWithdrawnStaysSoThoughItsReadingJitters) {
  jitter_ = 0.05;
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  const auto second = dwell(200, zoomed(200, 4));
  ASSERT_FALSE(second.empty());
  ASSERT_EQ(nodes(second), 2);
  static_cast<void>(test::lines_of(calibration_));
  test::Feed how;
  how.tracker = FrameTracks::Tracker::kOe;
  how.contradicting_from_s = 0;
  how.zoom_at = [this](double) {
    return 200 + jitter_ * std::normal_distribution<double>()(random_);
  };
  how.from_s = from_s_;
  how.first_frame = first_frame_;
  const auto published = test::feed(&calibration_, zoomed(200, 5), how);
  ASSERT_FALSE(published.empty());
  EXPECT_FALSE(published[0].calibration->calibrated);
  const auto messages = test::lines_of(calibration_);
  EXPECT_THAT(messages, Contains(HasSubstr("is withdrawn")));
  EXPECT_THAT(messages, Not(Contains(HasSubstr("the calibration zoom curve holds"))));
}

TEST_F(ZoomingCamera, HasACurveFromTheSecondZoomOn) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  const auto second = dwell(200, zoomed(200, 4));
  ASSERT_FALSE(second.empty());
  const PublishedCalibration& published = *second.back().calibration;
  EXPECT_EQ(published.calibration.zoom, 200);
  ASSERT_EQ(nodes(second), 2);
  EXPECT_THAT(test::lines_of(calibration_),
              Contains(HasSubstr("zoom curve: 2 nodes from reading 0 to 200")));
  for (int i = 0; i < 2; ++i) {
    const Calibration node = published.zoom_curve.node(i);
    const test::Simulation truth = zoomed(200 * i);
    test::expect_truth(truth, node);
    for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
      const double sigma = parameter_sigma(node, p);
      EXPECT_LT(std::abs(test::calibration_error(truth, node)[index(p)]), 4.2 * sigma) << i;
    }
  }
  // Two zooms tell centre and axes apart: each alone leaves the prior of the centre.
  EXPECT_LT(parameter_sigma(published.zoom_curve.node(0), Parameter::kCentreU), 6);
  // Between and beyond: an answer whose sigma grows.
  double least = 1;
  for (const double reading : {200.0, 150.0, 100.0, 300.0, 390.0}) {
    Calibration c;
    ASSERT_TRUE(published.zoom_curve.at(reading, &c)) << reading;
    const double sigma = parameter_sigma(c, Parameter::kFocalLength) / c.camera.focal_length;
    EXPECT_LT(std::abs(focal_length_error(c, reading)), 4 * sigma) << reading;
    if (reading == 200) least = sigma;
    EXPECT_GE(sigma, least) << reading;
  }
}

// Two nodes leave the focal length between them open by some per cent: PT mode has it at once, landmarks need a calibration.
TEST_F(ZoomingCamera, AReadingBetweenBecomesANode) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  const auto second = dwell(200, zoomed(200, 4));
  ASSERT_FALSE(second.empty());
  static_cast<void>(test::lines_of(calibration_));
  Calibration before;
  ASSERT_TRUE(second.back().calibration->zoom_curve.at(120, &before));
  const auto third = dwell(120, zoomed(120, 5));
  ASSERT_FALSE(third.empty());
  EXPECT_THAT(test::lines_of(calibration_),
              AllOf(Contains(HasSubstr("zoom 120: by the zoom curve the focal length is known to")),
                    Contains(HasSubstr("zoom curve: 3 nodes from reading 0 to 200"))));
  EXPECT_EQ(nodes(third), 3);
  const Calibration& made = third.back().calibration->calibration;
  test::expect_truth(zoomed(120), made);
  EXPECT_LT(std::abs(focal_length_error(before, 120)),
            4 * parameter_sigma(before, Parameter::kFocalLength) / before.camera.focal_length);
  EXPECT_LT(parameter_sigma(made, Parameter::kFocalLength),
            0.1 * parameter_sigma(before, Parameter::kFocalLength));
}

// As while the zoom moves: its lens is known, so that nothing is lacking.
TEST_F(ZoomingCamera, OnTheCurveNoCalibrationIsLacking) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  const auto last = dwell(100, zoomed(100, 5));
  ASSERT_FALSE(last.empty());
  const auto f_sigma = [&](double reading) {
    Calibration c;
    EXPECT_TRUE(last.back().calibration->zoom_curve.at(reading, &c));
    return relative_focal_length_sigma(c);
  };
  const auto pass = [this](double from, double to) {
    for (int i = 0; i <= 10; ++i) {
      PanTiltSample sample;
      sample.earliest_time_s = sample.latest_time_s = from_s_ += 0.05;
      sample.zoom = from + (to - from) * i / 10;
      calibration_.add(sample);
    }
  };
  pass(101, 105);
  ASSERT_LT(f_sigma(105), 0.01);
  EXPECT_EQ(calibration_.report().activity, CalibrationActivity::kWatching);
  EXPECT_FALSE(calibration_.progress());
  pass(110, 380);
  ASSERT_GT(f_sigma(380), 0.01);
  EXPECT_EQ(calibration_.report().activity, CalibrationActivity::kCollecting);
  EXPECT_TRUE(calibration_.progress());
}

// The lens comes back to about where it was.
TEST_F(ZoomingCamera, AVisitOfANodeIsAnotherOne) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  test::Simulation again = zoomed(0, 6);
  again.focal_length *= std::exp(1.5 * kRepeatability);
  const auto back = dwell(0, again);
  ASSERT_GE(back.size(), 2U);
  EXPECT_LT(back[0].time_s, 0.5) << "with the first readings";
  EXPECT_TRUE(back[0].calibration->calibrated);
  EXPECT_EQ(back[0].calibration->name, "zoom curve");
  EXPECT_TRUE(back[0].calibration->of_this_connection);
  EXPECT_LT(
      std::abs(std::log(back[0].calibration->calibration.camera.focal_length / again.focal_length)),
      4 * kRepeatability);
  EXPECT_EQ(nodes(back), 3);
  test::expect_truth(again, back.back().calibration->calibration);
  EXPECT_THAT(test::lines_of(calibration_), Not(Contains(HasSubstr("is not what"))));
  Calibration c;
  ASSERT_TRUE(back.back().calibration->zoom_curve.at(0, &c));
  EXPECT_NEAR(parameter_sigma(c, Parameter::kFocalLength) / c.camera.focal_length,
              kRepeatability * std::sqrt(1.5), 0.2 * kRepeatability)
      << "the mean of two visits, and what another one adds";
}

TEST_F(ZoomingCamera, MoreOfOneVisitMakesItsNodeSharper) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  const auto published = dwell(200, zoomed(200, 4), 40);
  ASSERT_GE(published.size(), 2U);
  EXPECT_EQ(nodes(published), 2);
  test::expect_truth(zoomed(200), published.back().calibration->calibration);
}

TEST_F(ZoomingCamera, TheClockOffsetOfAnotherConnectionContradictsNoNode) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  test::Simulation later = zoomed(120, 5);
  later.clock_offset += 0.004;
  test::Feed how;
  how.zoom = 120;
  how.from_s = from_s_;
  how.first_frame = first_frame_;
  how.restarts = true;
  const auto published = test::feed(&calibration_, later, how);
  ASSERT_FALSE(published.empty());
  EXPECT_EQ(nodes(published), 3);
  test::expect_truth(later, published.back().calibration->calibration);
}

TEST_F(ZoomingCamera, AnotherCameraBeginsANewCurveAfterTwoContradictions) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(test::lines_of(calibration_));
  const auto other = [](double reading, std::uint64_t seed) {
    test::Simulation s = zoomed(reading, seed);
    s.focal_length *= 1.3;
    s.line_delay *= 8;
    return s;
  };
  const auto first = dwell(100, other(100, 7), 30);
  ASSERT_FALSE(first.empty());
  EXPECT_THAT(test::warnings_of(calibration_),
              AllOf(Contains(AllOf(HasSubstr("zoom 100: not of the zoom curve"),
                                   HasSubstr("does not share line delay"))),
                    Contains(HasSubstr("a new curve begins at zoom 100"))));
  test::expect_truth(other(100, 7), first.back().calibration->calibration);
  const auto second = dwell(0, other(0, 8));
  ASSERT_FALSE(second.empty());
  EXPECT_EQ(nodes(second), 2);
  test::expect_truth(other(0, 8), second.back().calibration->calibration);
}

// Whoever moved the camera on its mount moved it for all zooms.
TEST_F(ZoomingCamera, NoZoomOfAWithdrawnCurveIsUsedUntilACalibrationAgrees) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(test::lines_of(calibration_));
  contradicting_ = true;
  const auto withdrawn = dwell(200, zoomed(200, 5), 4);
  contradicting_ = false;
  ASSERT_FALSE(withdrawn.empty());
  EXPECT_FALSE(withdrawn.back().calibration->calibrated);
  EXPECT_TRUE(withdrawn.back().calibration->zoom_curve.empty());
  EXPECT_THAT(test::lines_of(calibration_), Contains(HasSubstr("is withdrawn")));
  for (const double reading : {0.0, 200.0, 100.0}) {
    EXPECT_THAT(dwell(reading, zoomed(reading), 1), IsEmpty()) << reading;
  }
  const auto again = dwell(0, zoomed(0, 8), 20);
  ASSERT_FALSE(again.empty());
  EXPECT_TRUE(again.back().calibration->calibrated);
  EXPECT_EQ(nodes(again), 3) << "the first visits agree with it, and count again";
}

// Its reading does not follow the lens: f is higher there than at a higher reading.
TEST_F(ZoomingCamera, AReadingThatIsOfNoCurveKeepsTheCurve) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(test::lines_of(calibration_));
  const auto odd = dwell(1000, zoomed(100, 5));
  ASSERT_FALSE(odd.empty());
  EXPECT_TRUE(odd.back().calibration->calibrated) << "it holds where it was made";
  EXPECT_EQ(nodes(odd), 2);
  test::expect_truth(zoomed(100), odd.back().calibration->calibration);
  EXPECT_THAT(test::lines_of(calibration_),
              Contains(AllOf(HasSubstr("zoom 1000: not of the zoom curve"),
                             HasSubstr("the focal length goes back"))));
}

// What comes of a dwell in which the zoom readings are as told.
struct OddReadings {
  const char* name;
  std::function<std::optional<double>(double)> at;
  const char* said;
};

class ZoomReadings : public ::testing::TestWithParam<OddReadings> {};

TEST_P(ZoomReadings, ThatAreNoneCostNothingAndAreSaid) {
  test::Simulation s = zoomed(0);
  s.optical_centre_offset_px.setZero();
  SelfCalibration calibration(test::calibration_options(s), nullptr);
  test::Feed how;
  how.zoom_at = GetParam().at;
  const auto published = test::feed(&calibration, s, how);
  ASSERT_FALSE(published.empty());
  EXPECT_EQ(published.back().calibration->calibration.zoom, 0);
  EXPECT_FALSE(published.back().calibration->calibration.has_centre()) << "no second zoom";
  test::expect_truth(s, published.back().calibration->calibration);
  EXPECT_THAT(test::lines_of(calibration), Contains(HasSubstr(GetParam().said)));
}

INSTANTIATE_TEST_SUITE_P(
    Each, ZoomReadings,
    ::testing::Values(
        OddReadings{"Jump", [](double at_s) { return at_s > 3 && at_s < 3.1 ? 9999.0 : 0.0; },
                    "the zoom reading left 0 and was back within 0.2 s"},
        OddReadings{"NoNumber",
                    [](double at_s) { return at_s > 3 && at_s < 4 ? std::nan("") : 0.0; },
                    "a zoom reading that is no number"},
        OddReadings{"Missing",
                    [](double at_s) {
                      return at_s < 1 ? std::optional<double>(0.0) : std::optional<double>();
                    },
                    "no zoom reading for 5 s; the last, 0, is taken to hold"}),
    [](const auto& each) { return each.param.name; });

// The lens moves, and its reading does not.
TEST_F(ZoomingCamera, AFrozenReadingIsSaid) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(test::lines_of(calibration_));
  ASSERT_FALSE(dwell(0, zoomed(30, 5), 30).empty());
  EXPECT_THAT(test::lines_of(calibration_),
              AllOf(Contains(HasSubstr("is not what the calibration says")),
                    Contains(HasSubstr("its reading does not follow the lens"))));
}

// As where the calibration thread is seconds behind: telemetry is heard before the frames that wait.
TEST_F(ZoomingCamera, FramesFromBeforeAMovementAreNotOfTheReadingAfterIt) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  PanTiltSample sample;
  sample.zoom = 200;
  for (const double later_s : {20.0, 20.5}) {
    sample.earliest_time_s = sample.latest_time_s = from_s_ + later_s;
    calibration_.add(sample);
  }
  EXPECT_THAT(dwell(200, zoomed(0, 4)), IsEmpty());
}

// Wraps to 0 above 200: the same reading for two lenses.
TEST_F(ZoomingCamera, AReadingThatWrapsIsSaid) {
  ASSERT_FALSE(dwell(10, zoomed(10)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(test::lines_of(calibration_));
  ASSERT_FALSE(dwell(10, zoomed(210, 5), 30).empty());
  EXPECT_THAT(test::lines_of(calibration_),
              Contains(HasSubstr("is not what the calibration says")));
}

// Two seconds of a dwell out of focus, then a range in which nothing is to be seen.
TEST_F(ZoomingCamera, WhatIsNotSeenCostsNoNode) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  test::Feed how;
  how.zoom = 200;
  how.from_s = from_s_;
  how.first_frame = first_frame_;
  how.blurred = [](double t) { return t > 3 && t < 5; };
  test::Simulation s = zoomed(200, 4);
  s.duration_s = 12;
  const auto hunted = test::feed(&calibration_, s, how);
  ASSERT_FALSE(hunted.empty());
  EXPECT_EQ(nodes(hunted), 2);
  test::expect_truth(s, hunted.back().calibration->calibration);
  static_cast<void>(test::lines_of(calibration_));
  how.zoom = 700;
  how.from_s += 20;
  how.first_frame += 1000;
  how.blurred = [](double) { return true; };
  EXPECT_THAT(test::feed(&calibration_, zoomed(700, 5), how), IsEmpty());
  EXPECT_THAT(test::lines_of(calibration_), Contains(HasSubstr("not calibrated yet")));
  EXPECT_STREQ(to_string(calibration_.report().need), to_string(CalibrationNeed::kTexture));
  from_s_ = how.from_s + 20;
  first_frame_ = how.first_frame + 1000;
  const auto back = dwell(100, zoomed(100, 6));
  ASSERT_FALSE(back.empty());
  EXPECT_EQ(nodes(back), 3);
}

// On disk, and in another run.
class StoredZooms : public ZoomingCamera {
 protected:
  StoredZooms() : StoredZooms(std::make_unique<Stored>()) {}

  struct Stored {
    TemporaryDirectory directory;
    CalibrationStore store{directory.path() + "/calibration.yaml"};
  };
  explicit StoredZooms(std::unique_ptr<Stored> stored)
      : ZoomingCamera(&stored->store), stored_(std::move(stored)) {}

  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(stored_->directory.path()))
      names.push_back(entry.path().filename().string());
    return names;
  }

  std::unique_ptr<Stored> stored_;
};

TEST_F(StoredZooms, AreThereInTheNextRun) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  CalibrationStore again(stored_->directory.path() + "/calibration.yaml");
  EXPECT_THAT(again.load(0, 0),
              Contains(HasSubstr("calibration.yaml: zoom curve from reading 0 to 200")));
  SelfCalibration next(test::calibration_options(zoomed(0)), &again);
  EXPECT_TRUE(next.first()->calibrated);
  EXPECT_EQ(next.first()->zoom_curve.content().nodes, 2);
  // Another connection, too.
  test::Simulation later = zoomed(120, 5);
  later.clock_offset += 0.004;
  const auto published = dwell(&next, 120, later);
  ASSERT_FALSE(published.empty());
  EXPECT_EQ(nodes(published), 3);
  test::expect_truth(later, published.back().calibration->calibration);
  CalibrationStore third(stored_->directory.path() + "/calibration.yaml");
  static_cast<void>(third.load(0, 0));
  EXPECT_EQ(third.zoom_curve().content().nodes, 3);
}

TEST_F(StoredZooms, OfAnotherCameraAreKeptUnderOtherNames) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(test::lines_of(calibration_));
  test::Simulation other = zoomed(100, 7);
  other.focal_length *= 1.3;
  other.line_delay *= 8;
  ASSERT_FALSE(dwell(100, other, 30).empty());
  EXPECT_THAT(test::lines_of(calibration_),
              Contains(AllOf(HasSubstr("a new curve begins"),
                             HasSubstr("set aside as calibration.yaml.replaced"))));
  EXPECT_THAT(
      files(),
      AllOf(Contains("calibration.yaml.replaced"), Contains("calibration.zoom-0.yaml.replaced"),
            Contains("calibration.zoom-100.yaml"), Not(Contains("calibration.yaml"))));
  EXPECT_TRUE(stored_->store.zoom_curve().empty());
}

}  // namespace
}  // namespace alidade
