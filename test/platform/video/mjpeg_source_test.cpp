// MJPEG over HTTP with a camera in this process, each of whose pictures tells its number by its grey
// (mjpeg_server.h), and with servers that misbehave.

#include "platform/video/mjpeg_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <netinet/tcp.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "platform/video/jpeg_decoder.h"
#include "platform/video/recording_copy.h"
#include "platform/video/recording_frame_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/mjpeg_server.h"
#include "test/platform/support/picture_files.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using Login = MjpegServer::Login;

constexpr double kGreyTolerance = 3;  // neighbouring numbers differ by 7

MjpegSourceOptions options_for(const std::string& url) {
  MjpegSourceOptions options;
  options.url = url;
  options.timeout_s = kDeadline_s;
  options.max_backoff_s = 0.01;
  return options;
}

MjpegSourceOptions options_for(const RawServer& server) {
  return options_for("http://127.0.0.1:" + std::to_string(server.port()) + "/");
}

// The mean of all pixels: a wrong stride or a damaged edge shows.
double grey_of(const Frame& frame) {
  double sum = 0;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      sum += frame.luma[v * frame.stride + u];
    }
  }
  return sum / (frame.width * frame.height);
}

std::string stream_head(const std::string& type = "multipart/x-mixed-replace;boundary=b") {
  return "HTTP/1.1 200 OK\r\nContent-Type: " + type + "\r\n\r\n";
}

std::string part(const std::string& body, const std::string& headers = "") {
  return "--b\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(body.size()) +
         "\r\n" + headers + "\r\n" + body + "\r\n";
}

struct Style {
  const char* name;
  MjpegStyle style;
};

void PrintTo(const Style& style, std::ostream* out) { *out << style.name; }

std::vector<Style> styles() {
  std::vector<Style> all{{"Usual", {}}};
  MjpegStyle style;
  style.length = false;
  all.push_back({"WithoutLength", style});
  style.after = "";
  all.push_back({"WithoutLineEndBeforeTheDelimiter", style});
  style = {};
  style.type = "multipart/x-mixed-replace";
  all.push_back({"UndeclaredBoundary", style});
  style = {};
  style.type = "Multipart/X-Mixed-Replace ; Boundary = \"myboundary\"";
  style.before = "----myboundary\n";
  style.headers = "content-type:image/jpeg\n";
  all.push_back({"QuotedBoundaryAndLineFeeds", style});
  style = {};
  style.headers = "Content-Length: 20\r\n";
  style.length = false;
  all.push_back({"WrongLength", style});
  style = {};
  style.before = "--myboundary";
  all.push_back({"NoLineEndBehindTheBoundary", style});
  style.length = false;
  style.after = "";
  all.push_back({"NoLineEndAroundTheBoundaryAndNoLength", style});
  style.before = "--myboundary  ";
  style.headers = "content-type: image/jpeg\n";
  all.push_back({"BlanksBehindTheBoundaryAndLineFeeds", style});
  return all;
}

class MjpegSourceStyles : public ::testing::TestWithParam<Style> {};

TEST_P(MjpegSourceStyles, DeliversEveryPictureInOrder) {
  const MjpegServer server(GetParam().style);
  const auto source = open_mjpeg(options_for(server.url()));
  Frame frame;
  double last_s = 0;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.stamp.frame, i);
    EXPECT_EQ(frame.stamp.restarted, i == 0);
    EXPECT_FALSE(frame.stamp.sender_time_s);
    EXPECT_EQ(frame.width, MjpegServer::kWidth);
    EXPECT_EQ(frame.height, MjpegServer::kHeight);
    EXPECT_NEAR(grey_of(frame), MjpegServer::grey_of(i), kGreyTolerance);
    EXPECT_TRUE(frame.decode_s);
    EXPECT_GE(frame.stamp.receive_time_s, server.sent(i).before_first_s);
    EXPECT_GE(frame.stamp.receive_time_s, last_s);
    last_s = frame.stamp.receive_time_s;
  }
  EXPECT_EQ(source->counters().damaged, 0);
  EXPECT_EQ(source->counters().dropped, 0);
}

