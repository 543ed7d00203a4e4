// RTSP: a real server (gst-rtsp-server) that is killed and started again.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <set>
#include <string>

#include "platform/video/rtp_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/raw_server.h"
#include "test/platform/support/rtsp_server.h"
#include "test/platform/support/test_certificate.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using Transport = RtpSourceOptions::Transport;

RtpSourceOptions options_for(const std::string& url, Transport transport = Transport::kTcp) {
  RtpSourceOptions options;
  options.url = url;
  options.transport = transport;
  options.timeout_s = 10;  // the server needs a moment for its first picture
  options.max_backoff_s = 0.05;
  return options;
}

struct Way {
  const char* name;
  const RtspStream* stream;
  Transport transport;
};

void PrintTo(const Way& way, std::ostream* out) { *out << way.name; }

class RtspSource : public ::testing::TestWithParam<Way> {
 protected:
  RtspServer server_{*GetParam().stream};
  RtpSourceOptions options_ = options_for(server_.url(), GetParam().transport);
};

INSTANTIATE_TEST_SUITE_P(Ways, RtspSource,
                         ::testing::Values(Way{"MjpegTcp", &kMjpegStream, Transport::kTcp},
                                           Way{"MjpegUdp", &kMjpegStream, Transport::kUdp},
                                           Way{"H264Tcp", &kH264Stream, Transport::kTcp},
                                           Way{"H264Udp", &kH264Stream, Transport::kUdp},
                                           Way{"H265Tcp", &kH265Stream, Transport::kTcp},
                                           Way{"H265Udp", &kH265Stream, Transport::kUdp}),
                         [](const auto& way) { return way.param.name; });

TEST_P(RtspSource, DeliversWhitePicturesOnTheSendersClock) {
  const auto source = open_rtp(options_);
  double last_s = -1;
  double utc_offset_s = 0;
  bool utc_known = false;
  int frames = 0;
  while (frames < 30 || !utc_known) {
    Frame frame;
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.stamp.frame, frames++);
    ASSERT_EQ(frame.width, 320);
    ASSERT_EQ(frame.height, 240);
    for (const int v : {0, 120, 239}) {
      for (const int u : {0, 160, 319}) {
        EXPECT_NEAR(frame.luma[v * frame.stride + u], 235, 3);
      }
    }
    ASSERT_TRUE(frame.stamp.sender_time_s);
    if (frame.stamp.frame != kPicturesBeforePlay) {
      EXPECT_GT(*frame.stamp.sender_time_s, last_s);
    }
    last_s = *frame.stamp.sender_time_s;
    if (frame.stamp.sender_utc_s) {
      const double offset_s = *frame.stamp.sender_utc_s - *frame.stamp.sender_time_s;
      if (utc_known) {
        EXPECT_NEAR(offset_s, utc_offset_s, 1);
      }
      utc_offset_s = offset_s;
      utc_known = true;
      const double now_utc_s =
          1e-9 * static_cast<double>(
                     std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch())
                         .count());
      EXPECT_NEAR(*frame.stamp.sender_utc_s, now_utc_s, 60);  // the right epoch
    }
  }
}

TEST_P(RtspSource, PutsPicturesOfManyPacketsTogether) {
  std::string launch = GetParam().stream->launch;
  const std::string white = "pattern=white";
  launch.replace(launch.find(white), white.size(), "pattern=snow");
  const RtspServer server({"/snow", launch});
  const auto source = open_rtp(options_for(server.url(), GetParam().transport));
  Frame frame;
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    std::set<int> greys;
    for (int u = 0; u < frame.width; ++u) {
      greys.insert(frame.luma[(frame.height - 1) * frame.stride + u]);
    }
    EXPECT_GT(greys.size(), 50U) << "the last row, from the last packet";
  }
  EXPECT_EQ(source->counters().damaged, 0);
}

TEST_P(RtspSource, OutlivesAKillAndARestartOfTheServer) {
  const auto source = open_rtp(options_);
  Frame frame;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  }
  const std::int64_t before = frame.stamp.frame;
  server_.kill();
  ReadStatus status = ReadStatus::kOk;
  while (status == ReadStatus::kOk || status == ReadStatus::kTimeout) {
    status = source->read(frame, kDeadline_s);
  }
  ASSERT_EQ(status, ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), StartsWith(server_.url() + ": "));
  server_.restart();
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(frame.stamp.restarted);
  EXPECT_GT(frame.stamp.frame, before);
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_FALSE(frame.stamp.restarted);
}

