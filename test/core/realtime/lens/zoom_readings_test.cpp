// Zoom readings as they come: which are one zoom, and whether a calibration fits the present one.

#include "core/realtime/lens/zoom_readings.h"

#include <gtest/gtest.h>

#include <optional>

namespace alidade::test {
namespace {

TEST(ZoomReadings, TellWhenTheZoomChanges) {
  ZoomReadings readings(0.0);
  EXPECT_FALSE(readings.zoom());
  EXPECT_TRUE(readings.take(0, 100));
  EXPECT_FALSE(readings.take(0.04, 100));
  EXPECT_TRUE(readings.take(0.08, 101));
  EXPECT_EQ(readings.told(), 101);
  EXPECT_EQ(readings.zoom(), 101);
}

TEST(ZoomReadings, FitACalibrationWithinTheTolerance) {
  ZoomReadings readings(2.0);
  EXPECT_TRUE(readings.fits(100));  // nothing is known yet
  readings.take(0, 102);
  EXPECT_TRUE(readings.fits(100));
  EXPECT_FALSE(readings.fits(99));
}

TEST(ZoomReadings, TakeACalibrationWithoutZoomToBeMadeAtThatOfItsAdoption) {
  ZoomReadings readings(2.0);
  readings.note_adoption();
  readings.take(0, 100);  // the first reading, as there was none before
  EXPECT_TRUE(readings.fits(std::nullopt));
  readings.take(1, 200);
  EXPECT_FALSE(readings.fits(std::nullopt));
  readings.note_adoption();
  EXPECT_TRUE(readings.fits(std::nullopt));
}

TEST(ZoomReadings, StandWhereBothReadingsAroundTheTimeAre) {
  ZoomReadings readings(1.0);
  EXPECT_FALSE(readings.stands_at(100, 0));
  const auto read = [&](double time_s, double zoom) {
    readings.take(time_s, zoom);
    readings.place(time_s);
  };
  read(0, 100);
  read(1, 101);
  EXPECT_TRUE(readings.stands_at(100, 0.5));
  read(2, 110);
  EXPECT_FALSE(readings.stands_at(100, 1.5));
  EXPECT_TRUE(readings.stands_at(100, 0.5));
}

}  // namespace
}  // namespace alidade::test
