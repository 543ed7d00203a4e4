// The step with a camera that zooms before a scene: OE mode from one zoom to the next, and where the reading is wrong.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "core/calibration/zoom_fit.h"
#include "edge_app/step/orientation_step.h"
#include "test/support/allocation_guard.h"
#include "test/support/scene_teller.h"
#include "test/support/zooming_camera.h"

namespace alidade::test {
namespace {

constexpr double kTelemetryInterval_s = 0.02;
constexpr double kTelemetrySigma = 5e-5;  // rad

// As if recordings at some zooms had given them.
ZoomCurve curve_of(const ZoomingCamera& camera, const std::vector<double>& focal_lengths = {
                                                    1000, 1500, 2200, 3300, 5000, 7900}) {
  std::vector<Calibration> nodes;
  for (const double f : focal_lengths) {
    Calibration node = camera.curve_of(camera.reading_of(f), 1e-4);
    for (const Parameter p : {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0,
                              Parameter::kTiltAxis1, Parameter::kClockOffset}) {
      node.covariance(index(p), index(p)) = 1e-10;
    }
    node.covariance(index(Parameter::kLineDelay), index(Parameter::kLineDelay)) = 1e-18;
    nodes.push_back(node);
  }
  ZoomFit fit;
  std::string error;
  return fit_zoom(nodes, {}, &fit, &error) ? fit.curve : ZoomCurve();
}

// One film for all tests, and for all seeds of telemetry's noise.
class FollowedZoom : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const simulator::Config config = two_octaves();
    camera_ = new ZoomingCamera(config, std::make_unique<ZoomedPath>(config, 0.4, 3));
    curve_ = curve_of(*camera_);
    ASSERT_FALSE(curve_.empty());
  }
  static void TearDownTestSuite() {
    delete camera_;
    images_.clear();
  }

  FollowedZoom() {
    while (!moves(last_of_wide_ + 1)) ++last_of_wide_;
    first_of_tele_ = last_of_wide_ + 1;
    while (moves(first_of_tele_)) ++first_of_tele_;
    begin(3);
  }

  // seed: of telemetry's noise, or of what a scene map tells without it.
  void begin(std::uint64_t seed, bool has_telemetry = true) {
    // Without telemetry nobody knows at which zoom it begins.
    begin(seed, has_telemetry, curve_, has_telemetry ? reading(0) : camera_->reading_of(2200));
  }
  void begin(std::uint64_t seed, bool has_telemetry, const ZoomCurve& curve, double begins,
             bool follow_points = false) {
    OrientationStepOptions options;
    options.zoom_curve = curve;
    options.follow_points = follow_points;
    EXPECT_TRUE(curve.at(begins, &options.calibration));
    options.has_telemetry = has_telemetry_ = has_telemetry;
    options.calibrated = true;
    options.video_stamp_sigma_s = 1e-5;
    options.telemetry_noise.pan_tilt_sigma = kTelemetrySigma;
    options.oe.emplace();
    options.oe->max_landmarks = 2000;
    options.oe->maker.cell_size_px = 24;
    step_ = std::make_unique<OrientationStep>(options);
    fed_s_ = 0;
    random_.seed(seed);
    normal_.reset();
  }

  // Nothing is known of what was before frame k: a recording begins there.
  void skip_to(int k) { fed_s_ = std::max(0.0, camera_->time_s(k) - 0.4); }
  // Frames in OE mode from `first` to before `last`; all others of these are PT's, and say why.
  int count_oe(int first, int last) {
    int held = 0;
    for (int k = first; k < last; ++k) {
      const OrientationRecord record = add(k);
      // What the curve errs by is in the shape, too.
      expect_honest(k, record, std::numeric_limits<double>::infinity());
      held += record.mode == RecordMode::kOe ? 1 : 0;
      EXPECT_EQ(record.mode == RecordMode::kOe, record.status == RecordStatus::kOk)
          << k << ' ' << to_string(record.status);
    }
    return held;
  }

  [[nodiscard]] static bool moves(int k) { return camera_->lens(k, 0).moves; }
  [[nodiscard]] static double reading(double t) {
    return std::round(camera_->camera().zoom()->reading(std::max(0.0, t)));
  }

