// OE mode behind a lens that zooms: at rest, while it moves, and at rest again.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/realtime/oe_mode/oe_mode.h"
#include "test/support/allocation_guard.h"
#include "test/support/zooming_camera.h"

namespace alidade::test {
namespace {

constexpr double kRepeatability = kTwoOctavesRepeatability;

class ZoomingLens : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const simulator::Config config = two_octaves();
    camera_ = new ZoomingCamera(config, std::make_unique<ZoomedPath>(config, 0.4, 3));
  }
  static void TearDownTestSuite() {
    delete camera_;
    images_.clear();
  }

  ZoomingLens() : oe_(make_oe_mode()) {
    while (moves(last_of_wide_ + 1) == false) ++last_of_wide_;
    first_of_tele_ = last_of_wide_ + 1;
    while (moves(first_of_tele_)) ++first_of_tele_;
  }

  [[nodiscard]] static std::unique_ptr<OeMode> make_oe_mode() {
    OeOptions options;
    options.max_width = 480;
    options.max_height = 270;
    options.max_landmarks = 2000;
    options.maker.cell_size_px = 24;
    auto oe = std::make_unique<OeMode>(options);
    oe->reset(camera_->lens_at(0, kRepeatability).calibration, FocalLength::kLearnt);
    return oe;
  }

  [[nodiscard]] static bool moves(int k) { return camera_->lens(k, kRepeatability).moves; }

  [[nodiscard]] static ImageView image(int k) {
    std::vector<std::uint8_t>& pixels = images_[k];
    if (pixels.empty()) pixels = camera_->image(k);
    return camera_->view(pixels);
  }

  OeStatus process(int k, const FrameLens* lens, bool has_telemetry = true) {
    const InterpolatedPanTilt telemetry = camera_->telemetry(k, 5e-5, 5e-4);
    const ImageView view = image(k);
    const AllocationGuard guard;
    const OeStatus status =
        oe_->process(view, camera_->time_s(k), has_telemetry ? &telemetry : nullptr, lens, &frame_);
    statistics_ = oe_->statistics();
    oe_->maintain();
    EXPECT_EQ(guard.count(), 0);
    errors_ = errors_of(*camera_, k, frame_);
    // Whatever the mode: 5 sigmas of a direction, and of the focal length.
    EXPECT_LT(errors_.sigmas, 5) << k;
    EXPECT_LT(errors_.log_sigmas, 5) << k;
    return status;
  }
  OeStatus process(int k) {
    const FrameLens lens = camera_->lens(k, kRepeatability);
    return process(k, &lens);
  }
  // At rest at the wide end, so that the map knows its scale.
  void begin() {
    for (int k = kFirst; k <= last_of_wide_; ++k) static_cast<void>(process(k));
    ASSERT_EQ(oe_->statistics().status, OeStatus::kOk);
    ASSERT_FALSE(oe_->lens_has_moved());
  }
  [[nodiscard]] std::set<std::uint32_t> found_ids() const {
    std::set<std::uint32_t> ids;
    for (int i = 0; i < statistics_.found; ++i) ids.insert(oe_->observations()[i].id);
    return ids;
  }

  // The middle row of the very first frames is exposed before the path begins.
  static constexpr int kFirst = 2;
  static ZoomingCamera* camera_;
  static std::map<int, std::vector<std::uint8_t>> images_;
  std::unique_ptr<OeMode> oe_;
  FrameOrientation frame_;
  OeStatistics statistics_;
  FrameErrors errors_;
  int last_of_wide_ = kFirst;
  int first_of_tele_ = 0;
};

ZoomingCamera* ZoomingLens::camera_ = nullptr;
std::map<int, std::vector<std::uint8_t>> ZoomingLens::images_;

TEST_F(ZoomingLens, IsFollowedOverTwoOctavesAndBackToRest) {
  begin();
  const double of_map =
      std::sqrt(frame_.calibration.covariance(0, 0)) / frame_.calibration.camera.focal_length;
  double rms_square = 0;
  double rate_squares = 0;
  int moving = 0;
  for (int k = last_of_wide_ + 1; k < first_of_tele_ + 20; ++k) {
    ASSERT_EQ(process(k), OeStatus::kOk) << k;
    EXPECT_TRUE(statistics_.own_lens) << k;
    EXPECT_LT(statistics_.reading_sigmas, 4) << k;
    EXPECT_LT(errors_.rms_px, 0.15) << k;
    if (k >= first_of_tele_ + 5) {
      EXPECT_LT(errors_.rms_px, 0.05) << k;
    }
    if (k >= first_of_tele_) continue;
    ++moving;
    rms_square += errors_.rms_px * errors_.rms_px;
    // d log f / dt as the motor has it.
    const double middle_s = camera_->middle_s(k);
    const double middle_rate = std::log(camera_->camera().lens_at(middle_s + 1e-3).focal_length /
                                        camera_->camera().lens_at(middle_s - 1e-3).focal_length) /
                               2e-3;
    EXPECT_NEAR(frame_.zoom_rate, middle_rate, 0.02) << k;
    ASSERT_TRUE(frame_.zoom_rate_sigma) << k;
    ASSERT_GT(*frame_.zoom_rate_sigma, 0) << k;
    rate_squares += std::pow((frame_.zoom_rate - middle_rate) / *frame_.zoom_rate_sigma, 2);
  }
  EXPECT_GT(moving, 40);
  EXPECT_LT(std::sqrt(rms_square / moving), 0.05);
  EXPECT_LT(rate_squares / moving, 1 + 4 * std::sqrt(2.0 / moving));
  EXPECT_NEAR(frame_.zoom_rate, 0, 1e-4);
  // It knows f as well as the map knows its scale, not as well as the curve.
  EXPECT_LT(std::sqrt(frame_.calibration.covariance(0, 0)),
            3 * of_map * frame_.calibration.camera.focal_length);
  EXPECT_LT(of_map, 0.3 * kRepeatability);
}

