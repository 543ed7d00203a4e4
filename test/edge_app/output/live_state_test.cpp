#include "edge_app/output/live_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "edge_app/output/record_sinks.h"
#include "edge_app/record/record_format.h"

namespace alidade {
namespace {

using ::testing::ElementsAre;

OrientationRecord record(std::int64_t frame, double period_s = 0.04) {
  OrientationRecord out;
  out.frame = frame;
  out.time_s = 100 + static_cast<double>(frame) * period_s;
  out.receive_time_s = *out.time_s + 0.01;
  out.mode = RecordMode::kPt;
  out.orientation = OrientationRecord::Orientation{};
  out.orientation->pan_rad = static_cast<double>(frame);
  out.latency_s = 1e-3;
  return out;
}

OrientationRecord lost(double time_s) {
  OrientationRecord out;
  out.receive_time_s = time_s;
  out.status = RecordStatus::kVideoLost;
  return out;
}

void write(LiveState* state, std::int64_t from, std::int64_t to) {
  for (std::int64_t frame = from; frame <= to; ++frame) EXPECT_TRUE(state->write(record(frame)));
}

std::vector<std::int64_t> ids(const LiveState::News& news) {
  std::vector<std::int64_t> out;
  for (const auto& line : news.lines) out.push_back(line.id);
  return out;
}

TEST(LiveState, KnowsTheNewestRecordAndTheNewestWithAnOrientation) {
  LiveState state;
  EXPECT_FALSE(state.newest());
  EXPECT_FALSE(state.newest_oriented());
  EXPECT_FALSE(state.calibration_since_s());
  write(&state, 1, 3);
  EXPECT_TRUE(state.write(lost(101)));
  EXPECT_FALSE(state.newest()->frame);
  EXPECT_EQ(state.newest_oriented()->frame, 3);
}

TEST(LiveState, FindsTheFramesOfTheLastSeconds) {
  LiveState state;
  OrientationRecord found;
  EXPECT_EQ(state.find(1, &found), FrameSearch::kNoneYet);
  write(&state, 0, 500);  // 20 s
  EXPECT_EQ(state.find(500, &found), FrameSearch::kFound);
  EXPECT_EQ(found.orientation->pan_rad, 500);
  EXPECT_EQ(state.find(251, &found), FrameSearch::kFound);
  EXPECT_EQ(state.find(249, &found), FrameSearch::kNotKept);
  EXPECT_EQ(state.find(501, &found), FrameSearch::kNotKept);
  EXPECT_EQ(state.find(-1, &found), FrameSearch::kNotKept);
}

TEST(LiveState, KeepsNoMoreFramesThanItMay) {
  LiveStateOptions options;
  options.max_kept = 5;
  LiveState state(options);
  write(&state, 0, 50);
  OrientationRecord found;
  EXPECT_EQ(state.find(45, &found), FrameSearch::kNotKept);
  EXPECT_EQ(state.find(46, &found), FrameSearch::kFound);
}

TEST(LiveState, HoldsAFrameForAsLongAsNobodyHoldsManyOthers) {
  LiveState state;
  write(&state, 0, 3);
  OrientationRecord held;
  ASSERT_EQ(state.find(2, &held), FrameSearch::kFound);
  state.hold(held);
  write(&state, 4, 500);  // 20 s
  OrientationRecord found;
  EXPECT_EQ(state.find(1, &found), FrameSearch::kNotKept);
  ASSERT_EQ(state.find(2, &found), FrameSearch::kFound);
  EXPECT_EQ(found.orientation->pan_rad, 2);
  EXPECT_EQ(state.find_at(*held.time_s, &found), FrameSearch::kNotKept);
  // Held again it is the newest of those that are held, once.
  const auto hold_others = [&](std::int64_t from, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) state.hold(record(from + static_cast<std::int64_t>(i)));
  };
  hold_others(100, LiveState::kMaxHeld - 1);
  state.hold(held);
  hold_others(200, LiveState::kMaxHeld - 1);
  EXPECT_EQ(state.find(2, &found), FrameSearch::kFound);
  hold_others(300, 1);
  EXPECT_EQ(state.find(2, &found), FrameSearch::kNotKept);
  EXPECT_EQ(state.find(200, &found), FrameSearch::kFound);
}

TEST(LiveState, FindsTheFrameNearestToATimeWithinHalfAPeriod) {
  LiveState state;
  OrientationRecord found;
  EXPECT_EQ(state.find_at(100, &found), FrameSearch::kNoneYet);
  write(&state, 0, 3);
  write(&state, 10, 13);  // six frames are missing
  const auto frame_at = [&](double frame) {
    return state.find_at(100 + 0.04 * frame, &found) == FrameSearch::kFound ? *found.frame : -1;
  };
  EXPECT_EQ(frame_at(2), 2);
  EXPECT_EQ(frame_at(2.49), 2);
  EXPECT_EQ(frame_at(2.51), 3);
  EXPECT_EQ(frame_at(3.49), 3);
  EXPECT_EQ(frame_at(3.6), -1);
  EXPECT_EQ(frame_at(9.4), -1);
  EXPECT_EQ(frame_at(9.6), 10);
  EXPECT_EQ(frame_at(-0.4), 0);
  EXPECT_EQ(frame_at(-0.6), -1);
  EXPECT_EQ(frame_at(13.4), 13);
  EXPECT_EQ(frame_at(13.6), -1);
  EXPECT_EQ(frame_at(1e300), -1);
  EXPECT_EQ(frame_at(-1e300), -1);
}

// The time of whoever asks comes by way of another clock.
TEST(LiveState, ALoneFrameAndOneCloseToAnotherAreFoundWithinAMillisecond) {
  LiveState state;
  write(&state, 1, 1);
  OrientationRecord found;
  for (const double near_s : {-0.9e-3, 0.0, 1e-5, 0.9e-3}) {
    EXPECT_EQ(state.find_at(100.04 + near_s, &found), FrameSearch::kFound) << near_s;
  }
  EXPECT_EQ(state.find_at(100.04 - 1.1e-3, &found), FrameSearch::kNotKept);
  EXPECT_EQ(state.find_at(100.05, &found), FrameSearch::kNotKept);
  OrientationRecord next = record(2);
  next.time_s = 100.04 + 2e-5;
  EXPECT_TRUE(state.write(next));
  ASSERT_EQ(state.find_at(100.04 + 5e-5, &found), FrameSearch::kFound);
  EXPECT_EQ(found.frame, 2);
  ASSERT_EQ(state.find_at(100.04 - 5e-5, &found), FrameSearch::kFound);
  EXPECT_EQ(found.frame, 1);
}

TEST(LiveState, ForgetsFramesWhenTheirClockGoesBack) {
  LiveState state;
  write(&state, 50, 60);
  state.hold(record(55));
  OrientationRecord back = record(61);
  back.time_s = 1;
  EXPECT_TRUE(state.write(back));
  OrientationRecord found;
  EXPECT_EQ(state.find(60, &found), FrameSearch::kNotKept);
  EXPECT_EQ(state.find(55, &found), FrameSearch::kNotKept);
  EXPECT_EQ(state.find_at(1, &found), FrameSearch::kFound);
  EXPECT_EQ(found.frame, 61);
}

TEST(LiveState, ThinsTheHistoryOutAndKeepsTheLongestLatency) {
  LiveState state;
  for (std::int64_t frame = 0; frame < 2500; ++frame) {  // 100 s
    OrientationRecord one = record(frame);
    if (frame == 2404) one.latency_s = 0.5;  // one step begins with frame 2403
    if (frame < 2400) one.residual_px = 0.0625;
    EXPECT_TRUE(state.write(one));
  }
  const std::vector<HistorySample> history = state.history();
  // Every third frame, of the last minute.
  ASSERT_EQ(history.size(), 501u);
  EXPECT_NEAR(history.back().time_s - history.front().time_s, 60, 0.12);
  for (std::size_t i = 1; i < history.size(); ++i)
    EXPECT_NEAR(history[i].time_s - history[i - 1].time_s, 0.12, 1e-9);
  double longest_s = 0;
  for (const HistorySample& sample : history) longest_s = std::max(longest_s, *sample.latency_s);
  EXPECT_EQ(longest_s, 0.5);
  EXPECT_EQ(history.front().residual_px, 0.0625);
  EXPECT_FALSE(history.back().residual_px);
  EXPECT_TRUE(state.write(lost(250)));
  EXPECT_FALSE(state.history().back().pan_rad);
  EXPECT_EQ(state.history().back().mode, RecordMode::kNone);
}

TEST(LiveState, TheHistoriesOfMinuteAndHourAreOfTheSameRecords) {
  LiveState state;
  for (std::int64_t frame = 0; frame < 7500; ++frame)  // 5 min
    EXPECT_TRUE(state.write(record(frame)));
  EXPECT_EQ(state.history().size(), 501u);
  const std::vector<HistorySample> hour = state.hour();
  ASSERT_EQ(hour.size(), 30u);
  for (std::size_t i = 0; i < hour.size(); ++i) {
    EXPECT_NEAR(hour[i].time_s, 100 + 10 * static_cast<double>(i), 1e-9);
    EXPECT_EQ(*hour[i].pan_rad, 250 * static_cast<double>(i));
  }
}

TEST(RecordHistory, ARowHasTheWorstOfItsRecordsAndTheMeanSquareOfTelemetrysErrors) {
  RecordHistory history(60, 10);
  constexpr auto kOffset = static_cast<std::size_t>(Parameter::kClockOffset);
  OrientationRecord one = record(0);
  one.orientation->sigma_rad = {1e-6, 3e-6, 2e-6};
  history.add(one);
  one = record(1);
  one.mode = RecordMode::kOe;
  one.orientation->sigma_rad = {1e-6, 1e-6, 2e-6};
  one.telemetry_error = PanTilt<double>{3e-4, -1e-4};
  one.calibrated = true;
  one.camera.clock_offset = -0.08;
  one.camera.covariance[kOffset * kParameterCount + kOffset] = 4e-6;
  history.add(one);
  one.telemetry_error = PanTilt<double>{-4e-4, -1e-4};
  one.camera.clock_offset = -0.09;
  one.time_s = *one.time_s + 1;
  history.add(one);
  // The second row has no orientation and no calibration.
  history.add(lost(*one.time_s + 20));
  const std::vector<HistorySample> rows = history.samples();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].mode, RecordMode::kPt);
  EXPECT_EQ(rows[0].sigma_rad, 3e-6);
  ASSERT_TRUE(rows[0].telemetry_error);
  EXPECT_NEAR(rows[0].telemetry_error->pan, std::sqrt(12.5) * 1e-4, 1e-12);
  EXPECT_NEAR(rows[0].telemetry_error->tilt, 1e-4, 1e-12);
  EXPECT_EQ(rows[0].clock_offset_s, -0.09);
  EXPECT_EQ(rows[0].clock_offset_sigma_s, 2e-3);
  EXPECT_FALSE(rows[1].sigma_rad);
  EXPECT_FALSE(rows[1].telemetry_error);
  EXPECT_FALSE(rows[1].clock_offset_s);
  EXPECT_FALSE(rows[1].clock_offset_sigma_s);
}