  // All telemetry to a little behind the frame; told: the zoom's reading at a time, where it is not the lens'; blurred: nothing is seen.
  OrientationRecord add(int k, const std::function<double(double)>& told = reading,
                        bool blurred = false) {
    const double until_s = camera_->time_s(k) + 2 * kTelemetryInterval_s;
    for (; has_telemetry_ && fed_s_ <= until_s; fed_s_ += kTelemetryInterval_s) {
      PanTiltSample sample;
      sample.earliest_time_s = fed_s_ - 1e-5;
      sample.latest_time_s = fed_s_ + 1e-5;
      const simulator::Angles angles = camera_->angles_at(fed_s_);
      sample.pan_rad = angles.pan + kTelemetrySigma * normal_(random_);
      sample.tilt_rad = angles.tilt + kTelemetrySigma * normal_(random_);
      sample.zoom = told(fed_s_);
      step_->add_telemetry(sample);
    }
    std::vector<std::uint8_t>& pixels = images_[k];
    if (pixels.empty()) pixels = camera_->image(k);
    FrameStamp stamp;
    stamp.frame = k;
    stamp.receive_time_s = camera_->time_s(k);
    events_ = {};
    std::vector<std::uint8_t> nothing(pixels.size());
    for (std::uint8_t& grey : nothing) grey = static_cast<std::uint8_t>(127 + random_() % 3);
    const ImageView image = camera_->view(blurred ? nothing : pixels);
    const AllocationGuard guard;
    const OrientationRecord record = step_->add_frame(stamp, image, &events_);
    step_->maintain();
    EXPECT_EQ(guard.count(), 0);
    return record;
  }

  // most_px: in OE mode, of the picture's shape.
  void expect_honest(int k, const OrientationRecord& record, double most_px = 0.3) const {
    ASSERT_TRUE(record.orientation) << k;
    const FrameOrientation frame = unpack(record.orientation->geometry, record.camera);
    const FrameErrors errors = errors_of(*camera_, k, frame);
    EXPECT_LT(errors.sigmas, 5) << k;
    EXPECT_LT(errors.log_sigmas, 5) << k;
    // Until six polls have shown that the head measures on request, an angle's age counts as an error
    // of its time (RenewalAge), and so for some frames.
    constexpr int kKnown = 9;
    if (record.mode == RecordMode::kOe) {
      EXPECT_LT(errors.rms_px, k < kKnown ? std::max(0.5, most_px) : most_px) << k;
    }
  }

  static ZoomingCamera* camera_;
  static ZoomCurve curve_;
  static std::map<int, std::vector<std::uint8_t>> images_;
  std::unique_ptr<OrientationStep> step_;
  StepEvents events_;
  bool has_telemetry_ = true;
  double fed_s_ = 0;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  int last_of_wide_ = 2;
  int first_of_tele_ = 0;
};

ZoomingCamera* FollowedZoom::camera_ = nullptr;
ZoomCurve FollowedZoom::curve_;
std::map<int, std::vector<std::uint8_t>> FollowedZoom::images_;

TEST_F(FollowedZoom, StaysInOeModeFromOneZoomToTheNext) {
  int held = 0;
  for (int k = 2; k < first_of_tele_ + 5; ++k) {
    const OrientationRecord record = add(k);
    expect_honest(k, record);
    if (k > last_of_wide_) held += record.mode == RecordMode::kOe ? 1 : 0;
    if (record.mode == RecordMode::kOe && k > last_of_wide_ + 3 && k < first_of_tele_ - 3) {
      EXPECT_NE(record.orientation->geometry.zoom_rate, 0) << k;
    }
  }
  EXPECT_GE(held, 0.95 * (first_of_tele_ + 5 - last_of_wide_ - 1));
  // The calibration thread hands over the curve's calibration of the new zoom: the map stays.
  PublishedCalibration published;
  ASSERT_TRUE(curve_.at(reading(camera_->time_s(first_of_tele_ + 5)), &published.calibration));
  published.calibrated = true;
  published.zoom_curve = curve_;
  step_->adopt(published);
  for (int k = first_of_tele_ + 5; k < first_of_tele_ + 12; ++k) {
    const OrientationRecord record = add(k);
    EXPECT_EQ(record.mode, RecordMode::kOe) << k;
    EXPECT_EQ(record.status, RecordStatus::kOk);
    expect_honest(k, record);
  }
  // Another camera's is another map.
  published.calibration.mechanics.pan_scale = 1.001;
  step_->adopt(published);
  EXPECT_EQ(add(first_of_tele_ + 12).mode, RecordMode::kPt);
}

