// RTSP: a server that does what cameras do and the real server does not.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <string>

#include "platform/system/clock.h"
#include "platform/video/rtp_source.h"
#include "platform/video/rtsp_framing.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/scripted_rtsp_server.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

using Transport = RtpSourceOptions::Transport;

RtpSourceOptions options_for(const ScriptedRtspServer& server,
                             Transport transport = Transport::kTcp) {
  RtpSourceOptions options;
  options.url = server.url();
  options.transport = transport;
  options.timeout_s = 10;
  options.max_backoff_s = 0.01;
  return options;
}

// Reads on, without a loss, until the condition holds.
template <class Condition>
void read_while_waiting(FrameSource& source, Condition condition) {
  Frame frame;
  const double end_s = monotonic_now_s() + kDeadline_s;
  while (!condition()) {
    ASSERT_LT(monotonic_now_s(), end_s);
    const ReadStatus status = source.read(frame, 0.05);
    ASSERT_TRUE(status == ReadStatus::kOk || status == ReadStatus::kTimeout) << source.error();
  }
}

class RtspSessionBy : public ::testing::TestWithParam<Transport> {};

INSTANTIATE_TEST_SUITE_P(Transports, RtspSessionBy,
                         ::testing::Values(Transport::kTcp, Transport::kUdp), [](const auto& way) {
                           return way.param == Transport::kTcp ? "Tcp" : "Udp";
                         });

TEST_P(RtspSessionBy, FollowsARedirection) {
  const ScriptedRtspServer there;
  const ScriptedRtspServer here([&](const RtspRequest& request, RtspAnswer* answer) {
    if (request.method != "DESCRIBE") return;
    *answer = {"302 Moved Temporarily", "Location: " + there.url() + "\r\n", "", "", false};
  });
  RtpSourceOptions options = options_for(here, GetParam());
  options.rules.redirects = LinkRules::Redirects::kAny;
  const auto source = open_rtp(options);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_EQ(here.count("SETUP"), 0);
  EXPECT_EQ(there.count("PLAY"), 1);
}

RtspAnswer challenge(const std::string& how) {
  return {"401 Unauthorized", "WWW-Authenticate: " + how + "\r\n", "", "", false};
}

constexpr const char* kBasic = "Basic realm=\"r\"";
constexpr const char* kDigest = "Digest realm=\"r\", nonce=\"n\"";

// Wants a login of each request; then sends on to `location`, if there is one.
ScriptedRtspServer::Script with_login(const std::string& how, const std::string& location = "") {
  return [how, location](const RtspRequest& request, RtspAnswer* answer) {
    if (request.text.find("Authorization: ") == std::string::npos) {
      *answer = challenge(how);
    } else if (request.method == "DESCRIBE" && !location.empty() &&
               request.text.find("/within") == std::string::npos) {
      *answer = {"302 Moved Temporarily", "Location: " + location + "\r\n", "", "", false};
    }
  };
}

int logins(const ScriptedRtspServer& server) {
  return server.count("OPTIONS", "Authorization: ") + server.count("DESCRIBE", "Authorization: ");
}

RtpSourceOptions with_user(RtpSourceOptions options) {
  options.user = "user";
  options.password = "secret";
  options.max_backoff_s = 0.01;
  return options;
}

TEST_P(RtspSessionBy, TakesItsLoginToNoOtherServer) {
  const ScriptedRtspServer there(with_login(kBasic));
  const ScriptedRtspServer here(with_login(kDigest, there.url()));
  RtpSourceOptions options = with_user(options_for(here, GetParam()));
  options.rules.auth = LinkRules::Auth::kAny;
  Frame frame;
  {
    const auto source = open_rtp(options);
    for (int i = 0; i < 2; ++i) {
      ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
      EXPECT_THAT(source->error(), HasSubstr(here.url() + ": redirected to " + there.url() +
                                             ", another port: refused"));
    }
    EXPECT_EQ(there.count("OPTIONS"), 0);
  }
  options.rules.redirects = LinkRules::Redirects::kAny;
  const auto source = open_rtp(options);
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(),
                HasSubstr("redirected to " + there.url() + ", which wants a login (401)"));
  }
  EXPECT_GT(there.count("OPTIONS"), 0);
  EXPECT_EQ(logins(there), 0);
  EXPECT_GT(logins(here), 0);
}

