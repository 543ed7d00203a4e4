// When it is believed that a camera is no longer what its calibration says.

#include "edge_app/self_calibration/calibration_watch.h"

#include <gtest/gtest.h>

namespace alidade {
namespace {

using Verdict = ContradictionJudge::Verdict;

TEST(ContradictionJudge, BelievesTheSecondInARow) {
  ContradictionJudge judge;
  EXPECT_EQ(judge.judge(61), Verdict::kContradicts);
  EXPECT_EQ(judge.judge(61), Verdict::kBelieved);
}

TEST(ContradictionJudge, ForgetsAContradictionThatLaterMotionDoesNotBearOut) {
  ContradictionJudge judge;
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(judge.judge(1e6), Verdict::kContradicts) << i;
    EXPECT_EQ(judge.judge(59), Verdict::kAgrees) << i;
  }
}

TEST(ContradictionJudge, BeginsAnewWithAnotherCalibration) {
  ContradictionJudge judge;
  EXPECT_EQ(judge.judge(61), Verdict::kContradicts);
  judge.restart();
  EXPECT_EQ(judge.judge(61), Verdict::kContradicts);
}

TEST(DisagreementJudge, WithdrawsWhatHalfOfTheFramesContradict) {
  DisagreementJudge judge;
  int frames = 0;
  bool withdrawn = false;
  while (!withdrawn && frames < 100) {
    withdrawn = judge.judge(0.05 * frames, frames % 2 == 0);
    ++frames;
  }
  EXPECT_EQ(frames, 40) << "fewer tell nothing";
  EXPECT_EQ(judge.contradicted_frames(), 20U);
}

TEST(DisagreementJudge, BearsLessThanHalf) {
  DisagreementJudge judge;
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(judge.judge(0.05 * i, i % 5 < 2)) << i;
}

TEST(DisagreementJudge, LooksAtTheLastSecondsOnly) {
  DisagreementJudge judge;
  double time_s = 0;
  for (int i = 0; i < 39; ++i) EXPECT_FALSE(judge.judge(time_s += 0.05, true)) << i;
  for (int i = 0; i < 39; ++i) EXPECT_FALSE(judge.judge(time_s += 9, true)) << "alone " << i;
  EXPECT_EQ(judge.frames(), 1U);
}

}  // namespace
}  // namespace alidade
