// What every PanTiltSource promises, run on each of them.

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <ostream>
#include <thread>

#include "platform/pan_tilt/onvif_source.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/pan_tilt/recording_pan_tilt_source.h"
#include "platform/pan_tilt/vapix_source.h"
#include "test/platform/support/axis_server.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/head_rig.h"
#include "test/platform/support/onvif_server.h"
#include "test/platform/support/open_files.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

// A source and what it needs to live.
struct Rig {
  virtual ~Rig() = default;
  virtual std::unique_ptr<PanTiltSource> open() = 0;
};

struct VapixRig : Rig {
  std::unique_ptr<PanTiltSource> open() override {
    VapixSourceOptions options;
    options.url = server.url();
    options.user = "user";
    options.password = "secret";
    options.timeout_s = kDeadline_s;
    return std::make_unique<VapixSource>(options);
  }
  AxisServer server{"user", "secret", [] { return "pan=10\r\ntilt=20\r\n"; }};
};

struct OnvifRig : Rig {
  std::unique_ptr<PanTiltSource> open() override {
    OnvifSourceOptions options;
    options.url = server.url();
    options.user = "user";
    options.password = "secret";
    options.pan_range = {-3, 3};
    options.tilt_range = {-1, 1};
    options.timeout_s = kDeadline_s;
    return std::make_unique<OnvifSource>(options);
  }
  OnvifServer server{[] {
    OnvifDevice device;
    device.login = OnvifDevice::Login::kToken;
    device.user = "user";
    device.password = "secret";
    return device;
  }()};
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
    return std::make_unique<RecordingPanTiltSource>(options);
  }
  TemporaryDirectory directory;
  bool realtime;
};

struct AskedHeadRig : Rig {
  explicit AskedHeadRig(HeadKind kind) : rig(kind) {}
  std::unique_ptr<PanTiltSource> open() override { return rig.open(); }
  HeadRig rig;
};

struct Case {
  const char* name;
  std::function<std::unique_ptr<Rig>()> make;
};

void PrintTo(const Case& which, std::ostream* out) { *out << which.name; }

class PanTiltSourceContract : public ::testing::TestWithParam<Case> {
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

Case asked_head(const char* name, HeadKind kind) {
  return {name, [kind] { return std::make_unique<AskedHeadRig>(kind); }};
}

INSTANTIATE_TEST_SUITE_P(
    Sources, PanTiltSourceContract,
    ::testing::Values(
        Case{"Vapix", [] { return std::make_unique<VapixRig>(); }},
        Case{"Onvif", [] { return std::make_unique<OnvifRig>(); }},
        Case{"Recording", [] { return std::make_unique<RecordingRig>(false); }},
        Case{"RecordingInRealTime", [] { return std::make_unique<RecordingRig>(true); }},
        asked_head("PelcoDSerial", HeadKind::kPelcoDSerial),
        asked_head("PelcoDTcp", HeadKind::kPelcoDTcp),
        asked_head("ViscaSerial", HeadKind::kViscaSerial),
        asked_head("ViscaTcp", HeadKind::kViscaTcp), asked_head("ViscaUdp", HeadKind::kViscaUdp),
        asked_head("ViscaUdpHeader", HeadKind::kViscaUdpHeader),
        asked_head("PtuSerial", HeadKind::kPtuSerial), asked_head("PtuTcp", HeadKind::kPtuTcp)),
    [](const auto& which) { return which.param.name; });

}  // namespace
}  // namespace alidade
