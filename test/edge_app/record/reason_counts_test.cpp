#include "edge_app/record/reason_counts.h"

#include <gtest/gtest.h>

namespace alidade {
namespace {

OrientationRecord record_of(RecordMode mode, RecordStatus status) {
  OrientationRecord record;
  record.mode = mode;
  record.status = status;
  return record;
}

TEST(ReasonCounts, NameTheMostFrequentFirstAndNothingOfOeMode) {
  ReasonCounts counts;
  EXPECT_EQ(counts.line(), "");
  counts.add(record_of(RecordMode::kOe, RecordStatus::kOk));
  counts.add(record_of(RecordMode::kOe, RecordStatus::kTelemetryLost));
  EXPECT_EQ(counts.line(), "");
  counts.add(record_of(RecordMode::kPt, RecordStatus::kTooFewLandmarks));
  EXPECT_EQ(counts.line(), "not in OE mode: 1 record 'too few landmarks'");
  for (int i = 0; i < 3; ++i) counts.add(record_of(RecordMode::kPt, RecordStatus::kNotCalibrated));
  counts.add(record_of(RecordMode::kNone, RecordStatus::kTelemetryLost));
  EXPECT_EQ(counts.line(),
            "not in OE mode: 3 records 'not calibrated', 1 'telemetry lost', 1 'too few "
            "landmarks'");
  EXPECT_EQ(counts.of(RecordStatus::kNotCalibrated), 3);
}

TEST(ReasonCounts, NameTheZoomReadingsWithoutACalibration) {
  ReasonCounts counts;
  OrientationRecord record = record_of(RecordMode::kNone, RecordStatus::kOtherZoom);
  counts.add(record);
  EXPECT_EQ(counts.line(), "not in OE mode: 1 record 'no calibration for this zoom'")
      << "no reading";
  record.zoom = 3100;
  counts.add(record);
  EXPECT_EQ(counts.line(),
            "not in OE mode: 2 records 'no calibration for this zoom' (zoom reading 3100)");
  record.zoom = 2900.5;
  counts.add(record);
  EXPECT_EQ(counts.line(),
            "not in OE mode: 3 records 'no calibration for this zoom' (zoom readings 2900.5 to "
            "3100)");
}

TEST(ReasonCounts, WhereLandmarksAreNotAskedForCountWhatHasNoOrientation) {
  ReasonCounts counts(false);
  counts.add(record_of(RecordMode::kPt, RecordStatus::kOk));
  counts.add(record_of(RecordMode::kPt, RecordStatus::kClockWarmingUp));
  EXPECT_EQ(counts.line(), "");
  counts.add(record_of(RecordMode::kNone, RecordStatus::kTimeUnknown));
  EXPECT_EQ(counts.line(), "without orientation: 1 record 'picture time unknown'");
}

}  // namespace
}  // namespace alidade
