// What the real-time thread runs: it allocates nothing, counts what a full queue loses, and ends after the
// last message.

#include "edge_app/pipeline/realtime_stage.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

#include "platform/system/clock.h"
#include "test/support/allocation_guard.h"

namespace alidade {
namespace {

VideoMessage frame_message(std::int64_t frame) {
  VideoMessage message;
  message.stamp.frame = frame;
  message.stamp.receive_time_s = monotonic_now_s();
  return message;
}

TelemetryMessage sample_message(double pan_rad) {
  TelemetryMessage message;
  message.sample.latest_time_s = monotonic_now_s();
  message.sample.earliest_time_s = message.sample.latest_time_s - 1e-3;
  message.sample.pan_rad = pan_rad;
  return message;
}

int count_records(RealtimeStage* stage) {
  OutputMessage message;
  int count = 0;
  while (stage->pop(message)) ++count;
  return count;
}

// The queues are large: on the heap, once.
std::unique_ptr<RealtimeStage> make_stage() {
  OrientationStepOptions options;
  options.calibration.camera.focal_length = 30000;
  return std::make_unique<RealtimeStage>(options, true);
}

TEST(RealtimeStage, CountsWhatFullQueuesLose) {
  const auto stage = make_stage();
  for (int i = 0; i < 300; ++i) stage->push(frame_message(i));
  for (int i = 0; i < 1100; ++i) stage->push(sample_message(0.001 * i));
  EXPECT_EQ(stage->drops().frames, 300 - 256);
  EXPECT_EQ(stage->drops().telemetry, 1100 - 1024);
  EXPECT_TRUE(stage->process());
  EXPECT_EQ(count_records(stage.get()), 256);
  // Nobody takes the records: at the fifth filling the queue of 1024 is full.
  for (int filling = 0; filling < 5; ++filling) {
    for (int i = 0; i < 256; ++i) stage->push(frame_message(i));
    EXPECT_TRUE(stage->process());
  }
  EXPECT_EQ(stage->drops().records, 5 * 256 - 1024);
}

TEST(RealtimeStage, EndsBehindTheLastMessage) {
  const auto stage = make_stage();
  stage->push(frame_message(0));
  stage->end_input();
  EXPECT_FALSE(stage->output_ended());
  EXPECT_FALSE(stage->process());
  EXPECT_TRUE(stage->output_ended());
  EXPECT_EQ(count_records(stage.get()), 1);
}

// Every kind of message, fed by two other threads as in the pipeline, while the guard watches this one. The
// feeders take turns, so that each frame has its telemetry however they are scheduled.
TEST(RealtimeStage, AllocatesNothing) {
  constexpr int kRounds = 1000;
  const auto stage = make_stage();
  std::atomic<int> frames{0};
  std::atomic<int> samples{0};
  std::thread capture([&] {
    for (int i = 0; i < kRounds; ++i) {
      while (samples <= i) std::this_thread::yield();
      VideoMessage message = frame_message(i);
      if (i % 3 == 0) message.stamp.sender_time_s = 0.04 * i;
      if (i % 3 == 1) message.stamp.sequence = i;
      message.stamp.restarted = i % 100 == 0;
      if (i % 50 == 49) message.kind = VideoMessage::Kind::kLost;
      stage->push(message);
      ++frames;
    }
    stage->end_input();
  });
  std::thread telemetry([&] {
    for (int i = 0; i < kRounds; ++i) {
      while (frames < i) std::this_thread::yield();
      TelemetryMessage message = sample_message(0.001 * (i % 1000));
      if (i % 1000 > 500) message.sample.sequence = i;
      message.sample.restarted = i % 700 == 0;
      if (i % 60 == 59) message.kind = TelemetryMessage::Kind::kLost;
      stage->push(message);
      ++samples;
    }
  });
  std::int64_t records = 0;
  std::int64_t with_orientation = 0;
  {
    const test::AllocationGuard guard;
    bool more = true;
    while (more) {
      stage->wait();
      more = stage->process();
      OutputMessage message;
      while (stage->pop(message)) {
        ++records;
        if (message.record.orientation) ++with_orientation;
      }
    }
    EXPECT_EQ(guard.count(), 0);
  }
  capture.join();
  telemetry.join();
  EXPECT_EQ(records, kRounds - stage->drops().frames - stage->drops().records);
  EXPECT_GT(with_orientation, 0);
}

}  // namespace
}  // namespace alidade