TEST(RtspSession, TakesItsLoginAlongWithinTheServer) {
  const ScriptedRtspServer server(with_login(kDigest, "/within"));
  const auto source = open_rtp(with_user(options_for(server)));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_GE(server.count("DESCRIBE", "/within"), 1);
}

TEST(RtspSession, IsEndedByNoRedirectionFromItsBeginningOn) {
  for (const char* location :
       {"file:///etc/passwd", "http://127.0.0.1/", "rtsp://", "rtspt://x/"}) {
    const ScriptedRtspServer server([&](const RtspRequest& request, RtspAnswer* answer) {
      if (request.method != "DESCRIBE") return;
      *answer = {"302 Found", std::string("Location: ") + location + "\r\n", "", "", false};
    });
    const auto source = open_rtp(options_for(server));
    Frame frame;
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
      EXPECT_THAT(source->error(), HasSubstr(": refused")) << location;
    }
  }
}

TEST(RtspSession, SendsNoPasswordInClearUnlessTheUserSaysSo) {
  const ScriptedRtspServer server(with_login(kBasic));
  RtpSourceOptions options = with_user(options_for(server));
  Frame frame;
  {
    const auto source = open_rtp(options);
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
    EXPECT_THAT(source->error(),
                HasSubstr("by basic the password would cross the network in clear"));
    EXPECT_THAT(source->error(), HasSubstr("set auth: any (401)"));
    EXPECT_EQ(logins(server), 0);
  }
  options.rules.auth = LinkRules::Auth::kAny;
  const auto source = open_rtp(options);
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
}

// In the midst of a session that began by digest, and behind a restart of the camera.
TEST(RtspSession, SendsNoPasswordInClearWhereDigestWasOffered) {
  std::atomic<bool> downgraded{false};
  ScriptedRtspServer server([&](const RtspRequest& request, RtspAnswer* answer) {
    with_login(kDigest)(request, answer);
    if (downgraded) *answer = challenge(kBasic);
  });
  const auto source = open_rtp(with_user(options_for(server)));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  downgraded = true;
  server.hang_up = true;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  }
  EXPECT_THAT(source->error(), HasSubstr("would cross the network in clear"));
  for (const char* method : {"OPTIONS", "DESCRIBE", "SETUP", "PLAY", "GET_PARAMETER"}) {
    EXPECT_EQ(server.count(method, "Authorization: Basic"), 0) << method;
  }
  downgraded = false;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
}

TEST_P(RtspSessionBy, GivesUpAConnectionThatIsRefused) {
  const ScriptedRtspServer server;
  const auto source = open_rtp(options_for(server, GetParam()));
  Frame frame;
  for (int life = 0; life < 3; ++life) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    ASSERT_TRUE(source->refuse("of another size"));
    ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kDisconnected);
    EXPECT_EQ(source->error(), server.url() + ": of another size");
  }
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(frame.stamp.restarted);
}

TEST_P(RtspSessionBy, PingsByGetParameterWhereTheCameraOffersIt) {
  const ScriptedRtspServer server;
  const auto source = open_rtp(options_for(server, GetParam()));
  read_while_waiting(*source, [&] { return server.count("GET_PARAMETER", "Session: 1") >= 2; });
  EXPECT_EQ(server.count("OPTIONS"), 1);
}

TEST_P(RtspSessionBy, PingsByOptionsWhereTheCameraOffersNothingElse) {
  const ScriptedRtspServer server([](const RtspRequest& request, RtspAnswer* answer) {
    if (request.method == "OPTIONS") answer->headers = "Public: OPTIONS, DESCRIBE, SETUP, PLAY\r\n";
  });
  const auto source = open_rtp(options_for(server, GetParam()));
  read_while_waiting(*source, [&] { return server.count("OPTIONS", "Session: 1") >= 2; });
  EXPECT_EQ(server.count("GET_PARAMETER"), 0);
}

