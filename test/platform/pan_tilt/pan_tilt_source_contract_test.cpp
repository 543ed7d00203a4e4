// What every PanTiltSource promises, run on each of them.

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

#include "platform/pan_tilt/onvif_source.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/pan_tilt/recording_pan_tilt_source.h"
#include "platform/pan_tilt/vapix_source.h"
#include "test/platform/support/axis_server.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/head_rig.h"
#include "test/platform/support/open_files.h"
#include "test/simulator/servers/onvif_server.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

// How soon a device that is away is noticed, by silence where nothing else tells.
enum class Patience { kLong, kShort };

template <class Options>
void set_patience(Patience patience, Options* options) {
  options->timeout_s = patience == Patience::kLong ? 4 * kDeadline_s : 0.5;
  options->max_backoff_s = patience == Patience::kLong ? options->max_backoff_s : 0.05;
}

// A source and what it needs to live.
struct Rig {
  virtual ~Rig() = default;
  virtual std::unique_ptr<PanTiltSource> open() = 0;
};

// One whose device can be taken away and given back, and be silent from the beginning.
struct LiveRig : Rig {
  explicit LiveRig(Patience with_patience) : patience(with_patience) {}
  virtual void take_away() = 0;
  virtual void give_back() = 0;
  virtual void fall_silent() = 0;
  virtual bool is_asked() = 0;  // at least once
  Patience patience;
};

// Keeps the answers of a server back.
struct Silence {
  std::string let_through(const std::string& answer) {
    is_asked = true;
    eventually([this] { return !on; });
    return answer;
  }
  std::atomic<bool> on{false};
  std::atomic<bool> is_asked{false};
};

struct VapixRig : LiveRig {
  using LiveRig::LiveRig;
  std::unique_ptr<PanTiltSource> open() override {
    VapixSourceOptions options;
    options.url = url;
    options.user = "user";
    options.password = "secret";
    set_patience(patience, &options);
    return open_vapix(options);
  }
  ~VapixRig() override { silence.on = false; }
  void take_away() override { server.reset(); }
  void give_back() override { server = make(port); }
  void fall_silent() override { silence.on = true; }
  bool is_asked() override { return silence.is_asked; }
  std::unique_ptr<AxisServer> make(int at_port) {
    return std::make_unique<AxisServer>(
        "user", "secret", [this] { return silence.let_through("pan=10\r\ntilt=20\r\n"); }, at_port);
  }
  Silence silence;
  std::unique_ptr<AxisServer> server = make(0);
  int port = server->port();
  std::string url = server->url();
};

struct OnvifRig : LiveRig {
  using LiveRig::LiveRig;
  std::unique_ptr<PanTiltSource> open() override {
    OnvifSourceOptions options;
    options.url = url;
    options.user = "user";
    options.password = "secret";
    options.pan_range = {-3, 3};
    options.tilt_range = {-1, 1};
    set_patience(patience, &options);
    return open_onvif(options);
  }
  ~OnvifRig() override { silence.on = false; }
  void take_away() override { server.reset(); }
  void give_back() override { server = make(port); }
  void fall_silent() override { silence.on = true; }
  bool is_asked() override { return silence.is_asked; }
  std::unique_ptr<OnvifServer> make(int at_port) {
    OnvifDevice device;
    device.position = [this, answer = device.position] { return silence.let_through(answer()); };
    device.login = OnvifDevice::Login::kToken;
    device.user = "user";
    device.password = "secret";
    return std::make_unique<OnvifServer>(device, at_port);
  }
  Silence silence;
  std::unique_ptr<OnvifServer> server = make(0);
  int port = server->port();
  std::string url = server->url();
};

struct RecordingRig : Rig {
  explicit RecordingRig(bool in_real_time) : realtime(in_real_time) {
    std::string rows;
    for (int i = 0; i < 1000; ++i) {
      rows += std::to_string(i * 0.01) + ",0.1,0.2\n";
    }
    directory.write("telemetry.csv", "receive_time_s,pan_rad,tilt_rad\n" + rows);
  }
  std::unique_ptr<PanTiltSource> open() override {
    RecordingPanTiltSourceOptions options;
    options.directory = directory.path();
    options.realtime = realtime;
    return open_recorded_pan_tilt(options);
  }
  TemporaryDirectory directory;
  bool realtime;
};

