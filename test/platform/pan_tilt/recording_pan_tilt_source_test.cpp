#include "platform/pan_tilt/recording_pan_tilt_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "test/platform/support/eventually.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<PanTiltSource> source_of(const TemporaryDirectory& directory,
                                         bool realtime = false) {
  RecordingPanTiltSourceOptions options;
  options.directory = directory.path();
  options.realtime = realtime;
  return open_recorded_pan_tilt(options);
}

TEST(RecordingPanTiltSource, YieldsTheRowsAsTheyAreAndThenEnds) {
  const TemporaryDirectory directory;
  directory.write("telemetry.csv",
                  "receive_time_s,pan_rad,tilt_rad,earliest_time_s\n5,1,2,4.5\n5,3,4,4\n1,5,6,1\n");
  const auto source = source_of(directory);
  PanTiltSample sample;
  for (const auto& [earliest_s, latest_s, pan_rad] :
       {std::tuple(4.5, 5.0, 1.0), {4.0, 5.0, 3.0}, {1.0, 1.0, 5.0}}) {
    ASSERT_EQ(source->read(sample, 0), ReadStatus::kOk);
    EXPECT_EQ(sample.earliest_time_s, earliest_s);
    EXPECT_EQ(sample.latest_time_s, latest_s);
    EXPECT_EQ(sample.pan_rad, pan_rad);
  }
  EXPECT_EQ(source->read(sample, 0), ReadStatus::kEnd);
  EXPECT_EQ(source->read(sample, 0), ReadStatus::kEnd);
}

TEST(RecordingPanTiltSource, EndsAtOnceWithoutRows) {
  const TemporaryDirectory directory;
  directory.write("telemetry.csv", "receive_time_s,pan_rad,tilt_rad\n");
  const auto source = source_of(directory);
  PanTiltSample sample;
  EXPECT_EQ(source->read(sample, 0), ReadStatus::kEnd);
}

TEST(RecordingPanTiltSource, FailsForGoodWhenTheTableIsMissingOrMalformed) {
  const TemporaryDirectory directory;
  const auto missing = source_of(directory);
  PanTiltSample sample;
  EXPECT_EQ(missing->read(sample, 0), ReadStatus::kFailed);
  EXPECT_THAT(missing->error(), HasSubstr("telemetry.csv: cannot be read: No such file"));
  directory.write("telemetry.csv", "receive_time_s,pan_rad,tilt_rad\n0,0,0\n1,east,0\n");
  const auto malformed = source_of(directory);
  EXPECT_EQ(malformed->read(sample, 0), ReadStatus::kFailed);
  EXPECT_EQ(malformed->read(sample, 0), ReadStatus::kFailed);
  EXPECT_THAT(malformed->error(), HasSubstr("telemetry.csv:3: 'east'"));
}

TEST(RecordingPanTiltSource, KeepsThePaceOfTheRecordingWhenAskedTo) {
  const TemporaryDirectory directory;
  directory.write("telemetry.csv",
                  "receive_time_s,pan_rad,tilt_rad\n100,1,0\n100.02,2,0\n1000100,3,0\n");
  const auto source = source_of(directory, true);
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, 0), ReadStatus::kOk);
  ASSERT_EQ(source->read(sample, kNever_s), ReadStatus::kOk);
  EXPECT_EQ(sample.pan_rad, 2);
  EXPECT_EQ(source->read(sample, 0.01), ReadStatus::kTimeout);
}

}  // namespace
}  // namespace alidade
