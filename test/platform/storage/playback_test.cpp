#include "platform/storage/playback.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <utility>

#include "test/platform/support/eventually.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

TEST(Playback, LetsEverythingOutAtOnceAtFullSpeed) {
  Playback playback("", false);
  EXPECT_EQ(playback.wait_until_due(0, 0), ReadStatus::kOk);
  EXPECT_EQ(playback.wait_until_due(kNever_s, 0), ReadStatus::kOk);
}

TEST(Playback, HoldsAnItemBackUntilItIsDue) {
  const TemporaryDirectory directory;
  directory.write("frames.csv", "frame,receive_time_s\n0,100\n1,1000100\n");
  Playback playback(directory.path(), true);
  EXPECT_EQ(playback.wait_until_due(100, 0), ReadStatus::kOk);
  EXPECT_EQ(playback.wait_until_due(100.05, kNever_s), ReadStatus::kOk);
  EXPECT_EQ(playback.wait_until_due(100 + kNever_s, 0.01), ReadStatus::kTimeout);
}

TEST(Playback, CountsFromTheFirstStampOfFramesAndTelemetry) {
  for (const auto& [frame, sample] : {std::pair("1000100", "100"), std::pair("100", "1000100")}) {
    const TemporaryDirectory directory;
    directory.write("frames.csv", std::string("frame,receive_time_s\n0,") + frame + "\n");
    directory.write("telemetry.csv",
                    std::string("receive_time_s,pan_rad,tilt_rad\n") + sample + ",0,0\n");
    Playback playback(directory.path(), true);
    EXPECT_EQ(playback.wait_until_due(100 + kNever_s, 0), ReadStatus::kTimeout);
    EXPECT_EQ(playback.wait_until_due(100, 0), ReadStatus::kOk);
  }
}

TEST(Playback, EndsAWaitWhenItIsStopped) {
  const TemporaryDirectory directory;
  directory.write("frames.csv", "frame,receive_time_s\n0,100\n");
  Playback playback(directory.path(), true);
  std::thread stopper([&playback] { playback.stop(); });
  EXPECT_EQ(playback.wait_until_due(100 + kNever_s, kNever_s), ReadStatus::kStopped);
  stopper.join();
  EXPECT_TRUE(playback.stopped());
}

}  // namespace
}  // namespace alidade
