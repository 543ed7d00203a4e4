// `alidade check` with heads on a line, as a person meets it: a configuration, a device, the answer.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "platform/system/clock.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/platform/support/head_kinds.h"
#include "test/simulator/servers/head_server.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

HeadPosition position() { return {-120, 30, 0}; }

// Of a head at this address; there is no video.
Result check(const std::string& pan_tilt, const std::string& duration_s = "0.5") {
  const TemporaryDirectory directory;
  return alidade({"check", "--duration", duration_s, "-c",
                  directory.write("alidade.yaml",
                                  "video: {type: rtp, url: none.sdp}\n"
                                  "pan_tilt: {" +
                                      pan_tilt + "}\ncamera: {focal_length_px: 1000}\n")});
}

class CheckedHead : public ::testing::TestWithParam<HeadKind> {};

INSTANTIATE_TEST_SUITE_P(Heads, CheckedHead, ::testing::ValuesIn(last_kinds_in_turn()),
                         [](const auto& tested) { return tested.param.name(); });

// With nothing but the keys that its configuration requires.
TEST_P(CheckedHead, IsFoundWhereItIs) {
  const HeadServer server(GetParam().link, simulated_head(GetParam(), position));
  const Result result = check(settings_of(GetParam(), server.address()) + signs_of(GetParam()));
  const std::string headline = server.address() + ": pan ";
  const std::size_t begin = result.output.find(headline);
  ASSERT_NE(begin, std::string::npos) << result.output << result.errors;
  double pan_deg = 0;
  double tilt_deg = 0;
  ASSERT_EQ(std::sscanf(result.output.c_str() + begin + headline.size(), "%lf deg, tilt %lf deg, ",
                        &pan_deg, &tilt_deg),
            2);
  const double rounding_deg = GetParam().head->step_deg / 2 + 1e-4;
  EXPECT_NEAR(pan_deg, position().pan_deg, rounding_deg);
  EXPECT_NEAR(tilt_deg, position().tilt_deg, rounding_deg);
}

TEST(HeadCommand, MeasuresAHeadThatTurns) {
  // Swings by 3 and 2 degrees, a quarter of them a second; the steps are its protocol's.
  const auto swing = [] {
    const double t = monotonic_now_s();
    return HeadPosition{3 * std::sin(0.5 * t), 2 * std::sin(0.4 * t), 0};
  };
  const HeadServer server(HeadServer::Link::kUdp, std::make_unique<ViscaHead>(swing));
  const Result result = check(
      "type: visca, angle_sigma_rad: 5.0e-5, header: false, pan_positive: right, tilt_positive: "
      "up, "
      "pan_deg_per_step: 0.01953125, tilt_deg_per_step: 0.01953125, url: '" +
          server.address() + "'",
      "4");
  EXPECT_THAT(result.output, HasSubstr("quantum      pan 0.01953 deg, tilt 0.01953 deg"));
  EXPECT_THAT(result.output, HasSubstr("advice         pan/tilt " + server.address() +
                                       ": angles come in steps of 0.0195 deg"));
  EXPECT_THAT(result.output, HasSubstr("angle_quantum_rad: 0.000341"));
}

TEST(HeadCommand, SaysWhatASilentHeadNeeds) {
  HeadServer server(HeadServer::Link::kSerial, std::make_unique<PelcoDHead>(position));
  server.fault = LineFault::kSilence;
  const Result result = check("type: pelco_d, device: " + server.address());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("alidade: " + server.address() +
                                       ": no answer of Pelco-D; check power, wiring, address and "
                                       "baud or port\n"));
}

}  // namespace
}  // namespace alidade