struct AskedHeadRig : LiveRig {
  AskedHeadRig(const HeadKind& kind, Patience with_patience) : LiveRig(with_patience), rig(kind) {}
  std::unique_ptr<PanTiltSource> open() override {
    QuerySourceOptions options = rig.options();
    set_patience(patience, &options);
    return rig.open(options);
  }
  void take_away() override { rig.server().unplug(); }
  void give_back() override { rig.server().plug(); }
  void fall_silent() override { rig.server().fault = LineFault::kSilence; }
  bool is_asked() override { return rig.server().queries > 0; }
  HeadRig rig;
};

template <class AnyRig>
struct Case {
  std::string name;
  std::function<std::unique_ptr<AnyRig>()> make;
};

template <class AnyRig>
void PrintTo(const Case<AnyRig>& which, std::ostream* out) {
  *out << which.name;
}

class PanTiltSourceContract : public ::testing::TestWithParam<Case<Rig>> {
 protected:
  std::unique_ptr<Rig> rig_ = GetParam().make();
  std::unique_ptr<PanTiltSource> owned_ = rig_->open();
  PanTiltSource& source_ = *owned_;
  PanTiltSample sample_;
};

TEST_P(PanTiltSourceContract, DeliversSamplesWithOrderedIntervals) {
  double last_s = -1;
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(source_.read(sample_, kDeadline_s), ReadStatus::kOk) << source_.error();
    EXPECT_LE(sample_.earliest_time_s, sample_.latest_time_s);
    EXPECT_GE(sample_.latest_time_s, last_s);
    last_s = sample_.latest_time_s;
  }
}

TEST_P(PanTiltSourceContract, LosesNothingWhenAReadDoesNotWait) {
  int samples = 0;
  EXPECT_TRUE(eventually([&] {
    const ReadStatus status = source_.read(sample_, 0);
    EXPECT_TRUE(status == ReadStatus::kOk || status == ReadStatus::kTimeout) << source_.error();
    samples += status == ReadStatus::kOk ? 1 : 0;
    return samples == 5;
  }));
}

TEST_P(PanTiltSourceContract, StaysStoppedWhenStoppedBeforeTheFirstRead) {
  source_.stop();
  source_.stop();
  EXPECT_EQ(source_.read(sample_, kDeadline_s), ReadStatus::kStopped);
  EXPECT_EQ(source_.read(sample_, 0), ReadStatus::kStopped);
}

TEST_P(PanTiltSourceContract, EndsAReadWhenAnotherThreadStopsIt) {
  std::thread reader([&] {
    ReadStatus status = ReadStatus::kOk;
    while (status == ReadStatus::kOk || status == ReadStatus::kTimeout) {
      status = source_.read(sample_, kDeadline_s);
    }
    EXPECT_TRUE(status == ReadStatus::kStopped || status == ReadStatus::kEnd);
  });
  source_.stop();
  reader.join();
  EXPECT_EQ(source_.read(sample_, 0), ReadStatus::kStopped);
}

TEST_P(PanTiltSourceContract, LeaksNoFileDescriptorOverAThousandLives) {
  owned_.reset();
  const auto one_life = [&](double timeout_s) {
    const std::unique_ptr<PanTiltSource> source = rig_->open();
    EXPECT_NE(source->read(sample_, timeout_s), ReadStatus::kFailed) << source->error();
  };
  one_life(kDeadline_s);  // what stays open for good
  const auto before = open_files();
  for (int i = 0; i < 1000; ++i) {
    one_life(i % 250 == 0 ? kDeadline_s : 0);  // most end in the middle of connecting
  }
  // The rig's server, in this process, has its own ends; it notices their closing in time.
  EXPECT_TRUE(eventually([&] { return open_files() <= before; })) << open_files() - before;
}

TEST_P(PanTiltSourceContract, HasANameWithoutPassword) {
  EXPECT_FALSE(source_.name().empty());
  EXPECT_EQ(source_.name().find("secret"), std::string::npos);
}

