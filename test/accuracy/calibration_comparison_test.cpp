// Estimates beside truth, another program's estimates and limits: the statistics by hand.

#include "test/accuracy/calibration_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/model/direction.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

Calibration estimate() {
  Calibration c;
  c.camera = {4002, 1, {0}, 1920, 1080};
  c.line_delay = 1.1e-6;
  c.clock_offset = 0.021;
  const int f = index(Parameter::kFocalLength);
  const int d = index(Parameter::kClockOffset);
  c.covariance(f, f) = 4 * 4;
  c.covariance(d, d) = 5e-4 * 5e-4;
  for (const Parameter p :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    c.covariance(index(p), index(p)) = 1e-6;
  }
  return c;
}

ComparedRun known() {
  ComparedRun run;
  run.name = "somewhere";
  run.truth.focal_length = StatedValue{4000, std::nullopt};
  run.truth.clock_offset = StatedValue{0.020, std::nullopt};
  run.truth.pan_axis = Vector3<double>::UnitZ();
  run.peer.focal_length = StatedValue{4004, 2};
  run.limits.focal_length_rel = 0.001;
  return run;
}

TEST(CalibrationComparison, ShowsEachRunBesideWhatIsKnown) {
  CalibrationComparison comparison;
  const std::string text = comparison.add(known(), estimate());
  EXPECT_THAT(text, HasSubstr("somewhere\n"));
  // Estimate, sigma, truth, peer, its sigma, error, peer's, limit.
  EXPECT_THAT(text, ContainsRegex("focal_length +4002 +4 +4000 +4004 +2 +2 +4 +4 +px"));
  EXPECT_THAT(text, ContainsRegex("clock_offset +21 +0.5 +20 +- +- +1 +- +- +ms"));
  EXPECT_THAT(text, ContainsRegex("line_delay +1100 +exact +- +- +- +- +- +- +ns/row"));
}

// Two runs with an error of 2 px of 4000: 500 millionths, half of the limit, half of sigma. The peer's, of one run, is
// 4 px: the limit, and twice its sigma.
TEST(CalibrationComparison, SumsUpErrorsRatiosAndNees) {
  CalibrationComparison comparison;
  static_cast<void>(comparison.add(known(), estimate()));
  ComparedRun without_peer = known();
  without_peer.peer = {};
  static_cast<void>(comparison.add(without_peer, estimate()));
  const std::string text = comparison.statistics();
  EXPECT_THAT(text, HasSubstr("2 recordings: 2 calibrated, 0 failed\n"));
  EXPECT_THAT(text, ContainsRegex("focal_length, 1e-6 of it +ours +2 +500 +0.5 .* 0.25 "));
  EXPECT_THAT(text, ContainsRegex("focal_length, 1e-6 of it +peer +1 +1e\\+03 +1 \\[0.03, "
                                  "2.24\\] +4 \\[0.00, 5.02\\]"));
  EXPECT_THAT(text, ContainsRegex("clock_offset, ms +ours +2 +1 +- +4 "));
  EXPECT_THAT(text, Not(ContainsRegex("clock_offset, ms +peer")));
}

// Of an axis the error is that of two components: e^T P^-1 e / 2.
TEST(CalibrationComparison, AnAxisHasTwoDegreesOfFreedom) {
  CalibrationComparison comparison;
  Calibration c = estimate();
  c.mechanics.pan_axis = direction_plus<double>(Vector3<double>::UnitZ(), Vector2<double>(2e-3, 0));
  static_cast<void>(comparison.add(known(), c));
  EXPECT_THAT(comparison.statistics(), ContainsRegex("pan_axis, mrad +ours +1 +2 +- +2 "));
}

TEST(CalibrationComparison, ListsWhatFailed) {
  CalibrationComparison comparison;
  comparison.add_failure("there: no calibration");
  EXPECT_THAT(comparison.statistics(), AllOf(HasSubstr("1 recordings: 0 calibrated, 1 failed\n"),
                                             HasSubstr("  failed: there: no calibration\n")));
  EXPECT_EQ(comparison.failures(), 1U);
}

TEST(CalibrationComparison, ReadsWhatAFolderHoldsAndRefusesWhatIsMalformed) {
  const TemporaryDirectory directory;
  ComparedRun run;
  std::string error;
  EXPECT_TRUE(load_known_values(directory.path(), &run, &error)) << "all may be missing";
  EXPECT_FALSE(run.truth.focal_length);
  directory.write("truth.yaml", "focal_length: {value: 4000}\n");
  directory.write("limit.yaml", "focal_length_rel: 0.001\n");
  ASSERT_TRUE(load_known_values(directory.path(), &run, &error)) << error;
  EXPECT_EQ(run.name, directory.path());
  EXPECT_EQ(run.truth.focal_length->value, 4000);
  EXPECT_EQ(run.limits.focal_length_rel, 0.001);
  directory.write("peer.yaml", "focal_length: 4000\n");
  EXPECT_FALSE(load_known_values(directory.path(), &run, &error));
  EXPECT_THAT(error, HasSubstr("peer.yaml"));
}

}  // namespace
}  // namespace alidade::test
