// OE mode on frames of the virtual camera, from nothing: what it finds, what it does when it finds nothing,
// and that it never claims more than it knows.

#include "core/realtime/oe_mode/oe_mode.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "core/realtime/pt_mode.h"
#include "test/core/realtime/oe_mode/virtual_camera.h"
#include "test/support/parameter_changes.h"

namespace alidade::test {
namespace {

void expect_same(const FrameOrientation& a, const FrameOrientation& b) {
  EXPECT_EQ(a.time_s, b.time_s);
  EXPECT_EQ(a.mode, b.mode);
  EXPECT_EQ(a.landmarks, b.landmarks);
  EXPECT_EQ(a.angle.vector(), b.angle.vector());
  EXPECT_EQ(a.rate.vector(), b.rate.vector());
  EXPECT_EQ(a.acceleration.vector(), b.acceleration.vector());
  EXPECT_EQ(a.motion_covariance, b.motion_covariance);
  EXPECT_EQ(a.R_base_from_camera, b.R_base_from_camera);
  EXPECT_EQ(a.orientation_covariance, b.orientation_covariance);
  EXPECT_EQ(a.angular_velocity, b.angular_velocity);
}

// Telemetry's own answer, and nothing of landmarks.
void expect_pt(const VirtualCamera& camera, int k, const InterpolatedPanTilt& telemetry,
               const FrameOrientation& frame) {
  FrameOrientation pt;
  ASSERT_TRUE(pt_orientation(camera.calibration(), VirtualCamera::time_s(k), telemetry, &pt));
  EXPECT_EQ(frame.mode, OrientationMode::kPt);
  expect_same(frame, pt);
}

class OeModeOnFrames : public testing::Test {
 protected:
  void SetUp() override { oe_.reset(camera_.calibration()); }

  OeStatus process(int k) {
    telemetry_ = camera_.telemetry(k);
    return oe_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry_, &frame_);
  }

  // Frames [from, to), all of which must be in OE.
  void run(int from, int to) {
    for (int k = from; k < to; ++k) {
      ASSERT_EQ(process(k), OeStatus::kOk) << k;
      oe_.maintain();
    }
  }

  void start(int frames) {
    ASSERT_EQ(process(0), OeStatus::kTooFew);
    oe_.maintain();
    run(1, frames);
  }

  // Back in OE by the third frame at the latest, counting k.
  void expect_back(int k) {
    OeStatus status = OeStatus::kTooFew;
    for (int i = 0; i < 3 && status != OeStatus::kOk; ++i) {
      status = process(k + i);
      expect_honest(camera_, k + i, frame_);
      oe_.maintain();
    }
    EXPECT_EQ(status, OeStatus::kOk);
  }

