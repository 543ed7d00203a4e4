#include "alidade_ros/bag_conversion.h"

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/image_encodings.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <stdexcept>

#include "alidade_ros/conversions.h"
#include "alidade_ros/recording_files.h"

namespace alidade_ros {
namespace {

namespace fs = std::filesystem;
namespace encodings = sensor_msgs::image_encodings;
using Bytes = std::vector<std::uint8_t>;

constexpr double kNanosecond = 1e-9;

class BagConversion : public testing::Test {
 protected:
  BagConversion()
      : folder_(fs::path(testing::TempDir()) /
                (std::string("alidade_ros_") +
                 testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~BagConversion() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_ / name).string();
  }

  static cv::Mat picture(int number) {
    cv::Mat image(24, 32, CV_8U);
    cv::RNG random(static_cast<std::uint64_t>(number) + 1);
    random.fill(image, cv::RNG::UNIFORM, 0, 256);
    return image;
  }

  // Frames of every picture type; a polled head with a zoom. Times from `begin` on.
  RecordingTables make_recording(const std::string& name, double begin) const {
    std::mt19937 generator(1);
    std::uniform_real_distribution<double> late(0, 0.01);
    RecordingTables tables;
    tables.width = 32;
    tables.height = 24;
    make_recording_directory(path(name));
    const std::array<PictureType, 3> types = {PictureType::kPng, PictureType::kJpeg,
                                              PictureType::kPgm};
    const std::array<const char*, 3> extensions = {".png", ".jpg", ".pgm"};
    for (int i = 0; i < 12; ++i) {
      const double sender = 0.04 * i + 7;
      tables.frames.push_back({i, begin + 0.04 * i + late(generator), sender});
      Bytes bytes;
      cv::imencode(extensions[i % 3], picture(i), bytes);
      write_picture(path(name), i, types[i % 3], bytes);
    }
    for (int i = 0; i < 30; ++i) {
      RecordedSample sample;
      sample.receive_time_s = begin + 0.02 * i + late(generator);
      sample.pan_rad = 0.1 * std::sin(0.3 * i);
      sample.tilt_rad = 0.05 * std::cos(0.3 * i);
      sample.zoom = 1234;
      tables.samples.push_back(sample);
    }
    write_tables(path(name), tables, "of a test");
    return tables;
  }

  void expect_error(const std::string& part, const std::function<void()>& call) {
    try {
      call();
      ADD_FAILURE() << "no error about " << part;
    } catch (const std::exception& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(part), std::string::npos) << text;
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    }
  }

  fs::path folder_;
};

Bytes bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), {});
}

