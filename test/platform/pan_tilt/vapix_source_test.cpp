#include "platform/pan_tilt/vapix_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "platform/system/clock.h"
#include "test/platform/support/axis_server.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/raw_server.h"
#include "test/simulator/servers/digest_check.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

VapixSourceOptions vapix_options(const std::string& url) {
  VapixSourceOptions options;
  options.url = url;
  options.rate_hz = 1000;
  options.timeout_s = kDeadline_s;
  options.max_backoff_s = 0.01;
  return options;
}

std::string position(double pan_deg) {
  return "pan=" + std::to_string(pan_deg) + "\r\ntilt=-1.5\r\nzoom=900\r\n";
}

std::string url_of(const RawServer& server) {
  return "http://127.0.0.1:" + std::to_string(server.port());
}

TEST(VapixSource, DeliversPositionsInRadians) {
  AxisServer server("", "", [] { return position(12.5); });
  const auto source = open_vapix(vapix_options(server.url()));
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_DOUBLE_EQ(sample.pan_rad, 12.5 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(sample.tilt_rad, -1.5 * kRadPerDeg);
  EXPECT_EQ(sample.zoom, 900);
  EXPECT_TRUE(sample.restarted);
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_FALSE(sample.restarted);
  EXPECT_EQ(server.last_query(), "/axis-cgi/com/ptz.cgi?query=position");
}

TEST(VapixSource, NamesTheVideoChannelIfThereAreSeveral) {
  AxisServer server("", "", [] { return position(0); });
  VapixSourceOptions options = vapix_options(server.url() + "/");
  options.camera = 2;
  const auto source = open_vapix(options);
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_EQ(server.last_query(), "/axis-cgi/com/ptz.cgi?query=position&camera=2");
}

TEST(VapixSource, TurnsSignAndZeroOfEachAxis) {
  AxisServer server("", "", [] { return "pan=-170.5\ntilt=20\n"; });
  VapixSourceOptions options = vapix_options(server.url());
  options.pan = {-1, 20};
  options.tilt = {1, 5};
  const auto source = open_vapix(options);
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_NEAR(sample.pan_rad, (190.5 - 360) * kRadPerDeg, 1e-12) << "beyond half a turn";
  EXPECT_NEAR(sample.tilt_rad, 15 * kRadPerDeg, 1e-12);
}

// The server notes the moment at which it looks at its angle, and answers with that moment.
TEST(VapixSource, GivesAnIntervalThatHoldsTheMomentOfTheMeasurement) {
  double origin_s = monotonic_now_s();
  AxisServer server("user", "secret",
                    [origin_s] { return position(monotonic_now_s() - origin_s); });
  VapixSourceOptions options = vapix_options(server.url());
  options.user = "user";
  options.password = "secret";
  const auto source = open_vapix(options);
  double last_s = 0;
  for (int i = 0; i < 200; ++i) {
    PanTiltSample sample;
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    const double measured_s = origin_s + sample.pan_rad / kRadPerDeg;
    constexpr double kDigit_s = 1e-6;  // the answer's resolution
    EXPECT_LE(sample.earliest_time_s, measured_s + kDigit_s);
    EXPECT_GE(sample.latest_time_s, measured_s - kDigit_s);
    EXPECT_GE(sample.earliest_time_s, last_s);
    last_s = sample.latest_time_s;
  }
}

TEST(VapixSource, LogsInOnceAndKeepsItsConnection) {
  AxisServer server("us er", "p@ss:w\"ord/%", [] { return position(1); });
  VapixSourceOptions options = vapix_options(server.url());
  options.user = "us er";
  options.password = "p@ss:w\"ord/%";
  const auto source = open_vapix(options);
  PanTiltSample sample;
  for (int i = 0; i < 50; ++i) {
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  }
  EXPECT_EQ(server.refusals, 1);
  EXPECT_EQ(server.polls, 50);
  EXPECT_EQ(server.connections(), 1U);
}

TEST(VapixSource, LogsInAgainWhenTheCameraHasForgottenItsNonces) {
  AxisServer server("user", "secret", [] { return position(1); });
  VapixSourceOptions options = vapix_options(server.url());
  options.user = "user";
  options.password = "secret";
  const auto source = open_vapix(options);
  PanTiltSample sample;
  for (int life = 0; life < 3; ++life) {
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
      EXPECT_EQ(sample.restarted, life == 0 && i == 0);
    }
    server.renew_nonce();
  }
  EXPECT_EQ(server.refusals,
            5);  // one at first; then the old nonce's, and one that gives a new one
}

