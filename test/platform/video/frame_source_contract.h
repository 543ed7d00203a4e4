#pragma once
// What every FrameSource promises: the suite, for one program to instantiate with its sources.

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <thread>

#include "platform/video/frame_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/open_files.h"

namespace alidade {

// A source and what it needs to live.
struct FrameSourceRig {
  virtual ~FrameSourceRig() = default;
  virtual std::unique_ptr<FrameSource> open() const = 0;
  std::unique_ptr<FrameSource> source;
};

// One whose camera can be taken away and given back, also in the middle of connecting, and made silent while
// it stays connected.
struct LiveFrameSourceRig : FrameSourceRig {
  virtual void take_away() = 0;
  virtual void give_back() = 0;
  virtual void set_silent(bool silent) = 0;
};

template <class Rig>
struct FrameSourceCase {
  const char* name;
  std::function<std::unique_ptr<Rig>()> make;
};

template <class Rig>
void PrintTo(const FrameSourceCase<Rig>& which, std::ostream* out) {
  *out << which.name;
}

class FrameSourceContract : public ::testing::TestWithParam<FrameSourceCase<FrameSourceRig>> {
 protected:
  std::unique_ptr<FrameSourceRig> rig_ = GetParam().make();
  FrameSource& source_ = *rig_->source;
  Frame frame_;
};

// Sources that give up after a short silence and pause shortly.
class LiveFrameSourceContract
    : public ::testing::TestWithParam<FrameSourceCase<LiveFrameSourceRig>> {
 protected:
  void expect_report() const {
    const std::string error = source_.error();
    EXPECT_EQ(error.rfind(source_.name() + ": ", 0), 0U) << error;
    EXPECT_GT(error.size(), source_.name().size() + 2);
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    EXPECT_EQ(error.find("secret"), std::string::npos) << error;
  }
  std::unique_ptr<LiveFrameSourceRig> rig_ = GetParam().make();
  FrameSource& source_ = *rig_->source;
  Frame frame_;
};

// The same that take any silence.
class PatientFrameSourceContract
    : public ::testing::TestWithParam<FrameSourceCase<LiveFrameSourceRig>> {
 protected:
  std::unique_ptr<LiveFrameSourceRig> rig_ = GetParam().make();
  FrameSource& source_ = *rig_->source;
  Frame frame_;
};

constexpr double kForever_s = 1e6;

TEST_P(FrameSourceContract, NumbersItsFramesAndGivesEachItsPicture) {
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(read_until(source_, frame_, ReadStatus::kOk), ReadStatus::kOk) << source_.error();
    EXPECT_EQ(frame_.stamp.frame, i);
    EXPECT_GT(frame_.width, 0);
    EXPECT_GT(frame_.height, 0);
    ASSERT_NE(frame_.luma, nullptr);
    EXPECT_GE(frame_.stride, frame_.width);
    EXPECT_NE(frame_.owner, nullptr);
    if (frame_.decode_s) {
      EXPECT_GT(*frame_.decode_s, 0);
    }
  }
}

TEST_P(FrameSourceContract, LosesNothingWhenAReadDoesNotWait) {
  int frames = 0;
  EXPECT_TRUE(eventually([&] {
    const ReadStatus status = source_.read(frame_, 0);
    EXPECT_TRUE(status == ReadStatus::kOk || status == ReadStatus::kTimeout) << source_.error();
    if (status == ReadStatus::kOk) {
      EXPECT_EQ(frame_.stamp.frame, frames++);
    }
    return frames == 5;
  }));
}

TEST_P(FrameSourceContract, StaysStoppedWhenStoppedBeforeTheFirstRead) {
  source_.stop();
  source_.stop();
  EXPECT_EQ(source_.read(frame_, kDeadline_s), ReadStatus::kStopped);
  EXPECT_EQ(source_.read(frame_, 0), ReadStatus::kStopped);
}

TEST_P(FrameSourceContract, EndsAReadWhenAnotherThreadStopsIt) {
  std::atomic<int> frames{0};
  std::thread reader([&] {
    ReadStatus status = ReadStatus::kOk;
    while (status == ReadStatus::kOk || status == ReadStatus::kTimeout) {
      status = source_.read(frame_, kDeadline_s);
      ++frames;
    }
    // A recording at full speed may be over, or out of pictures, before the stop.
    EXPECT_NE(status, ReadStatus::kDisconnected);
  });
  EXPECT_TRUE(eventually([&] { return frames > 0; }));
  source_.stop();
  reader.join();
  EXPECT_EQ(source_.read(frame_, 0), ReadStatus::kStopped);
}