INSTANTIATE_TEST_SUITE_P(Cameras, MjpegSourceStyles, ::testing::ValuesIn(styles()),
                         [](const auto& which) { return which.param.name; });

TEST(MjpegSource, StampsTheFirstByteOfAPictureThatComesSlowly) {
  MjpegStyle style;
  style.pause_in_part = true;
  const MjpegServer server(style);
  const auto source = open_mjpeg(options_for(server.url()));
  Frame frame;
  int early = 0;
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
    EXPECT_GE(frame.stamp.receive_time_s, server.sent(i).before_first_s);
    early += frame.stamp.receive_time_s < server.sent(i).before_rest_s ? 1 : 0;
  }
  EXPECT_GE(early,
            1);  // a busy machine may sleep over a pause, but a stamp of the last byte never is
}

std::string login_name(Login login) {
  return login == Login::kBasic       ? "Basic"
         : login == Login::kDigestMd5 ? "DigestMd5"
                                      : "DigestSha256";
}

class MjpegSourceLogin : public ::testing::TestWithParam<Login> {};

TEST_P(MjpegSourceLogin, LogsIn) {
  const MjpegServer server({}, GetParam());
  MjpegSourceOptions options = options_for(server.url());
  options.user = MjpegServer::kUser;
  options.password = MjpegServer::kPassword;
  options.rules.auth = LinkRules::Auth::kAny;
  const auto source = open_mjpeg(options);
  Frame frame;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
  }
  EXPECT_EQ(server.refusals, 1);
}

TEST_P(MjpegSourceLogin, FailsForGoodOnAWrongPasswordAndDoesNotShowIt) {
  const MjpegServer server({}, GetParam());
  Frame frame;
  {
    MjpegSourceOptions options = options_for(
        "http://us%20er:guess@127.0.0.1:" + std::to_string(server.port()) + "/video.cgi?x=y");
    options.rules.auth = LinkRules::Auth::kAny;
    const auto source = open_mjpeg(options);
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
    EXPECT_EQ(source->error(), server.url() + ": wrong user or password (401)");
    EXPECT_EQ(source->read(frame, 0), ReadStatus::kFailed);
  }  // and its connection: the server has one at a time
  const auto anonymous = open_mjpeg(options_for(server.url()));
  EXPECT_EQ(read_until(*anonymous, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(anonymous->error(), HasSubstr("wants a user and a password (401)"));
}

TEST_P(MjpegSourceLogin, LogsInAgainWhenTheCameraHasForgottenItsNonces) {
  MjpegServer server({}, GetParam());
  MjpegSourceOptions options = options_for(server.url());
  options.user = MjpegServer::kUser;
  options.password = MjpegServer::kPassword;
  options.rules.auth = LinkRules::Auth::kAny;
  const auto source = open_mjpeg(options);
  Frame frame;
  for (int life = 0; life < 3; ++life) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    server.hang_up = true;
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    server.renew_nonce();
    server.hang_up = false;
  }
}

TEST_P(MjpegSourceLogin, TriesOnWhenACameraThatHasWorkedRefuses) {
  MjpegServer server({}, GetParam());
  MjpegSourceOptions options = options_for(server.url());
  options.user = MjpegServer::kUser;
  options.password = MjpegServer::kPassword;
  options.rules.auth = LinkRules::Auth::kAny;
  const auto source = open_mjpeg(options);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  server.refuse = true;
  server.hang_up = true;
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  }
  EXPECT_EQ(source->error(), server.url() + ": wrong user or password (401)");
  server.hang_up = false;
  server.refuse = false;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(frame.stamp.restarted);
}

INSTANTIATE_TEST_SUITE_P(Methods, MjpegSourceLogin,
                         ::testing::Values(Login::kBasic, Login::kDigestMd5, Login::kDigestSha256),
                         [](const auto& which) { return login_name(which.param); });