TEST(VapixSource, TriesOnWhenACameraThatHasWorkedRefuses) {
  AxisServer server("user", "secret", [] { return position(1); });
  VapixSourceOptions options = vapix_options(server.url());
  options.user = "user";
  options.password = "secret";
  const auto source = open_vapix(options);
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  server.refuse = true;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_EQ(source->error(),
              server.url() + "/: wrong user or password (401); it was right before");
  }
  server.refuse = false;
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(sample.restarted);
}

TEST(VapixSource, TakesUserAndPasswordOutOfTheUrl) {
  AxisServer server("user", "sec@ret", [] { return position(1); });
  const auto source =
      open_vapix(vapix_options("http://user:sec%40ret@127.0.0.1:" + std::to_string(server.port())));
  PanTiltSample sample;
  EXPECT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_EQ(source->name(), server.url() + "/");
}

TEST(VapixSource, FailsForGoodOnAWrongPasswordAndDoesNotShowIt) {
  AxisServer server("user", "secret", [] { return position(1); });
  VapixSourceOptions options = vapix_options(server.url());
  options.user = "user";
  options.password = "guess";
  const auto source = open_vapix(options);
  PanTiltSample sample;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_EQ(source->error(), server.url() + "/: wrong user or password (401)");
  EXPECT_EQ(source->read(sample, 0), ReadStatus::kFailed);
  EXPECT_EQ(server.polls, 0);

  const auto anonymous = open_vapix(vapix_options(server.url()));
  EXPECT_EQ(read_until(*anonymous, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(anonymous->error(), HasSubstr("the camera wants a user and a password (401)"));
}

// Answers as told, without a login only where none is wanted; and counts the logins that it saw.
class SayingServer {
 public:
  explicit SayingServer(std::string challenge = "") : challenge_(std::move(challenge)) {}
  [[nodiscard]] std::string url() const { return url_of(server_); }
  std::atomic<int> logins{0};
  std::atomic<int> requests{0};
  std::string location;  // set before anybody asks; of every answer but /there

 private:
  void serve(int fd) {
    std::string request;
    while (server_.read_request(fd, &request)) {
      ++requests;
      const bool logs_in = !header_of(request, "Authorization").empty();
      logins += logs_in ? 1 : 0;
      const std::string body = "pan=10.0\r\ntilt=5.0\r\nzoom=1\r\n";
      RawServer::send(
          fd, !challenge_.empty() && !logs_in ? "HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: " +
                                                    challenge_ + "\r\nContent-Length: 0\r\n\r\n"
              : !location.empty() && request.find("/there") == std::string::npos
                  ? "HTTP/1.1 302 Found\r\nLocation: " + location + "\r\nContent-Length: 0\r\n\r\n"
                  : "HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(body.size()) +
                        "\r\n\r\n" + body);
    }
  }
  std::string challenge_;
  RawServer server_{[this](int fd) { serve(fd); }};
};

constexpr const char* kBasicOnly = "Basic realm=\"x\"";
constexpr const char* kAnyDigest = "Digest realm=\"x\", nonce=\"1\", qop=\"auth\"";

VapixSourceOptions with_login(const SayingServer& server) {
  VapixSourceOptions options = vapix_options(server.url());
  options.user = "user";
  options.password = "secret";
  return options;
}

TEST(VapixSource, SendsNoPasswordInClearUnlessTheUserSaysSo) {
  SayingServer server(kBasicOnly);
  VapixSourceOptions options = with_login(server);
  PanTiltSample sample;
  {
    const auto source = open_vapix(options);
    EXPECT_EQ(read_until(*source, sample, ReadStatus::kFailed), ReadStatus::kFailed);
    EXPECT_THAT(source->error(),
                HasSubstr("by basic the password would cross the network in clear"));
    EXPECT_THAT(source->error(), HasSubstr("set auth: any"));
    EXPECT_EQ(server.logins, 0);
  }
  options.rules.auth = LinkRules::Auth::kAny;
  const auto source = open_vapix(options);
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  }
}

TEST(VapixSource, TakesItsLoginNowhereElse) {
  SayingServer other(kBasicOnly);
  SayingServer camera(kAnyDigest);
  camera.location = other.url() + "/there?a=b";
  VapixSourceOptions options = with_login(camera);
  options.rules.auth = LinkRules::Auth::kAny;
  PanTiltSample sample;
  {
    const auto source = open_vapix(options);
    ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), StartsWith(camera.url() + "/: redirected to " + other.url() +
                                            "/there?a=b, another port: refused"));
    EXPECT_EQ(other.requests, 0);
  }
  options.rules.redirects = LinkRules::Redirects::kAny;
  const auto source = open_vapix(options);
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("/there?a=b, which wants a login (401)"));
  EXPECT_GT(other.requests, 0);
  EXPECT_EQ(other.logins, 0);
}