// Nobody looked while it moved, by less than an octave: the map is the same, and holds from the first frame on.
TEST_F(ZoomingLens, KeepsItsMapAcrossAChangeThatNobodySaw) {
  begin();
  const std::set<std::uint32_t> before = found_ids();
  int stop = last_of_wide_ + 1;
  const double f = camera_->camera().lens_at(camera_->time_s(last_of_wide_)).focal_length;
  while (camera_->camera().lens_at(camera_->time_s(stop)).focal_length < 1.7 * f) ++stop;
  FrameLens lens = camera_->lens(stop, kRepeatability);
  ASSERT_EQ(process(stop, &lens), OeStatus::kOk);
  EXPECT_LT(errors_.rms_px, 0.15);
  std::size_t again = 0;
  for (const std::uint32_t id : found_ids()) again += before.count(id);
  EXPECT_GT(again, 20U);
}

// The reading stands still all the way: images tell, the contradiction is said, and the curve has a lens for what they tell.
TEST_F(ZoomingLens, IsFollowedWhereItsReadingIsStuck) {
  begin();
  const FrameLens stuck = camera_->lens_at(0, kRepeatability);
  const double told = stuck.calibration.camera.focal_length;
  int held = 0;
  int contradictions = 0;
  const int frames = first_of_tele_ + 10 - last_of_wide_;
  double found = told;
  for (int k = last_of_wide_ + 1; k <= last_of_wide_ + frames; ++k) {
    const bool contradicted = std::abs(std::log(found / told)) > 5 * kRepeatability;
    const FrameLens lens =
        contradicted ? camera_->lens_of_focal_length(
                           found * std::exp(frame_.zoom_rate * camera_->time_s(1)), kRepeatability)
                     : stuck;
    const bool ok = process(k, &lens) == OeStatus::kOk;
    held += ok ? 1 : 0;
    found = ok ? frame_.calibration.camera.focal_length : told;
    contradictions += contradicted ? 1 : 0;
  }
  EXPECT_GE(held, 0.95 * frames);
  EXPECT_GT(contradictions, frames / 2);
}

// Neither angles nor zoom are told on the way: each frame by the one before, and what was expected of its rates is kept in a second look.
TEST_F(ZoomingLens, IsFollowedByImagesAlone) {
  begin();
  for (int k = last_of_wide_ + 1; k < first_of_tele_ + 10; ++k) {
    const FrameLens lens = camera_->lens_of_focal_length(
        frame_.calibration.camera.focal_length * std::exp(frame_.zoom_rate * camera_->time_s(1)),
        kRepeatability);
    ASSERT_EQ(process(k, oe_->lens_has_moved() ? &lens : nullptr, false), OeStatus::kOk) << k;
    EXPECT_LT(errors_.rms_px, 0.15) << k;
  }
}

// From the long end back to the wide one by a curve of which the distortion is known there alone, and off by what it says elsewhere,
// either way: no direction and no focal length is beyond what the answer claims.
TEST_F(ZoomingLens, ErrsAsItSaysWhereTheCurveKnowsTheDistortionLess) {
  constexpr double kUnknown = 0.01;  // in the corner, part of its distance, a factor of 4 away
  const int first = first_of_tele_ + 3;
  int end = first;
  while (!moves(end)) ++end;
  while (moves(end)) ++end;
  end += 10;
  ASSERT_LT(end, camera_->frames());
  for (const double error : {-kUnknown, kUnknown}) {
    SCOPED_TRACE(error);
    const auto lens_of = [&](int k) {
      FrameLens lens = camera_->lens(k, kRepeatability);
      Camera<double>& camera = lens.calibration.camera;
      const double away = std::max(0.0, std::log(4000 / camera.focal_length) / std::log(4.0));
      const double of_corner = corner_unit(camera)[0];
      camera.distortion.radial += away * error * of_corner;
      const int of_k = index(Parameter::kRadialDistortion);
      lens.calibration.covariance(of_k, of_k) += std::pow(away * kUnknown * of_corner, 2);
      lens.corner_by_zoom[0] -= error / std::log(4.0);
      return lens;
    };
    oe_->reset(lens_of(first).calibration, FocalLength::kLearnt);
    int held = 0;
    for (int k = first; k < end; ++k) {
      const FrameLens lens = lens_of(k);
      held += process(k, &lens) == OeStatus::kOk ? 1 : 0;
    }
    EXPECT_GE(held, 0.95 * (end - first));
    EXPECT_TRUE(statistics_.own_lens);
  }
}

