// ONVIF with an ONVIF camera in this process (onvif_server.h), and with servers that misbehave.

#include "platform/pan_tilt/onvif_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "core/model/trigonometry.h"
#include "platform/pan_tilt/onvif_messages.h"
#include "platform/pan_tilt/onvif_time.h"
#include "platform/system/clock.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/raw_server.h"
#include "test/simulator/servers/onvif_server.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using Login = OnvifDevice::Login;

OnvifSourceOptions onvif_options(const std::string& url) {
  OnvifSourceOptions options;
  options.url = url;
  options.pan_range = {-kPi, kPi};
  options.tilt_range = {kPi / 2, -kPi / 2};  // sign turned
  options.rate_hz = 1000;
  options.timeout_s = kDeadline_s;
  options.max_backoff_s = 0.01;
  return options;
}

OnvifSourceOptions onvif_options(const OnvifServer& server, const OnvifDevice& device = {}) {
  OnvifSourceOptions options = onvif_options(server.url());
  if (device.login != Login::kNone) {
    options.user = device.user;
    options.password = device.password;
  }
  return options;
}

std::string url_of(const RawServer& server) {
  return "http://127.0.0.1:" + std::to_string(server.port());
}

OnvifDevice device_with(Login login) {
  OnvifDevice device;
  device.login = login;
  return device;
}

OnvifDevice device_at(const std::string& position) {
  OnvifDevice device;
  device.position = [position] { return position; };
  return device;
}

TEST(OnvifSource, MapsTheGenericSpaceByItsRanges) {
  const OnvifServer server;
  const auto source = open_onvif(onvif_options(server));
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_DOUBLE_EQ(sample.pan_rad, kPi / 2);
  EXPECT_DOUBLE_EQ(sample.tilt_rad, kPi / 8);
  EXPECT_EQ(sample.zoom, 0.125);
  EXPECT_FALSE(sample.device_time_s);
  EXPECT_TRUE(sample.restarted);
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_FALSE(sample.restarted);
  EXPECT_EQ(server.last_profile(), "turning&1");
  EXPECT_EQ(server.count("GetSystemDateAndTime"), 0);  // nothing to log in for
  EXPECT_EQ(server.count("GetCapabilities"), 1);
  EXPECT_EQ(server.count("GetProfiles"), 1);
  EXPECT_EQ(server.connections(), 1U);
}