TEST(VapixSource, FollowsARedirectionToItsOwnCamera) {
  SayingServer camera(kAnyDigest);
  camera.location = "/there";
  const auto source = open_vapix(with_login(camera));
  PanTiltSample sample;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  }
}

TEST(VapixSource, FailsAtOnceOnAUrlItCannotUse) {
  PanTiltSample sample;
  for (const char* url : {"http://user:se@cret@camera", "camera", "ftp://camera",
                          "http://camera/axis-cgi/com/ptz.cgi", ""}) {
    const auto source = open_vapix(vapix_options(url));
    EXPECT_EQ(source->read(sample, 0), ReadStatus::kFailed) << url;
    EXPECT_THAT(source->error(), AllOf(HasSubstr("://"), Not(HasSubstr("cret"))));
  }
}

TEST(VapixSource, ReportsRefusedConnectionsAndTriesAgainUntilTheCameraIsThere) {
  const int port = unused_port();
  const auto source =
      open_vapix(vapix_options("http://user:secret@127.0.0.1:" + std::to_string(port)));
  PanTiltSample sample;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), AllOf(StartsWith("http://127.0.0.1:" + std::to_string(port)),
                                       Not(HasSubstr("secret"))));
  }
  AxisServer server(
      "", "", [] { return position(1); }, port);
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk);
  EXPECT_TRUE(sample.restarted);
}

TEST(VapixSource, OutlivesARestartOfTheCamera) {
  auto server = std::make_unique<AxisServer>("user", "secret", [] { return position(1); });
  const int port = server->port();
  VapixSourceOptions options = vapix_options(server->url());
  options.user = "user";
  options.password = "secret";
  const auto source = open_vapix(options);
  PanTiltSample sample;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  }
  server.reset();
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  server = std::make_unique<AxisServer>(
      "user", "secret", [] { return position(2); }, port);
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk);
  EXPECT_TRUE(sample.restarted);
  EXPECT_DOUBLE_EQ(sample.pan_rad, 2 * kRadPerDeg);
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk);
  EXPECT_FALSE(sample.restarted);
}

TEST(VapixSource, ReportsHttpErrorsAndRecovers) {
  AxisServer server("", "", [] { return position(1); });
  const auto source = open_vapix(vapix_options(server.url()));
  PanTiltSample sample;
  for (const int status : {404, 500, 302}) {
    server.status = status;
    EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), HasSubstr("HTTP status " + std::to_string(status)));
    server.status = 200;
    EXPECT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk);
    EXPECT_TRUE(sample.restarted);
  }
}

TEST(VapixSource, RecognisesAnErrorInAnAnswerOfStatus200) {
  AxisServer server("", "", [] { return "Error: PTZ is off\r\n"; });
  const auto source = open_vapix(vapix_options(server.url()));
  PanTiltSample sample;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("the camera answers 'Error: PTZ is off'"));
}

