// The zoom at which a camera stands: what counts as another one, and what is left out.

#include "edge_app/self_calibration/present_zoom.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>

namespace alidade {
namespace {

using Change = PresentZoom::Change;

class PresentZoomTest : public ::testing::Test {
 protected:
  static constexpr double kPeriod_s = 0.05;

  Change read(std::optional<double> zoom) {
    PanTiltSample sample;
    sample.earliest_time_s = sample.latest_time_s = time_s_ += kPeriod_s;
    sample.zoom = zoom;
    return zoom_.add(sample);
  }
  // The last change but kSame.
  Change read_for(double span_s, std::optional<double> zoom) {
    Change last = Change::kSame;
    for (double end_s = time_s_ + span_s; time_s_ < end_s;) {
      const Change change = read(zoom);
      if (change != Change::kSame) last = change;
    }
    return last;
  }

  PresentZoom zoom_{std::nullopt, CalibrationSchedule{}};
  double time_s_ = 100;
};

TEST_F(PresentZoomTest, IsUnknownWithoutAReadingAndThenFitsAny) {
  EXPECT_EQ(read_for(10, std::nullopt), Change::kNone);
  EXPECT_FALSE(zoom_.reading());
  EXPECT_TRUE(zoom_.fits(3.0));
  EXPECT_EQ(read(5), Change::kFirst);
  EXPECT_EQ(zoom_.reading(), 5.0);
  EXPECT_FALSE(zoom_.fits(3.0));
  EXPECT_TRUE(zoom_.fits(std::nullopt));
  EXPECT_TRUE(zoom_.has_settled(time_s_)) << "nothing has moved";
}

TEST_F(PresentZoomTest, IsAnotherOnceReadingsStayAway) {
  EXPECT_EQ(read(5), Change::kFirst);
  EXPECT_EQ(read_for(1, 5), Change::kSame);
  EXPECT_EQ(read(6), Change::kNone);
  EXPECT_EQ(zoom_.reading(), 5.0);
  EXPECT_EQ(read_for(0.2, 6), Change::kMoved);
  EXPECT_EQ(zoom_.reading(), 6.0);
  EXPECT_FALSE(zoom_.has_arrived(time_s_));
  EXPECT_TRUE(zoom_.has_arrived(time_s_ + 0.15));
  EXPECT_FALSE(zoom_.has_settled(time_s_ + 0.15));
  EXPECT_TRUE(zoom_.has_settled(time_s_ + 0.55));
}

TEST_F(PresentZoomTest, MovesWithEachReadingOfAMovement) {
  read_for(1, 5);
  for (double zoom = 5; zoom < 5.5; zoom += 0.1) static_cast<void>(read(zoom));
  for (double zoom = 6; zoom < 8; zoom += 0.1) EXPECT_EQ(read(zoom), Change::kMoved) << zoom;
  EXPECT_FALSE(zoom_.has_settled(time_s_ + 0.45));
}

TEST_F(PresentZoomTest, LeavesOutAGlitch) {
  read_for(1, 5);
  EXPECT_EQ(read(60), Change::kNone);
  EXPECT_EQ(read(5), Change::kGlitch);
  EXPECT_EQ(read(5), Change::kSame);
  EXPECT_EQ(zoom_.reading(), 5.0);
  EXPECT_TRUE(zoom_.has_settled(time_s_));
}

TEST_F(PresentZoomTest, HoldsWhileReadingsAreMissingOrNoNumber) {
  read_for(1, 5);
  EXPECT_EQ(read_for(4, std::numeric_limits<double>::quiet_NaN()), Change::kNone);
  EXPECT_EQ(read_for(2, std::nullopt), Change::kSilent);
  EXPECT_EQ(zoom_.reading(), 5.0);
  EXPECT_EQ(read(5), Change::kSame);
}

TEST_F(PresentZoomTest, TakesNeighboursForOneZoomWhereTheUserSaysSo) {
  zoom_ = PresentZoom(0.5, CalibrationSchedule{});
  EXPECT_EQ(read(5), Change::kFirst);
  EXPECT_EQ(read_for(2, 5.4), Change::kSame);
  EXPECT_EQ(zoom_.reading(), 5.0);
  zoom_.take_level();
  EXPECT_EQ(zoom_.reading(), 5.0) << "there is no jitter, and so no level";
}

}  // namespace
}  // namespace alidade