TEST(RecordHistory, ForgetsWhatIsTooOldAndAllIfTimeGoesBack) {
  RecordHistory history(60, 10);
  for (int second = 0; second <= 200; ++second) history.add(lost(second));
  const std::vector<HistorySample> rows = history.samples();
  ASSERT_EQ(rows.size(), 7u);
  EXPECT_EQ(rows.front().time_s, 140);
  EXPECT_EQ(rows.back().time_s, 200);
  history.add(lost(199));
  ASSERT_EQ(history.samples().size(), 1u);
  EXPECT_EQ(history.samples().front().time_s, 199);
}

TEST(LiveState, SaysSinceWhenTheCalibrationIsInUse) {
  LiveState state;
  write(&state, 1, 1);
  const double since_s = *state.calibration_since_s();
  write(&state, 2, 2);
  EXPECT_EQ(*state.calibration_since_s(), since_s);
  OrientationRecord other = record(3);
  other.camera.line_delay = 1e-5;
  EXPECT_TRUE(state.write(other));
  EXPECT_GT(*state.calibration_since_s(), since_s);
}

TEST(LiveState, AReaderGetsEveryRecordAfterItCameOnceAndInOrder) {
  LiveState state;
  write(&state, 1, 5);
  LiveState::Reader reader(&state);
  write(&state, 6, 7);
  LiveState::News news = reader.take();
  EXPECT_THAT(ids(news), ElementsAre(6, 7));
  EXPECT_EQ(*news.lines[0].json + "\n", json_line(record(6)));
  EXPECT_EQ(news.lost, 0);
  EXPECT_TRUE(reader.take().lines.empty());
  write(&state, 8, 8);
  EXPECT_THAT(ids(reader.take()), ElementsAre(8));
}