TEST(VapixSource, RefusesAnAnswerTooLongForAPosition) {
  AxisServer server("", "", [] { return std::string(100'000, 'x'); });
  const auto source = open_vapix(vapix_options(server.url()));
  PanTiltSample sample;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("longer than 4096 bytes"));
}

TEST(VapixSource, SurvivesConnectionsThatBreakAtAnyPoint) {
  int turn = 0;
  RawServer server([&](int fd) {
    ++turn;
    if (turn % 4 == 1) {
      RawServer::reset(fd);
      return;
    }
    if (!server.read_request(fd) || turn % 4 == 2) {
      return;
    }
    if (turn % 4 == 3) {
      RawServer::send(fd, "HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\npan=");
      RawServer::reset(fd);
      return;
    }
    RawServer::send(fd, "HTTP/1.1 200 OK\r\nConnection: close\r\n\r\n" + position(4));
  });
  const auto source = open_vapix(vapix_options(url_of(server)));
  PanTiltSample sample;
  int lost = 0;
  for (int good = 0; good < 3;) {
    const ReadStatus status = source->read(sample, kDeadline_s);
    ASSERT_TRUE(status == ReadStatus::kOk || status == ReadStatus::kDisconnected);
    good += status == ReadStatus::kOk ? 1 : 0;
    lost += status == ReadStatus::kDisconnected ? 1 : 0;
  }
  EXPECT_EQ(lost, 9);
}

TEST(VapixSource, StampsTheFirstBytesOfAnAnswerThatComesInPieces) {
  double body_sent_s = 0;
  std::atomic<bool> send_body{false};
  RawServer server([&](int fd) {
    while (server.read_request(fd)) {
      RawServer::send(fd, "HTTP/1.1 200 OK\r\nContent-Length: 12\r\n\r\n");
      eventually([&] { return send_body || server.closing(); });
      body_sent_s = monotonic_now_s();
      RawServer::send(fd, "pan=1\ntilt=1");
    }
  });
  const auto source = open_vapix(vapix_options(url_of(server)));
  PanTiltSample sample;
  EXPECT_EQ(source->read(sample, 0.02), ReadStatus::kTimeout);
  EXPECT_EQ(source->read(sample, 0.02), ReadStatus::kTimeout);
  send_body = true;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_LT(sample.latest_time_s, body_sent_s);
  EXPECT_LE(sample.earliest_time_s, sample.latest_time_s);
}

TEST(VapixSource, GivesUpAPollThatIsNotAnswered) {
  RawServer server([&server](int fd) { server.stay_silent(fd); });
  VapixSourceOptions options = vapix_options(url_of(server));
  options.timeout_s = 0.05;
  const auto source = open_vapix(options);
  PanTiltSample sample;
  EXPECT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("timed out"));
}

TEST(VapixSource, NeverPollsFasterThanAsked) {
  AxisServer server("", "", [] { return position(1); });
  VapixSourceOptions options = vapix_options(server.url());
  options.rate_hz = 100;
  const auto source = open_vapix(options);
  const double before_s = monotonic_now_s();
  PanTiltSample sample;
  for (int i = 0; i <= 20; ++i) {
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
  }
  EXPECT_GT(sample.latest_time_s - before_s, 0.2);
}

TEST(VapixSource, LeaksNoFileDescriptorOverManyReconnections) {
  RawServer server([](int fd) { RawServer::reset(fd); });
  const auto source = open_vapix(vapix_options(url_of(server)));
  PanTiltSample sample;
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                         std::filesystem::directory_iterator());
  };
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  const auto before = open_files();
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(read_until(*source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  }
  EXPECT_LE(open_files(), before + 2);  // one connection at each end may be under way
}

TEST(VapixSource, StopEndsAPollThatIsNotAnswered) {
  RawServer server([&server](int fd) { server.stay_silent(fd); });
  const auto source = open_vapix(vapix_options(url_of(server)));
  PanTiltSample sample;
  EXPECT_EQ(server.status_when_stopped(*source, sample), ReadStatus::kStopped);
}

TEST(VapixSource, StopEndsAPause) {
  VapixSourceOptions options = vapix_options("http://127.0.0.1:" + std::to_string(unused_port()));
  options.max_backoff_s = kNever_s;
  const auto source = open_vapix(options);
  PanTiltSample sample;
  ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kDisconnected);
  std::thread stopper([&] { source->stop(); });
  // Pauses double from 0.25 s on, so that the source sleeps most of the time.
  ReadStatus status = ReadStatus::kDisconnected;
  while (status == ReadStatus::kDisconnected) {
    status = source->read(sample, kNever_s);
  }
  EXPECT_EQ(status, ReadStatus::kStopped);
  stopper.join();
}

}  // namespace
}  // namespace alidade