  VirtualCamera camera_;
  OeMode oe_{small_options()};
  InterpolatedPanTilt telemetry_;
  FrameOrientation frame_;
};

TEST_F(OeModeOnFrames, BeginsWithNothingAndIsInOeFromTheSecondFrameOn) {
  ASSERT_EQ(process(0), OeStatus::kTooFew);
  expect_pt(camera_, 0, telemetry_, frame_);
  EXPECT_EQ(oe_.map().size(), 0);
  oe_.maintain();
  EXPECT_GT(oe_.map().size(), 50);
  Vector2<double> before = Vector2<double>::Zero();
  double turns = 0;
  constexpr int kFrames = 150;
  for (int k = 1; k < kFrames; ++k) {
    ASSERT_EQ(process(k), OeStatus::kOk) << k;
    EXPECT_EQ(frame_.mode, OrientationMode::kOe);
    EXPECT_GE(frame_.landmarks, 20);
    expect_honest(camera_, k, frame_);
    const Vector2<double> error = camera_.error(k, frame_, {kWidth / 2, kHeight / 2});
    if (k > 1) turns += (error - before).squaredNorm() / 2;
    before = error;
    oe_.maintain();
  }
  // From frame to frame, where telemetry alone would show sqrt(2) px.
  EXPECT_LT(std::sqrt(turns / (kFrames - 2)), 0.1);
}

// The same images and the same telemetry, by one calibration and by another.
TEST_F(OeModeOnFrames, FollowsTheCalibrationAsItsSensitivitySays) {
  constexpr int kFrames = 40;
  std::vector<InterpolatedPanTilt> telemetry;
  for (int k = 0; k < kFrames; ++k) telemetry.push_back(camera_.telemetry(k));
  const Calibration& calibration = camera_.calibration();
  const auto last_frame = [&](const ParameterVector& e) {
    const double later_s = e[index(Parameter::kClockOffset)] +
                           e[index(Parameter::kLineDelay)] * calibration.camera.height / 2;
    oe_.reset(plus(calibration, e));
    for (int k = 0; k < kFrames; ++k) {
      InterpolatedPanTilt told = telemetry[static_cast<std::size_t>(k)];
      told.angle = {told.angle.pan + later_s * told.rate.pan,
                    told.angle.tilt + later_s * told.rate.tilt};
      const OeStatus status =
          oe_.process(camera_.image(k), VirtualCamera::time_s(k), &told, &frame_);
      EXPECT_EQ(status, k == 0 ? OeStatus::kTooFew : OeStatus::kOk);
      oe_.maintain();
    }
    return frame_;
  };
  const FrameOrientation frame = last_frame(ParameterVector::Zero());
  int shown = 0;
  // Small enough for the same corners and the same inliers.
  const ParameterVector steps = 0.3 * parameter_steps(calibration.camera);
  for (int j = 0; j < kParameterCount; ++j) {
    ParameterVector e = ParameterVector::Zero();
    e[j] = steps[j];
    const FrameOrientation more = last_frame(e);
    const FrameOrientation less = last_frame(-e);
    const Vector2<double> numeric = (more.angle.vector() - less.angle.vector()) / (2 * kPixel);
    const Vector2<double> told = frame.motion_sensitivity.col(j).head<2>() * steps[j] / kPixel;
    // Of the third of a pixel by which the image itself has moved. A centre that is elsewhere turns the camera by as
    // much and leaves next to nothing of that: what differs is told by other patches, not by the shift.
    const bool is_centre = j == index(Parameter::kCentreU) || j == index(Parameter::kCentreV);
    EXPECT_LT((told - numeric).norm(), 2e-3 + 0.06 * numeric.norm() + (is_centre ? 0.03 * 0.3 : 0))
        << to_string(static_cast<Parameter>(j)) << " " << told.transpose() << ", by difference "
        << numeric.transpose();
    shown += numeric.norm() > 0.01 ? 1 : 0;
  }
  EXPECT_GE(shown, 4);
}

TEST_F(OeModeOnFrames, KnowsTheBaseBetterTheLongerItSeesTelemetry) {
  start(2);
  Matrix2<double> covariance = oe_.statistics().map_offset_covariance;
  run(2, 100);
  // White noise of a pixel, averaged 100 times.
  const double sigma = std::sqrt(oe_.statistics().map_offset_covariance(0, 0));
  EXPECT_LT(sigma, 1.5 * kPixel / std::sqrt(100.0));
  EXPECT_LT(sigma, std::sqrt(covariance(0, 0)) / 4);
}

TEST_F(OeModeOnFrames, IsTelemetryAloneWhereTheImageShowsNothing) {
  start(20);
  std::mt19937_64 random(2);
  std::vector<std::uint8_t> image(static_cast<std::size_t>(kWidth) * kHeight);
  const ImageView view{image.data(), kWidth, kHeight, kWidth};
  int k = 20;
  for (const int kind : {0, 1, 2, 3}) {
    for (int i = 0; i < 10; ++i, ++k) {
      for (std::uint8_t& pixel : image) {
        const auto noise = static_cast<std::uint8_t>(random() % 7);
        if (kind == 0) pixel = 0;
        if (kind == 1) pixel = 255;
        if (kind == 2) pixel = static_cast<std::uint8_t>(20 + noise);
        if (kind == 3) pixel = static_cast<std::uint8_t>(random() % 256);
      }
      telemetry_ = camera_.telemetry(k);
      const OeStatus status = oe_.process(view, VirtualCamera::time_s(k), &telemetry_, &frame_);
      EXPECT_NE(status, OeStatus::kOk) << kind;
      EXPECT_NE(status, OeStatus::kNoPrediction) << kind;
      expect_pt(camera_, k, telemetry_, frame_);
      oe_.maintain();
    }
    expect_back(k);
    k += 3;
    run(k, k + 5);
    k += 5;
  }
}

TEST(OeMode, IsTelemetryAloneWhileTheLensIsCovered) {
  simulator::Config config = swinging_camera();
  config.sensor.covered = {{0.795, 1.215}};
  VirtualCamera camera(config);
  OeMode oe(small_options());
  oe.reset(camera.calibration());
  FrameOrientation frame;
  int in_oe_after = 0;
  for (int k = 0; k < 40; ++k) {
    const InterpolatedPanTilt telemetry = camera.telemetry(k);
    const OeStatus status =
        oe.process(camera.image(k), VirtualCamera::time_s(k), &telemetry, &frame);
    if (k >= 20 && k <= 30) {
      EXPECT_NE(status, OeStatus::kOk);
      expect_pt(camera, k, telemetry, frame);
    } else if (k > 0 && k < 20) {
      EXPECT_EQ(status, OeStatus::kOk) << k;
    } else if (k > 32) {
      in_oe_after += status == OeStatus::kOk ? 1 : 0;
    }
    expect_honest(camera, k, frame);
    oe.maintain();
  }
  EXPECT_EQ(in_oe_after, 7);
}

TEST_F(OeModeOnFrames, BeginsAtThePreviousFrameWhereTelemetryLeavesMuchOpen) {
  start(30);
  for (int k = 30; k < 46; ++k) {
    telemetry_ = camera_.telemetry(k);
    const double turn = k;
    telemetry_.angle.pan += 60 * kPixel * std::cos(turn);
    telemetry_.angle.tilt += 60 * kPixel * std::sin(turn);
    telemetry_.covariance.topLeftCorner<2, 2>() =
        40 * 40 * kPixel * kPixel * Matrix2<double>::Identity();
    ASSERT_EQ(oe_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry_, &frame_),
              OeStatus::kOk)
        << k;
    EXPECT_LT(oe_.statistics().coarse_shift_px, 8);
    expect_honest(camera_, k, frame_);
    double px = 0;
    double square = 0;
    camera_.judge(k, frame_, &px, &square);
    EXPECT_LT(px, 1.5) << k;
    oe_.maintain();
  }
}

// Telemetry is wrong and does not say so. Nobody can tell, but for the landmarks: the answer is
// telemetry's, as uncertain as the two are apart.
TEST_F(OeModeOnFrames, CoversWhatLandmarksAndTelemetrySayWhereTheyExcludeEachOther) {
  start(20);
  for (int k = 20; k < 25; ++k) {
    telemetry_ = camera_.telemetry(k);
    telemetry_.angle.pan += 15 * kPixel;
    EXPECT_EQ(oe_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry_, &frame_),
              OeStatus::kContradiction);
    FrameOrientation pt;
    ASSERT_TRUE(pt_orientation(camera_.calibration(), VirtualCamera::time_s(k), telemetry_, &pt));
    EXPECT_EQ(frame_.mode, OrientationMode::kPt);
    EXPECT_LT((frame_.angle.vector() - pt.angle.vector()).norm(), 1e-12);
    EXPECT_GT(frame_.motion_covariance(0, 0), 10 * 10 * kPixel * kPixel);
    EXPECT_LT(frame_.motion_covariance(0, 0), 20 * 20 * kPixel * kPixel);
    expect_honest(camera_, k, frame_);
    oe_.maintain();
  }
  expect_back(25);
}

