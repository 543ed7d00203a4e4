// `alidade check` with heads on a line, as a person meets it: a configuration, a device, the answer.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "platform/system/clock.h"
#include "test/edge_app/alidade_command.h"
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

TEST(HeadCommand, ChecksAPelcoDHead) {
  const HeadServer server(HeadServer::Link::kSerial, std::make_unique<PelcoDHead>(position));
  const Result result = check("type: pelco_d, device: " + server.address());
  EXPECT_THAT(result.output,
              HasSubstr(server.address() + ": pan -120.0000 deg, tilt 30.0000 deg, "));
}

TEST(HeadCommand, ChecksAViscaHead) {
  const HeadServer server(HeadServer::Link::kUdp, std::make_unique<ViscaHead>(position));
  const Result result = check(
      "type: visca, header: false, pan_positive: right, tilt_positive: up, "
      "pan_deg_per_step: 0.01953125, tilt_deg_per_step: 0.01953125, url: '" +
      server.address() + "'");
  EXPECT_THAT(result.output,
              HasSubstr(server.address() + ": pan -120.0000 deg, tilt 30.0000 deg, "));
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

TEST(HeadCommand, ChecksAPtu) {
  const HeadServer server(HeadServer::Link::kTcp, std::make_unique<PtuHead>(position));
  const Result result =
      check("type: ptu, pan_positive: left, tilt_positive: up, url: '" + server.address() + "'");
  // 2333 steps of 185.1428 and 1167 of 92.5714 seconds of arc.
  EXPECT_THAT(result.output,
              HasSubstr(server.address() + ": pan -119.9828 deg, tilt 30.0086 deg, "));
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