TEST(OnvifSource, TakesDegreesAsTheyAre) {
  const OnvifServer server(
      device_at(R"(<tt:PanTilt x="-170.5" y="20" space="http://www.onvif.org/ver10/)"
                R"(tptz/PanTiltSpaces/SphericalPositionSpaceDegrees"/>)"));
  OnvifSourceOptions options = onvif_options(server);
  options.pan_range.reset();
  options.tilt_range.reset();
  options.profile = "mine";
  const auto source = open_onvif(options);
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_DOUBLE_EQ(sample.pan_rad, -170.5 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(sample.tilt_rad, 20 * kRadPerDeg);
  EXPECT_FALSE(sample.zoom);
  EXPECT_EQ(server.last_profile(), "mine");
  EXPECT_EQ(server.count("GetProfiles"), 0);
}

TEST(OnvifSource, TurnsSignAndZeroOfEachAxis) {
  OnvifDevice device;
  device.position = [] { return R"(<tt:PanTilt x="0.5" y="-0.25"/>)"; };
  const OnvifServer server(device);
  OnvifSourceOptions options = onvif_options(server);
  options.pan_range = OnvifRange{-180 * kRadPerDeg, 180 * kRadPerDeg};
  options.tilt_range = OnvifRange{-90 * kRadPerDeg, 90 * kRadPerDeg};
  options.pan = {1, -10};
  options.tilt = {-1, 0};
  const auto source = open_onvif(options);
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_NEAR(sample.pan_rad, 100 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(sample.tilt_rad, 22.5 * kRadPerDeg, 1e-12);
}

TEST(OnvifSource, SaysThatTheGenericSpaceNeedsRanges) {
  const OnvifServer server;
  OnvifSourceOptions options = onvif_options(server);
  options.pan_range.reset();
  const auto source = open_onvif(options);
  PanTiltSample sample;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(), HasSubstr("pan_range_deg"));
}

TEST(OnvifSource, FindsTheServicesWhateverTheDeviceCallsItself) {
  for (const char* host : {"192.168.1.64", "10.0.0.1:8080", ""}) {
    for (const char* prefix : {"tt:", "x:", ""}) {
      OnvifDevice device;
      device.announced_host = host;
      device.prefix = prefix;
      device.position = [] { return R"(<tt:PanTilt y="0" x="1"/>)"; };
      const OnvifServer server(device);
      const auto source = open_onvif(onvif_options(server.url() + "/onvif/device_service"));
      PanTiltSample sample;
      ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
      EXPECT_DOUBLE_EQ(sample.pan_rad, -kPi);
    }
  }
}

class OnvifSourceLogin : public ::testing::TestWithParam<Login> {};

TEST_P(OnvifSourceLogin, LogsInOnTheDevicesClockAndKeepsItsConnection) {
  const OnvifDevice device = device_with(GetParam());
  for (const double offset_s : {0.0, 86400.0 * 365, -1.5e9}) {
    OnvifServer server(device);
    server.clock_offset_s = offset_s;
    const auto source = open_onvif(onvif_options(server, device));
    PanTiltSample sample;
    for (int i = 0; i < 20; ++i) {
      ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    }
    EXPECT_EQ(server.refusals, GetParam() == Login::kToken ? 0 : 1);
    EXPECT_EQ(server.count("GetStatus"), 21);  // the first shows that ranges matter
    EXPECT_EQ(server.connections(), 1U);
  }
}

TEST_P(OnvifSourceLogin, LogsInWhereEvenTheClockNeedsIt) {
  OnvifDevice device = device_with(GetParam());
  device.clock_needs_login = true;
  const OnvifServer server(device);
  const auto source = open_onvif(onvif_options(server, device));
  PanTiltSample sample;
  EXPECT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
}

TEST_P(OnvifSourceLogin, OutlivesARestartOfTheDevice) {
  const OnvifDevice device = device_with(GetParam());
  auto server = std::make_unique<OnvifServer>(device);
  const int port = server->port();
  const auto source = open_onvif(onvif_options(*server, device));
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  server->renew_nonce();
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_FALSE(sample.restarted);
  server.reset();
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  }
  server = std::make_unique<OnvifServer>(device, port);
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(sample.restarted);
}

TEST_P(OnvifSourceLogin, FailsForGoodOnAWrongPasswordAndDoesNotShowIt) {
  const OnvifDevice device = device_with(GetParam());
  const OnvifServer server(device);
  OnvifSourceOptions options = onvif_options(server, device);
  options.password = "guess";
  const auto source = open_onvif(options);
  PanTiltSample sample;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(), AllOf(StartsWith(server.url() + "/: wrong user or password"),
                                     Not(HasSubstr("guess"))));
  EXPECT_EQ(source->read(sample, 0), ReadStatus::kFailed);
  EXPECT_EQ(server.count("GetStatus"), 0);

  const auto anonymous = open_onvif(onvif_options(server));
  EXPECT_EQ(read_until(*anonymous, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(anonymous->error(), HasSubstr("wants a user and a password"));
}

TEST_P(OnvifSourceLogin, TriesOnWhenADeviceThatHasWorkedRefuses) {
  const OnvifDevice device = device_with(GetParam());
  OnvifServer server(device);
  const auto source = open_onvif(onvif_options(server, device));
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  server.password_changed = true;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), HasSubstr("the login is refused"));
  }
  server.password_changed = false;
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(sample.restarted);
}

INSTANTIATE_TEST_SUITE_P(Methods, OnvifSourceLogin,
                         ::testing::Values(Login::kToken, Login::kDigestMd5, Login::kDigestSha256),
                         [](const auto& which) {
                           return std::string(which.param == Login::kToken       ? "Token"
                                              : which.param == Login::kDigestMd5 ? "DigestMd5"
                                                                                 : "DigestSha256");
                         });

TEST(OnvifSource, FollowsADeviceWhoseClockIsSet) {
  const OnvifDevice device = device_with(Login::kToken);
  OnvifServer server(device);
  const auto source = open_onvif(onvif_options(server, device));
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  server.clock_offset_s = 3600;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(sample.restarted);
}

// The server notes the moment at which it looks at its angle, and answers with that moment.
TEST(OnvifSource, GivesAnIntervalThatHoldsTheMomentOfTheMeasurement) {
  const double origin_s = monotonic_now_s();
  OnvifDevice device = device_with(Login::kDigestMd5);
  device.position = [origin_s] {
    return "<tt:PanTilt x=\"" + std::to_string((monotonic_now_s() - origin_s) / 100) +
           "\" y=\"0\"/>";
  };
  const OnvifServer server(device);
  const auto source = open_onvif(onvif_options(server, device));
  double last_s = 0;
  for (int i = 0; i < 100; ++i) {
    PanTiltSample sample;
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    const double measured_s = origin_s + 100 * sample.pan_rad / kPi;
    constexpr double kDigit_s = 1e-4;  // the answer's resolution
    EXPECT_LE(sample.earliest_time_s, measured_s + kDigit_s);
    EXPECT_GE(sample.latest_time_s, measured_s - kDigit_s);
    EXPECT_GE(sample.earliest_time_s, last_s);
    last_s = sample.latest_time_s;
  }
}