// Five of its sigmas, as pictures that lag show: too little to be excluded, too much for chance.
TEST_F(OeModeOnFrames, CoversWhatTelemetrySaysWhereChanceHardlyExplainsIt) {
  start(20);
  EXPECT_LT(frame_.motion_covariance(0, 0), 0.5 * 0.5 * kPixel * kPixel);
  telemetry_ = camera_.telemetry(20);
  telemetry_.angle.pan += 5 * kPixel;
  ASSERT_EQ(oe_.process(camera_.image(20), VirtualCamera::time_s(20), &telemetry_, &frame_),
            OeStatus::kOk);
  EXPECT_EQ(frame_.mode, OrientationMode::kOe);
  EXPECT_GT(frame_.motion_covariance(0, 0), 1.5 * 1.5 * kPixel * kPixel);
  EXPECT_LT(frame_.motion_covariance(0, 0), 6 * 6 * kPixel * kPixel);
  EXPECT_LT(frame_.motion_covariance(1, 1), 1.5 * 1.5 * kPixel * kPixel);
  expect_honest(camera_, 20, frame_);
  oe_.maintain();
  run(21, 24);
  EXPECT_LT(frame_.motion_covariance(0, 0), 0.5 * 0.5 * kPixel * kPixel);
}

TEST_F(OeModeOnFrames, GoesOnWithoutTelemetryWhileItSees) {
  start(30);
  // 0.3 s
  for (int k = 30; k < 38; ++k) {
    EXPECT_EQ(oe_.process(camera_.image(k), VirtualCamera::time_s(k), nullptr, &frame_),
              OeStatus::kOk)
        << k;
    EXPECT_EQ(frame_.mode, OrientationMode::kOe);
    expect_honest(camera_, k, frame_);
    oe_.maintain();
  }
  run(38, 50);
}

TEST_F(OeModeOnFrames, WritesNothingWithoutPrediction) {
  FrameOrientation untouched;
  untouched.time_s = -7;
  frame_ = untouched;
  EXPECT_EQ(oe_.process(camera_.image(0), 0, nullptr, &frame_), OeStatus::kNoPrediction);
  expect_same(frame_, untouched);
  oe_.maintain();
  EXPECT_EQ(oe_.map().size(), 0);

  start(10);
  frame_ = untouched;
  // The last frame is a second old.
  EXPECT_EQ(oe_.process(camera_.image(35), VirtualCamera::time_s(35), nullptr, &frame_),
            OeStatus::kNoPrediction);
  expect_same(frame_, untouched);
  EXPECT_EQ(oe_.statistics().status, OeStatus::kNoPrediction);
  oe_.maintain();
  // Recent, but dark.
  run(36, 40);
  frame_ = untouched;
  const std::vector<std::uint8_t> black(static_cast<std::size_t>(kWidth) * kHeight, 0);
  for (int k = 40; k < 43; ++k) {
    EXPECT_EQ(oe_.process({black.data(), kWidth, kHeight, kWidth}, VirtualCamera::time_s(k),
                          nullptr, &frame_),
              OeStatus::kNoPrediction);
    oe_.maintain();
  }
  EXPECT_EQ(oe_.process({}, VirtualCamera::time_s(43), nullptr, &frame_), OeStatus::kNoPrediction);
  expect_same(frame_, untouched);
  expect_back(44);
}

TEST_F(OeModeOnFrames, AnswersWithTelemetryWhereTheImageIsNone) {
  start(10);
  const ImageView good = camera_.image(10);
  const ImageView bad[] = {{},
                           {nullptr, kWidth, kHeight, kWidth},
                           {good.luma, kWidth - 1, kHeight, kWidth},
                           {good.luma, kWidth, kHeight - 1, kWidth},
                           {good.luma, 16, 16, kWidth},
                           {good.luma, kWidth, kHeight, kWidth - 1},
                           {good.luma, 0, 0, 0}};
  for (const ImageView& view : bad) {
    telemetry_ = camera_.telemetry(10);
    EXPECT_EQ(oe_.process(view, VirtualCamera::time_s(10), &telemetry_, &frame_),
              OeStatus::kBadImage);
    EXPECT_EQ(oe_.statistics().status, OeStatus::kBadImage);
    expect_pt(camera_, 10, telemetry_, frame_);
    const int size = oe_.map().size();
    oe_.maintain();
    EXPECT_EQ(oe_.map().size(), size);
  }
  run(10, 12);
}

TEST_F(OeModeOnFrames, WritesNothingForWhatIsNotFinite) {
  start(10);
  FrameOrientation untouched;
  untouched.time_s = -7;
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  const double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    frame_ = untouched;
    telemetry_ = camera_.telemetry(10);
    EXPECT_EQ(oe_.process(camera_.image(10), bad, &telemetry_, &frame_), OeStatus::kNotFinite);
    EXPECT_EQ(oe_.process(camera_.image(10), bad, nullptr, &frame_), OeStatus::kNotFinite);
    InterpolatedPanTilt wrong = telemetry_;
    wrong.angle.pan = bad;
    EXPECT_EQ(oe_.process(camera_.image(10), 0.4, &wrong, &frame_), OeStatus::kNotFinite);
    wrong = telemetry_;
    wrong.rate.tilt = bad;
    EXPECT_EQ(oe_.process(camera_.image(10), 0.4, &wrong, &frame_), OeStatus::kNotFinite);
    wrong = telemetry_;
    wrong.covariance(1, 1) = bad;
    EXPECT_EQ(oe_.process(camera_.image(10), 0.4, &wrong, &frame_), OeStatus::kNotFinite);
    expect_same(frame_, untouched);
    oe_.maintain();
  }
  run(10, 12);
}

// Each frame once more at the same time, and time that runs backwards: as good, or telemetry's.
TEST_F(OeModeOnFrames, SurvivesRepeatedAndDisorderedTimes) {
  start(20);
  for (const int k : {20, 20, 20, 21, 19, 25, 24, 22, 26}) {
    const OeStatus status = process(k);
    EXPECT_TRUE(status == OeStatus::kOk || status == OeStatus::kTooFew) << k;
    expect_honest(camera_, k, frame_);
    oe_.maintain();
  }
  run(27, 30);
}