// The ping comes after 3 s; without another one before 5.5 s the camera would end the session.
TEST_P(RtspSessionBy, PingsAgainWhenTheLoginRanOut) {
  std::atomic<int> nonce{1};
  std::atomic<int> pings{0};
  std::atomic<double> last_let_in_s{monotonic_now_s()};
  ScriptedRtspServer server([&](const RtspRequest& request, RtspAnswer* answer) {
    const std::string current = "nonce=\"n" + std::to_string(nonce) + "\"";
    if (request.text.find(current) == std::string::npos) {
      *answer = {"401 Unauthorized",
                 "WWW-Authenticate: Digest realm=\"r\", " + current + ", stale=true\r\n", "", "",
                 false};
      return;
    }
    last_let_in_s = monotonic_now_s();
    pings += request.method == "GET_PARAMETER" ? 1 : 0;
    nonce += request.method == "PLAY" ? 1 : 0;
    if (request.method == "SETUP") {
      answer->headers.replace(answer->headers.find("timeout=2"), 9, "timeout=4");
    }
  });
  RtpSourceOptions options = options_for(server, GetParam());
  options.user = "user";
  options.password = "secret";
  const auto source = open_rtp(options);
  read_while_waiting(*source, [&] {
    if (monotonic_now_s() > last_let_in_s + 5.5) server.hang_up = true;
    return pings >= 1;
  });
}

TEST_P(RtspSessionBy, AnswersTheCamerasOwnRequests) {
  ScriptedRtspServer server([](const RtspRequest& request, RtspAnswer* answer) {
    if (request.method == "SETUP") answer->before = "OPTIONS * RTSP/1.0\r\nCSeq: 76\r\n\r\n";
  });
  server.ask = true;
  const auto source = open_rtp(options_for(server, GetParam()));
  read_while_waiting(*source, [&] { return server.count("RTSP/1.0", "CSeq: 77") == 1; });
  EXPECT_EQ(server.count("RTSP/1.0", "RTSP/1.0 200 OK"), 2);
  EXPECT_EQ(server.count("RTSP/1.0", "CSeq: 76"), 1);
}

TEST_P(RtspSessionBy, SaysWhichTransportTheCameraRefuses) {
  const ScriptedRtspServer server([](const RtspRequest& request, RtspAnswer* answer) {
    if (request.method == "SETUP") answer->status = "461 Unsupported Transport";
  });
  const auto source = open_rtp(options_for(server, GetParam()));
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(),
              HasSubstr(GetParam() == Transport::kTcp ? "by TCP (461); set transport: udp"
                                                      : "by UDP (461); set transport: tcp"));
}

TEST_P(RtspSessionBy, SaysThatTheCameraHungUp) {
  ScriptedRtspServer server;
  const auto source = open_rtp(options_for(server, GetParam()));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  server.hang_up = true;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("the camera closed the connection"));
}

TEST(RtspSession, GoesOnByUdpWhileACameraThatHungUpSends) {
  ScriptedRtspServer server;
  const auto source = open_rtp(options_for(server, Transport::kUdp));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  server.stop_speaking = true;
  int frames = 0;
  read_while_waiting(*source, [&] { return !server.stop_speaking && ++frames > 60; });
}

TEST(RtspSession, GivesUpRedirectionsInACircle) {
  std::promise<std::string> known;
  const std::shared_future<std::string> url = known.get_future().share();
  const ScriptedRtspServer server([url](const RtspRequest& request, RtspAnswer* answer) {
    if (request.method != "DESCRIBE") return;
    const std::string other = request.text.find("/other") == std::string::npos ? "/other" : "";
    *answer = {"301 Moved", "Location: " + url.get() + other + "\r\n", "", "", false};
  });
  known.set_value(server.url());
  const auto source = open_rtp(options_for(server));
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("more than 5 redirections"));
}

