// The video server seen by a client that shares no code with it: libavformat over real sockets.
#include "test/simulator/servers/video_server.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <ostream>
#include <thread>
#include <tuple>

#include "test/simulator/servers/av_client.h"
#include "test/simulator/servers/encoder.h"
#include "test/support/udp_port_pair.h"

extern "C" {
#include <libavutil/error.h>
}

namespace alidade {

using Codec = VideoServerOptions::Codec;

// GoogleTest prints parameters with these.
static void PrintTo(Codec codec, std::ostream* out) {
  *out << (codec == Codec::kMjpeg ? "Mjpeg" : codec == Codec::kH264 ? "H264" : "H265");
}

static void PrintTo(Transport transport, std::ostream* out) {
  *out << (transport == Transport::kTcp   ? "RtspTcp"
           : transport == Transport::kUdp ? "RtspUdp"
                                          : "PlainRtp");
}

namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kRateHz = 50;

// The IDR interval of VideoEncoder at kRateHz.
constexpr int kFramesPerIdr = 50;

bool wait_until(const std::function<bool()>& condition) {
  const double deadline_s = monotonic_s() + AvClient::kDeadlineS;
  while (!condition()) {
    if (monotonic_s() > deadline_s) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

VideoServerOptions options_for(Codec codec) {
  VideoServerOptions options;
  options.codec = codec;
  options.width = kWidth;
  options.height = kHeight;
  options.rate_hz = kRateHz;
  return options;
}

std::string url_of(const VideoServer& server, const std::string& login = "") {
  return "rtsp://" + login + "127.0.0.1:" + std::to_string(server.port()) + "/video";
}

// Pushes frames 0, 1, 2, ... at kRateHz from a thread of its own and remembers when each was taken.
class Camera {
 public:
  Camera(VideoServer& server, const VideoServerOptions& options)
      : server_(server), options_(options), thread_([this] { run(); }) {}

  ~Camera() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  double capture_time_s(int number) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return capture_time_s_.at(static_cast<std::size_t>(number));
  }

  int frames() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return static_cast<int>(capture_time_s_.size());
  }

  // From now on no more than kMaxAhead frames follow the one told last.
  void received(int number) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      received_ = number;
    }
    changed_.notify_all();
  }

 private:
  // Fewer than the server queues, so that it need not drop any on a slow machine.
  static constexpr int kMaxAhead = 5;

  void run() {
    VideoEncoder encoder;
    std::string error;
    const bool jpeg = options_.codec == Codec::kMjpeg;
    const auto standard = options_.codec == Codec::kH265 ? VideoEncoder::Standard::kH265
                                                         : VideoEncoder::Standard::kH264;
    if (!jpeg && !encoder.open(standard, options_.width, options_.height, kRateHz, &error)) {
      std::abort();
    }
    std::unique_lock<std::mutex> lock(mutex_);
    while (!stopping_) {
      const int number = static_cast<int>(capture_time_s_.size());
      const double capture_time_s = monotonic_s();
      capture_time_s_.push_back(capture_time_s);
      lock.unlock();
      const auto picture = numbered_picture(options_.width, options_.height, number);
      const auto frame =
          jpeg ? encode_jpeg(picture.data(), options_.width, options_.height, options_.width, 100)
               : encoder.encode(picture.data(), options_.width, false);
      server_.push(frame.data(), frame.size(), capture_time_s);
      lock.lock();
      changed_.wait_for(lock, std::chrono::duration<double>(1 / kRateHz),
                        [this] { return stopping_; });
      changed_.wait(lock, [this, number] {
        return stopping_ || received_ < 0 || number - received_ < kMaxAhead;
      });
    }
  }

  VideoServer& server_;
  const VideoServerOptions options_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  int received_ = -1;
  std::vector<double> capture_time_s_;
  std::thread thread_;
};