TEST_F(OeModeOnFrames, TakesImagesBottomUpAndWithPadding) {
  OeMode other(small_options());
  other.reset(camera_.calibration());
  constexpr int kStride = kWidth + 13;
  std::vector<std::uint8_t> memory(static_cast<std::size_t>(kStride) * kHeight, 77);
  for (int k = 0; k < 20; ++k) {
    const ImageView image = camera_.image(k);
    std::uint8_t* first = memory.data() + static_cast<std::ptrdiff_t>(kHeight - 1) * kStride;
    for (int v = 0; v < kHeight; ++v) {
      std::copy_n(image.row(v), kWidth, first - static_cast<std::ptrdiff_t>(v) * kStride);
    }
    const OeStatus status = process(k);
    FrameOrientation frame;
    EXPECT_EQ(other.process({first, kWidth, kHeight, -kStride}, VirtualCamera::time_s(k),
                            &telemetry_, &frame),
              status);
    expect_same(frame, frame_);
    oe_.maintain();
    other.maintain();
  }
  EXPECT_EQ(oe_.statistics().status, OeStatus::kOk);
}

// What every answer rests on, ids aside, which are never given twice.
TEST_F(OeModeOnFrames, AnswersAlikeAgainAndAfterAReset) {
  struct Answer {
    OeStatus status;
    FrameOrientation frame;
    int map;
  };
  const auto answers_of = [&](OeMode* oe) {
    VirtualCamera camera;
    oe->reset(camera.calibration());
    EXPECT_EQ(oe->map().size(), 0);
    EXPECT_EQ(oe->statistics().found, 0);
    EXPECT_EQ(oe->statistics().status, OeStatus::kNoPrediction);
    std::vector<Answer> answers;
    for (int k = 0; k < 40; ++k) {
      const InterpolatedPanTilt telemetry = camera.telemetry(k);
      Answer answer;
      answer.status =
          oe->process(camera_.image(k), VirtualCamera::time_s(k), &telemetry, &answer.frame);
      oe->maintain();
      answer.map = oe->map().size();
      answers.push_back(answer);
    }
    return answers;
  };
  OeMode other(small_options());
  const std::vector<Answer> first = answers_of(&oe_);
  const std::vector<Answer> second = answers_of(&other);
  const std::vector<Answer> after_reset = answers_of(&oe_);
  for (std::size_t k = 0; k < first.size(); ++k) {
    SCOPED_TRACE(k);
    for (const Answer* again : {&second[k], &after_reset[k]}) {
      EXPECT_EQ(again->status, first[k].status);
      EXPECT_EQ(again->map, first[k].map);
      expect_same(again->frame, first[k].frame);
    }
  }
  // Nothing is left to go on from.
  oe_.reset(camera_.calibration());
  EXPECT_EQ(oe_.process(camera_.image(40), VirtualCamera::time_s(40), nullptr, &frame_),
            OeStatus::kNoPrediction);
}

TEST_F(OeModeOnFrames, TellsWhatEachAnswerRestsOn) {
  start(2);
  for (int k = 2; k < 60; ++k) {
    ASSERT_EQ(process(k), OeStatus::kOk);
    const OeStatistics& s = oe_.statistics();
    EXPECT_EQ(s.status, OeStatus::kOk);
    EXPECT_LE(s.inliers, s.found);
    EXPECT_LE(s.found, s.chosen);
    EXPECT_LE(s.chosen, std::min(s.fine_visible, small_options().search.choice.max_chosen));
    EXPECT_LE(s.fine_visible, oe_.map().size());
    EXPECT_EQ(s.inliers, frame_.landmarks);
    int inliers = 0;
    std::vector<std::uint32_t> ids;
    for (int i = 0; i < s.found; ++i) {
      const OeObservation& seen = oe_.observations()[i];
      inliers += seen.inlier ? 1 : 0;
      ASSERT_TRUE(oe_.map().occupied(seen.slot));
      const Landmark& landmark = oe_.map().at(seen.slot);
      EXPECT_EQ(landmark.id, seen.id);
      EXPECT_EQ(landmark.octave, seen.octave);
      EXPECT_GT(seen.covariance.determinant(), 0);
      EXPECT_TRUE(seen.u.x() > 0 && seen.u.x() < kWidth && seen.u.y() > 0 && seen.u.y() < kHeight);
      ids.push_back(seen.id);
      if (!seen.inlier) continue;
      // Found where the answer, less the map's offset, sees the landmark. The offset of this frame's
      // own landmarks, and where the mean of the map lies, is not told.
      EXPECT_LT(seen.residual.norm(), 4);
    }
    EXPECT_EQ(inliers, s.inliers);
    std::sort(ids.begin(), ids.end());
    EXPECT_EQ(std::adjacent_find(ids.begin(), ids.end()), ids.end());
    oe_.maintain();
  }
}

TEST(OeMode, NeitherFillsItsMapNorUsesMoreThanItMay) {
  OeOptions options = small_options();
  options.max_landmarks = 150;
  options.search.choice.max_chosen = 25;
  VirtualCamera camera;
  OeMode oe(options);
  oe.reset(camera.calibration());
  FrameOrientation frame;
  int in_oe = 0;
  for (int k = 0; k < 150; ++k) {
    const InterpolatedPanTilt telemetry = camera.telemetry(k);
    const OeStatus status =
        oe.process(camera.image(k), VirtualCamera::time_s(k), &telemetry, &frame);
    in_oe += status == OeStatus::kOk ? 1 : 0;
    EXPECT_LE(oe.statistics().chosen, 25);
    EXPECT_LE(oe.statistics().found, 25);
    EXPECT_LE(frame.landmarks, 25);
    expect_honest(camera, k, frame);
    oe.maintain();
    ASSERT_LE(oe.map().size(), 150);
  }
  EXPECT_GT(oe.map().replaced(), 0);
  EXPECT_GT(in_oe, 140);
}

