// The sources that every machine can have, under the contract of FrameSource.

#include "test/platform/video/frame_source_contract.h"

#include <vector>

#include "platform/video/mjpeg_source.h"
#include "platform/video/recording_frame_source.h"
#include "platform/video/rtp_source.h"
#include "test/platform/support/mjpeg_server.h"
#include "test/platform/support/rtp_sender.h"
#include "test/platform/support/rtsp_server.h"
#include "test/support/temporary_directory.h"
#include "test/support/udp_port_pair.h"

namespace alidade {
namespace {

// How soon a camera that is away is noticed, by silence where nothing else tells.
enum class Patience { kForever, kLong, kShort };

template <class Options>
void set_patience(Patience patience, Options* options, double short_timeout_s = 10) {
  options->timeout_s = patience == Patience::kForever ? kForever_s
                       : patience == Patience::kLong  ? kDeadline_s
                                                      : short_timeout_s;
  options->max_backoff_s = patience == Patience::kShort ? 0.05 : options->max_backoff_s;
}

struct RtspRig : LiveFrameSourceRig {
  RtspRig(const RtspStream& stream, RtpSourceOptions::Transport transport, Patience patience)
      : server(stream, "user", "secret") {
    options.url = server.url();
    options.transport = transport;
    options.user = "user";
    options.password = "secret";
    set_patience(patience, &options);
    source = open();
  }
  std::unique_ptr<FrameSource> open() const override { return open_rtp(options); }
  void take_away() override { server.kill(); }
  void give_back() override { server.restart(); }
  void set_silent(bool silent) override { silent ? server.freeze() : server.thaw(); }
  RtspServer server;
  RtpSourceOptions options;
};

struct RtpRig : LiveFrameSourceRig {
  explicit RtpRig(Patience patience) {
    const int port = test::udp_port_pair();
    options.url = "rtp://@:" + std::to_string(port);
    set_patience(patience, &options, 0.5);
    source = open();
    thread = std::thread([this, port] {
      RtpSender sender(RtpSender::Codec::kMjpeg, port);
      while (!over) {
        if (!away) sender.send();
        std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the camera's pace
      }
    });
  }
  ~RtpRig() override {
    over = true;
    thread.join();
  }
  std::unique_ptr<FrameSource> open() const override { return open_rtp(options); }
  void take_away() override { away = true; }
  void give_back() override { away = false; }
  void set_silent(bool silent) override { away = silent; }
  RtpSourceOptions options;
  std::atomic<bool> over{false};
  std::atomic<bool> away{false};
  std::thread thread;
};

struct MjpegRig : LiveFrameSourceRig {
  explicit MjpegRig(Patience patience) {
    options.url = server.url();
    options.user = MjpegServer::kUser;
    options.password = MjpegServer::kPassword;
    set_patience(patience, &options);
    source = open();
  }
  ~MjpegRig() override { source.reset(); }  // before the server, which waits for it
  std::unique_ptr<FrameSource> open() const override { return open_mjpeg(options); }
  void take_away() override { server.hang_up = true; }
  void give_back() override { server.hang_up = false; }
  void set_silent(bool silent) override { server.allowed = silent ? 0 : 1 << 30; }
  MjpegServer server{{}, MjpegServer::Login::kDigestMd5};
  MjpegSourceOptions options;
};

struct RecordingRig : FrameSourceRig {
  explicit RecordingRig(bool realtime) {
    directory.write("recording.yaml", "format: 1\nwidth: 4\nheight: 2\n");
    std::string rows;
    for (int i = 0; i < 10'000; ++i) {
      rows += std::to_string(i) + "," + std::to_string(i * 0.01) + "\n";
    }
    directory.write("frames.csv", "frame,receive_time_s\n" + rows);
    for (int i = 0; i < 100; ++i) {
      char name[32];
      std::snprintf(name, sizeof name, "frames/%06d.pgm", i);
      directory.write(name, "P5\n4 2\n255\nabcdefgh");
    }
    options.directory = directory.path();
    options.realtime = realtime;
    source = open();
  }
  std::unique_ptr<FrameSource> open() const override { return open_recorded_frames(options); }
  TemporaryDirectory directory;
  RecordingFrameSourceOptions options;
};

template <class Rig>
std::vector<FrameSourceCase<Rig>> live_cases(Patience patience) {
  using Transport = RtpSourceOptions::Transport;
  const auto rtsp = [patience](const RtspStream& stream, Transport transport) {
    return [&stream, transport, patience] {
      return std::make_unique<RtspRig>(stream, transport, patience);
    };
  };
  return {{"RtspMjpeg", rtsp(kMjpegStream, Transport::kTcp)},
          {"RtspH264", rtsp(kH264Stream, Transport::kTcp)},
          {"RtspUdp", rtsp(kH264Stream, Transport::kUdp)},
          {"Rtp", [patience] { return std::make_unique<RtpRig>(patience); }},
          {"Mjpeg", [patience] { return std::make_unique<MjpegRig>(patience); }}};
}

// Neither where it names itself nor where it says what failed.
TEST(FrameSourceNames, HoldNoSecretOfAQuery) {
  MjpegSourceOptions mjpeg;
  mjpeg.url = "http://127.0.0.1:1/video?user=secret&pwd=secret&size=4";
  RtpSourceOptions rtsp;
  rtsp.url = "rtsp://127.0.0.1:1/live?user=secret&pwd=secret&size=4";
  Frame frame;
  for (const auto& source : {open_mjpeg(mjpeg), open_rtp(rtsp)}) {
    EXPECT_NE(source->name().find("?user=***&pwd=***&size=4"), std::string::npos) << source->name();
    ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_EQ(source->error().find("secret"), std::string::npos) << source->error();
  }
}

const auto name_of = [](const auto& which) { return which.param.name; };

INSTANTIATE_TEST_SUITE_P(Network, FrameSourceContract,
                         ::testing::ValuesIn(live_cases<FrameSourceRig>(Patience::kLong)), name_of);
INSTANTIATE_TEST_SUITE_P(
    Recording, FrameSourceContract,
    ::testing::Values(
        FrameSourceCase<FrameSourceRig>{"AtFullSpeed",
                                        [] { return std::make_unique<RecordingRig>(false); }},
        FrameSourceCase<FrameSourceRig>{"InRealTime",
                                        [] { return std::make_unique<RecordingRig>(true); }}),
    name_of);
INSTANTIATE_TEST_SUITE_P(Network, LiveFrameSourceContract,
                         ::testing::ValuesIn(live_cases<LiveFrameSourceRig>(Patience::kShort)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Network, PatientFrameSourceContract,
                         ::testing::ValuesIn(live_cases<LiveFrameSourceRig>(Patience::kForever)),
                         name_of);

}  // namespace
}  // namespace alidade