class VideoServerStream : public testing::TestWithParam<std::tuple<Codec, Transport>> {
 protected:
  void SetUp() override {
    const auto [codec, transport] = GetParam();
    options_ = options_for(codec);
    if (transport == Transport::kPlainRtp) {
      options_.rtp_port = test::udp_port_pair();
      options_.sdp_file =
          testing::TempDir() + "video_server_test_" + std::to_string(options_.rtp_port) + ".sdp";
    }
  }

  void TearDown() override {
    if (!options_.sdp_file.empty()) std::remove(options_.sdp_file.c_str());
  }

  int open(const VideoServer& server, AvClient& client) const {
    const Transport transport = std::get<Transport>(GetParam());
    return client.open(transport == Transport::kPlainRtp ? options_.sdp_file : url_of(server),
                       transport);
  }

  VideoServerOptions options_;
};

TEST_P(VideoServerStream, TellsTheUtcOfEachFramesCapture) {
  VideoServer server(options_);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  Camera camera(server, options_);
  AvClient client;
  ASSERT_EQ(open(server, client), 0);
  constexpr int kFrames = 40;
  // One tick of the RTP clock is 11 us, libav's start time is rounded to 1 us; the rest is room for
  // the two readings of the clocks' offset, the server's and the test's.
  constexpr double kToleranceS = 200e-6;
  const double utc_minus_monotonic = utc_minus_monotonic_s();
  for (int stamped = 0; stamped < kFrames;) {
    const auto frame = client.read();
    ASSERT_TRUE(frame.has_value());
    if (!frame->utc_s) continue;
    const double captured_s = camera.capture_time_s(frame->number) + utc_minus_monotonic;
    EXPECT_NEAR(*frame->utc_s - captured_s, 0, kToleranceS) << "frame " << frame->number;
    ++stamped;
  }
}

TEST_P(VideoServerStream, DeliversEveryFrameOnceAndInOrder) {
  VideoServer server(options_);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  Camera camera(server, options_);
  AvClient client;
  ASSERT_EQ(open(server, client), 0);
  // While the client was still asking for the stream, the server may have dropped frames.
  const int settled = camera.frames() + 10;
  int previous = -1;
  while (previous < settled + 40) {
    const auto frame = client.read();
    ASSERT_TRUE(frame.has_value());
    camera.received(frame->number);
    if (previous >= settled) {
      EXPECT_EQ(frame->number, previous + 1);
    } else {
      EXPECT_GT(frame->number, previous);
    }
    previous = frame->number;
  }
}

TEST_P(VideoServerStream, GoesOnAfterARestart) {
  VideoServer server(options_);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  Camera camera(server, options_);
  AvClient client;
  ASSERT_EQ(open(server, client), 0);
  ASSERT_TRUE(client.read().has_value());
  server.stop();
  const int frames = camera.frames();
  ASSERT_TRUE(server.start(&error)) << error;
  ASSERT_EQ(open(server, client), 0);
  const auto frame = client.read();
  ASSERT_TRUE(frame.has_value());
  EXPECT_GE(frame->number, frames - 1);
}

std::string stream_name(const testing::TestParamInfo<VideoServerStream::ParamType>& info) {
  return testing::PrintToString(std::get<Codec>(info.param)) +
         testing::PrintToString(std::get<Transport>(info.param));
}

INSTANTIATE_TEST_SUITE_P(
    All, VideoServerStream,
    testing::Combine(testing::Values(Codec::kMjpeg, Codec::kH264, Codec::kH265),
                     testing::Values(Transport::kTcp, Transport::kUdp, Transport::kPlainRtp)),
    stream_name);

class VideoServerCodec : public testing::TestWithParam<Codec> {};

TEST_P(VideoServerCodec, DiscardsFramesThatNobodyWaitsFor) {
  const VideoServerOptions options = options_for(GetParam());
  VideoServer server(options);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  Camera camera(server, options);
  ASSERT_TRUE(wait_until([&] { return camera.frames() >= 20; }));
  AvClient client;
  ASSERT_EQ(client.open(url_of(server), Transport::kTcp), 0);
  const auto frame = client.read();
  ASSERT_TRUE(frame.has_value());
  // Frame 19 may still have been on its way when frames() counted it.
  EXPECT_GE(frame->number, 19);
}

