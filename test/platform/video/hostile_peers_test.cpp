// Cameras, and who stands between, that never come to an end: each link is lost in its time, is made again, and can be
// stopped whatever state the other side is in. No picture asks for more memory than the configured one. And who sends datagrams to a port that is not meant for him.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "platform/video/mjpeg_source.h"
#include "platform/video/rtp_source.h"
#include "platform/video/rtsp_framing.h"
#include "platform/video/udp_senders.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/mjpeg_server.h"
#include "test/platform/support/scripted_rtsp_server.h"
#include "test/simulator/servers/digest_check.h"
#include "test/support/temporary_directory.h"
#include "test/support/udp_port_pair.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kOptionsAnswer = "RTSP/1.0 200 OK\r\nCSeq: 1\r\n\r\n";
constexpr const char* kPart =
    "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=b\r\n\r\n--b\r\n";

// What it sends: `first` to the request, `then` to the next one, if that is to come; after that `drop`, again and again.
struct Peer {
  const char* name;
  const char* scheme;
  std::string first;
  std::string then;  // empty: there is no other
  std::string drop;
  const char* says;
};

void PrintTo(const Peer& peer, std::ostream* out) { *out << peer.name; }

class PeerWithoutEnd : public ::testing::TestWithParam<Peer> {
 protected:
  std::unique_ptr<FrameSource> open(double timeout_s) const {
    const std::string url =
        std::string(GetParam().scheme) + "://127.0.0.1:" + std::to_string(server_.port()) + "/x";
    if (url.rfind("http", 0) == 0) {
      MjpegSourceOptions options;
      options.url = url;
      options.timeout_s = timeout_s;
      options.max_backoff_s = 0.01;
      return open_mjpeg(options);
    }
    RtpSourceOptions options;
    options.url = url;
    options.timeout_s = timeout_s;
    options.max_backoff_s = 0.01;
    return open_rtp(options);
  }

  void serve(int fd) const {
    const Peer& peer = GetParam();
    const bool speaks_tls = std::string(peer.scheme).back() == 's';
    char byte = 0;
    if (speaks_tls ? ::recv(fd, &byte, 1, MSG_PEEK) != 1 : !server_.read_request(fd)) return;
    if (!RawServer::send(fd, peer.first)) return;
    if (!peer.then.empty() && (!server_.read_request(fd) || !RawServer::send(fd, peer.then))) {
      return;
    }
    pollfd pace{-1, 0, 0};
    while (!server_.closing() && RawServer::send(fd, peer.drop)) ::poll(&pace, 1, 2);
  }

  RawServer server_{[this](int fd) { serve(fd); }};
};

const std::string kTlsRecord("\x16\x03\x03\x40\x00", 5);  // of 16 KB, part of a greeting

INSTANTIATE_TEST_SUITE_P(
    , PeerWithoutEnd,
    ::testing::Values(
        Peer{"RtspAnswerThatDrips", "rtsp", "RTSP/1.0 200 OK\r\nX: ", "", "y",
             "nothing received for"},
        Peer{"RtspDescriptionThatDrips", "rtsp", kOptionsAnswer,
             "RTSP/1.0 200 OK\r\nCSeq: 2\r\nContent-Length: 9000\r\n\r\nv=0\r\n", "s",
             "nothing received for"},
        Peer{"RtspHeadersWithoutEnd", "rtsp", "RTSP/1.0 200 OK\r\n", "",
             "X: " + std::string(7997, 'y') + "\r\n", "the camera's answer is longer than 64 KB"},
        Peer{"RtspRequestsWithoutEnd", "rtsp", kOptionsAnswer,
             "OPTIONS * RTSP/1.0\r\nCSeq: 7\r\n\r\n", "OPTIONS * RTSP/1.0\r\nCSeq: 8\r\n\r\n",
             "nothing received for"},
        Peer{"TlsGreetingThatDrips", "rtsps", kTlsRecord, "", "y", "nothing received for"},
        Peer{"HttpAnswerThatDrips", "http", "HTTP/1.0 200 OK\r\nX: ", "", "y", "no answer within"},
        Peer{"HttpHeadersWithoutEnd", "http", "HTTP/1.0 200 OK\r\n", "",
             "X: " + std::string(7997, 'y') + "\r\n", "headers are longer than 64 KB"},
        Peer{"HttpsGreetingThatDrips", "https", kTlsRecord, "", "y", "no answer within"},
        Peer{"MjpegPartThatDrips", "http", kPart, "", "y", "bytes come, but no whole picture"}),
    [](const auto& which) { return which.param.name; });