TEST(LiveState, ASlowReaderLosesTheOldestAndIsToldHowMany) {
  LiveStateOptions options;
  options.max_lines = 4;
  LiveState state(options);
  LiveState::Reader slow(&state);
  LiveState::Reader quick(&state);
  for (std::int64_t frame = 1; frame <= 10; ++frame) {
    write(&state, frame, frame);
    EXPECT_THAT(ids(quick.take()), ElementsAre(frame));
  }
  EXPECT_EQ(state.lost_by_readers(), 6);
  const LiveState::News news = slow.take();
  EXPECT_EQ(news.lost, 6);
  EXPECT_THAT(ids(news), ElementsAre(7, 8, 9, 10));
  EXPECT_EQ(slow.take().lost, 0);
  ASSERT_EQ(state.readers().size(), 2u);
  EXPECT_EQ(state.readers()[0].lost, 6);
  EXPECT_EQ(state.readers()[0].records, 4);
  EXPECT_EQ(state.readers()[1].lost, 0);
  EXPECT_EQ(state.readers()[1].records, 10);
  EXPECT_EQ(state.lost_by_readers(), 6);
}

TEST(LiveState, LossesOfReadersThatLeftStillCount) {
  LiveStateOptions options;
  options.max_lines = 1;
  LiveState state(options);
  {
    LiveState::Reader reader(&state);
    write(&state, 1, 3);
    EXPECT_EQ(reader.take().lost, 2);
  }
  EXPECT_TRUE(state.readers().empty());
  EXPECT_EQ(state.lost_by_readers(), 2);
}