TEST_F(BagConversion, ARecordingComesBackTheSame) {
  const RecordingTables there = make_recording("there", 1000);
  for (const bool raw : {true, false}) {
    const std::string bag = path(raw ? "raw.bag" : "compressed.bag");
    BagOptions options;
    const BagCounts counts = recording_to_bag(path("there"), bag, options, raw);
    EXPECT_EQ(counts.frames, 12U);
    EXPECT_EQ(counts.samples, 30U);
    EXPECT_EQ(counts.moved_by_s, 0);
    if (!raw) options.image_topic = "image/compressed";  // the PGM pictures are on image
    const std::string back_folder = path(raw ? "back_raw" : "back_compressed");
    ASSERT_EQ(bag_to_recording(bag, back_folder, options, Stamps::kBag).samples, 30U);
    const RecordingTables back = read_tables(back_folder);
    EXPECT_EQ(back.width, 32);
    EXPECT_EQ(back.height, 24);
    ASSERT_EQ(back.samples.size(), there.samples.size());
    for (std::size_t i = 0; i < back.samples.size(); ++i) {
      EXPECT_EQ(back.samples[i].pan_rad, there.samples[i].pan_rad);
      EXPECT_EQ(back.samples[i].tilt_rad, there.samples[i].tilt_rad);
      EXPECT_EQ(back.samples[i].zoom, there.samples[i].zoom);
      EXPECT_NEAR(back.samples[i].receive_time_s, there.samples[i].receive_time_s, kNanosecond);
    }
    ASSERT_EQ(back.frames.size(), raw ? 12U : 8U);
    double clocks = 0;
    for (std::size_t i = 0; i < back.frames.size(); ++i) {
      const std::size_t from = raw ? i : i / 2 * 3 + i % 2;
      EXPECT_NEAR(back.frames[i].receive_time_s, there.frames[from].receive_time_s, kNanosecond);
      // The sender's clock may begin anywhere.
      const double offset = *back.frames[i].sender_time_s - *there.frames[from].sender_time_s;
      if (i == 0) clocks = offset;
      EXPECT_NEAR(offset, clocks, 2 * kNanosecond);
      const std::string number = "/frames/00000" + std::to_string(i);
      if (!raw) {
        const std::string extension = i % 2 == 0 ? ".png" : ".jpg";
        char there_number[32];
        std::snprintf(there_number, sizeof there_number, "/frames/%06zu", from);
        EXPECT_EQ(bytes_of(back_folder + number + extension),
                  bytes_of(path("there") + there_number + extension));
      } else if (from % 3 != 1 && i < 10) {  // PNG and PGM lose nothing
        const cv::Mat seen = cv::imread(back_folder + number + ".png", cv::IMREAD_GRAYSCALE);
        EXPECT_EQ(cv::norm(seen, picture(static_cast<int>(from)), cv::NORM_INF), 0);
      }
    }
  }
}

TEST_F(BagConversion, TimesBefore1970AreMovedByWholeSeconds) {
  const RecordingTables there = make_recording("there", -1.25);
  const BagCounts counts = recording_to_bag(path("there"), path("a.bag"), {}, true);
  EXPECT_GT(counts.moved_by_s, 0);
  ASSERT_EQ(bag_to_recording(path("a.bag"), path("back"), {}, Stamps::kBag).frames, 12U);
  const RecordingTables back = read_tables(path("back"));
  for (std::size_t i = 0; i < back.samples.size(); ++i) {
    EXPECT_NEAR(back.samples[i].receive_time_s,
                there.samples[i].receive_time_s + double(counts.moved_by_s), 2 * kNanosecond);
  }
}

TEST_F(BagConversion, HeaderStampsAreTheTimesOfADriver) {
  rosbag::Bag bag(path("driver.bag"), rosbag::bagmode::Write);
  sensor_msgs::Image image;
  image.width = 2;
  image.height = 1;
  image.step = 8;  // more than the pixels take
  image.encoding = encodings::BGR8;
  image.data = {255, 0, 0, 0, 0, 255, 9, 9};
  image.header.stamp = ros_time(99.5);
  bag.write("/cam/image_raw", ros_time(100), image);
  sensor_msgs::JointState joints;
  joints.name = {"wheel", "head_tilt", "head_pan"};
  joints.position = {9, 0.25, -0.5};
  joints.header.stamp = ros_time(99.25);
  bag.write("/joint_states", ros_time(100), joints);
  joints.name = {"wheel"};
  joints.position = {9};
  bag.write("/joint_states", ros_time(101), joints);
  bag.close();

  ASSERT_EQ(bag_to_recording(path("driver.bag"), path("header"), {}, Stamps::kHeader).samples, 1U);
  const RecordingTables tables = read_tables(path("header"));
  ASSERT_EQ(tables.frames.size(), 1U);
  EXPECT_EQ(tables.frames[0].receive_time_s, 99.5);
  EXPECT_FALSE(tables.frames[0].sender_time_s);
  EXPECT_EQ(tables.samples[0].receive_time_s, 99.25);
  EXPECT_EQ(tables.samples[0].pan_rad, 0.5);     // to the left is negative in Alidade
  EXPECT_EQ(tables.samples[0].tilt_rad, -0.25);  // and down

  BagOptions upwards;
  upwards.tilt_sign = 1;
  ASSERT_EQ(bag_to_recording(path("driver.bag"), path("bag"), upwards, Stamps::kBag).samples, 1U);
  const RecordingTables of_bag = read_tables(path("bag"));
  EXPECT_EQ(of_bag.samples[0].tilt_rad, 0.25);
  EXPECT_EQ(of_bag.samples[0].receive_time_s, 100);
  EXPECT_EQ(of_bag.samples[0].device_time_s, 99.25);
  EXPECT_EQ(of_bag.frames[0].sender_time_s, 99.5);
}