TEST(OeMode, NeedsACalibrationThatItHasRoomFor) {
  VirtualCamera camera;
  FrameOrientation frame;
  const InterpolatedPanTilt telemetry = camera.telemetry(0);
  OeMode oe(small_options());
  EXPECT_EQ(oe.process(camera.image(0), 0, &telemetry, &frame), OeStatus::kNoPrediction);
  Calibration large = camera.calibration();
  large.camera.width = kWidth + 1;
  oe.reset(large);
  EXPECT_EQ(oe.process(camera.image(0), 0, &telemetry, &frame), OeStatus::kNoPrediction);
  oe.maintain();
  oe.reset(camera.calibration());
  EXPECT_EQ(oe.process(camera.image(0), 0, &telemetry, &frame), OeStatus::kTooFew);
  oe.maintain();
  EXPECT_GT(oe.map().size(), 0);
  oe.reset(large);
  EXPECT_EQ(oe.map().size(), 0);
}

// Telemetry that ends 80 ms before each frame, and tells of it two frames later.
class LateTelemetry : public OeModeOnFrames {
 protected:
  static constexpr int kLate = 2;                     // frames
  static constexpr double kBeyond = kLate / kRateHz;  // s

  OeStatus process_extrapolated(int k) {
    telemetry_ = camera_.extrapolated(k, kBeyond);
    return oe_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry_, &frame_);
  }

  // Samples that reach frame k: it is settled, and so are those before it, with nothing.
  void tell(int k, double off_px = 0) {
    TelemetryLookUp look_up;
    while (oe_.pending(VirtualCamera::time_s(k), &look_up)) {
      const bool is_k = look_up.time_s == VirtualCamera::time_s(k);
      InterpolatedPanTilt late = camera_.telemetry(k);
      late.angle.pan += off_px * kPixel;
      oe_.settle_pending(is_k ? &late : nullptr);
    }
  }

  // Frames [from, to), all in OE but the very first.
  void run_late(int from, int to) {
    for (int k = from; k < to; ++k) {
      if (k >= kLate) tell(k - kLate);
      ASSERT_EQ(process_extrapolated(k), k == 0 ? OeStatus::kTooFew : OeStatus::kOk) << k;
      expect_honest(camera_, k, frame_);
      oe_.maintain();
    }
  }

  [[nodiscard]] Matrix2<double> offset_covariance() const {
    return oe_.map_state().offset_covariance;
  }
};

TEST_F(LateTelemetry, TellsTheOffsetAsWellAsTelemetryInTime) {
  constexpr int kFrames = 250;
  double squares = 0;
  for (int k = 0; k < kFrames; ++k) {
    run_late(k, k + 1);
    double px = 0;
    double square = 0;
    camera_.judge(k, frame_, &px, &square);
    squares += square / 2;
    if (k > kFrames / 2) {
      EXPECT_LT(px, 0.6) << k;
    }
  }
  // Of five places the worst; one offset is in all frames, so that this is but a few draws.
  EXPECT_LT(squares / kFrames, 5);
  // White noise of a pixel, averaged.
  EXPECT_LT(std::sqrt(offset_covariance()(0, 0)), 1.5 * kPixel / std::sqrt(1.0 * kFrames));
}

TEST_F(LateTelemetry, IsNotReplacedByWhatWasExtrapolated) {
  run_late(0, 20);
  const Matrix2<double> before = offset_covariance();
  for (int k = 20; k < 40; ++k) {
    ASSERT_EQ(process_extrapolated(k), OeStatus::kOk) << k;
    oe_.maintain();
  }
  EXPECT_GE(offset_covariance()(0, 0), before(0, 0));
  EXPECT_GE(offset_covariance()(1, 1), before(1, 1));
  // All wait for it.
  for (int k = 18; k < 40; ++k) tell(k);
  EXPECT_LT(offset_covariance()(0, 0), before(0, 0) / 1.5);
  run_late(42, 45);
}

TEST_F(LateTelemetry, IsAskedForOnceWhenItEnclosesTheFrame) {
  run_late(0, 20);
  const double time_s = VirtualCamera::time_s(18);
  TelemetryLookUp look_up;
  EXPECT_FALSE(oe_.pending(time_s - 1e-4, &look_up));
  ASSERT_TRUE(oe_.pending(time_s, &look_up));
  EXPECT_EQ(look_up.time_s, time_s);
  tell(18);
  EXPECT_FALSE(oe_.pending(time_s, &look_up));
  ASSERT_TRUE(oe_.pending(VirtualCamera::time_s(19), &look_up));
  EXPECT_EQ(look_up.time_s, VirtualCamera::time_s(19));
}

TEST_F(LateTelemetry, TeachesNothingWhereThereIsNone) {
  run_late(0, 20);
  tell(18);
  const MapState before = oe_.map_state();
  const auto expect_unchanged = [&] {
    const MapState now = oe_.map_state();
    EXPECT_EQ(now.offset.vector(), before.offset.vector());
    EXPECT_EQ(now.offset_covariance, before.offset_covariance);
  };
  TelemetryLookUp look_up;
  const auto pending = [&](int k) { return oe_.pending(VirtualCamera::time_s(k), &look_up); };
  InterpolatedPanTilt late = camera_.telemetry(18);
  oe_.settle_pending(nullptr);  // frame 19
  EXPECT_FALSE(pending(19));
  oe_.settle_pending(&late);  // nobody waits
  expect_unchanged();
  ASSERT_EQ(process_extrapolated(20), OeStatus::kOk);
  ASSERT_TRUE(pending(20));
  late = camera_.extrapolated(20, kBeyond);
  oe_.settle_pending(&late);
  EXPECT_FALSE(pending(20));
  oe_.maintain();
  ASSERT_EQ(process_extrapolated(21), OeStatus::kOk);
  late = camera_.telemetry(21);
  late.angle.tilt = std::numeric_limits<double>::quiet_NaN();
  const MapState last = oe_.map_state();
  oe_.settle_pending(&late);
  EXPECT_EQ(oe_.map_state().offset.vector(), last.offset.vector());
  EXPECT_EQ(oe_.map_state().offset_covariance, last.offset_covariance);
  // Of a clock that is gone, and of a map that is gone.
  ASSERT_EQ(process_extrapolated(22), OeStatus::kOk);
  oe_.forget_pending();
  EXPECT_FALSE(pending(22));
  ASSERT_EQ(process_extrapolated(23), OeStatus::kOk);
  oe_.reset(camera_.calibration());
  EXPECT_FALSE(pending(23));
  EXPECT_EQ(offset_covariance(), (Matrix2<double>::Zero()));
}