TEST(MjpegSource, SendsNoPasswordInClearUnlessTheUserSaysSo) {
  const MjpegServer server({}, Login::kBasic);
  MjpegSourceOptions options = options_for(server.url());
  options.user = MjpegServer::kUser;
  options.password = MjpegServer::kPassword;
  const auto source = open_mjpeg(options);
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(),
              AllOf(StartsWith(server.url() + ": the camera offers no digest authentication"),
                    HasSubstr("set auth: any")));
  EXPECT_EQ(server.refusals, 1) << "asked once, without a login";
}

// Answers one request with this redirection.
std::string sent_on_to(const std::string& location) {
  return "HTTP/1.1 302 Found\r\nLocation: " + location + "\r\nContent-Length: 0\r\n\r\n";
}

TEST(MjpegSource, TakesItsLoginNowhereElse) {
  const MjpegServer there({}, Login::kBasic);
  std::string location = there.url();
  RawServer here([&](int fd) {
    std::string request;
    if (here.read_request(fd, &request)) RawServer::send(fd, sent_on_to(location));
  });
  MjpegSourceOptions options = options_for(here);
  options.user = MjpegServer::kUser;
  options.password = MjpegServer::kPassword;
  options.rules.auth = LinkRules::Auth::kAny;
  Frame frame;
  {
    const auto source = open_mjpeg(options);
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), StartsWith(options.url + ": redirected to " + there.url() +
                                            ", another port: refused"));
    EXPECT_EQ(there.refusals, 0);
  }
  options.rules.redirects = LinkRules::Redirects::kAny;
  const auto source = open_mjpeg(options);
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr(there.url() + ", which wants a login (401)"));
  EXPECT_GE(there.refusals, 1) << "though the right login would have been let in";
}

TEST(MjpegSource, FollowsARedirectionWhereItMay) {
  const MjpegServer there;
  std::atomic<int> asked{0};
  RawServer here([&](int fd) {
    std::string request;
    if (!here.read_request(fd, &request)) return;
    const int which = ++asked;
    RawServer::send(fd, sent_on_to(which == 1 ? "/within?x=y" : there.url()));
  });
  MjpegSourceOptions options = options_for(here);
  options.rules.redirects = LinkRules::Redirects::kAny;
  const auto source = open_mjpeg(options);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_EQ(asked, 2);
}

TEST(MjpegSource, GivesUpRedirectionsInACircleAndToWhatIsNoCamera) {
  for (const auto& [location, says] : {std::pair{"/", "more than 5 redirections"},
                                       {"file:///etc/passwd", "no address of this kind"},
                                       {"rtsp://127.0.0.1/x", "no address of this kind"}}) {
    RawServer here([&here, to = std::string(location)](int fd) {
      while (here.read_request(fd)) RawServer::send(fd, sent_on_to(to));
    });
    const auto source = open_mjpeg(options_for(here));
    Frame frame;
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), HasSubstr(says));
  }
}

TEST(MjpegSource, GivesUpAConnectionThatIsRefused) {
  const MjpegServer server;
  const auto source = open_mjpeg(options_for(server.url()));
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

TEST(MjpegSource, GivesUpAStreamOfPartsThatAreNoPictures) {
  RawServer server([&server](int fd) {
    if (!server.read_request(fd)) return;
    RawServer::send(fd, stream_head());
    std::string parts;
    for (int i = 0; i < 2000; ++i) parts += "--b\r\nContent-Type: text/plain\r\n\r\nx\r\n";
    RawServer::send(fd, parts);
    server.stay_silent(fd);
  });
  const auto source = open_mjpeg(options_for(server));
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("more than 1000 parts in a row are not pictures"));
}

TEST(MjpegSource, TakesAPictureThatComesInTinyPieces) {
  RawServer server([&server](int fd) {
    if (!server.read_request(fd)) return;
    const int on = 1;
    ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    const std::string picture = MjpegServer::picture(1);
    const std::string bytes = stream_head() + "--b\r\n\r\n" + picture + "\r\n--b\r\n";
    for (std::size_t at = 0; at < bytes.size(); at += 2) {
      if (!RawServer::send(fd, bytes.substr(at, 2))) return;
    }
    server.stay_silent(fd);
  });
  const auto source = open_mjpeg(options_for(server));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_NEAR(grey_of(frame), MjpegServer::grey_of(1), kGreyTolerance);
}

