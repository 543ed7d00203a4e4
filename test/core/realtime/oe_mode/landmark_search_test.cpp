// Finding landmarks from a prediction that is off, and what it makes of views that show none.

#include "core/realtime/oe_mode/landmark_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "core/model/direction.h"
#include "test/core/realtime/oe_mode/textured_scene.h"
#include "test/support/parameter_changes.h"

namespace alidade::test {
namespace {

class SearchedScene : public testing::Test {
 protected:
  SearchedScene() {
    search_.reset(scene_.calibration_);
    LandmarkMaker maker(TexturedScene::maker_options(), OctaveOptions{}, TexturedScene::kWidth,
                        TexturedScene::kHeight);
    scene_.look({0, 0});
    static_cast<void>(scene_.make_landmarks(&maker, {0, 0}));
  }

  [[nodiscard]] SearchedFrame frame() const {
    return {scene_.calibration_, scene_.map_, scene_.pyramid_, scene_.octaves_};
  }

  TexturedScene scene_;
  LandmarkSearch search_{LandmarkSearchOptions{}, scene_.map_.capacity()};
};

TEST_F(SearchedScene, MovesAPredictionToWhereCoarseLandmarksFit) {
  const Vector2<double> at(5.3, -3.7);
  scene_.look(at);
  for (const Vector2<double>& off : {Vector2<double>(0, 0), {4, 3}, {-9, 14}}) {
    const LandmarkSearch::Coarse coarse =
        search_.align_coarse(frame(), TexturedScene::motion_at(at + off), off.norm());
    ASSERT_TRUE(coarse.aligned) << off.transpose();
    const Vector2<double> left =
        coarse.motion.angle.vector() - TexturedScene::motion_at(at).angle.vector();
    EXPECT_LT(left.norm(), 0.3 * TexturedScene::kPixel) << off.transpose();
    EXPECT_NEAR(coarse.shift_px, off.norm(), 0.3);
  }
}

TEST_F(SearchedScene, FindsFineLandmarksWhereTheyAre) {
  const Vector2<double> at(5.3, -3.7);
  scene_.look(at);
  const LandmarkSearch::Fine fine =
      search_.align_fine(frame(), TexturedScene::motion_at(at + Vector2<double>(0.5, 0.2)));
  EXPECT_GT(fine.chosen, 50);
  EXPECT_GE(fine.fine_visible, fine.chosen);
  EXPECT_GT(fine.found, 0.9 * fine.chosen);
  ASSERT_EQ(search_.found().size(), static_cast<std::size_t>(fine.found));
  ASSERT_EQ(search_.observations().size(), search_.found().size());
  ASSERT_EQ(search_.J_tangent().size(), search_.found().size());
  // Residuals less what the prediction was off by are as large as said.
  Vector6 correction = Vector6::Zero();
  correction.head<2>() = -TexturedScene::kPixel * Vector2<double>(0.5, 0.2);
  for (FoundLandmark& found : search_.found()) found.inlier = true;
  search_.conclude(correction);
  double squares = 0;
  for (std::size_t i = 0; i < search_.found().size(); ++i) {
    const OeObservation& found = search_.observations()[i];
    EXPECT_EQ(found.id, scene_.map_.at(found.slot).id);
    EXPECT_TRUE(found.inlier);
    squares += found.residual.dot(search_.found()[i].covariance.inverse() * found.residual) / 2;
  }
  EXPECT_LT(squares / fine.found, 2);
  EXPECT_GT(squares / fine.found, 0.3);
}

// A view a little wider than the landmarks' is within what a prepared patch serves for. How long it serves may cost
// time, but must not move its landmark: to second order, 4 px of half a patch times the square of the change, and
// what alignment leaves between its last step and none.
TEST_F(SearchedScene, FindsLandmarksAtTheSamePlaceHoweverLongAPatchServes) {
  constexpr double kWider = 0.009;
  scene_.calibration_.camera.focal_length /= 1 + kWider;
  LandmarkSearchOptions options;
  ASSERT_GT(0.5 * options.fine_warp_tolerance, kWider);
  options.fine_warp_tolerance = 1e-6F;
  LandmarkSearch exact(options, scene_.map_.capacity());
  exact.reset(scene_.calibration_);
  static_cast<void>(exact.align_fine(frame(), TexturedScene::motion_at({0, 0})));
  static_cast<void>(search_.align_fine(frame(), TexturedScene::motion_at({0, 0})));
  std::map<std::uint32_t, Vector2<double>> expected;
  for (const OeObservation& seen : exact.observations()) expected[seen.id] = seen.u;
  double squares = 0;
  int compared = 0;
  for (const OeObservation& seen : search_.observations()) {
    const auto other = expected.find(seen.id);
    if (other == expected.end()) continue;
    squares += std::ldexp((seen.u - other->second).squaredNorm() / 2, -2 * seen.octave);
    ++compared;
  }
  ASSERT_GT(compared, 50);
  EXPECT_LT(std::sqrt(squares / compared), 4 * kWider * kWider + AlignmentLimits{}.converged_step);
}

// While the lens zooms, fine landmarks are chosen from what coarse alignment saw: whichever view was looked at before.
TEST_F(SearchedScene, ChoosesFromThisFramesViewWhileTheLensZooms) {
  const auto chosen_again = [&](const SearchedFrame& searched, const FrameMotion<double>& about) {
    static_cast<void>(search_.align_fine(searched, about));
    std::set<int> slots;
    for (const VisibleLandmark& landmark : search_.chosen()) slots.insert(landmark.slot);
    return slots;
  };
  const auto chosen = [&](const SearchedFrame& searched, const FrameMotion<double>& coarse_about,
                          const FrameMotion<double>& about) {
    static_cast<void>(search_.align_coarse(searched, coarse_about, 0));
    return chosen_again(searched, about);
  };
  SearchedFrame zooms = frame();
  zooms.zooms = true;
  for (const Vector2<double>& at : {Vector2<double>(0, 0), {5.3, -3.7}, {-31, 18}}) {
    scene_.look(at);
    const FrameMotion<double> there = TexturedScene::motion_at(at);
    const FrameMotion<double> off = TexturedScene::motion_at(at + Vector2<double>(30, -20));
    const std::set<int> expected = chosen(frame(), there, there);
    ASSERT_GT(expected.size(), 50U);
    EXPECT_EQ(chosen(zooms, there, there), expected);
    // Coarse alignment moves it there; a second look, at another view, sees that.
    EXPECT_EQ(chosen(zooms, off, there), expected);
    const std::set<int> expected_off = chosen(frame(), off, off);
    ASSERT_NE(expected_off, expected);
    static_cast<void>(chosen(zooms, there, there));
    EXPECT_EQ(chosen_again(zooms, off), expected_off);
  }
}

TEST_F(SearchedScene, CountsTheOctavesThatALandmarkHasGrownByAsTheyRound) {
  Landmark landmark;
  landmark.J_pixel_tangent << 1000, 120, -60, 900;
  for (const std::uint8_t octave : {std::uint8_t{0}, std::uint8_t{3}}) {
    landmark.octave = octave;
    const double made_px =
        std::sqrt(landmark.J_pixel_tangent.determinant()) * std::ldexp(1.0, octave);
    for (double octaves = -6.02; octaves < 6; octaves += 0.09) {
      EXPECT_EQ(octaves_larger(landmark, made_px * std::exp2(octaves)), std::lround(octaves))
          << octaves;
    }
  }
}

TEST_F(SearchedScene, FindsNothingWhereThereIsNothing) {
  scene_.look_at_nothing();
  const LandmarkSearch::Coarse coarse =
      search_.align_coarse(frame(), TexturedScene::motion_at({0, 0}), 1);
  EXPECT_FALSE(coarse.aligned);
  EXPECT_EQ(coarse.shift_px, 0);
  EXPECT_EQ(coarse.motion.angle.pan, 0) << "as predicted";
  const LandmarkSearch::Fine fine = search_.align_fine(frame(), coarse.motion);
  EXPECT_GT(fine.chosen, 50);
  EXPECT_EQ(fine.found, 0);
}

// Every other landmark has served well: of each part of the image such a one is looked for, and found.
TEST_F(SearchedScene, LooksForNoMoreThanItMayAndForTheReliableOfAllTheImage) {
  LandmarkSearchOptions options;
  options.choice.max_chosen = 8;
  options.choice.columns = 4;
  options.choice.rows = 2;
  LandmarkSearch search(options, scene_.map_.capacity());
  search.reset(scene_.calibration_);
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    scene_.map_.statistics(slot).looked_for = 100;
    scene_.map_.statistics(slot).matched = slot % 2 == 1 ? 100 : 10;
  }
  const LandmarkSearch::Fine fine = search.align_fine(frame(), TexturedScene::motion_at({0, 0}));
  EXPECT_EQ(fine.chosen, 8);
  EXPECT_EQ(fine.found, 8);
  EXPECT_GT(fine.fine_visible, 10 * 8);
  ASSERT_EQ(search.chosen().size(), 8U);
  std::set<std::pair<int, int>> parts;
  for (const VisibleLandmark& chosen : search.chosen()) {
    EXPECT_EQ(chosen.slot % 2, 1);
    parts.insert({static_cast<int>(chosen.u.x() * 4 / TexturedScene::kWidth),
                  static_cast<int>(chosen.u.y() * 2 / TexturedScene::kHeight)});
  }
  EXPECT_EQ(parts.size(), 8U);
  search.clear();
  EXPECT_TRUE(search.chosen().empty());
  EXPECT_TRUE(search.found().empty());
  EXPECT_TRUE(search.coarse().empty());
}

// A landmark of a coarser octave is aligned in that octave's pixels: in the image's they are 2^l as wide.
TEST_F(SearchedScene, TellsPositionsInPixelsOfTheImageWhateverTheOctave) {
  const Vector2<double> at(5.3, -3.7);
  scene_.look(at);
  static_cast<void>(search_.align_fine(frame(), TexturedScene::motion_at(at)));
  int coarser = 0;
  for (const OeObservation& seen : search_.observations()) {
    const double scale = std::ldexp(1.0, seen.octave);
    ReferencePatch patch;
    ASSERT_TRUE(is_usable(prepare(scene_.map_.at(seen.slot).image(),
                                  Vector2<double>::Constant(kReferenceCentre),
                                  Matrix2<double>::Identity(), 1, &patch)));
    Alignment alignment;
    ASSERT_EQ(align(patch, scene_.pyramid_.octave(seen.octave), seen.u / scale, {}, &alignment),
              AlignmentStatus::kConverged);
    EXPECT_LT((scale * alignment.position - seen.u).norm(), 0.01 * scale);
    const Matrix2<double> expected = scale * scale * alignment.covariance;
    EXPECT_LT((seen.covariance - expected).norm(), 0.02 * expected.norm());
    coarser += seen.octave > 0 ? 1 : 0;
  }
  EXPECT_GT(coarser, 10);
}

TEST_F(SearchedScene, AddsWhatTheLandmarksThemselvesAreUncertainBy) {
  constexpr double kUncertain = 2;  // px
  const Matrix2<double> covariance =
      std::pow(kUncertain * TexturedScene::kPixel, 2) * Matrix2<double>::Identity();
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    scene_.map_.refine(slot, scene_.map_.at(slot).d, covariance);
  }
  static_cast<void>(search_.align_fine(frame(), TexturedScene::motion_at({0, 0})));
  ASSERT_GT(search_.found().size(), 50U);
  for (std::size_t i = 0; i < search_.found().size(); ++i) {
    const Matrix2<double> added =
        search_.found()[i].covariance - search_.observations()[i].covariance;
    const Matrix2<double> expected = kUncertain * kUncertain * Matrix2<double>::Identity();
    EXPECT_LT((added - expected).norm(), 1e-3 * expected.norm());
  }
}