TEST_P(PeerWithoutEnd, IsLostAndTriedAgain) {
  const auto source = open(0.3);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr(GetParam().says));
  EXPECT_TRUE(eventually([&] { return server_.connections() >= 2; }));
}

TEST_P(PeerWithoutEnd, IsStoppedAtOnce) {
  const auto source = open(kNever_s);
  Frame frame;
  EXPECT_EQ(server_.status_when_stopped(*source, frame), ReadStatus::kStopped);
}

// After some video.
class VideoWithoutEnd : public ::testing::TestWithParam<bool> {
 protected:
  // A packet's head, and then a byte in place of each packet; or each picture without its end.
  VideoWithoutEnd() {
    if (GetParam()) {
      server_.change_bytes = [](std::int64_t packet, std::string* bytes) {
        if (packet == 50) *bytes = std::string("$\0\xff\xff\x80", 5);
        if (packet > 50) *bytes = "y";
      };
    } else {
      server_.change_packets = [](std::int64_t picture, RtpRelay::Packets* packets) {
        if (picture > 10) packets->resize(1);
        if (picture > 10) packets->front()[1] &= 0x7FU;
      };
    }
    options_.url = server_.url();
    options_.timeout_s = 0.5;
    options_.max_backoff_s = 0.01;
  }

  ScriptedRtspServer server_;
  RtpSourceOptions options_;
};

INSTANTIATE_TEST_SUITE_P(, VideoWithoutEnd, ::testing::Bool(), [](const auto& which) {
  return which.param ? "PacketThatDrips" : "PicturesWithoutEnds";
});

TEST_P(VideoWithoutEnd, IsLostAndComesAgain) {
  const auto source = open_rtp(options_);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr(" for 0.5 s"));
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_TRUE(frame.stamp.restarted);
}

TEST_P(VideoWithoutEnd, IsStoppedAtOnce) {
  options_.timeout_s = kNever_s;
  const auto source = open_rtp(options_);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  while (source->read(frame, 0.5) == ReadStatus::kOk) {
  }
  source->stop();
  EXPECT_EQ(source->read(frame, kNever_s), ReadStatus::kStopped);
}

TEST(RtspAnswerTooLong, IsRefusedByWhatItSaysOfItself) {
  for (const char* length :
       {"65536", "3999999999", "18446744073709551615", "99999999999999999999999"}) {
    const ScriptedRtspServer server([&](const RtspRequest& request, RtspAnswer* answer) {
      if (request.method == "DESCRIBE") {
        answer->headers = "Content-Length: " + std::string(length) + "\r\n";
      }
    });
    RtpSourceOptions options;
    options.url = server.url();
    options.timeout_s = kNever_s;
    const auto source = open_rtp(options);
    Frame frame;
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), HasSubstr("the camera's answer is longer than 64 KB"));
  }
}

// The next frame of plain RTP, pictures of which are sent until it comes.
ReadStatus next_by_rtp(FrameSource& source, RtpSender& sender, Frame& frame) {
  ReadStatus status = ReadStatus::kTimeout;
  for (const double end_s = monotonic_now_s() + kDeadline_s;
       status == ReadStatus::kTimeout && monotonic_now_s() < end_s;) {
    sender.send();
    status = source.read(frame, 0.02);
  }
  return status;
}

class PictureSize : public ::testing::TestWithParam<RtpSender::Codec> {};
INSTANTIATE_TEST_SUITE_P(, PictureSize,
                         ::testing::Values(RtpSender::Codec::kH264, RtpSender::Codec::kH265),
                         ::testing::PrintToStringParamName());

