// When a session is worth another adjustment.

#include "edge_app/self_calibration/try_pace.h"

#include <gtest/gtest.h>

namespace alidade {
namespace {

class TryPaceTest : public ::testing::Test {
 protected:
  // A frame a tenth of a second.
  void add_frames(double span_s) {
    for (int i = 0; i < static_cast<int>(10 * span_s + 0.5); ++i) {
      FrameTracks tracks;
      tracks.stamp.frame = ++frame_;
      tracks.stamp.receive_time_s = 0.1 * static_cast<double>(frame_);
      if (session_.empty()) pace_.begin(tracks.stamp.receive_time_s);
      session_.add(tracks);
    }
  }
  // Seconds of frames until the next is due.
  template <class Due>
  double wait(const Due& due) {
    double waited_s = 0;
    while (!due() && waited_s < 1000) {
      add_frames(0.1);
      waited_s += 0.1;
    }
    return waited_s;
  }
  double wait_for_first() {
    const double waited_s = wait([this] { return pace_.first_is_due(session_); });
    pace_.note_try(session_);
    pace_.note_first();
    return waited_s;
  }
  double wait_for_watch(bool soon = false) {
    const double waited_s = wait([&] { return pace_.watch_is_due(session_, soon); });
    pace_.note_try(session_);
    return waited_s;
  }

  CalibrationSession session_{SessionLimits{}};
  TryPace pace_{CalibrationSchedule{}};
  std::int64_t frame_ = 0;
};

TEST_F(TryPaceTest, TriesWithSixSecondsAndThenMoreAndMoreRarely) {
  EXPECT_NEAR(wait_for_first(), 6.1, 0.15);
  for (int i = 1; i < 20; ++i) EXPECT_NEAR(wait_for_first(), 1.5, 0.15) << i;
  EXPECT_NEAR(wait_for_first(), 5, 0.15);
  session_.clear();
  pace_.begin_anew();
  EXPECT_FALSE(pace_.has_tried());
  EXPECT_NEAR(wait_for_first(), 6.1, 0.15);
}

TEST_F(TryPaceTest, WatchesLessOftenWhatAgrees) {
  EXPECT_NEAR(wait_for_watch(), 12.1, 0.15);
  pace_.watch_later();
  EXPECT_NEAR(wait_for_watch(), 24, 0.15);
  pace_.watch_later();
  EXPECT_NEAR(wait_for_watch(true), 12, 0.15) << "its clock offset is not known";
  EXPECT_NEAR(wait_for_watch(), 48, 0.15);
  pace_.watch_soon();
  EXPECT_NEAR(wait_for_watch(), 12, 0.15);
  for (int i = 0; i < 20; ++i) pace_.watch_later();
  EXPECT_NEAR(wait_for_watch(), 600, 0.15);
}

TEST_F(TryPaceTest, MakesANodeAsSoonAsADwellIsLongEnough) {
  pace_.watch_after(1.5);
  EXPECT_NEAR(wait([this] { return pace_.node_is_due(session_); }), 6.1, 0.15);
  pace_.note_try(session_);
  EXPECT_NEAR(wait([this] { return pace_.node_is_due(session_); }), 1.5, 0.15);
}

}  // namespace
}  // namespace alidade
