// Whether a zoom reading is believed, after landmarks agreed with it, excluded it, or were seen too
// long ago.

#include "core/realtime/lens/reading_belief.h"

#include <gtest/gtest.h>

#include <limits>

namespace alidade::test {
namespace {

constexpr ReadingBeliefOptions kLimits;
constexpr double kSigma = 1e-3;  // of log f
constexpr double kJudgedFrame_s = 0.04;

TEST(ReadingJudge, BelievesWhatNothingSpeaksAgainst) {
  ReadingJudge judge(kLimits);
  EXPECT_EQ(judge.belief(0), ReadingBelief::kBelieved);
  judge.judge(0.9 * kLimits.excluded_sigmas * kSigma, kSigma);
  EXPECT_EQ(judge.belief(0), ReadingBelief::kBelieved);
  judge.judge(std::numeric_limits<double>::quiet_NaN(), kSigma);
  EXPECT_EQ(judge.belief(0), ReadingBelief::kBelieved);
}

TEST(ReadingJudge, ExcludesWhatLandmarksContradictUntilTheyAgreeOrAreTooOld) {
  ReadingJudge judge(kLimits);
  judge.judge(-1.1 * kLimits.excluded_sigmas * kSigma, kSigma);
  EXPECT_EQ(judge.belief(0), ReadingBelief::kExcluded);
  EXPECT_EQ(judge.belief(0.99 * kLimits.longest_s), ReadingBelief::kExcluded);
  EXPECT_EQ(judge.belief(kLimits.longest_s), ReadingBelief::kBelieved);
  judge.judge(0, kSigma);
  EXPECT_EQ(judge.belief(0), ReadingBelief::kBelieved);
  judge.judge(1, kSigma);
  judge.forget();
  EXPECT_EQ(judge.belief(0), ReadingBelief::kBelieved);
}

TEST(ReadingJudge, SeesAReadingJumpThatMovesFasterThanAnyLens) {
  const ReadingJudge judge(kLimits);
  const double most = kLimits.fastest * kJudgedFrame_s + kLimits.excluded_sigmas * kSigma;
  EXPECT_EQ(judge.belief(kJudgedFrame_s, 0.99 * most, kSigma), ReadingBelief::kBelieved);
  EXPECT_EQ(judge.belief(kJudgedFrame_s, -0.99 * most, kSigma), ReadingBelief::kBelieved);
  EXPECT_EQ(judge.belief(kJudgedFrame_s, 1.01 * most, kSigma), ReadingBelief::kJumped);
  EXPECT_EQ(judge.belief(-kJudgedFrame_s, -1.01 * most, kSigma), ReadingBelief::kJumped);
  EXPECT_EQ(judge.belief(kLimits.longest_s, 9, kSigma), ReadingBelief::kBelieved);
  // A reading that says nothing does not excuse every jump.
  const double largest = kLimits.excluded_sigmas * kLimits.largest_sigma;
  EXPECT_EQ(judge.belief(0, 1.01 * largest, 10), ReadingBelief::kJumped);
}

TEST(ReadingJudge, CallsAnExcludedReadingExcludedThoughItJumps) {
  ReadingJudge judge(kLimits);
  judge.judge(1, kSigma);
  EXPECT_EQ(judge.belief(kJudgedFrame_s, 9, kSigma), ReadingBelief::kExcluded);
}

TEST(ReadingBeliefOptions, NameWhatIsNotValid) {
  ReadingBeliefOptions options;
  EXPECT_TRUE(options.validate());
  const char* error = nullptr;
  options.fastest = 0;
  EXPECT_FALSE(options.validate(&error));
  EXPECT_STREQ(error, "fastest must be positive");
}

}  // namespace
}  // namespace alidade::test