TEST_P(PictureSize, BeyondTheConfiguredOneIsSaidAndNotDecoded) {
  constexpr std::int64_t kPixels = RtpSender::kWidth * RtpSender::kHeight;
  for (const std::int64_t most : {kPixels, kPixels - 1}) {
    const int port = test::udp_port_pair();
    RtpSourceOptions options;
    options.url = "rtp://@:" + std::to_string(port);
    options.format = GetParam() == RtpSender::Codec::kH264 ? "H264" : "H265";
    options.max_pixels = most;
    options.timeout_s = kNever_s;
    const auto source = open_rtp(options);
    Frame frame;
    (void)source->read(frame, 0);
    ASSERT_TRUE(eventually([&] { return rtp_port_taken(port); }));
    RtpSender sender(GetParam(), port);
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(next_by_rtp(*source, sender, frame), ReadStatus::kOk) << source->error();
      EXPECT_EQ(frame.width, RtpSender::kWidth);
      EXPECT_EQ(frame.height, RtpSender::kHeight);
      EXPECT_EQ(frame.luma != nullptr, most == kPixels);
    }
  }
}

TEST(PictureSizeOfMjpeg, BeyondTheConfiguredOneIsSaidAndNotDecoded) {
  const MjpegServer server;
  for (const bool fits : {true, false}) {
    MjpegSourceOptions options;
    options.url = server.url();
    options.max_pixels = MjpegServer::kWidth * MjpegServer::kHeight - (fits ? 0 : 1);
    const auto source = open_mjpeg(options);
    Frame frame;
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_EQ(frame.width, MjpegServer::kWidth);
    EXPECT_EQ(frame.height, MjpegServer::kHeight);
    EXPECT_EQ(frame.luma != nullptr, fits);
  }
}

// A socket of somebody else on this machine.
class Stranger {
 public:
  Stranger() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK + 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Stranger() { ::close(socket_); }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  void send(int port, const std::vector<std::uint8_t>& bytes) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    (void)::sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to),
                   sizeof to);
  }

 private:
  int socket_;
};

// The camera's own packets, damaged: the worst that can come.
TEST(RtspByUdp, TakesPacketsOfTheCamerasAddressOnly) {
  std::atomic<int> port{0};
  const Stranger stranger;
  ScriptedRtspServer server([&](const RtspRequest& request, RtspAnswer*) {
    if (request.method != "SETUP") return;
    const std::string transport = header_of(request.text, "Transport");
    port = std::stoi(transport.substr(transport.find("client_port=") + 12));
  });
  server.change_packets = [&](std::int64_t, RtpRelay::Packets* packets) {
    RtpRelay::Packet forged = packets->front();
    for (std::size_t i = 12; i < forged.size(); ++i) forged[i] ^= 0x5AU;
    stranger.send(port, forged);
    forged[1] = 203;  // RTCP: the sender says good-bye
    stranger.send(port + 1, forged);
  };
  RtpSourceOptions options;
  options.url = server.url();
  options.transport = RtpSourceOptions::Transport::kUdp;
  options.timeout_s = kNever_s;
  const auto source = open_rtp(options);
  Frame frame;
  for (int i = 0; i < 40; ++i) {
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    ASSERT_NEAR(frame.luma[0], RtpSender::grey_of(i), 3) << i;
  }
  EXPECT_EQ(source->counters().damaged, 0);
  EXPECT_GE(source->counters().foreign_packets, 40);
  EXPECT_THAT(source->remark(), HasSubstr("another address (127.0.0.2 in place of 127.0.0.1)"));
}

TEST(RtspByUdp, SaysWhoSendsWhereTheCameraDoesNot) {
  std::atomic<int> port{0};
  const Stranger stranger;
  ScriptedRtspServer server([&](const RtspRequest& request, RtspAnswer*) {
    if (request.method != "SETUP") return;
    const std::string transport = header_of(request.text, "Transport");
    port = std::stoi(transport.substr(transport.find("client_port=") + 12));
  });
  server.change_packets = [&](std::int64_t, RtpRelay::Packets* packets) {
    for (const RtpRelay::Packet& packet : *packets) stranger.send(port, packet);
    packets->clear();
  };
  RtpSourceOptions options;
  options.url = server.url();
  options.transport = RtpSourceOptions::Transport::kUdp;
  options.timeout_s = 0.5;
  const auto source = open_rtp(options);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(
      source->error(),
      AllOf(HasSubstr("nothing received for 0.5 s"),
            HasSubstr("the packets that come are of another address (127.0.0.2 in place of")));
}

