#include "test/simulator/played_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/simulator/telemetry.h"
#include "test/support/temporary_directory.h"

namespace alidade::simulator {
namespace {

constexpr double kPlay = 2e-3;  // rad

Config with_play(PlayConfig::Encoder encoder) {
  Config config;
  config.camera.focal_length = 10000;
  config.path.period = 8;
  config.telemetry.play = {kPlay, 2 * kPlay, encoder};
  return config;
}

TEST(VirtualPlay, KeepsReadingAndCameraWithinHalfItsWidthAndReachesBothSides) {
  for (const auto encoder : {PlayConfig::Encoder::kMotor, PlayConfig::Encoder::kOutput}) {
    const auto path = make_path(with_play(encoder));
    double least = 0;
    double most = 0;
    for (int i = 0; i < 8000; ++i) {
      const double time = 1e-3 * i + 3e-4;
      const double lead = path->encoder_at(time).pan - path->at(time).pan;
      least = std::min(least, lead);
      most = std::max(most, lead);
      EXPECT_LE(std::abs(path->encoder_at(time).tilt - path->at(time).tilt), kPlay + 1e-12);
    }
    EXPECT_NEAR(least, -kPlay / 2, 1e-12);
    EXPECT_NEAR(most, kPlay / 2, 1e-12);
  }
}

// The loop of reading over driven angle: as high as the play is wide, whichever side is told.
TEST(VirtualPlay, LagsBehindTheDirectionOfMotion) {
  const auto motor = make_path(with_play(PlayConfig::Encoder::kMotor));
  const auto output = make_path(with_play(PlayConfig::Encoder::kOutput));
  // Pan rises through 0 at t = 0 and falls at t = 4 s.
  EXPECT_NEAR(motor->encoder_at(8).pan - motor->at(8).pan, kPlay / 2, 1e-12);
  EXPECT_NEAR(motor->encoder_at(4).pan - motor->at(4).pan, -kPlay / 2, 1e-12);
  EXPECT_NEAR(output->encoder_at(8).pan - output->at(8).pan, -kPlay / 2, 1e-12);
  EXPECT_NEAR(output->encoder_at(4).pan - output->at(4).pan, kPlay / 2, 1e-12);
}

TEST(VirtualPlay, StandsStillUntilTheWidthIsCrossedAndThenFollows) {
  const auto path = make_path(with_play(PlayConfig::Encoder::kMotor));
  // Pan turns about at t = 2 s.
  const double top = path->encoder_at(2).pan;
  const double held = path->at(2).pan;
  EXPECT_NEAR(held, top - kPlay / 2, 1e-9);
  int still = 0;
  for (double time = 2; path->encoder_at(time).pan > top - kPlay; time += 1e-3, ++still) {
    EXPECT_NEAR(path->at(time).pan, held, 1e-9);
  }
  EXPECT_GT(still, 20);
  EXPECT_NEAR(path->at(3).pan, path->encoder_at(3).pan + kPlay / 2, 1e-12);
}

TEST(VirtualPlay, IsTheSameInEveryRoundAndClosesItsLoop) {
  const auto path = make_path(with_play(PlayConfig::Encoder::kOutput));
  for (int i = 0; i < 100; ++i) {
    const double time = 0.0813 * i;
    EXPECT_NEAR(path->encoder_at(time).pan, path->encoder_at(time + 8).pan, 1e-9);
    EXPECT_NEAR(path->encoder_at(time).tilt, path->encoder_at(time - 16).tilt, 1e-9);
  }
}

TEST(VirtualPlay, BeginsInTheMiddleWhereAPathOfATableBegins) {
  const TemporaryDirectory directory;
  Config config = with_play(PlayConfig::Encoder::kMotor);
  config.path.type = PathConfig::Type::kCsv;
  config.path.file =
      directory.write("path.csv", "time_s,pan_rad,tilt_rad\n0,0,0\n1,0.1,0\n2,0,0\n");
  const auto path = make_path(config);
  EXPECT_EQ(path->at(-1).pan, 0);
  EXPECT_NEAR(path->at(0.5).pan, path->encoder_at(0.5).pan - kPlay / 2, 1e-12);
  EXPECT_NEAR(path->at(5).pan, path->encoder_at(5).pan + kPlay / 2, 1e-12);
  EXPECT_EQ(path->at(5).tilt, 0);
}

TEST(VirtualPlay, IsWhatTelemetrySees) {
  Config config = with_play(PlayConfig::Encoder::kOutput);
  config.telemetry.quantum = 1e-3;
  const auto path = make_path(config);
  Telemetry telemetry(config, *path);
  for (int i = 0; i < 100; ++i) {
    const double time = 0.0813 * i;
    const double seen = path->encoder_at(time).pan;
    EXPECT_NEAR(telemetry.measure(time).pan, std::round(seen / 1e-3) * 1e-3, 1e-12);
  }
}

}  // namespace
}  // namespace alidade::simulator