TEST_P(VideoServerCodec, ServesALateClientFromAKeyFrame) {
  const VideoServerOptions options = options_for(GetParam());
  VideoServer server(options);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  Camera camera(server, options);
  AvClient early;
  ASSERT_EQ(early.open(url_of(server), Transport::kUdp), 0);
  ASSERT_TRUE(early.read().has_value());
  const int before = camera.frames();
  AvClient late;
  ASSERT_EQ(late.open(url_of(server), Transport::kTcp), 0);
  EXPECT_EQ(server.clients(), 2);
  auto frame = late.read();
  // libav's decoder of H.265 makes up what the first pictures are coded from; that of H.264 waits.
  for (int i = 0; GetParam() == Codec::kH265 && i < kFramesPerIdr; ++i) {
    ASSERT_TRUE(frame.has_value());
    if (frame->key_frame) break;
    frame = late.read();
  }
  ASSERT_TRUE(frame.has_value());
  // Frames inside the server when the client came are not much older than the client.
  EXPECT_GE(frame->number, before - 10);
  EXPECT_TRUE(frame->key_frame);
  EXPECT_EQ(frame->number % (GetParam() == Codec::kMjpeg ? 1 : kFramesPerIdr), 0);
}

TEST_P(VideoServerCodec, ComesBackAfterDisconnection) {
  const VideoServerOptions options = options_for(GetParam());
  VideoServer server(options);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  Camera camera(server, options);
  AvClient client;
  ASSERT_EQ(client.open(url_of(server), Transport::kTcp), 0);
  ASSERT_TRUE(client.read().has_value());
  EXPECT_EQ(server.clients(), 1);
  server.disconnect_clients();
  EXPECT_EQ(server.clients(), 0);
  // What was already in the sockets may still come; then the connection ends.
  const int sent = camera.frames();
  for (int left = 0; client.read().has_value(); ++left) ASSERT_LE(left, sent);
  ASSERT_EQ(client.open(url_of(server), Transport::kTcp), 0);
  const auto frame = client.read();
  ASSERT_TRUE(frame.has_value());
  EXPECT_GE(frame->number, sent - 1);
}

INSTANTIATE_TEST_SUITE_P(All, VideoServerCodec,
                         testing::Values(Codec::kMjpeg, Codec::kH264, Codec::kH265),
                         testing::PrintToStringParamName());

TEST(VideoServer, ServesOneClientWhileAnotherDoesNotRead) {
  VideoServerOptions options = options_for(Codec::kMjpeg);
  // Frames of more than 100 kB fill the sockets of the client that does not read.
  options.width = 1280;
  options.height = 720;
  VideoServer server(options);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  Camera camera(server, options);
  AvClient idle;
  ASSERT_EQ(idle.open(url_of(server), Transport::kTcp), 0);
  AvClient busy;
  ASSERT_EQ(busy.open(url_of(server), Transport::kTcp), 0);
  int last = -1;
  for (int i = 0; i < 150; ++i) {
    const auto frame = busy.read();
    ASSERT_TRUE(frame.has_value());
    ASSERT_GT(frame->number, last);
    last = frame->number;
  }
}

TEST(VideoServer, LetsInWhoeverKnowsThePassword) {
  VideoServerOptions options = options_for(Codec::kMjpeg);
  options.user = "root";
  options.password = "pass";
  VideoServer server(options);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  Camera camera(server, options);
  AvClient client;
  EXPECT_EQ(client.open(url_of(server), Transport::kTcp), AVERROR_HTTP_UNAUTHORIZED);
  EXPECT_EQ(client.open(url_of(server, "root:wrong@"), Transport::kTcp), AVERROR_HTTP_UNAUTHORIZED);
  EXPECT_EQ(client.open(url_of(server, "who:pass@"), Transport::kTcp), AVERROR_HTTP_UNAUTHORIZED);
  ASSERT_EQ(client.open(url_of(server, "root:pass@"), Transport::kTcp), 0);
  EXPECT_TRUE(client.read().has_value());
}

