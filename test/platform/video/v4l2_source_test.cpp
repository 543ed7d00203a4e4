// V4L2 where there is no camera, and what it stores. With cameras: test/system/virtual_machine.

#include "platform/video/v4l2_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <thread>

#include "platform/video/recording_frame_source.h"
#include "platform/video/stream_copy.h"
#include "platform/video/v4l2_device.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/open_files.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

V4l2SourceOptions device(const std::string& path) {
  V4l2SourceOptions options;
  options.device = path;
  return options;
}

TEST(V4l2Source, WaitsForACameraThatIsNotThere) {
  const auto source = open_v4l2(device("/dev/no-such-camera"));
  Frame frame;
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("/dev/no-such-camera: no such device; is the camera"));
  EXPECT_EQ(source->read(frame, 0), ReadStatus::kTimeout) << "a pause before the next try";
  EXPECT_EQ(read_until(*source, frame, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
}

TEST(V4l2Source, RefusesWhatIsNoCamera) {
  const TemporaryDirectory directory;
  const auto before = open_files();
  for (const std::string& path : {directory.write("file", "text"), std::string("/dev/null")}) {
    const auto source = open_v4l2(device(path));
    Frame frame;
    EXPECT_EQ(source->read(frame, kDeadline_s), ReadStatus::kFailed);
    EXPECT_EQ(source->error(), path + ": is no V4L2 device; video devices are /dev/video*");
    EXPECT_EQ(source->read(frame, 0), ReadStatus::kFailed);
    source->stop();
    EXPECT_EQ(source->read(frame, 0), ReadStatus::kStopped);
  }
  EXPECT_EQ(open_files(), before);
}

// root may open everything.
class AsNobody {
 public:
  AsNobody() {
    constexpr uid_t kNobody = 65534;
    EXPECT_TRUE(::geteuid() != 0 || ::seteuid(kNobody) == 0);
  }
  ~AsNobody() { EXPECT_EQ(::seteuid(::getuid()), 0); }
};

TEST(V4l2Source, TriesOnWhenADeviceThatComesLaterHasNoRightsYet) {
  const TemporaryDirectory directory;
  ASSERT_EQ(::chmod(directory.path().c_str(), 0755), 0);
  V4l2SourceOptions options = device(directory.path() + "/video0");
  options.max_backoff_s = 0.01;
  const auto source = open_v4l2(options);
  Frame frame;
  const auto read = [&](ReadStatus wanted) {
    const AsNobody nobody;
    return read_until(*source, frame, wanted);
  };
  ASSERT_EQ(read(ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("no such device"));
  directory.write("video0", "text");
  ASSERT_EQ(::chmod(options.device.c_str(), 0), 0);
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(read(ReadStatus::kDisconnected), ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(), HasSubstr("permission denied"));
  }
  ASSERT_EQ(::chmod(options.device.c_str(), 0666), 0);
  ASSERT_EQ(read(ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source->error(), HasSubstr("is no V4L2 device")) << "it has been opened";
}

TEST(V4l2Source, FailsAtOnceOnADeviceThatItMayNotOpen) {
  const TemporaryDirectory directory;
  ASSERT_EQ(::chmod(directory.path().c_str(), 0755), 0);
  const auto source = open_v4l2(device(directory.write("video0", "text")));
  ASSERT_EQ(::chmod(source->name().c_str(), 0), 0);
  Frame frame;
  const AsNobody nobody;
  EXPECT_EQ(source->read(frame, kDeadline_s), ReadStatus::kFailed);
  EXPECT_THAT(source->error(), HasSubstr("permission denied; the user must be in the group"));
}

TEST(V4l2Source, StopsWhileItWaitsForTheNextTry) {
  const auto source = open_v4l2(device("/dev/no-such-camera"));
  Frame frame;
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kDisconnected);
  std::thread reader([&] {
    Frame later;
    EXPECT_EQ(read_until(*source, later, ReadStatus::kStopped), ReadStatus::kStopped);
  });
  source->stop();
  reader.join();
}

TEST(V4l2Device, SaysInTheUsersWordsWhatTheKernelMeans) {
  const auto error = [](int number) { return v4l2_call_error("VIDIOC_STREAMON", number, "/v"); };
  EXPECT_THAT(error(ENOSPC), HasSubstr("the USB bus has no bandwidth left; use a smaller size"));
  EXPECT_THAT(error(ENOLINK), HasSubstr("no usable signal at the input"));
  EXPECT_EQ(error(ENOLCK), error(ENOLINK));
  EXPECT_THAT(error(EBUSY), HasSubstr("fuser -v /v names it"));
  EXPECT_THAT(error(ENODEV), HasSubstr("is the camera plugged in?"));
  EXPECT_THAT(error(EACCES), HasSubstr("the user must be in the group video"));
  EXPECT_EQ(error(EIO), "VIDIOC_STREAMON: Input/output error");
}

// What open_v4l2() stores of raw pictures.
TEST(StreamCopy, StoresUncompressedLumaThatARecordingGivesBack) {
  constexpr int kWidth = 38;
  constexpr int kHeight = 5;
  constexpr int kPictures = 4;
  const TemporaryDirectory directory;
  directory.write("recording.yaml", "format: 1\nwidth: 38\nheight: 5\n");
  directory.write("frames.csv", "frame,receive_time_s\n0,0.5\n1,0.51\n2,0.52\n3,0.53\n");
  const auto grey = [](int picture, int place) { return (7 * picture + place) % 256; };
  {
    StreamCopy copy(directory.path() + "/video.mkv");
    for (int i = 0; i < kPictures; ++i) {
      StreamPicture picture;
      picture.packet = make_picture_packet(kWidth * kHeight);
      ASSERT_TRUE(picture.packet);
      for (int place = 0; place < kWidth * kHeight; ++place) {
        picture.packet->data[place] = static_cast<std::uint8_t>(grey(i, place));
      }
      picture.parameters = picture_parameters(AV_CODEC_ID_RAWVIDEO);
      picture.width = kWidth;
      picture.height = kHeight;
      EXPECT_EQ(copy.fault_of(picture), "");
      std::string error;
      ASSERT_TRUE(copy.add(picture, 0.5 + 0.01 * i, &error)) << error;
    }
  }
  const auto recording = open_recorded_frames({directory.path(), true, false});
  Frame frame;
  for (int i = 0; i < kPictures; ++i) {
    ASSERT_EQ(recording->read(frame, kDeadline_s), ReadStatus::kOk) << recording->error();
    ASSERT_EQ(frame.width, kWidth);
    for (int place = 0; place < kWidth * kHeight; ++place) {
      ASSERT_EQ(frame.luma[place / kWidth * frame.stride + place % kWidth], grey(i, place));
    }
  }
  EXPECT_EQ(recording->read(frame, kDeadline_s), ReadStatus::kEnd);
  EXPECT_EQ(recording->missing_frames(), 0);
}

}  // namespace
}  // namespace alidade