TEST(RtspSourceLogin, TakesAPasswordOfAnyCharacters) {
  const RtspServer server(kMjpegStream, "user", "p@s/w%rd? &x");
  RtpSourceOptions options = options_for(server.url());
  options.user = "user";
  options.password = "p@s/w%rd? &x";
  const auto source = open_rtp(options);
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
}

TEST(RtspSourceLogin, FailsForGoodOnAWrongPasswordAndDoesNotShowIt) {
  const RtspServer server(kMjpegStream, "user", "secret");
  RtpSourceOptions options = options_for(server.url());
  options.url.replace(0, 7, "rtsp://user:guess@");
  const auto source = open_rtp(options);
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_EQ(source->error(), server.url() + ": wrong user or password (401)");
  EXPECT_EQ(source->name(), server.url());
  EXPECT_EQ(source->read(frame, 0), ReadStatus::kFailed);

  const auto anonymous = open_rtp(options_for(server.url()));
  EXPECT_EQ(read_until(*anonymous, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(anonymous->error(), HasSubstr("the camera wants a user and a password (401)"));
}

// A camera that speaks TLS, with a certificate that it signed itself.
class RtspSourceOverTls : public ::testing::Test {
 protected:
  RtpSourceOptions options(const std::string& certificate) const {
    RtpSourceOptions result = options_for(server_.url());
    result.certificate_file = certificate.empty() ? "" : directory_.path() + "/" + certificate;
    return result;
  }
  // Writes NAME (the certificate) and its key together as NAME.pair.
  std::string write_certificate(const std::string& name, const std::string& host, int days) const {
    const TestCertificate made = make_certificate(host, days);
    directory_.write(name, made.certificate);
    directory_.write(name + ".pair", made.certificate + made.key);
    return directory_.path() + "/" + name + ".pair";
  }
  void expect_pictures(const RtpSourceOptions& of) const {
    const auto source = open_rtp(of);
    Frame frame;
    for (int i = 0; i < 10; ++i) {
      ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
      EXPECT_EQ(frame.stamp.frame, i);
      EXPECT_NEAR(frame.luma[0], 235, 3);
    }
    EXPECT_EQ(source->counters().damaged, 0);
  }

  TemporaryDirectory directory_;
  RtspServer server_{kH265Stream, "", "", write_certificate("camera.pem", "127.0.0.1", 1)};
};

TEST_F(RtspSourceOverTls, TrustsTheCertificateThatItIsGiven) {
  expect_pictures(options("camera.pem"));
}

TEST_F(RtspSourceOverTls, TrustsTheCamerasOwnWhateverNameAndDatesStandInIt) {
  const RtspServer other(kMjpegStream, "user", "secret",
                         write_certificate("old.pem", "camera.example", -1));
  RtpSourceOptions of = options("old.pem");
  of.url = other.url();
  of.user = "user";
  of.password = "secret";
  expect_pictures(of);
}

TEST_F(RtspSourceOverTls, GivesEachPictureAsItComes) {
  const auto source = open_rtp(options("camera.pem"));
  Frame frame;
  // One record of TLS may hold several packets: none waits in it for the next.
  for (int i = 0; i < 60; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.stamp.frame, i);
  }
  EXPECT_EQ(source->counters().dropped, 0);
}

TEST_F(RtspSourceOverTls, RefusesACertificateThatNobodyKnows) {
  (void)write_certificate("same_name.pem", "127.0.0.1", 1);
  (void)write_certificate("other_name.pem", "camera.example", 1);
  for (const char* known : {"", "same_name.pem", "other_name.pem"}) {
    const RtpSourceOptions of = options(known);
    const auto source = open_rtp(of);
    Frame frame;
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
    const std::string why =
        of.certificate_file.empty()
            ? "no authority that is known here has signed it"
            : "it is neither in " + of.certificate_file + " nor signed by what is";
    EXPECT_EQ(source->error(),
              server_.url() + ": the camera's certificate is refused: " + why +
                  "; if it is the camera's, save it as a PEM file and set certificate_file");
  }
}

TEST_F(RtspSourceOverTls, NamesAFileWithoutCertificates) {
  directory_.write("empty.pem", "no certificate");
  for (const char* name : {"empty.pem", "none.pem"}) {
    const auto source = open_rtp(options(name));
    Frame frame;
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
    EXPECT_THAT(source->error(), HasSubstr(std::string(name) + ": no certificates in PEM form"));
  }
}

TEST_F(RtspSourceOverTls, NamesAServerWithoutTlsAndOneThatIsNotThere) {
  const RtspServer plain(kMjpegStream);
  RtpSourceOptions of = options("camera.pem");
  of.url = "rtsps" + plain.url().substr(4);
  Frame frame;
  const auto without = open_rtp(of);
  EXPECT_EQ(read_until(*without, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(without->error(), HasSubstr("the camera answers, but speaks no TLS there"));
  of.url = "rtsps://127.0.0.1:" + std::to_string(unused_port()) + "/x";
  const auto refused = open_rtp(of);
  EXPECT_EQ(read_until(*refused, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(refused->error(), HasSubstr("Connection refused"));
}

TEST_F(RtspSourceOverTls, OutlivesAKillAndARestartOfTheServer) {
  const auto source = open_rtp(options("camera.pem"));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  server_.kill();
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  server_.restart();
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(frame.stamp.restarted);
}

TEST_F(RtspSourceOverTls, StopsWhileNobodyAnswersItsGreeting) {
  RawServer server([&server](int fd) { server.stay_silent(fd); });
  RtpSourceOptions of = options("camera.pem");
  of.url = "rtsps://127.0.0.1:" + std::to_string(server.port()) + "/x";
  of.timeout_s = kNever_s;
  const auto source = open_rtp(of);
  Frame frame;
  EXPECT_EQ(server.status_when_stopped(*source, frame), ReadStatus::kStopped);
}

TEST(RtspSourceErrors, NameAStreamThatIsNotThere) {
  const RtspServer server(kMjpegStream);
  const auto source = open_rtp(options_for(server.url() + "/none"));
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("/none: no such stream on this camera (404)"));
}

TEST(RtspSourceErrors, NameARefusedConnectionAndTryAgain) {
  RtpSourceOptions options =
      options_for("rtsp://user:secret@127.0.0.1:" + std::to_string(unused_port()) + "/x");
  const auto source = open_rtp(options);
  Frame frame;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), AllOf(HasSubstr("Connection refused"), Not(HasSubstr("secret"))));
  }
}

TEST(RtspSourceErrors, NameASilentServer) {
  RawServer server([&server](int fd) { server.stay_silent(fd); });
  RtpSourceOptions options =
      options_for("rtsp://127.0.0.1:" + std::to_string(server.port()) + "/x");
  options.timeout_s = 0.2;
  const auto source = open_rtp(options);
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("nothing received for 0.2 s"));
}