TEST(MjpegSource, FailsAtOnceOnAUrlItCannotUse) {
  Frame frame;
  for (const char* url : {"http://user:se@cret@camera/", "camera", "rtsp://camera/", ""}) {
    const auto source = open_mjpeg(options_for(url));
    EXPECT_EQ(source->read(frame, 0), ReadStatus::kFailed) << url;
    EXPECT_THAT(source->error(), AllOf(HasSubstr("://"), Not(HasSubstr("cret"))));
  }
}

TEST(MjpegSource, TakesTheSendersClockWhileItAdvances) {
  MjpegStyle style;
  style.timestamp_step_s = 0.04;
  const MjpegServer server(style);
  const auto source = open_mjpeg(options_for(server.url()));
  Frame frame;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
    ASSERT_TRUE(frame.stamp.sender_time_s);
    EXPECT_NEAR(*frame.stamp.sender_time_s, 1000 + 0.04 * i, 1e-6);
  }
}

TEST(MjpegSource, ForgetsASendersClockThatStands) {
  MjpegStyle style;
  style.timestamp_step_s = 0;
  const MjpegServer server(style);
  const auto source = open_mjpeg(options_for(server.url()));
  Frame frame;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.stamp.sender_time_s.has_value(), i == 0);
  }
}

// What becomes of the parts' stamps; negative: none.
class MjpegSourceClock : public ::testing::Test {
 protected:
  // Of one connection after another.
  void send(std::vector<std::vector<double>> connections) { connections_ = std::move(connections); }
  Frame read() {
    if (!source_) {
      source_ = open_mjpeg(options_for(server_));
    }
    Frame frame;
    EXPECT_EQ(read_until(*source_, frame, ReadStatus::kOk), ReadStatus::kOk) << source_->error();
    return frame;
  }
  FrameSourceCounters counters() const { return source_->counters(); }
  std::string remark() { return source_->remark(); }
  void expect(const std::vector<double>& times) {
    for (std::size_t i = 0; i < times.size(); ++i) {
      EXPECT_EQ(read().stamp.sender_time_s.value_or(-1), times[i]) << i;
    }
  }

 private:
  void serve(int fd) {
    if (!server_.read_request(fd) || next_ == connections_.size()) {
      return;
    }
    RawServer::send(fd, stream_head());
    for (const double stamp : connections_[next_++]) {
      RawServer::send(
          fd, part(jpeg_, stamp < 0 ? "" : "X-Timestamp: " + std::to_string(stamp) + "\r\n"));
    }
  }
  std::vector<std::vector<double>> connections_;
  std::size_t next_ = 0;
  std::string jpeg_ = MjpegServer::picture(0);
  RawServer server_{[this](int fd) { serve(fd); }};
  std::unique_ptr<FrameSource> source_;  // before the server, which waits for it
};

// As soon as some agree on it.
TEST_F(MjpegSourceClock, BeginsAnewWhereItIsSet) {
  send({{100, 100.5, 50, 50.5, 51, 51.5, 7000, 7000.5, 7001, 7001.5}, {50, 50.5}});
  const std::vector<double> told = {100, 100.5, -1, -1, 51, 51.5, -1, -1, 7001, 7001.5, 50, 50.5};
  for (std::size_t i = 0; i < told.size(); ++i) {
    const FrameStamp stamp = read().stamp;
    EXPECT_EQ(stamp.sender_time_s.value_or(-1), told[i]) << i;
    EXPECT_EQ(stamp.restarted, i == 0 || i == 4 || i == 8 || i == 10) << i;
  }
}