TEST(RtspSession, KeepsThePacketsThatComeBeforeTheAnswerToPlay) {
  const ScriptedRtspServer server([](const RtspRequest& request, RtspAnswer* answer) {
    answer->pictures_before = request.method == "PLAY";
  });
  const auto source = open_rtp(options_for(server));
  Frame frame;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_NEAR(frame.luma[0], RtpSender::grey_of(i), 3);
  }
}

// Bytes that a camera, or what stands between, puts before the packets of its connection.
TEST(RtspSession, PassesOverBytesThatBelongToNoPacket) {
  const std::vector<std::string> garbage = {"x",
                                            std::string("\0\0\0\0", 4),
                                            "$",
                                            "$$$$",
                                            std::string("$\0\0\0", 4),
                                            "RTSP",
                                            "\r\nOPTIO",
                                            "text",
                                            "\x80\x1a\xff\n",
                                            std::string("$\x01\xff\xff", 4)};
  for (const int each : {1, 9}) {
    ScriptedRtspServer server;
    server.change_bytes = [&](std::int64_t packet, std::string* bytes) {
      const auto which = static_cast<std::size_t>(packet / each) % garbage.size();
      if (packet % each == each - 1) *bytes = garbage[which] + *bytes;
    };
    const auto source = open_rtp(options_for(server));
    Frame frame;
    for (int i = 0; i < 60; ++i) {
      ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
      ASSERT_NEAR(frame.luma[0], RtpSender::grey_of(i), 3) << i;
    }
    EXPECT_EQ(source->counters().damaged, 0);
    EXPECT_GT(source->counters().garbage_bytes, 0);
    EXPECT_THAT(source->remark(), HasSubstr("bytes come that belong to no packet"));
    EXPECT_EQ(source->remark(), "");
    EXPECT_EQ(server.count("PLAY"), 1);
  }
}

TEST(RtspSession, PassesOverBytesBeforeTheAnswerToPlay) {
  for (const std::string& garbage :
       {std::string("x"), std::string("\0\0\0\0$\0", 6), std::string("RTSP/2.0 junk\r\n\r\n$\x07"),
        "\xff\xd8\xff" + std::string(3000, 'j')}) {
    const ScriptedRtspServer server([&](const RtspRequest& request, RtspAnswer* answer) {
      if (request.method != "PLAY") return;
      answer->before = garbage;
      answer->pictures_before = true;
    });
    const auto source = open_rtp(options_for(server));
    Frame frame;
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
      EXPECT_NEAR(frame.luma[0], RtpSender::grey_of(i), 3);
    }
    EXPECT_GE(source->counters().garbage_bytes, static_cast<std::int64_t>(garbage.size()));
    EXPECT_EQ(server.count("PLAY"), 1);
  }
}

TEST(RtspSession, EndsWhereGarbageComesInPlaceOfTheAnswerToPlay) {
  const ScriptedRtspServer server([&](const RtspRequest& request, RtspAnswer* answer) {
    if (request.method == "PLAY") answer->before = std::string(RtspFraming::kMaxGarbage + 9, 'x');
  });
  const auto source = open_rtp(options_for(server));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("what the camera sends is not RTSP"));
}

TEST(RtspSession, AnswersTheCameraBesideBytesThatBelongToNoPacket) {
  ScriptedRtspServer server;
  server.change_bytes = [](std::int64_t, std::string* bytes) { *bytes = "..." + *bytes; };
  const auto source = open_rtp(options_for(server));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  server.ask = true;
  read_while_waiting(*source, [&] { return server.count("RTSP/1.0", "CSeq: 77") == 1; });
}

TEST(RtspSession, EndsWhereWhatComesIsNoRtspAnyMore) {
  ScriptedRtspServer server;
  server.change_bytes = [](std::int64_t packet, std::string* bytes) {
    if (packet > 10) *bytes = std::string(5000, 'x');
  };
  const auto source = open_rtp(options_for(server));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("what the camera sends is not RTSP"));
}

// Which answer: that to PLAY, or to SETUP.
class RtspSessionWithTwoSenders : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(, RtspSessionWithTwoSenders, ::testing::Bool());