class LivePanTiltSourceContract : public ::testing::TestWithParam<Case<LiveRig>> {
 protected:
  static void expect_report(const PanTiltSource& source) {
    const std::string error = source.error();
    EXPECT_EQ(error.rfind(source.name() + ": ", 0), 0U) << error;
    EXPECT_GT(error.size(), source.name().size() + 2);
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    EXPECT_EQ(error.find("secret"), std::string::npos) << error;
  }
  std::unique_ptr<LiveRig> rig_ = GetParam().make();
  std::unique_ptr<PanTiltSource> source_ = rig_->open();
  PanTiltSample sample_;
};

TEST_P(LivePanTiltSourceContract, SaysThatTheDeviceWentAndComesBackWithItByItself) {
  ASSERT_EQ(read_until(*source_, sample_, ReadStatus::kOk), ReadStatus::kOk) << source_->error();
  EXPECT_TRUE(sample_.restarted);
  for (int life = 0; life < 3; ++life) {
    rig_->take_away();
    ASSERT_EQ(read_until(*source_, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    expect_report(*source_);
    const double last_s = sample_.latest_time_s;
    rig_->give_back();
    ASSERT_EQ(read_until(*source_, sample_, ReadStatus::kOk), ReadStatus::kOk) << source_->error();
    EXPECT_TRUE(sample_.restarted);
    EXPECT_GE(sample_.earliest_time_s, last_s);
    EXPECT_LE(sample_.earliest_time_s, sample_.latest_time_s);
  }
}

TEST_P(LivePanTiltSourceContract, WaitsForADeviceThatIsNotThereYet) {
  rig_->take_away();
  ASSERT_EQ(read_until(*source_, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  expect_report(*source_);
  rig_->give_back();
  ASSERT_EQ(read_until(*source_, sample_, ReadStatus::kOk), ReadStatus::kOk) << source_->error();
  EXPECT_TRUE(sample_.restarted);
}

TEST_P(LivePanTiltSourceContract, StopsWhileTheDeviceIsAway) {
  rig_->take_away();
  ASSERT_EQ(read_until(*source_, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  std::thread stopper([&] { source_->stop(); });
  EXPECT_EQ(read_until(*source_, sample_, ReadStatus::kStopped), ReadStatus::kStopped);
  stopper.join();
}

// So patient that only stop() can end the read.
class SilentPanTiltSourceContract : public LivePanTiltSourceContract {};

TEST_P(SilentPanTiltSourceContract, EndsAReadThatWaitsForAnAnswer) {
  rig_->fall_silent();
  std::thread stopper([&] {
    EXPECT_TRUE(eventually([&] { return rig_->is_asked(); }));
    source_->stop();
  });
  EXPECT_EQ(source_->read(sample_, 4 * kDeadline_s), ReadStatus::kStopped);
  stopper.join();
  EXPECT_EQ(source_->read(sample_, 0), ReadStatus::kStopped);
}

template <class AnyRig>
std::vector<Case<AnyRig>> live_cases(Patience patience) {
  std::vector<Case<AnyRig>> cases = {
      {"Vapix", [patience] { return std::make_unique<VapixRig>(patience); }},
      {"Onvif", [patience] { return std::make_unique<OnvifRig>(patience); }}};
  for (const HeadKind& kind : all_head_kinds()) {
    cases.push_back(
        {kind.name(), [kind, patience] { return std::make_unique<AskedHeadRig>(kind, patience); }});
  }
  return cases;
}

const auto name_of = [](const auto& which) { return which.param.name; };

INSTANTIATE_TEST_SUITE_P(Live, PanTiltSourceContract,
                         ::testing::ValuesIn(live_cases<Rig>(Patience::kLong)), name_of);
INSTANTIATE_TEST_SUITE_P(
    Recording, PanTiltSourceContract,
    ::testing::Values(Case<Rig>{"AtFullSpeed",
                                [] { return std::make_unique<RecordingRig>(false); }},
                      Case<Rig>{"InRealTime", [] { return std::make_unique<RecordingRig>(true); }}),
    name_of);
INSTANTIATE_TEST_SUITE_P(Live, LivePanTiltSourceContract,
                         ::testing::ValuesIn(live_cases<LiveRig>(Patience::kShort)), name_of);
INSTANTIATE_TEST_SUITE_P(Live, SilentPanTiltSourceContract,
                         ::testing::ValuesIn(live_cases<LiveRig>(Patience::kLong)), name_of);

}  // namespace
}  // namespace alidade