// One in a connection of its own each, as no more pictures wait than those of a second.
TEST_F(MjpegSourceClock, GoesOnOverStampsThatCannotBeTrue) {
  const std::vector<double> off = {7200, -10, -5000, 1e9, 2, -0.04};
  std::vector<std::vector<double>> sent(off.size());
  for (std::size_t i = 0; i < off.size(); ++i) {
    for (int n = 0; n < 16; ++n) sent[i].push_back(9000 + 0.25 * n + (n == 8 ? off[i] : 0));
  }
  sent.back()[8] = sent.back()[7];  // told again
  send(sent);
  for (const std::vector<double>& connection : sent) {
    for (std::size_t n = 0; n < connection.size(); ++n) {
      const FrameStamp stamp = read().stamp;
      EXPECT_EQ(stamp.sender_time_s.value_or(-1), n == 8 ? -1 : connection[n]) << n;
      EXPECT_EQ(stamp.restarted, n == 0) << n;
    }
  }
  EXPECT_EQ(counters().unstamped, 5) << "one told no new time";
  EXPECT_THAT(remark(), HasSubstr("a picture's time stamp cannot be true: it is +7.2e+03 s off"));
  EXPECT_EQ(remark(), "");
}

TEST_F(MjpegSourceClock, IsNotGivenUpForAPartWithoutANewStamp) {
  send({{1, -1, 3, 3, 5, 6}});
  expect({1, -1, 3, -1, 5, 6});
}

TEST_F(MjpegSourceClock, IsForgottenUntilTheNextConnectionWhereItStands) {
  send({{1, 1, 1, 1, 5, 6}, {1, -1, -1, -1, 5, 6}, {1, 2}});
  expect({1, -1, -1, -1, -1, -1, 1, -1, -1, -1, -1, -1, 1, 2});
}

TEST_F(MjpegSourceClock, IsForgottenWhereItRunsBackwards) {
  send({{9, 8, 7, 6, 7, 8}});
  expect({9, -1, -1, -1, -1, -1});
}

TEST_F(MjpegSourceClock, IsForgottenWhereItIsCoarserThanTheFrames) {
  send({{1, 1, 2, 2, 3, 3, 4, 4}});
  expect({1, -1, 2, -1, 3, -1, -1, -1});
}

TEST(MjpegSource, ReportsRefusedConnectionsAndTriesAgainUntilTheCameraIsThere) {
  MjpegServer server;
  const auto lost =
      open_mjpeg(options_for("http://user:secret@127.0.0.1:" + std::to_string(unused_port())));
  Frame frame;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(read_until(*lost, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(lost->error(), AllOf(StartsWith("http://127.0.0.1:"), HasSubstr("connect"),
                                     Not(HasSubstr("secret"))));
  }
  const auto source = open_mjpeg(options_for(server.url()));
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
  server.hang_up = true;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("ended the stream"));
  server.hang_up = false;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk);
  EXPECT_TRUE(frame.stamp.restarted);
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk);
  EXPECT_FALSE(frame.stamp.restarted);
}

TEST(MjpegSource, SaysWhatTheAnswerIsInPlaceOfAStream) {
  struct Answer {
    const char* head;
    const char* error;
  };
  for (const Answer& answer :
       {Answer{"404 Not Found\r\nContent-Type: text/html", "HTTP status 404"},
        Answer{"500 Internal Server Error\r\nContent-Type: text/html", "HTTP status 500"},
        Answer{"302 Found\r\nLocation: /login",
               "more than 5 redirections, the last to http://127.0.0.1:"},
        Answer{"200 OK\r\nContent-Type: text/html", "the answer is text/html, not a stream"},
        Answer{"200 OK\r\nContent-Type: image/jpeg", "the answer is image/jpeg, not a stream"},
        Answer{"200 OK\r\nX: y", "the answer is of no type, not a stream"}}) {
    RawServer server([&](int fd) {
      if (server.read_request(fd)) {
        RawServer::send(fd, std::string("HTTP/1.1 ") + answer.head +
                                "\r\nContent-Length: 5\r\nConnection: close\r\n\r\nhello");
      }
    });
    const auto source = open_mjpeg(options_for(server));
    Frame frame;
    for (int i = 0; i < 2; ++i) {
      ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
      EXPECT_THAT(source->error(), HasSubstr(answer.error));
    }
  }
}