TEST(RtspSourceErrors, NameACodecThatIsNotSupported) {
  const RtspServer server(
      {"/vp8", std::string(kWhitePictures) + "vp8enc deadline=1 ! rtpvp8pay name=pay0 pt=96"});
  const auto source = open_rtp(options_for(server.url()));
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(),
              HasSubstr("the video is vp8; set the camera to MJPEG, H.264 or H.265"));
}

TEST(RtspSourceErrors, NameAStreamWithoutVideo) {
  const RtspServer server({"/sound",
                           "audiotestsrc is-live=true ! alawenc ! "
                           "rtppcmapay name=pay0 pt=8"});
  const auto source = open_rtp(options_for(server.url()));
  Frame frame;
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(), HasSubstr("there is no video in this stream"));
}

TEST(RtspSourceErrors, NameBFrames) {
  const std::string pictures =
      "videotestsrc is-live=true pattern=ball ! "
      "video/x-raw,format=I420,width=320,height=240,framerate=30/1 ! ";
  const struct {
    const char* encoder;
    const char* says;
  } cases[] = {{"x264enc bframes=2 b-adapt=false rc-lookahead=0 key-int-max=30 ! "
                "video/x-h264,profile=main ! rtph264pay config-interval=1 name=pay0 pt=96",
                "the H.264 stream has B-frames"},
               {"x265enc speed-preset=ultrafast key-int-max=30 "
                "option-string=log-level=none:bframes=2:b-adapt=0:rc-lookahead=3 ! "
                "rtph265pay config-interval=1 name=pay0 pt=96",
                "the H.265 stream has B-frames"}};
  for (const auto& which : cases) {
    const RtspServer server({"/b", pictures + which.encoder});
    const auto source = open_rtp(options_for(server.url()));
    Frame frame;
    // Behind pictures that can be used: from then on nothing that comes is for good.
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), HasSubstr(which.says));
  }
}