TEST(OnvifSource, GivesEachSampleTheDevicesTimeIfItChangesSensibly) {
  int answers = 0;
  OnvifDevice device;
  device.utc_time = [&answers] { return xml_time(1.8e9 + 0.005 * ++answers); };
  const OnvifServer server(device);
  const auto source = open_onvif(onvif_options(server));
  PanTiltSample sample;
  double last_s = 0;
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    EXPECT_EQ(sample.restarted, i == 0);
    ASSERT_TRUE(sample.device_time_s);
    EXPECT_GT(*sample.device_time_s, last_s);
    last_s = *sample.device_time_s;
  }
  EXPECT_DOUBLE_EQ(last_s, std::round(1e3 * (1.8e9 + 0.005 * answers)) * 1e-3);
}

TEST(OnvifSource, GivesNoDeviceTimeThatStands) {
  OnvifDevice device;
  device.utc_time = [] { return "2026-01-01T00:00:00Z"; };
  const OnvifServer server(device);
  const auto source = open_onvif(onvif_options(server));
  PanTiltSample sample;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    EXPECT_FALSE(sample.device_time_s);
  }
}

TEST(OnvifSource, ReportsFaultsAndHttpErrorsAndRecovers) {
  OnvifServer server;
  const auto source = open_onvif(onvif_options(server));
  PanTiltSample sample;
  server.set_fault("ter:NoProfile", "The profile token does not exist");
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("the device answers GetStatus with 'ter:NoProfile: The "
                                         "profile token does not exist'"));
  server.set_fault("", "");
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk);
  for (const int status : {404, 500, 503}) {
    server.status = status;
    EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(),
                HasSubstr("HTTP status " + std::to_string(status) + " for GetStatus"));
    server.status = 200;
    EXPECT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk);
    EXPECT_TRUE(sample.restarted);
  }
}

TEST(OnvifSource, FailsAtOnceOnAUrlItCannotUse) {
  PanTiltSample sample;
  for (const char* url : {"http://user:se@cret@camera", "camera", "ftp://camera", ""}) {
    const auto source = open_onvif(onvif_options(url));
    EXPECT_EQ(source->read(sample, 0), ReadStatus::kFailed) << url;
    EXPECT_THAT(source->error(), AllOf(HasSubstr("://"), Not(HasSubstr("cret"))));
  }
}

TEST(OnvifSource, SurvivesAnswersThatBreakOrMeanNothing) {
  int turn = 0;
  RawServer server([&](int fd) {
    const int kind = turn++ % 5;
    if (kind == 0) {
      RawServer::reset(fd);
    } else if (server.read_request(fd)) {
      if (kind == 1) {
        RawServer::send(fd, "HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n<s:Envelope");
        RawServer::reset(fd);
      } else if (kind == 2) {
        RawServer::send(fd, "HTTP/1.1 200 OK\r\nConnection: close\r\n\r\n<html>\n</html>");
      } else if (kind == 3) {
        RawServer::send(fd, "HTTP/1.1 200 OK\r\n\r\n" + std::string(300'000, '<'));
      }
    }
  });
  const auto source = open_onvif(onvif_options(url_of(server)));
  PanTiltSample sample;
  std::string errors;
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    errors += source->error() + "\n";
  }
  EXPECT_THAT(errors, HasSubstr("no answer to GetCapabilities in '<html>'"));
  EXPECT_THAT(errors, HasSubstr("longer than 262144 bytes: not an ONVIF answer"));
}

TEST(OnvifSource, GivesUpAnAnswerWhoseBodyIsTooSlow) {
  RawServer server([&server](int fd) {
    if (server.read_request(fd) &&
        RawServer::send(fd, "HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n")) {
      while (!server.closing() && RawServer::send(fd, " ")) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
  });
  OnvifSourceOptions options = onvif_options(url_of(server));
  options.timeout_s = 0.1;
  const auto source = open_onvif(options);
  PanTiltSample sample;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("timed out"));
}

TEST(OnvifSource, StopEndsARequestThatIsNotAnswered) {
  RawServer server([&server](int fd) { server.stay_silent(fd); });
  const auto source = open_onvif(onvif_options(url_of(server)));
  PanTiltSample sample;
  EXPECT_EQ(server.status_when_stopped(*source, sample), ReadStatus::kStopped);
}

}  // namespace
}  // namespace alidade