TEST(VideoServer, SendsNoFrameCapturedBeforeItsTimeBegan) {
  const VideoServerOptions options = options_for(Codec::kMjpeg);
  const double early_s = monotonic_s();
  VideoServer server(options);
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  std::atomic<bool> done{false};
  std::thread pusher([&] {
    const auto old = numbered_picture(kWidth, kHeight, 1);
    const auto fresh = numbered_picture(kWidth, kHeight, 2);
    const auto old_jpeg = encode_jpeg(old.data(), kWidth, kHeight, kWidth, 90);
    const auto fresh_jpeg = encode_jpeg(fresh.data(), kWidth, kHeight, kWidth, 90);
    while (!done) {
      server.push(old_jpeg.data(), old_jpeg.size(), early_s);
      server.push(fresh_jpeg.data(), fresh_jpeg.size(), monotonic_s());
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  AvClient client;
  EXPECT_EQ(client.open(url_of(server), Transport::kTcp), 0);
  for (int i = 0; i < 10; ++i) {
    const auto frame = client.read();
    EXPECT_TRUE(frame.has_value() && frame->number == 2);
  }
  done = true;
  pusher.join();
}

TEST(VideoServer, SaysThatThePortIsTaken) {
  VideoServer first(options_for(Codec::kMjpeg));
  std::string error;
  ASSERT_TRUE(first.start(&error)) << error;
  VideoServerOptions options = options_for(Codec::kMjpeg);
  options.port = first.port();
  VideoServer second(options);
  EXPECT_FALSE(second.start(&error));
  EXPECT_NE(error.find("127.0.0.1:" + std::to_string(first.port())), std::string::npos) << error;
}

TEST(VideoServer, StartsAgainOnThePortItHad) {
  std::string error;
  VideoServer first(options_for(Codec::kMjpeg));
  ASSERT_TRUE(first.start(&error)) << error;
  VideoServerOptions options = options_for(Codec::kMjpeg);
  options.port = first.port();
  {
    // A connection that the server closes leaves the port in TIME_WAIT.
    Camera camera(first, options);
    AvClient client;
    ASSERT_EQ(client.open(url_of(first), Transport::kTcp), 0);
    ASSERT_TRUE(client.read().has_value());
    first.stop();
  }
  EXPECT_EQ(first.port(), 0);
  VideoServer second(options);
  ASSERT_TRUE(second.start(&error)) << error;
  EXPECT_EQ(second.port(), options.port);
}

TEST(VideoServer, RefusesOptionsThatCannotWork) {
  const auto reason = [](const std::function<void(VideoServerOptions&)>& spoil) {
    VideoServerOptions options = options_for(Codec::kMjpeg);
    spoil(options);
    std::string error;
    VideoServer server(options);
    EXPECT_FALSE(server.start(&error));
    return error;
  };
  EXPECT_NE(reason([](auto& o) { o.width = 0; }).find("no image size"), std::string::npos);
  EXPECT_NE(reason([](auto& o) { o.width = 322; }).find("multiples of 8"), std::string::npos);
  EXPECT_NE(reason([](auto& o) { o.height = 2160; }).find("up to 2040"), std::string::npos);
  EXPECT_NE(reason([](auto& o) { o.rate_hz = -1; }).find("frame rate"), std::string::npos);
  EXPECT_NE(reason([](auto& o) { o.rtp_port = 5005; }).find("even"), std::string::npos);
  EXPECT_NE(reason([](auto& o) { o.port = 65536; }).find("no such port"), std::string::npos);
  EXPECT_NE(reason([](auto& o) { o.path = "video"; }).find("begin with '/'"), std::string::npos);
}

}  // namespace
}  // namespace alidade