TEST(MjpegSource, SurvivesConnectionsThatBreakAtAnyPoint) {
  const std::string jpeg = MjpegServer::picture(0);
  int turn = 0;
  RawServer server([&](int fd) {
    ++turn;
    if (turn % 5 == 1) {
      RawServer::reset(fd);
      return;
    }
    if (!server.read_request(fd) || turn % 5 == 2) {
      return;
    }
    RawServer::send(fd, stream_head());
    if (turn % 5 == 3) {
      RawServer::send(fd, part(jpeg).substr(0, 20));
      RawServer::reset(fd);
    } else if (turn % 5 == 4) {
      RawServer::send(fd, part(jpeg).substr(0, jpeg.size()));
    } else {
      RawServer::send(fd, part(jpeg));
    }
  });
  const auto source = open_mjpeg(options_for(server));
  Frame frame;
  int lost = 0;
  for (int good = 0; good < 3;) {
    const ReadStatus status = source->read(frame, kDeadline_s);
    ASSERT_TRUE(status == ReadStatus::kOk || status == ReadStatus::kDisconnected);
    if (status == ReadStatus::kOk) {
      EXPECT_TRUE(frame.stamp.restarted);
      EXPECT_EQ(frame.stamp.frame, good++);
    } else {
      ++lost;
    }
  }
  EXPECT_GE(lost, 3);  // reports that follow each other become one
  EXPECT_EQ(source->counters().damaged, 0);
}