// As a recording that begins at another dwell than the calibration's: with the curve's lens there, and a map of its own.
TEST_F(FollowedZoom, BeginsAtAnyReadingOfTheCurve) {
  const int first = first_of_tele_ + 1;
  const int last = first + 20;
  const double tele = reading(camera_->time_s(first));
  struct Case {
    const char* name;
    ZoomCurve curve;
    double begins;  // the calibration's reading
  };
  for (const Case& c : {Case{"between two nodes", curve_, reading(0)},
                        Case{"at a node", curve_of(*camera_, {1000, 2200, 4000, 7900}), reading(0)},
                        Case{"at the curve's end, the calibration's at the other",
                             curve_of(*camera_, {1000, 2200, 4000}), reading(0)},
                        Case{"where it is known to some per cent",
                             curve_of(*camera_, {1000, 5000, 7900}), reading(0)},
                        Case{"at the calibration's own", curve_, tele}}) {
    SCOPED_TRACE(c.name);
    ASSERT_FALSE(c.curve.empty());
    begin(3, true, c.curve, c.begins);
    skip_to(first);
    const OrientationRecord record = add(first - 1);
    EXPECT_EQ(record.mode, RecordMode::kPt);
    EXPECT_EQ(record.status, RecordStatus::kTooFewLandmarks);
    expect_honest(first - 1, record);
    EXPECT_GE(count_oe(first, last), last - first - 1);
  }
}

// A map begins with a lens at rest.
TEST_F(FollowedZoom, WhereItBeginsWhileTheZoomMovesItSaysSoUntilItStands) {
  const int first = (last_of_wide_ + first_of_tele_) / 2;
  begin(3);
  skip_to(first);
  // The last steps are less than one of the reading.
  for (int k = first; k < first_of_tele_ - 3; ++k) {
    const OrientationRecord record = add(k);
    EXPECT_EQ(record.mode, RecordMode::kPt) << k;
    EXPECT_EQ(record.status, RecordStatus::kZoomMoves) << k;
    expect_honest(k, record);
  }
  EXPECT_GE(count_oe(first_of_tele_ - 3, first_of_tele_ + 20), 15);
}

TEST_F(FollowedZoom, NoRecordThatIsNotOfOeModeIsOkWhateverTheZoomDoes) {
  const int first = first_of_tele_ + 1;
  const double tele = reading(camera_->time_s(first));
  // Outside: the curve ends before.
  begin(3, true, curve_of(*camera_, {1000, 1200}), reading(0));
  skip_to(first);
  OrientationRecord record = add(first);
  EXPECT_EQ(record.mode, RecordMode::kNone);
  EXPECT_EQ(record.status, RecordStatus::kOtherZoom);
  EXPECT_FALSE(record.calibrated);
  // The lens is about to leave the curve: its last frame there.
  begin(3, true, curve_of(*camera_, {1000, 2200, 4000}), reading(0));
  skip_to(first);
  const double leaves_s = camera_->time_s(first) + 1.5 * kTelemetryInterval_s;
  record = add(first, [&](double t) { return t < leaves_s ? tele - 1 : 9999.0; });
  EXPECT_NE(record.mode, RecordMode::kOe);
  EXPECT_NE(record.status, RecordStatus::kOk);
  // Where the curve knows little: 4 % for a camera that calibrates itself, which waits for that, 16 % for any other.
  for (const bool calibrates : {true, false}) {
    const ZoomCurve rough =
        calibrates ? curve_of(*camera_, {1000, 5000, 7900}) : curve_of(*camera_, {1000, 7900});
    begin(3, true, rough, reading(0), calibrates);
    skip_to(first);
    record = add(first);
    EXPECT_EQ(record.mode, RecordMode::kPt);
    EXPECT_EQ(record.status, RecordStatus::kFocalLengthUnsure);
    FrameTracks tracks;
    step_->get_tracks(&tracks);
    EXPECT_EQ(tracks.tracker == FrameTracks::Tracker::kStartUp, calibrates);
  }
  // No picture, and one that shows nothing.
  begin(3);
  skip_to(first);
  record = add(first, reading, true);
  EXPECT_EQ(record.mode, RecordMode::kPt);
  EXPECT_EQ(record.status, RecordStatus::kTooFewLandmarks);
}