// Another camera's packets of the same type come first.
TEST_P(RtspSessionWithTwoSenders, TakesThePacketsOfTheSourceThatAnAnswerNames) {
  ScriptedRtspServer server([](const RtspRequest& request, RtspAnswer* answer) {
    if (request.method == "SETUP" && !GetParam()) {
      answer->headers.insert(answer->headers.find("\r\n"), ";ssrc=0A0B0C0D");
    } else if (request.method == "PLAY" && GetParam()) {
      answer->headers += "RTP-Info: url=\"x\" ssrc=0A0B0C0D:seq=1\r\n";
    }
  });
  server.change_packets = [](std::int64_t, RtpRelay::Packets* packets) {
    RtpRelay::Packets all;
    for (RtpRelay::Packet& packet : *packets) {
      all.push_back(packet);
      for (std::size_t i = 0; i < 4; ++i) packet[8 + i] = static_cast<std::uint8_t>(0x0A + i);
      for (std::size_t i = 12; i < all.back().size(); ++i) all.back()[i] ^= 0x5AU;
      all.back()[2] ^= 0x10U;
      all.push_back(packet);
    }
    *packets = all;
  };
  const auto source = open_rtp(options_for(server));
  Frame frame;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_NEAR(frame.luma[0], RtpSender::grey_of(i), 3);
  }
  EXPECT_EQ(source->counters().damaged, 0);
}

struct Refusal {
  const char* name;
  const char* method;
  RtspAnswer answer;
  const char* says;
};

void PrintTo(const Refusal& refusal, std::ostream* out) { *out << refusal.name; }

class RtspSessionOfACameraThatBoots : public ::testing::TestWithParam<Refusal> {
 protected:
  // From which connection up to which one it refuses.
  void refuse(int first, int last, ScriptedRtspServer::Script* script) const {
    *script = [first, last, refusal = GetParam()](const RtspRequest& request, RtspAnswer* answer) {
      if (request.method == refusal.method && request.connection >= first &&
          request.connection <= last) {
        *answer = refusal.answer;
      }
    };
  }
};

const char* const kNoVideo = "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=x\r\nt=0 0\r\n";
const char* const kVp8 =
    "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=x\r\nt=0 0\r\n"
    "m=video 0 RTP/AVP 96\r\na=rtpmap:96 VP8/90000\r\na=control:track1\r\n";

INSTANTIATE_TEST_SUITE_P(
    Refusals, RtspSessionOfACameraThatBoots,
    ::testing::Values(Refusal{"NoVideo",
                              "DESCRIBE",
                              {"200 OK", "", kNoVideo, "", false},
                              "there is no video in this stream"},
                      Refusal{"AnotherCodec",
                              "DESCRIBE",
                              {"200 OK", "", kVp8, "", false},
                              "the video is vp8; set the camera to MJPEG, H.264 or H.265"},
                      Refusal{"Login",
                              "OPTIONS",
                              {"401 Unauthorized", "", "", "", false},
                              "the camera wants a user and a password (401)"},
                      Refusal{"Transport",
                              "SETUP",
                              {"461 Unsupported Transport", "", "", "", false},
                              "does not send RTP by TCP (461)"}),
    [](const auto& which) { return which.param.name; });

TEST_P(RtspSessionOfACameraThatBoots, IsTriedAgainOnceItWorked) {
  ScriptedRtspServer::Script script;
  refuse(2, 3, &script);
  ScriptedRtspServer server(script);
  const auto source = open_rtp(options_for(server));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  server.hang_up = true;
  ASSERT_EQ(read_until(*source, frame,
                       [&](ReadStatus status) {
                         return status == ReadStatus::kDisconnected &&
                                source->error().find(GetParam().says) != std::string::npos;
                       }),
            ReadStatus::kDisconnected)
      << source->error();
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(frame.stamp.restarted);
}

TEST_P(RtspSessionOfACameraThatBoots, FailsForGoodIfItNeverWorked) {
  ScriptedRtspServer::Script script;
  refuse(1, 1000, &script);
  const ScriptedRtspServer server(script);
  const auto source = open_rtp(options_for(server));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(), HasSubstr(GetParam().says));
}

}  // namespace
}  // namespace alidade