TEST(MjpegSource, SkipsAndCountsDamagedPicturesAndPassesOverText) {
  const std::string jpeg = MjpegServer::picture(3);
  RawServer server([&](int fd) {
    if (!server.read_request(fd)) {
      return;
    }
    RawServer::send(fd, stream_head());
    RawServer::send(fd, part(jpeg.substr(0, jpeg.size() / 2)));
    RawServer::send(fd, "--b\r\nContent-Type: text/plain\r\n\r\nmotion=1\r\n");
    RawServer::send(fd, part("no picture"));
    RawServer::send(fd, part("\xFF\xD8 no picture either \xFF\xD9"));
    RawServer::send(fd, part(std::string(100'000, 'x')));
    RawServer::send(fd, part(jpeg));
    server.stay_silent(fd);
  });
  MjpegSourceOptions options = options_for(server);
  options.max_pixels = 96 * 64;
  const auto source = open_mjpeg(options);
  Frame frame;
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
  EXPECT_EQ(frame.stamp.frame, 0);
  EXPECT_NEAR(grey_of(frame), MjpegServer::grey_of(3), kGreyTolerance);
  EXPECT_EQ(source->counters().damaged, 4);
}

TEST(MjpegSource, TakesAPictureThatIsShorterThanTold) {
  const std::string whole = part(MjpegServer::picture(1));
  const std::string jpeg = MjpegServer::picture(3);
  RawServer server([&](int fd) {
    if (!server.read_request(fd)) return;
    RawServer::send(fd, stream_head() + whole + "--b\r\nContent-Length: " +
                            std::to_string(jpeg.size() + 100'000) + "\r\n\r\n" + jpeg);
    // All but the delimiter has come when that is what the source waits for.
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    RawServer::send(fd, "\r\n--b\r\n");
    server.stay_silent(fd);
  });
  const auto source = open_mjpeg(options_for(server));
  Frame frame;
  for (const int number : {1, 3}) {
    ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
    EXPECT_NEAR(grey_of(frame), MjpegServer::grey_of(number), kGreyTolerance);
  }
}

TEST(MjpegSource, ReportsPicturesThatAreAllDamaged) {
  const std::string jpeg = MjpegServer::picture(0);
  const std::string half = jpeg.substr(0, jpeg.size() / 2) + "\xFF\xD9";
  RawServer server([&](int fd) {
    if (server.read_request(fd) && RawServer::send(fd, stream_head())) {
      while (!server.closing() && RawServer::send(fd, part(half))) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
  });
  const auto source = open_mjpeg(options_for(server));
  Frame frame;
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("30 pictures in a row cannot be used"));
  EXPECT_THAT(source->error(), HasSubstr("damaged JPEG"));
}

TEST(MjpegSource, GivesUpAConnectionWithoutAnAnswer) {
  RawServer server([&server](int fd) { server.stay_silent(fd); });
  MjpegSourceOptions options = options_for(server);
  options.timeout_s = 0.05;
  const auto source = open_mjpeg(options);
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("no answer within 50 ms"));
}

TEST(MjpegSource, GivesUpAStreamInWhichNoPictureEnds) {
  RawServer server([&server](int fd) {
    if (server.read_request(fd) && RawServer::send(fd, stream_head())) {
      while (!server.closing() && RawServer::send(fd, "x")) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
  });
  MjpegSourceOptions options = options_for(server);
  options.timeout_s = 0.2;
  const auto source = open_mjpeg(options);
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("no whole picture within 200 ms"));
}

TEST(MjpegSource, DropsTheOldestPicturesWhenTheReaderIsSlow) {
  const MjpegServer server;
  const auto source = open_mjpeg(options_for(server.url()));
  Frame frame;
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk);
  ASSERT_TRUE(eventually([&] { return source->counters().dropped >= 10; }));
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk);
  EXPECT_EQ(frame.stamp.frame, 1);
  EXPECT_GE(frame.stamp.receive_time_s, server.sent(11).before_first_s);
}

TEST(MjpegSource, KeepsABoundedNumberOfPicturesAndReportsWhenNobodyReads) {
  const std::string jpeg = MjpegServer::picture(0);
  RawServer server([&](int fd) {
    if (server.read_request(fd)) {
      RawServer::send(fd, stream_head() + part(jpeg));
    }
  });
  const auto source = open_mjpeg(options_for(server));
  Frame frame;
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
  ASSERT_TRUE(eventually([&] { return source->counters().dropped >= 100; }));
  ReadStatus before = ReadStatus::kOk;
  for (int i = 0; i < 20; ++i) {  // all from the queue
    const ReadStatus status = source->read(frame, kDeadline_s);
    ASSERT_TRUE(status == ReadStatus::kOk || status == ReadStatus::kDisconnected);
    EXPECT_TRUE(status == ReadStatus::kOk || before == ReadStatus::kOk) << "two reports in a row";
    EXPECT_TRUE(status != ReadStatus::kOk || i == 0 || frame.stamp.restarted);
    before = status;
  }
}

TEST(MjpegSource, CopiesThePicturesOverReconnections) {
  const TemporaryDirectory directory;
  std::string error;
  MjpegServer server;
  MjpegSourceOptions options = options_for(server.url());
  options.decode = false;
  {
    RecordingCopy copy(directory.path());
    const auto source = open_mjpeg(options);
    ASSERT_TRUE(source->keep_stream(true));
    Frame frame;
    for (int i = 0; i < 10; ++i) {
      ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kOk) << source->error();
      EXPECT_EQ(frame.luma, nullptr);
      EXPECT_FALSE(frame.decode_s);
      EXPECT_EQ(frame.width, MjpegServer::kWidth);
      ASSERT_TRUE(copy.add(frame, &error)) << error;
    }
    server.hang_up = true;
    ASSERT_TRUE(eventually([&] {
      const ReadStatus status = source->read(frame, 0);
      if (status == ReadStatus::kOk) {
        EXPECT_TRUE(copy.add(frame, &error)) << error;
      }
      return status == ReadStatus::kDisconnected;
    }));
    server.hang_up = false;
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk);
    ASSERT_TRUE(copy.add(frame, &error)) << error;
  }
  RecordingFrameSourceOptions recorded;
  recorded.directory = directory.path();
  const auto recording = open_recorded_frames(recorded);
  Frame frame;
  int frames = 0;
  for (; recording->read(frame, 0) == ReadStatus::kOk; ++frames) {
    EXPECT_NEAR(grey_of(frame), MjpegServer::grey_of(frames), kGreyTolerance);
  }
  EXPECT_GE(frames, 11);
  EXPECT_EQ(recording->missing_frames(), 0);
}