// A relay that takes the camera's stream apart and sends it on, and begins where that is.
TEST(RtspSourceStream, ComesThroughARelay) {
  const struct {
    const RtspStream& stream;
    const char* relay;
  } cases[] = {{kH264Stream, "rtph264depay ! rtph264pay config-interval=-1 name=pay0 pt=96"},
               {kH265Stream, "rtph265depay ! rtph265pay config-interval=-1 name=pay0 pt=96"}};
  for (const auto& which : cases) {
    RtspServer camera(which.stream);
    const RtspServer relay({"/relay", "rtspsrc latency=0 protocols=tcp location=" + camera.url() +
                                          " ! " + which.relay});
    const auto source = open_rtp(options_for(relay.url()));
    Frame frame;
    for (int i = 0; i < 30; ++i) {
      ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
      EXPECT_EQ(frame.stamp.frame, i);
      ASSERT_NE(frame.luma, nullptr);
      EXPECT_NEAR(frame.luma[0], 235, 3);
    }
    EXPECT_EQ(source->counters().damaged, 0);
  }
}

TEST(RtspSourceStream, TellsInterlacedCoding) {
  for (const bool interlaced : {false, true}) {
    const RtspServer server(
        {"/fields", std::string(kWhitePictures) +
                        (interlaced ? "capssetter caps=video/x-raw,interlace-mode=interleaved ! "
                                      "x264enc interlaced=true "
                                    : "x264enc ") +
                        "tune=zerolatency speed-preset=ultrafast key-int-max=10 ! "
                        "rtph264pay config-interval=1 name=pay0 pt=96"});
    const auto source = open_rtp(options_for(server.url()));
    Frame frame;
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.interlaced, interlaced);
  }
}

TEST(RtspSourceStream, KeepsTheVideosClockWhenThereIsSoundToo) {
  const RtspServer server(
      {"/both",
       kMjpegStream.launch + " audiotestsrc is-live=true ! alawenc ! rtppcmapay name=pay1 pt=8"});
  const auto source = open_rtp(options_for(server.url()));
  Frame frame;
  bool utc_known = false;
  double last_s = -1;
  int after_report = 0;
  while (after_report < 10) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    if (frame.stamp.frame > kPicturesBeforePlay) {
      EXPECT_GT(*frame.stamp.sender_time_s, last_s);
      EXPECT_LT(*frame.stamp.sender_time_s, last_s + 1000);
    }
    last_s = *frame.stamp.sender_time_s;
    utc_known = utc_known || frame.stamp.sender_utc_s.has_value();
    after_report += utc_known ? 1 : 0;
  }
}

TEST(RtspSourceStop, EndsAConnectionThatIsNotAnswered) {
  RawServer server([&server](int fd) { server.stay_silent(fd); });
  RtpSourceOptions options =
      options_for("rtsp://127.0.0.1:" + std::to_string(server.port()) + "/x");
  options.timeout_s = kNever_s;
  const auto source = open_rtp(options);
  Frame frame;
  EXPECT_EQ(server.status_when_stopped(*source, frame), ReadStatus::kStopped);
}

TEST(RtspSourceStop, LeaksNoFileDescriptorOverManyReconnections) {
  RawServer server([](int fd) { RawServer::reset(fd); });
  RtpSourceOptions options =
      options_for("rtsp://127.0.0.1:" + std::to_string(server.port()) + "/x");
  options.max_backoff_s = 0.001;
  const auto source = open_rtp(options);
  Frame frame;
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                         std::filesystem::directory_iterator());
  };
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  const auto before = open_files();
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  }
  EXPECT_LE(open_files(), before + 3);  // a connection may be under way at both ends
}

}  // namespace
}  // namespace alidade