TEST(LiveState, AReaderTakesMuchThatWaitsInSeveralBatches) {
  LiveState state;
  LiveState::Reader reader(&state);
  write(&state, 1, 40);
  EXPECT_EQ(reader.take().lines.size(), LiveState::kBatch);
  EXPECT_EQ(reader.take().lines.size(), LiveState::kBatch);
  const LiveState::News rest = reader.take();
  EXPECT_EQ(rest.lines.size(), 40 - 2 * LiveState::kBatch);
  EXPECT_EQ(rest.lines.back().id, 40);
}

TEST(LiveState, ReadersOnOtherThreadsMissNothingThatTheyAreNotToldOf) {
  constexpr std::int64_t kRecords = 2000;
  LiveStateOptions options;
  options.max_lines = 8;
  LiveState state(options);
  std::vector<std::thread> threads;
  std::array<std::int64_t, 4> received{};
  std::array<std::int64_t, 4> missed{};
  std::atomic<int> ready{0};
  for (std::size_t i = 0; i < received.size(); ++i) {
    threads.emplace_back([&, i] {
      LiveState::Reader reader(&state);
      ++ready;
      std::int64_t last = 0;
      while (last < kRecords) {
        const LiveState::News news = reader.take();
        last += news.lost;
        missed[i] += news.lost;
        for (const auto& line : news.lines) EXPECT_EQ(line.id, ++last);
        received[i] += static_cast<std::int64_t>(news.lines.size());
      }
    });
  }
  while (ready < 4) std::this_thread::yield();
  write(&state, 1, kRecords);
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < received.size(); ++i) EXPECT_EQ(received[i] + missed[i], kRecords);
}

TEST(LiveState, TellsOfNewsOnceARecordIsThereForAReader) {
  LiveState state;
  int told = 0;
  std::size_t taken = 0;
  LiveState::Reader* following = nullptr;
  int told_another = 0;
  state.add_on_news([&] {
    ++told;
    taken += following->take().lines.size();
  });
  state.add_on_news([&] { ++told_another; });
  write(&state, 1, 3);
  EXPECT_EQ(told, 0) << "nobody follows";
  LiveState::Reader reader(&state);
  following = &reader;
  write(&state, 4, 8);
  EXPECT_EQ(told, 5);
  EXPECT_EQ(told_another, 5) << "each who asked to be told";
  EXPECT_EQ(taken, 5U);
}

class Counting final : public RecordSink {
 public:
  explicit Counting(int most) : most_(most) {}
  bool write(const OrientationRecord&) override { return ++count_ <= most_; }
  void interrupt() override { ++interrupted_; }
  std::string error() const override { return "full"; }
  int count_ = 0;
  int interrupted_ = 0;

 private:
  int most_;
};

TEST(RecordSinks, EndWithTheFirstThatEnds) {
  Counting first(100);
  Counting second(1);
  RecordSinks sinks;
  sinks.add(&first);
  sinks.add(&second);
  EXPECT_TRUE(sinks.write(record(1)));
  EXPECT_EQ(sinks.error(), "");
  EXPECT_FALSE(sinks.write(record(2)));
  EXPECT_EQ(sinks.error(), "full");
  EXPECT_EQ(first.count_, 2);
  sinks.interrupt();
  EXPECT_EQ(first.interrupted_, 1);
  EXPECT_EQ(second.interrupted_, 1);
}

}  // namespace
}  // namespace alidade
