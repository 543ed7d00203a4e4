// Self-calibration of a camera that zooms: dwells become nodes of a curve, which holds in between; what contradicts it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/calibration/calibration_difference.h"
#include "edge_app/storage/calibration_store.h"
#include "test/edge_app/fed_calibration.h"
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
    how.from_s = from_s_;
    how.first_frame = first_frame_;
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

TEST_F(ZoomingCamera, HasACurveFromTheSecondZoomOn) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  const auto second = dwell(200, zoomed(200, 4));
  ASSERT_FALSE(second.empty());
  const PublishedCalibration& published = *second.back().calibration;
  EXPECT_EQ(published.calibration.zoom, 200);
  ASSERT_EQ(nodes(second), 2);
  EXPECT_THAT(calibration_.take_messages(),
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

TEST_F(ZoomingCamera, HoldsAtOnceAtAReadingBetweenAndBecomesANodeThere) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(calibration_.take_messages());
  const auto third = dwell(120, zoomed(120, 5));
  ASSERT_GE(third.size(), 2U);
  EXPECT_LT(third[0].time_s, 0.4) << "with the first readings";
  EXPECT_TRUE(third[0].calibration->calibrated);
  const Calibration& at_once = third[0].calibration->calibration;
  EXPECT_EQ(at_once.zoom, 120);
  EXPECT_LT(std::abs(focal_length_error(at_once, 120)),
            4 * parameter_sigma(at_once, Parameter::kFocalLength) / at_once.camera.focal_length);
  EXPECT_EQ(nodes(third), 3);
  test::expect_truth(zoomed(120), third.back().calibration->calibration);
  EXPECT_LT(parameter_sigma(third.back().calibration->calibration, Parameter::kFocalLength),
            0.3 * parameter_sigma(at_once, Parameter::kFocalLength));
  EXPECT_THAT(calibration_.take_messages(),
              Contains(HasSubstr("zoom 120: the calibration zoom curve holds")));
}

// The lens comes back to about where it was.
TEST_F(ZoomingCamera, AVisitOfANodeIsAnotherOne) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  test::Simulation again = zoomed(0, 6);
  again.focal_length *= std::exp(1.5 * kRepeatability);
  const auto back = dwell(0, again);
  ASSERT_GE(back.size(), 2U);
  EXPECT_EQ(nodes(back), 3);
  test::expect_truth(again, back.back().calibration->calibration);
  EXPECT_THAT(calibration_.take_messages(), Not(Contains(HasSubstr("is not what"))));
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
  static_cast<void>(calibration_.take_messages());
  const auto other = [](double reading, std::uint64_t seed) {
    test::Simulation s = zoomed(reading, seed);
    s.focal_length *= 1.3;
    s.line_delay *= 8;
    return s;
  };
  const auto first = dwell(100, other(100, 7), 30);
  ASSERT_FALSE(first.empty());
  EXPECT_THAT(calibration_.take_messages(),
              AllOf(Contains(HasSubstr("is not what the calibration says")),
                    Contains(HasSubstr("a new curve begins at zoom 100"))));
  test::expect_truth(other(100, 7), first.back().calibration->calibration);
  const auto second = dwell(0, other(0, 8));
  ASSERT_FALSE(second.empty());
  EXPECT_EQ(nodes(second), 2);
  test::expect_truth(other(0, 8), second.back().calibration->calibration);
}

// Its reading does not follow the lens: f is higher there than at a higher reading.
TEST_F(ZoomingCamera, AReadingThatIsOfNoCurveKeepsTheCurve) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(calibration_.take_messages());
  const auto odd = dwell(1000, zoomed(100, 5));
  ASSERT_FALSE(odd.empty());
  EXPECT_TRUE(odd.back().calibration->calibrated) << "it holds where it was made";
  EXPECT_EQ(nodes(odd), 2);
  test::expect_truth(zoomed(100), odd.back().calibration->calibration);
  EXPECT_THAT(calibration_.take_messages(),
              Contains(AllOf(HasSubstr("zoom 1000: not of the zoom curve"),
                             HasSubstr("the focal length goes back"))));
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
  ASSERT_GE(published.size(), 2U);
  EXPECT_LT(published[0].time_s, 0.4);
  EXPECT_EQ(nodes(published), 3);
  test::expect_truth(later, published.back().calibration->calibration);
  CalibrationStore third(stored_->directory.path() + "/calibration.yaml");
  static_cast<void>(third.load(0, 0));
  EXPECT_EQ(third.zoom_curve().content().nodes, 3);
}

TEST_F(StoredZooms, OfAnotherCameraAreKeptUnderOtherNames) {
  ASSERT_FALSE(dwell(0, zoomed(0)).empty());
  ASSERT_FALSE(dwell(200, zoomed(200, 4)).empty());
  static_cast<void>(calibration_.take_messages());
  test::Simulation other = zoomed(100, 7);
  other.focal_length *= 1.3;
  other.line_delay *= 8;
  ASSERT_FALSE(dwell(100, other, 30).empty());
  EXPECT_THAT(calibration_.take_messages(),
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