// Where a landmark is expected by one calibration and by another, each with the direction that it gave it.
TEST_F(SearchedScene, ResidualsFollowTheCalibrationAsTheirSensitivitySays) {
  const ParameterVector steps = parameter_steps(scene_.calibration_.camera);
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    for (int j = 0; j < kParameterCount; ++j) {
      const Vector2<double> moved(std::sin(1 + slot + 3 * j), std::cos(slot + 5 * j));
      scene_.map_.sensitivity(slot).col(j) =
          (TexturedScene::kPixel * moved / steps[j]).cast<float>();
    }
  }
  const FrameMotion<double> motion = TexturedScene::motion_at({0, 0});
  static_cast<void>(search_.align_fine(frame(), motion));
  ASSERT_GT(search_.found().size(), 50U);
  for (std::size_t i = 0; i < search_.found().size(); ++i) {
    const Landmark& landmark = scene_.map_.at(search_.observations()[i].slot);
    const auto expected_with = [&](int j, double change) {
      const Calibration changed = plus(scene_.calibration_, change * ParameterVector::Unit(j));
      const Vector2<double> moved = change * landmark.sensitivity.col(j).cast<double>();
      Vector2<double> u = Vector2<double>::Zero();
      EXPECT_TRUE(
          ViewProjection(changed, motion).project(direction_plus<double>(landmark.d, moved), &u));
      return u;
    };
    for (int j = 0; j < kParameterCount; ++j) {
      const Vector2<double> numeric =
          (expected_with(j, steps[j]) - expected_with(j, -steps[j])) / 2;
      const Vector2<double> told = steps[j] * search_.found()[i].sensitivity.col(j);
      EXPECT_LT((told + numeric).norm(), 1e-3 + 1e-3 * numeric.norm()) << j;
    }
  }
}

// A search may find what only looks alike: within reach of the coarsest octave there is none.
TEST_F(SearchedScene, SearchesNothingWhereThePredictionIsSure) {
  LandmarkSearchOptions options;
  options.wide_search_px = 0;
  LandmarkSearch search(options, scene_.map_.capacity());
  search.reset(scene_.calibration_);
  const Vector2<double> off(8, 8);  // two of the coarsest octave's pixels each way
  const double reach_px =
      std::ldexp(options.coarse_reach_px, scene_.pyramid_.octaves() - 1) / options.search_sigmas;
  EXPECT_FALSE(search.align_coarse(frame(), TexturedScene::motion_at(off), 0.9 * reach_px).aligned);
  EXPECT_TRUE(search.align_coarse(frame(), TexturedScene::motion_at(off), 1.1 * reach_px).aligned);
}

}  // namespace
}  // namespace alidade::test
