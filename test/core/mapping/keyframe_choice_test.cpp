#include "core/mapping/keyframe_choice.h"

#include <gtest/gtest.h>

namespace alidade::test {
namespace {

TEST(KeyframeChoice, KeepsPicturesAPartOfTheirFieldApart) {
  KeyframeChoice choice(1280, 720);
  const double log_f = std::log(2000.0);
  const double field = 2 * std::atan(0.32);
  EXPECT_TRUE(choice.is_new({{0, 0}, log_f}));
  choice.keep({{0, 0}, log_f});
  EXPECT_FALSE(choice.is_new({{0.3 * field, 0}, log_f}));
  EXPECT_TRUE(choice.is_new({{0.36 * field, 0}, log_f}));
  EXPECT_TRUE(choice.is_new({{0, 0.36 * 2 * std::atan(0.18)}, log_f}));
  // The longer of two focal lengths has the smaller field.
  EXPECT_FALSE(choice.is_new({{0.1 * field, 0}, log_f + 0.3}));
  EXPECT_TRUE(choice.is_new({{0.3 * field, 0}, log_f + 0.3}));
  EXPECT_TRUE(choice.is_new({{0, 0}, log_f + 0.36}));
}

TEST(KeyframeChoice, PansLessFarWhereItLooksUp) {
  KeyframeChoice choice(1280, 720);
  const double log_f = std::log(2000.0);
  const double field = 2 * std::atan(0.32);
  choice.keep({{0, 1}, log_f});
  EXPECT_FALSE(choice.is_new({{0.36 * field, 1}, log_f}));
  EXPECT_TRUE(choice.is_new({{0.36 * field / std::cos(1.0), 1}, log_f}));
}

TEST(KeyframeChoice, KnowsThatPanTurnsAround) {
  KeyframeChoice choice(1280, 720);
  choice.keep({{3.1, 0}, 7});
  EXPECT_FALSE(choice.is_new({{-3.1, 0}, 7}));
}

TEST(KeyframeChoice, TakesNothingThatMovesFast) {
  const KeyframeChoice choice(1280, 720);
  const double log_f = std::log(2000.0);
  EXPECT_TRUE(choice.is_slow(log_f, 0.1, 0, 0.02));
  EXPECT_FALSE(choice.is_slow(log_f, -0.5, 0, 0.02));
  EXPECT_FALSE(choice.is_slow(log_f, 0, 0.3, 0.02));
  EXPECT_TRUE(choice.is_slow(log_f, 5, 3, 0));
  EXPECT_NEAR(choice.haste(log_f, -0.5, 0, 0.02), 0.5 * std::exp(log_f) * 0.02 / 10, 1e-12);
  EXPECT_NEAR(choice.haste(log_f, 0, 0.3, 0.02), 3, 1e-12);
}

TEST(KeyframeChoice, RefusesOptionsOutOfRange) {
  KeyframeChoiceOptions options;
  EXPECT_TRUE(options.validate());
  options.step_fields = 0;
  const char* error = nullptr;
  EXPECT_FALSE(options.validate(&error));
  EXPECT_NE(error, nullptr);
}

}  // namespace
}  // namespace alidade::test