// The frames in between cannot know: extrapolated telemetry hides 15 px. The next one says so.
TEST_F(LateTelemetry, ThatContradictsTheLandmarksIsAContradiction) {
  run_late(0, 60);
  tell(58, 15);
  EXPECT_EQ(process_extrapolated(60), OeStatus::kContradiction);
  EXPECT_EQ(frame_.mode, OrientationMode::kPt);
  EXPECT_GT(frame_.motion_covariance(0, 0), kPixel * kPixel);
  oe_.maintain();
  tell(59);
  run_late(61, 65);
}

TEST_F(LateTelemetry, ForgetsAMapThatItContradictsForLong) {
  run_late(0, 60);
  OeStatus status = OeStatus::kOk;
  int lost = 0;
  for (int k = 60; k < 140; ++k) {
    tell(k - kLate, 15);
    telemetry_ = camera_.extrapolated(k, kBeyond);
    telemetry_.angle.pan += 15 * kPixel;
    status = oe_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry_, &frame_);
    lost += status != OeStatus::kOk ? 1 : 0;
    oe_.maintain();
  }
  EXPECT_EQ(status, OeStatus::kOk);
  EXPECT_LT(lost, 60);
}

// A camera whose telemetry has another zero than the base that somebody outside knows: told of one frame, answers are in that base.
class ToldBase : public OeModeOnFrames {
 protected:
  static constexpr double kZero = 5e-3;      // rad, 7.5 px
  static constexpr double kMeasured = 1e-4;  // rad, 0.15 px

  OeStatus process(int k) {
    telemetry_ = camera_.telemetry(k);
    telemetry_.angle.pan += kZero;
    return oe_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry_, &frame_);
  }

  // Of frame k, just answered.
  BaseMeasurement measure(int k) {
    const PanTilt<double> truth = camera_.telemetry(k, {0, 0}).angle;
    const PanTilt<double> answered =
        angle_at_row(frame_.motion(), frame_.calibration.line_delay, kHeight / 2.0);
    BaseMeasurement out;
    out.change = {truth.pan - answered.pan + kMeasured * normal_(random_),
                  truth.tilt - answered.tilt + kMeasured * normal_(random_)};
    out.covariance = kMeasured * kMeasured * Matrix2<double>::Identity();
    return out;
  }

  [[nodiscard]] double error_px(int k) const {
    return camera_.error(k, frame_, {kWidth / 2.0, kHeight / 2.0}).norm();
  }

  std::mt19937_64 random_{3};
  std::normal_distribution<double> normal_;
};

TEST_F(ToldBase, LandmarksHoldItFromTheNextFrameOnWhateverTelemetrySays) {
  ASSERT_EQ(process(0), OeStatus::kTooFew);
  oe_.maintain();
  ASSERT_EQ(process(1), OeStatus::kOk);
  EXPECT_GT(error_px(1), 5);
  const BaseMeasurement measurement = measure(1);
  ASSERT_TRUE(oe_.ask_about_base());
  oe_.maintain();
  // The answer takes a while.
  for (int k = 2; k < 5; ++k) {
    ASSERT_EQ(process(k), OeStatus::kOk);
    oe_.maintain();
  }
  ASSERT_TRUE(oe_.settle_base(measurement));
  ASSERT_TRUE(oe_.tie().is_tied());
  for (int k = 5; k < 100; ++k) {
    ASSERT_EQ(process(k), OeStatus::kOk) << k;
    expect_honest(camera_, k, frame_);
    // Three standard deviations of the measurement, and what landmarks leave.
    EXPECT_LT(error_px(k), 3 * kMeasured / kPixel + 0.2) << k;
    EXPECT_LT(std::sqrt(frame_.motion_covariance(0, 0)), 2 * kMeasured);
    oe_.maintain();
  }
  EXPECT_NEAR(oe_.telemetry_zero().value.x(), -kZero,
              5 * std::sqrt(oe_.telemetry_zero().covariance(0, 0)));
}

TEST_F(ToldBase, TelemetrysAnswersAndTheNextMapHaveItToo) {
  ASSERT_EQ(process(0), OeStatus::kTooFew);
  const BaseMeasurement measurement = measure(0);
  ASSERT_TRUE(oe_.ask_about_base());
  oe_.maintain();
  ASSERT_TRUE(oe_.settle_base(measurement));
  for (int k = 1; k < 20; ++k) {
    ASSERT_EQ(process(k), OeStatus::kOk) << k;
    expect_honest(camera_, k, frame_);
    oe_.maintain();
  }
  oe_.reset(camera_.calibration());
  ASSERT_EQ(process(20), OeStatus::kTooFew);
  EXPECT_EQ(frame_.mode, OrientationMode::kPt);
  expect_honest(camera_, 20, frame_);
  EXPECT_LT(error_px(20), 5);
}

// One OeMode's map in the hands of another.
class HandedOverMap : public OeModeOnFrames {
 protected:
  // Frame k for the OeMode that takes over, telemetry off by so much.
  OeStatus take_over(int k, const Vector2<double>& off_px = Vector2<double>::Zero(),
                     const Sigmas& sigmas = {}) {
    telemetry_ = camera_.telemetry(k, sigmas);
    telemetry_.angle.pan += off_px.x() * kPixel;
    telemetry_.angle.tilt += off_px.y() * kPixel;
    return other_.process(camera_.image(k), VirtualCamera::time_s(k), &telemetry_, &frame_);
  }