// The one of that reading, from before, shows more of the scene than what has begun there.
TEST_F(FollowedZoom, AStoredMapTakesThePlaceOfOneThatHasJustBegun) {
  const int first = first_of_tele_ + 1;
  const auto adopted = [&](const MapState& map) {
    begin(3);
    skip_to(first);
    for (int k = first; k < first + 3; ++k) static_cast<void>(add(k));
    PublishedCalibration published;
    EXPECT_TRUE(curve_.at(reading(camera_->time_s(first)), &published.calibration));
    published.calibrated = true;
    published.zoom_curve = curve_;
    published.map = map;
    step_->adopt(published);
    return add(first + 3).mode;
  };
  EXPECT_EQ(adopted({}), RecordMode::kOe) << "kept";
  MapState useless;
  useless.landmarks.emplace_back();
  EXPECT_EQ(adopted(useless), RecordMode::kPt) << "taken over, however little there is in it";
}

// By one of 10,000, as a potentiometer does, and as one that is coarser.
TEST_F(FollowedZoom, StaysInOeModeWithAReadingThatJitters) {
  for (const double sigma : {1.0, 3.0}) {
    SCOPED_TRACE(sigma);
    begin(3);
    std::mt19937_64 random(9);
    std::normal_distribution<double> jitter(0, sigma);
    const auto told = [&](double t) { return std::round(reading(t) + jitter(random)); };
    // Until the jitter is known.
    constexpr int kKnown = 8;
    int held = 0;
    for (int k = 0; k < first_of_tele_ + 5; ++k) {
      const OrientationRecord record = add(k, told);
      if (k < kKnown) continue;
      expect_honest(k, record);
      held += record.mode == RecordMode::kOe ? 1 : 0;
    }
    EXPECT_GE(held, 0.95 * (first_of_tele_ + 5 - kKnown));
  }
}

// Whatever telemetry's noise has made the map's offset: the curve's optical centre errs between its nodes by several times that noise.
TEST_F(FollowedZoom, StaysInOeModeWhereTheReadingIsStuckAndSaysSo) {
  const double stuck = reading(0);
  for (const std::uint64_t seed : {1U, 4U, 7U, 8U}) {
    SCOPED_TRACE(seed);
    begin(seed);
    int lost = 0;
    int said = 0;
    for (int k = 2; k < first_of_tele_ + 5; ++k) {
      const OrientationRecord record = add(k, [stuck](double) { return stuck; });
      if (k <= last_of_wide_) continue;
      expect_honest(k, record);
      lost += record.mode == RecordMode::kOe ? 0 : 1;
      said += events_.zoom_contradicted ? 1 : 0;
    }
    EXPECT_LE(lost, 1);
    EXPECT_GE(said, 1);
  }
}

// As no lens can: to the other end for a tenth of a second.
TEST_F(FollowedZoom, AReadingThatJumpsCostsNoRecordItsHonesty) {
  const double from_s = camera_->time_s(last_of_wide_ / 2);
  const auto jumping = [&](double t) {
    return t >= from_s && t < from_s + 0.1 ? 9999.0 : reading(t);
  };
  int held = 0;
  for (int k = 2; k <= last_of_wide_; ++k) {
    const OrientationRecord record = add(k, jumping);
    expect_honest(k, record);
    held += record.mode == RecordMode::kOe ? 1 : 0;
  }
  EXPECT_GE(held, last_of_wide_ - 8) << "but the first, and those of the jump";
  EXPECT_EQ(add(last_of_wide_ + 1, jumping).mode, RecordMode::kOe);
}