// One of another size in mid-stream cannot be in a recording, and ends neither it nor the program.
TEST(MjpegSource, GivesUpAConnectionWhosePictureDoesNotFitARecording) {
  const TemporaryDirectory directory;
  RawServer server([&server](int fd) {
    if (!server.read_request(fd)) return;
    RawServer::send(fd, stream_head());
    const auto send = [&](const std::string& picture) {
      RawServer::send(fd, "--b\r\nContent-Length: " + std::to_string(picture.size()) + "\r\n\r\n" +
                              picture + "\r\n");
    };
    send(MjpegServer::picture(1));
    if (server.connections() == 1) send(picture_file("mjpeg", 32, 16, 100));
    server.stay_silent(fd);
  });
  MjpegSourceOptions options = options_for(server);
  RecordingCopy copy(directory.path());
  const auto source = open_mjpeg(options);
  ASSERT_TRUE(source->keep_stream(true));
  Frame frame;
  std::string error;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  ASSERT_EQ(copy.fault_of(frame), "");
  ASSERT_TRUE(copy.add(frame, &error)) << error;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_THAT(copy.fault_of(frame), HasSubstr("video.mkv began as mjpeg of 96x64"));
  ASSERT_TRUE(source->refuse(copy.fault_of(frame)));
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("video.mkv began as mjpeg of 96x64"));
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_EQ(frame.width, MjpegServer::kWidth);
  EXPECT_EQ(copy.fault_of(frame), "");
}

TEST(MjpegSource, StopEndsAReadThatGetsNoAnswer) {
  RawServer server([&server](int fd) { server.stay_silent(fd); });
  const auto source = open_mjpeg(options_for(server));
  Frame frame;
  EXPECT_EQ(server.status_when_stopped(*source, frame), ReadStatus::kStopped);
}

TEST(MjpegSource, StopEndsAPause) {
  MjpegSourceOptions options = options_for("http://127.0.0.1:" + std::to_string(unused_port()));
  options.max_backoff_s = kNever_s;
  const auto source = open_mjpeg(options);
  Frame frame;
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kDisconnected);
  std::thread stopper([&] { source->stop(); });
  ReadStatus status = ReadStatus::kDisconnected;
  while (status == ReadStatus::kDisconnected) {
    status = source->read(frame, kNever_s);
  }
  EXPECT_EQ(status, ReadStatus::kStopped);
  stopper.join();
}

TEST(JpegDecoder, TellsWholePicturesFromCutOffOnes) {
  const std::string jpeg = picture_file("mjpeg", 50, 34, 100);
  JpegDecoder decoder;
  Picture picture;
  ASSERT_TRUE(decoder.decode(jpeg, &picture)) << decoder.error();
  EXPECT_EQ(picture.width, 50);
  EXPECT_EQ(picture.height, 34);
  EXPECT_NEAR(picture.luma[33 * picture.stride + 49], 100, kGreyTolerance);
  for (std::size_t size = 0; size + 2 < jpeg.size(); ++size) {
    EXPECT_FALSE(decoder.decode(jpeg.substr(0, size), &picture)) << size;
    EXPECT_THAT(decoder.error(), Not(HasSubstr("\n")));
    ASSERT_TRUE(decoder.decode(jpeg, &picture)) << "after one of " << size << " bytes";
  }
}

TEST(JpegDecoder, ForgivesBytesTooManyBeforeTheEndMarker) {
  std::string jpeg = picture_file("mjpeg", 50, 34, 100);
  jpeg.insert(jpeg.size() - 2, "  ");
  JpegDecoder decoder;
  Picture picture;
  EXPECT_TRUE(decoder.decode(jpeg, &picture)) << decoder.error();
}

TEST(JpegDecoder, RefusesASizeThatNoCameraHas) {
  std::string jpeg = picture_file("mjpeg", 48, 32, 100);
  const std::size_t frame_header = jpeg.find("\xFF\xC0");
  ASSERT_NE(frame_header, std::string::npos);
  jpeg.replace(frame_header + 5, 4, "\xFF\x00\xFF\x00", 4);
  JpegDecoder decoder;
  Picture picture;
  EXPECT_FALSE(decoder.decode(jpeg, &picture));
  EXPECT_THAT(decoder.error(), HasSubstr("65280x65280"));
}

}  // namespace
}  // namespace alidade