  [[nodiscard]] std::set<std::uint32_t> ids() const {
    std::set<std::uint32_t> out;
    for (int slot = 0; slot < other_.map().capacity(); ++slot) {
      if (other_.map().occupied(slot)) out.insert(other_.map().at(slot).id);
    }
    return out;
  }

  OeMode other_{small_options()};
};

TEST_F(HandedOverMap, HoldsTheNextFrameAsItHeldTheLast) {
  start(60);
  const MapState map = oe_.map_state();
  ASSERT_EQ(static_cast<int>(map.landmarks.size()), oe_.map().size());
  other_.reset(camera_.calibration(), map);
  EXPECT_GE(other_.map().size(), oe_.map().size() * 98 / 100);
  for (int k = 60; k < 90; ++k) {
    ASSERT_EQ(take_over(k), OeStatus::kOk) << k;
    EXPECT_GE(frame_.landmarks, 20);
    expect_honest(camera_, k, frame_);
    // The offset goes on from where it was: a single sample of telemetry says 1 px.
    EXPECT_LT(frame_.motion_covariance(0, 0), 0.3 * 0.3 * kPixel * kPixel);
    other_.maintain();
  }
}

TEST_F(HandedOverMap, IsThatMapAgainWhenItIsToldAtOnce) {
  start(60);
  const MapState map = oe_.map_state();
  other_.reset(camera_.calibration(), map);
  const MapState again = other_.map_state();
  EXPECT_EQ(again.offset.vector(), map.offset.vector());
  EXPECT_EQ(again.offset_covariance, map.offset_covariance);
  EXPECT_EQ(again.shear_covariance, map.shear_covariance);
  EXPECT_EQ(again.shear_tilt, map.shear_tilt);
  // Refined directions may have got into a neighbour's cell: one of the two stays.
  EXPECT_GE(again.landmarks.size(), map.landmarks.size() * 98 / 100);
  std::size_t next = 0;
  for (const Landmark& a : again.landmarks) {
    const auto same = [&](const Landmark& l) { return (l.d - a.d).norm() < 1e-15; };
    while (next < map.landmarks.size() && !same(map.landmarks[next])) ++next;
    ASSERT_LT(next, map.landmarks.size());
    const Landmark& b = map.landmarks[next];
    EXPECT_EQ(a.octave, b.octave);
    EXPECT_EQ(a.covariance, b.covariance);
    EXPECT_EQ(a.shared_covariance, b.shared_covariance);
    EXPECT_EQ(a.J_pixel_tangent, b.J_pixel_tangent);
    EXPECT_EQ(a.pixels, b.pixels);
    EXPECT_EQ(a.statistics.matched, b.statistics.matched);
  }
}

TEST_F(HandedOverMap, IsFoundWhereTelemetryIsOffByAFewPixels) {
  start(40);
  const MapState map = oe_.map_state();
  for (const Vector2<double>& off :
       {Vector2<double>(6, -4), Vector2<double>(-9, 2), Vector2<double>(3, 8)}) {
    other_.reset(camera_.calibration(), map);
    ASSERT_EQ(take_over(40, off, {5 * kPixel, 5 * kPixel}), OeStatus::kOk) << off.transpose();
    expect_honest(camera_, 40, frame_);
    double px = 0;
    double square = 0;
    camera_.judge(40, frame_, &px, &square);
    EXPECT_LT(px, 1) << off.transpose();
  }
}

TEST_F(HandedOverMap, LosesWhatMakesNoSense) {
  start(20);
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  const MapState good = oe_.map_state();
  const std::size_t size = good.landmarks.size();
  const std::vector<std::function<void(Landmark*)>> damages = {
      [&](Landmark* l) { l->d.y() = kNaN; },
      [&](Landmark* l) { l->d *= 1.01; },
      [&](Landmark* l) { l->d.setZero(); },
      [&](Landmark* l) { l->octave = 200; },
      [&](Landmark* l) { l->octave = 5; },  // the image is too low for that
      [&](Landmark* l) { l->covariance(0, 1) = kNaN; },
      [&](Landmark* l) { l->covariance(1, 1) *= -1; },
      [&](Landmark* l) { l->shared_covariance(1, 1) = -1; },
      [&](Landmark* l) { l->J_pixel_tangent.setZero(); },
      [&](Landmark* l) { l->J_pixel_tangent(1, 0) = kNaN; }};
  ASSERT_GT(size, damages.size());
  MapState map = good;
  for (std::size_t i = 0; i < damages.size(); ++i) damages[i](&map.landmarks[i]);
  other_.reset(camera_.calibration(), map);
  EXPECT_EQ(other_.map().size(), static_cast<int>(size - damages.size()));
  EXPECT_EQ(take_over(20), OeStatus::kOk);
  expect_honest(camera_, 20, frame_);

  const std::vector<std::function<void(MapState*)>> hopeless = {
      [&](MapState* m) { m->offset.pan = kNaN; },
      [&](MapState* m) { m->offset_covariance(0, 0) = kNaN; },
      [&](MapState* m) { m->offset_covariance(1, 1) = -1; },
      [&](MapState* m) { m->shear_covariance[1](2, 2) = kNaN; },
      [&](MapState* m) { m->shear_tilt = kNaN; },
      [&](MapState* m) { m->landmarks.clear(); }};
  for (const auto& damage : hopeless) {
    map = good;
    damage(&map);
    other_.reset(camera_.calibration(), map);
    EXPECT_EQ(other_.map().size(), 0);
    EXPECT_EQ(take_over(20), OeStatus::kTooFew);
    expect_pt(camera_, 20, telemetry_, frame_);
  }
}

TEST_F(HandedOverMap, IsCutWhereThereIsNoRoom) {
  start(20);
  OeOptions options = small_options();
  options.max_landmarks = 80;
  OeMode small(options);
  small.reset(camera_.calibration(), oe_.map_state());
  EXPECT_EQ(small.map().size(), 80);
}