// Readings in steps of 2 % have distortion and centre of another focal length: f comes out as with readings of each frame's own.
TEST_F(ZoomingLens, IsFollowedAsWellByReadingsInCoarseSteps) {
  constexpr double kQuantum = 200;  // of 9998
  const std::unique_ptr<OeMode> other = make_oe_mode();
  int moving = 0;
  double difference_square = 0;
  double sigmas_square = 0;
  for (int k = kFirst; k < first_of_tele_; ++k) {
    const InterpolatedPanTilt telemetry = camera_->telemetry(k, 5e-5, 5e-4);
    const FrameLens exact = camera_->lens(k, kRepeatability);
    const FrameLens coarse = moves(k) ? camera_->coarse_lens(k, kQuantum, kRepeatability) : exact;
    FrameOrientation by_exact;
    const OeStatus status =
        other->process(image(k), camera_->time_s(k), &telemetry, &exact, &by_exact);
    other->maintain();
    EXPECT_EQ(oe_->process(image(k), camera_->time_s(k), &telemetry, &coarse, &frame_), status);
    oe_->maintain();
    if (!moves(k)) continue;
    ASSERT_EQ(status, OeStatus::kOk) << k;
    ++moving;
    errors_ = errors_of(*camera_, k, frame_);
    EXPECT_LT(errors_.sigmas, 5) << k;
    sigmas_square += errors_.log_sigmas * errors_.log_sigmas;
    const double difference =
        std::log(frame_.calibration.camera.focal_length / by_exact.calibration.camera.focal_length);
    difference_square += difference * difference;
  }
  EXPECT_GT(moving, 40);
  // A third of what distortion and centre of the readings themselves make of it.
  EXPECT_LT(std::sqrt(difference_square / moving), 7e-5);
  // All frames share the error of the map's scale: 99.9 % of a chi-square of one degree.
  EXPECT_LT(sigmas_square / moving, 10.8);
}

// For some frames there is no reading at all.
TEST_F(ZoomingLens, IsFollowedThroughAGapInItsReadings) {
  begin();
  const int middle = (last_of_wide_ + first_of_tele_) / 2;
  for (int k = last_of_wide_ + 1; k < middle + 15; ++k) {
    const bool gap = k >= middle && k < middle + 8;
    // The optical centre wanders unseen: no contradiction of what telemetry says.
    EXPECT_EQ(gap ? process(k, nullptr) : process(k), OeStatus::kOk) << k;
  }
}

TEST_F(ZoomingLens, BeginsItsMapAtRest) {
  const int middle = (last_of_wide_ + first_of_tele_) / 2;
  oe_->reset(camera_->lens(middle, kRepeatability).calibration, FocalLength::kLearnt);
  for (int k = middle + 1; k < first_of_tele_; ++k) {
    ASSERT_EQ(process(k), OeStatus::kLensMoves) << k;
    EXPECT_EQ(frame_.mode, OrientationMode::kPt);
    EXPECT_EQ(oe_->map().size(), 0);
  }
  for (int k = first_of_tele_; k < first_of_tele_ + 10; ++k) static_cast<void>(process(k));
  EXPECT_EQ(oe_->statistics().status, OeStatus::kOk);
  EXPECT_GT(oe_->map().size(), 50);
}

// What is handed over is a map of the calibration that was given, and of its lens.
TEST_F(ZoomingLens, HandsOnWhatTheFirstLensMade) {
  begin();
  const Calibration given = camera_->lens_at(0, kRepeatability).calibration;
  for (int k = last_of_wide_ + 1; k < first_of_tele_; ++k) static_cast<void>(process(k));
  const MapState map = oe_->map_state();
  EXPECT_LT(map.landmarks.size(), static_cast<std::size_t>(oe_->map().size()));
  oe_->reset(given, map, FocalLength::kLearnt);
  EXPECT_EQ(process(last_of_wide_), OeStatus::kOk);
}

// A calibration of the zoom before, with its map, comes when the lens has left that: nobody has seen it there.
TEST_F(ZoomingLens, IsLookedForByItsReadingWhereItsMapComesLate) {
  begin();
  const Calibration given = camera_->lens_at(0, kRepeatability).calibration;
  const MapState map = oe_->map_state();
  for (const int late : {2, 4, 8}) {
    SCOPED_TRACE(late);
    oe_->reset(given, map, FocalLength::kLearnt);
    for (int k = last_of_wide_ + late; k < last_of_wide_ + late + 5; ++k) {
      EXPECT_EQ(process(k), OeStatus::kOk) << k;
      EXPECT_LT(errors_.rms_px, 0.15) << k;
    }
  }
}

}  // namespace
}  // namespace alidade::test