// From the middle of its range on it begins at its first value again.
TEST_F(FollowedZoom, AReadingThatWrapsIsExcludedByImages) {
  const double first = reading(0);
  const double last = reading(camera_->time_s(first_of_tele_));
  const auto wrapping = [&](double t) {
    const double z = reading(t);
    const double middle = (first + last) / 2;
    return z < middle ? z : z - middle + first;
  };
  int held = 0;
  int said = 0;
  for (int k = 2; k < first_of_tele_ + 10; ++k) {
    const OrientationRecord record = add(k, wrapping);
    expect_honest(k, record);
    if (k <= last_of_wide_) continue;
    held += record.mode == RecordMode::kOe ? 1 : 0;
    said += events_.zoom_contradicted ? 1 : 0;
  }
  EXPECT_GE(held, 0.95 * (first_of_tele_ + 9 - last_of_wide_));
  EXPECT_GE(said, 1);
}

// Two seconds in which nothing is seen, as out of focus or where there is no texture, from the middle of a movement on.
TEST_F(FollowedZoom, AfterTwoSecondsWithoutFocusLandmarksHoldAgain) {
  const int from = (last_of_wide_ + first_of_tele_) / 2;
  const int until = from + 50;
  ASSERT_GT(until, first_of_tele_);
  RecordMode last = RecordMode::kNone;
  for (int k = 2; k < camera_->frames() - 2; ++k) {
    const OrientationRecord record = add(k, reading, k >= from && k < until);
    // The map is lost at the end, and begins anew, with the lens as the curve has it.
    constexpr double kByCurve_px = 1;
    expect_honest(k, record, k < until ? 0.3 : kByCurve_px);
    if (k >= until + 3) {
      EXPECT_EQ(record.mode, RecordMode::kOe) << k;
    }
    last = record.mode;
    if (k >= from && k < until) {
      EXPECT_EQ(record.mode, RecordMode::kPt) << k;
    }
  }
  EXPECT_EQ(last, RecordMode::kOe);
}

// A camera of which a scene map alone tells where it looks, and with which focal length: that of another zoom than the calibration's, and
// again after half a second in which nothing is seen; between, images alone.
TEST_F(FollowedZoom, WithoutTelemetryAMapTellsTheFocalLengthAndImagesFollowIt) {
  const int dark_from = first_of_tele_ + 1;
  const int dark_until = dark_from + 13;
  const auto is_dark = [&](int k) { return k >= dark_from && k < dark_until; };
  constexpr double kLogSigma = 5e-4;
  SceneTeller teller(
      [&](int k) -> std::optional<SceneTeller::Truth> {
        if (is_dark(k)) return std::nullopt;
        const double t = camera_->middle_s(k);
        const simulator::Angles angles = camera_->angles_at(t);
        return SceneTeller::Truth{
            R_base_from_camera(Mechanics<double>(), PanTilt<double>{angles.pan, angles.tilt}),
            std::log(camera_->camera().lens_at(t).focal_length)};
      },
      kLogSigma);
  for (const std::uint64_t seed : {1U, 2U}) {
    SCOPED_TRACE(seed);
    begin(seed, false);
    teller.begin(seed);
    int first = 0;
    int moving = 0;
    int held_moving = 0;
    int again = 0;
    for (int k = 2; k < camera_->frames() - 2; ++k) {
      const OrientationRecord record = add(k, reading, is_dark(k));
      const bool holds = record.mode == RecordMode::kOe;
      EXPECT_NE(record.mode, RecordMode::kPt) << k;
      if (holds) {
        EXPECT_FALSE(is_dark(k)) << k;
        expect_honest(k, record);
        EXPECT_TRUE(record.localized) << k;
      } else {
        EXPECT_EQ(record.status, RecordStatus::kNotLocalized) << k;
      }
      if (holds && first == 0) first = k;
      if (holds && again == 0 && k >= dark_until) again = k;
      if (moves(k)) {
        ++moving;
        held_moving += holds ? 1 : 0;
      }
      teller.follow(k, record, step_.get());
    }
    // Twice told, as the first is of another lens; and some frames to begin.
    EXPECT_GT(first, 2 * SceneTeller::kAnswered);
    EXPECT_LE(first, last_of_wide_ - 5);
    EXPECT_GE(held_moving, 0.95 * moving);
    EXPECT_LE(again, dark_until + SceneTeller::kAnswered + 6);
    EXPECT_GT(again, 0);
  }
}

}  // namespace
}  // namespace alidade::test