// Which of two has the filter: of the video, or of the session.
class SourceFilter : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(, SourceFilter, ::testing::Bool());

TEST_P(SourceFilter, OfADescriptionIsKeptTo) {
  const int port = test::udp_port_pair();
  RtpRelay relay(port);
  RtpSender sender(RtpSender::Codec::kMjpeg, relay.port());
  const std::string filter = "a=source-filter: incl IN IP4 * 127.0.0.1\r\n";
  const TemporaryDirectory directory;
  RtpSourceOptions options;
  options.url = directory.write(
      "x.sdp", "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=x\r\nc=IN IP4 127.0.0.1\r\nt=0 0\r\n" +
                   (GetParam() ? "" : filter) + "m=video " + std::to_string(port) +
                   " RTP/AVP 26\r\n" + (GetParam() ? filter : ""));
  options.timeout_s = kNever_s;
  const auto source = open_rtp(options);
  Frame frame;
  (void)source->read(frame, 0);
  ASSERT_TRUE(eventually([&] { return rtp_port_taken(port); }));
  const Stranger stranger;
  for (int i = 0; i < 10; ++i) {
    sender.send();
    relay.forward([&](RtpRelay::Packets& packets) {
      RtpRelay::Packet forged = packets.front();
      for (std::size_t at = 12; at < forged.size(); ++at) forged[at] ^= 0x5AU;
      stranger.send(port, forged);
    });
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_NEAR(frame.luma[0], RtpSender::grey_of(i), 3);
  }
  EXPECT_EQ(source->counters().damaged, 0);
  EXPECT_GE(source->counters().foreign_packets, 10);
}

TEST(SourceFilterOfNames, IsRefused) {
  const TemporaryDirectory directory;
  RtpSourceOptions options;
  options.url =
      directory.write("x.sdp",
                      "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=x\r\nc=IN IP4 127.0.0.1\r\nt=0 0\r\n"
                      "a=source-filter: incl IN * * camera.example\r\nm=video 5004 RTP/AVP 26\r\n");
  const auto source = open_rtp(options);
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(), HasSubstr("source-filter names 'camera.example'; write"));
}

sockaddr_storage ipv6(const std::string& address) {
  sockaddr_storage storage{};
  auto* of_ipv6 = reinterpret_cast<sockaddr_in6*>(&storage);
  of_ipv6->sin6_family = AF_INET6;
  EXPECT_EQ(::inet_pton(AF_INET6, address.c_str(), &of_ipv6->sin6_addr), 1);
  return storage;
}

TEST(UdpSenders, AreKnownByTheirAddresses) {
  UdpSenders senders;
  EXPECT_TRUE(senders.take(ipv6("2001:db8::9")));
  ASSERT_TRUE(senders.add("2001:db8::1"));
  ASSERT_TRUE(senders.add("192.0.2.7"));
  for (const char* none : {"camera", "", "192.0.2", "2001:db8::1%eth0"}) {
    EXPECT_FALSE(senders.add(none)) << none;
  }
  EXPECT_TRUE(senders.take(ipv6("2001:db8:0::1")));
  EXPECT_TRUE(senders.take(ipv6("::ffff:192.0.2.7")));
  EXPECT_EQ(senders.foreign(), 0);
  EXPECT_FALSE(senders.take(ipv6("2001:db8::2")));
  EXPECT_FALSE(senders.take(ipv6("::ffff:192.0.2.8")));
  EXPECT_FALSE(senders.take({}));
  EXPECT_EQ(senders.foreign(), 3);
  EXPECT_EQ(senders.foreign_kind(), "another address (192.0.2.8 in place of 2001:db8::1)");
}

}  // namespace
}  // namespace alidade