// Only what should be in view is given up: the rest may be right.
TEST_F(HandedOverMap, IsForgottenWhereTheImageShowsSomethingElse) {
  start(30);
  other_.reset(camera_.calibration(), oe_.map_state());
  std::mt19937_64 random(3);
  // Night: neither to be found nor a reason to give up what is not.
  std::vector<std::uint8_t> dark(static_cast<std::size_t>(kWidth) * kHeight);
  int frames = 0;
  const int size = other_.map().size();
  for (; frames < 120; ++frames) {
    for (std::uint8_t& pixel : dark) pixel = static_cast<std::uint8_t>(20 + random() % 7);
    telemetry_ = camera_.telemetry(30);
    EXPECT_EQ(other_.process({dark.data(), kWidth, kHeight, kWidth},
                             VirtualCamera::time_s(30 + frames), &telemetry_, &frame_),
              OeStatus::kTooFew);
    other_.maintain();
  }
  EXPECT_EQ(other_.map().size(), size);
  // Another scene, from the same mount.
  simulator::Config config = swinging_camera();
  config.scene.photos[0].azimuth = 4.5 * kPi / 180;
  config.scene.photos[0].elevation = 5 * kPi / 180;
  VirtualCamera elsewhere(config);
  OeStatus status = OeStatus::kTooFew;
  int lost = 0;
  for (int k = 30; k < 110; ++k) {
    telemetry_ = elsewhere.telemetry(k);
    status = other_.process(elsewhere.image(k), VirtualCamera::time_s(k), &telemetry_, &frame_);
    expect_honest(elsewhere, k, frame_);
    lost += status != OeStatus::kOk ? 1 : 0;
    other_.maintain();
  }
  EXPECT_EQ(status, OeStatus::kOk);
  EXPECT_LT(lost, 55);
}

TEST_F(HandedOverMap, IsForgottenWhereTelemetryContradictsIt) {
  start(30);
  MapState map = oe_.map_state();
  for (const double off_px : {20.0, 50.0, 300.0}) {
    MapState wrong = map;
    wrong.offset.pan += off_px * kPixel;
    wrong.offset_covariance = kPixel * kPixel * Matrix2<double>::Identity();
    other_.reset(camera_.calibration(), wrong);
    OeStatus status = OeStatus::kTooFew;
    int lost = 0;
    for (int k = 30; k < 100; ++k) {
      status = take_over(k);
      expect_honest(camera_, k, frame_);
      lost += status != OeStatus::kOk ? 1 : 0;
      other_.maintain();
    }
    EXPECT_EQ(status, OeStatus::kOk) << off_px;
    EXPECT_LT(lost, 55) << off_px;
  }
}

TEST(OeMode, GoesOnBesideAMapThatIsNotInViewAndFindsItAgain) {
  simulator::Config config = swinging_camera();
  config.path.amplitude = 0.8;
  config.path.period = 10;
  config.scene.photos[0].width = 75 * kPi / 180;
  VirtualCamera camera(config);
  OeMode oe(small_options());
  oe.reset(camera.calibration());
  FrameOrientation frame;
  const auto process = [&](int k) {
    const InterpolatedPanTilt telemetry = camera.telemetry(k);
    const OeStatus status =
        oe.process(camera.image(k), VirtualCamera::time_s(k), &telemetry, &frame);
    expect_honest(camera, k, frame);
    return status;
  };
  // The left end of the path.
  for (int k = 175; k < 200; ++k) {
    EXPECT_EQ(process(k), k == 175 ? OeStatus::kTooFew : OeStatus::kOk) << k;
    oe.maintain();
  }
  const MapState map = oe.map_state();
  oe.reset(camera.calibration(), map);
  std::set<std::uint32_t> old;
  for (int slot = 0; slot < oe.map().capacity(); ++slot) {
    if (oe.map().occupied(slot)) old.insert(oe.map().at(slot).id);
  }
  // From the right end back.
  int found = 0;
  for (int k = 50; k < 200; ++k) {
    EXPECT_EQ(process(k), k == 50 ? OeStatus::kTooFew : OeStatus::kOk) << k;
    found = 0;
    for (int i = 0; i < oe.statistics().found; ++i) {
      const OeObservation& seen = oe.observations()[i];
      found += seen.inlier && old.count(seen.id) > 0 ? 1 : 0;
    }
    if (k % 5 == 0) oe.maintain();
  }
  EXPECT_GT(found, 20);
}

// What frames find of the acceleration, right or wrong, leaves alone what is far above and below.
TEST_F(OeModeOnFrames, DisplacesNothingFarAwayByAccelerations) {
  start(10);
  MapState map = oe_.map_state();
  constexpr double kFar = 0.4;  // rad
  const Matrix3<double> up =
      Eigen::AngleAxisd(kFar, frame_.R_base_from_camera.col(0)).toRotationMatrix();
  std::vector<Landmark> far = map.landmarks;
  for (Landmark& landmark : far) landmark.d = up * landmark.d;
  map.landmarks.insert(map.landmarks.end(), far.begin(), far.end());
  constexpr double kAcceleration = 0.5;  // rad/s^2: found again and again, as with few landmarks
  for (Matrix3<double>& shear : map.shear_covariance) {
    shear.setZero();
    shear(2, 2) = kAcceleration * kAcceleration;
  }
  map.shear_tilt = frame_.angle.tilt;
  oe_.reset(camera_.calibration(), map);
  std::map<std::uint32_t, Vector3<double>> before;
  for (const Landmark& landmark : oe_.map_state().landmarks) before[landmark.id] = landmark.d;
  run(10, 40);
  const Vector3<double> axis = frame_.R_base_from_camera.col(2);
  int compared = 0;
  double worst = 0;
  for (const Landmark& landmark : oe_.map_state().landmarks) {
    if (before.count(landmark.id) == 0 || std::acos(axis.dot(landmark.d)) < 0.8 * kFar) continue;
    worst = std::max(worst, (landmark.d - before[landmark.id]).norm() / kPixel);
    ++compared;
  }
  EXPECT_GT(compared, 50);
  EXPECT_LT(worst, 0.1);
}

}  // namespace
}  // namespace alidade::test