TEST_P(FrameSourceContract, LeaksNoFileDescriptorOverAThousandLives) {
  rig_->source.reset();
  const auto one_life = [&](double timeout_s) {
    const std::unique_ptr<FrameSource> source = rig_->open();
    const ReadStatus status = source->read(frame_, timeout_s);
    EXPECT_NE(status, ReadStatus::kFailed) << source->error();
    frame_ = Frame{};
  };
  one_life(1);  // what stays open for good
  const auto before = open_files();
  for (int i = 0; i < 1000; ++i) {
    one_life(i % 250 == 0 ? 1 : 0);  // most end in the middle of connecting
  }
  // The rig's server, in this process, has its own ends; it notices their closing in time.
  EXPECT_TRUE(eventually([&] { return open_files() <= before; })) << open_files() - before;
}

TEST_P(FrameSourceContract, HasANameWithoutPassword) {
  EXPECT_FALSE(source_.name().empty());
  EXPECT_EQ(source_.name().find("secret"), std::string::npos);
}

TEST_P(PatientFrameSourceContract, StampsFramesAsTheyComeByTheHostsClock) {
  const double begin_s = monotonic_now_s();
  double first_s = 0;
  double last_s = begin_s;
  // One piece of a stream may hold two, and all that a busy machine has not read yet.
  for (int i = 0; i < 10 || last_s == first_s; ++i) {
    ASSERT_LT(i, 1000);
    ASSERT_EQ(read_until(source_, frame_, ReadStatus::kOk), ReadStatus::kOk) << source_.error();
    EXPECT_GE(frame_.stamp.receive_time_s, last_s) << i;
    EXPECT_LE(frame_.stamp.receive_time_s, monotonic_now_s());
    last_s = frame_.stamp.receive_time_s;
    first_s = i == 0 ? last_s : first_s;
  }
}

TEST_P(PatientFrameSourceContract, EndsAReadOfASilentCameraWhenAnotherThreadStopsIt) {
  ASSERT_EQ(read_until(source_, frame_, ReadStatus::kOk), ReadStatus::kOk) << source_.error();
  rig_->set_silent(true);
  std::atomic<pid_t> reader_id{0};
  std::atomic<bool> over{false};
  std::thread reader([&] {
    reader_id = ::gettid();
    ReadStatus status = ReadStatus::kOk;
    while (status == ReadStatus::kOk) {
      status = source_.read(frame_, kForever_s);
    }
    EXPECT_EQ(status, ReadStatus::kStopped);
    over = true;
  });
  EXPECT_TRUE(eventually([&] { return reader_id != 0; }));
  EXPECT_TRUE(falls_asleep(reader_id));
  source_.stop();
  // In vain: nothing can end the reader, so its thread ends the program.
  ASSERT_TRUE(eventually([&] { return over.load(); })) << "stop() does not wake what waits";
  reader.join();
  rig_->set_silent(false);
}

TEST_P(LiveFrameSourceContract, SaysThatTheCameraWentAndComesBackWithItByItself) {
  ASSERT_EQ(read_until(source_, frame_, ReadStatus::kOk), ReadStatus::kOk) << source_.error();
  EXPECT_TRUE(frame_.stamp.restarted);
  for (int life = 0; life < 3; ++life) {
    rig_->take_away();
    const std::int64_t before = frame_.stamp.frame;
    std::int64_t last = before;
    ASSERT_EQ(read_until(source_, frame_,
                         [&](ReadStatus status) {
                           last = status == ReadStatus::kOk ? frame_.stamp.frame : last;
                           return status == ReadStatus::kDisconnected;
                         }),
              ReadStatus::kDisconnected);
    expect_report();
    rig_->give_back();
    ASSERT_EQ(read_until(source_, frame_, ReadStatus::kOk), ReadStatus::kOk) << source_.error();
    EXPECT_TRUE(frame_.stamp.restarted) << "the sender's clock and sequence begin anew";
    EXPECT_EQ(frame_.stamp.frame, last + 1);
  }
}

TEST_P(LiveFrameSourceContract, WaitsForACameraThatIsNotThereYet) {
  rig_->take_away();
  const std::unique_ptr<FrameSource> source = rig_->open();
  ASSERT_EQ(read_until(*source, frame_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_EQ(source->error().rfind(source->name() + ": ", 0), 0U) << source->error();
  rig_->give_back();
  ASSERT_EQ(read_until(*source, frame_, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_EQ(frame_.stamp.frame, 0);
  EXPECT_TRUE(frame_.stamp.restarted);
}

TEST_P(LiveFrameSourceContract, StopsWhileTheCameraIsAway) {
  rig_->take_away();
  const std::unique_ptr<FrameSource> source = rig_->open();
  ASSERT_EQ(read_until(*source, frame_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  std::thread stopper([&] { source->stop(); });
  EXPECT_EQ(read_until(*source, frame_, ReadStatus::kStopped), ReadStatus::kStopped);
  stopper.join();
}

}  // namespace alidade