TEST_F(BagConversion, TakesTheLumaOfEveryEncodingItKnows) {
  const auto luma = [](const std::string& encoding, const Bytes& data) {
    sensor_msgs::Image image;
    image.width = 2;
    image.height = 1;
    image.step = static_cast<std::uint32_t>(data.size());
    image.encoding = encoding;
    image.data = data;
    return luma_of(image);
  };
  EXPECT_EQ(luma(encodings::MONO8, {7, 8}), (Bytes{7, 8}));
  EXPECT_EQ(luma(encodings::YUV422, {1, 7, 2, 8}), (Bytes{7, 8}));
  EXPECT_EQ(luma("yuv422_yuy2", {7, 1, 8, 2}), (Bytes{7, 8}));
  // ITU-R BT.601: blue 0.114, red 0.299
  EXPECT_EQ(luma(encodings::BGR8, {200, 0, 0, 0, 0, 200}), (Bytes{23, 60}));
  EXPECT_EQ(luma(encodings::RGB8, {200, 0, 0, 0, 0, 200}), (Bytes{60, 23}));
  EXPECT_EQ(luma(encodings::BGRA8, {200, 0, 0, 9, 0, 0, 200, 9}), (Bytes{23, 60}));
  EXPECT_EQ(luma(encodings::RGBA8, {200, 0, 0, 9, 0, 0, 200, 9}), (Bytes{60, 23}));
  expect_error("bayer", [&] { (void)luma(encodings::BAYER_RGGB8, {1, 2}); });
  expect_error("do not fill", [&] { (void)luma(encodings::BGR8, {1, 2}); });
}

TEST_F(BagConversion, SaysWhatIsWrongInOneLine) {
  (void)make_recording("there", 1000);
  ASSERT_EQ(recording_to_bag(path("there"), path("a.bag"), {}, true).frames, 12U);
  const auto convert = [&](const BagOptions& options) {
    (void)bag_to_recording(path("a.bag"), path("out"), options, Stamps::kHeader);
  };
  BagOptions wrong_topic;
  wrong_topic.image_topic = "other";
  expect_error("there are: image", [&] { convert(wrong_topic); });
  BagOptions wrong_joint;
  wrong_joint.pan_joint = "shoulder";
  expect_error("pan_joint, tilt_joint", [&] { convert(wrong_joint); });
  expect_error("not empty",
               [&] { (void)bag_to_recording(path("a.bag"), path("there"), {}, Stamps::kHeader); });
  expect_error("exists already",
               [&] { (void)recording_to_bag(path("there"), path("a.bag"), {}, true); });
  expect_error("",
               [&] { (void)bag_to_recording(path("no.bag"), path("out2"), {}, Stamps::kHeader); });
  expect_error("recording.yaml",
               [&] { (void)recording_to_bag(path("no"), path("b.bag"), {}, true); });
  std::ofstream(path("there") + "/frames.csv") << "frame,receive_time_s\n0,1\n1,soon\n";
  expect_error("frames.csv:3", [&] { (void)read_tables(path("there")); });
  std::ofstream(path("there") + "/frames.csv") << "frame,receive_time_s\n0,1\n1,2";
  expect_error("frames.csv:3", [&] { (void)read_tables(path("there")); });
  std::ofstream(path("there") + "/frames.csv") << "frame\n0\n";
  expect_error("receive_time_s", [&] { (void)read_tables(path("there")); });
}

}  // namespace
}  // namespace alidade_ros
