// `alidade calibrate-shutter` as a person meets it: the built executable on a rendered video, and on what is none or is spoilt.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "edge_app/storage/lens_file.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/platform/support/coded_stream.h"
#include "test/simulator/pattern_renderer.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

namespace fs = std::filesystem;

std::string pgm(int width, int height, const std::vector<std::uint8_t>& luma) {
  return fmt::format("P5\n{} {}\n255\n", width, height) + std::string(luma.begin(), luma.end());
}

// A recording of even greys, all different, with these stamps.
void write_greys(const TemporaryDirectory& directory, int width, int height,
                 const std::vector<double>& stamps_s) {
  directory.write("recording.yaml",
                  fmt::format("format: 1\nwidth: {}\nheight: {}\n", width, height));
  std::string frames = "frame,receive_time_s\n";
  for (std::size_t i = 0; i < stamps_s.size(); ++i) {
    frames += fmt::format("{},{}\n", i, stamps_s[i]);
    directory.write(fmt::format("frames/{:06}.pgm", i),
                    pgm(width, height,
                        std::vector<std::uint8_t>(static_cast<std::size_t>(width * height),
                                                  static_cast<std::uint8_t>(20 + 3 * (i % 70)))));
  }
  directory.write("frames.csv", frames);
}

// A recording of what the virtual camera sees, in "video".
void write_film(const TemporaryDirectory& directory, const simulator::Config& config, int images) {
  const simulator::PatternRenderer renderer(config);
  directory.write("video/recording.yaml", fmt::format("format: 1\nwidth: {}\nheight: {}\n",
                                                      config.image.width, config.image.height));
  std::string frames = "frame,receive_time_s,sequence\n";
  for (int i = 0; i < images; ++i) {
    const double time_s = i / config.image.rate_hz;
    frames += fmt::format("{},{},{}\n", i, 10 + time_s, i);
    directory.write(fmt::format("video/frames/{:06}.pgm", i),
                    pgm(config.image.width, config.image.height, renderer.render(time_s, i)));
  }
  directory.write("video/frames.csv", frames);
}

std::vector<double> steady(int count) {
  std::vector<double> stamps;
  for (int i = 0; i < count; ++i) stamps.push_back(10 + 0.05 * i);
  return stamps;
}

// Annex B in an MPEG transport stream.
void write_transport_stream(const std::string& path, const CodedStream& coded) {
  AVFormatContext* format = nullptr;
  ASSERT_GE(avformat_alloc_output_context2(&format, nullptr, "mpegts", path.c_str()), 0);
  AVStream* stream = avformat_new_stream(format, nullptr);
  ASSERT_GE(avcodec_parameters_copy(stream->codecpar, coded.parameters.get()), 0);
  ASSERT_GE(avio_open(&format->pb, path.c_str(), AVIO_FLAG_WRITE), 0);
  ASSERT_GE(avformat_write_header(format, nullptr), 0);
  const PacketPtr packet(av_packet_alloc());
  std::int64_t number = 0;
  for (const std::string& picture : coded.pictures) {
    ASSERT_GE(av_new_packet(packet.get(), static_cast<int>(picture.size())), 0);
    std::copy(picture.begin(), picture.end(), packet->data);
    packet->pts = packet->dts = number++ * 3600;
    ASSERT_GE(av_interleaved_write_frame(format, packet.get()), 0);
  }
  ASSERT_GE(av_write_trailer(format), 0);
  avio_closep(&format->pb);
  avformat_free_context(format);
}

class CalibrateShutterCommand : public ::testing::Test {
 protected:
  [[nodiscard]] Result calibrate(const std::string& video,
                                 const std::string& pattern = "chessboard:9x6:30mm") const {
    return alidade({"calibrate-shutter", video, "--pattern", pattern, "-o", out()});
  }
  [[nodiscard]] std::string out() const { return directory_.path() + "/out"; }
  void expect_refused(const Result& result, int exit_code, const std::string& why) const {
    EXPECT_EQ(result.exit_code, exit_code) << result.errors;
    EXPECT_THAT(last_line(result.errors), AllOf(StartsWith("alidade: "), HasSubstr(why)));
    EXPECT_FALSE(fs::exists(out() + "/lens.yaml"));
  }

  static void SetUpTestSuite() { silence_av_log(); }

  TemporaryDirectory directory_;
};

TEST_F(CalibrateShutterCommand, AVideoGivesLensReportAndWay) {
  simulator::Config config;
  config.image = {376, 240, 12};
  config.seed = 2;
  config.camera.line_delay = 80e-6;
  config.sensor.read_noise = 1;
  config.pattern.emplace();
  config.pattern->lens = {300, 301, 190, 118, -0.28, 0.08, 3e-4, -2e-4};
  config.pattern->hand.speed = 0.6;  // which 12 frames a second can follow
  write_film(directory_, config, 96);
  const Result result = calibrate(directory_.path() + "/video");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("line_delay"), HasSubstr("images show the pattern")));
  LensEstimate lens;
  std::string error;
  ASSERT_TRUE(load_lens(out() + "/lens.yaml", &lens, &error)) << error;
  EXPECT_EQ(lens.width, 376);
  const double sigma = std::sqrt(
      lens.covariance(index(LensParameter::kLineDelay), index(LensParameter::kLineDelay)));
  // What rendered corners have in common is not in sigma, which is some tenths of a microsecond: here it is to be the right delay.
  EXPECT_NEAR(lens.lens[index(LensParameter::kLineDelay)], 80e-6, 6 * sigma + 1e-6);
  const std::string page = directory_.read("out/report.html");
  for (const char* part :
       {"Line delay and lens of", "images of 376\u00d7240 px", "chessboard:9x6:30mm", "Line delay ",
        "from top to bottom", "focal_length_u", "Residuals over time, u", "Residuals over time, v",
        "same lens and curve, all rows exposed with the middle one", "Residuals over the image",
        "Residuals by row", "<b>Knots</b>", "<b>Position</b>", "<b>Orientation</b>",
        "cells are empty", "<b>Tilt</b>", "<b>Distance</b>", "</html>"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
  for (const char* part : {"nan", "http:", "<script", "src=", "no data"}) {
    EXPECT_THAT(page, Not(HasSubstr(part)));
  }
  EXPECT_THAT(directory_.read("out/trajectory.csv"), StartsWith("time_s,x_m,y_m,z_m"));
  EXPECT_THAT(directory_.read("out/camera_info.yaml"), HasSubstr("image_width: 376"));
}

TEST_F(CalibrateShutterCommand, AFileThatIsNoVideo) {
  expect_refused(calibrate(directory_.write("text.mp4", "hello\n")), 1,
                 "text.mp4: Invalid data found when processing input; expected a video file");
  expect_refused(calibrate(directory_.path() + "/none.mp4"), 1, "none.mp4: is not there");
}

TEST_F(CalibrateShutterCommand, WrongUnitsOfThePattern) {
  write_greys(directory_, 64, 48, steady(14));
  for (const auto& [pattern, what] :
       {std::pair("chessboard:9x6:25", "'25' is not a length with its unit, mm, cm, m or in"),
        {"chessboard:9x6:25km", "'25km' is not a length with its unit"},
        {"chessboard:9x6:25m", "'25m' is out of range, 0.1 mm to 10 m"},
        {"chessboard:9x6:0.00001mm", "is out of range"},
        {"chessboard:25mm:9x6", "'25mm' is not COLUMNSxROWS"},
        {"chessbord:9x6:25mm", "'chessbord' is not a kind of pattern"}}) {
    expect_refused(calibrate(directory_.path(), pattern), 2, what);
  }
}

TEST_F(CalibrateShutterCommand, NoPatternInAnyFrame) {
  write_greys(directory_, 64, 48, steady(14));
  expect_refused(calibrate(directory_.path()), 1, "9x6 are inner corners, of a board of 10x7");
  expect_refused(calibrate(directory_.path(), "circles:4x11:20mm"), 1,
                 "4x11 are 11 rows of 4 circles, every second row moved by half");
  expect_refused(calibrate(directory_.path(), "aprilgrid:6x6:30mm:0.3"), 1, "family 36h11");
}

// kalibr's board under another name: what differs, and what its name would be.
TEST_F(CalibrateShutterCommand, AnAprilGridThatIsMisnamed) {
  simulator::Config config;
  config.image = {376, 240, 12};
  config.sensor.read_noise = 1;
  config.pattern.emplace();
  config.pattern->kind = simulator::PatternConfig::Kind::kAprilGrid;
  config.pattern->columns = 4;
  config.pattern->rows = 3;
  config.pattern->size = 0.05;
  config.pattern->lens = {300, 301, 190, 118, -0.28, 0.08, 3e-4, -2e-4};
  write_film(directory_, config, 6);
  const std::string video = directory_.path() + "/video";
  expect_refused(calibrate(video, "aprilgrid:4x3:50mm:0.25"), 1,
                 video +
                     ": the gap between its tags is 0.30 of a tag's side, but 0.25 was "
                     "given; is it aprilgrid:4x3:50mm:0.30?");
  expect_refused(calibrate(video, "aprilgrid:3x4:50mm:0.3"), 1,
                 "its tags lie in rows of 4, but 3 were given");
}

// Of a build without OpenCV's aruco the package that it lacks.
TEST_F(CalibrateShutterCommand, NoCharucoBoardInAnyFrame) {
  write_greys(directory_, 64, 48, steady(14));
  const Result result = calibrate(directory_.path(), "charuco:9x6:30mm:22mm");
  if (!simulator::PatternBoard::has_charuco())
    return expect_refused(result, 2,
                          "cannot find ChArUco boards; build it with Debian's package libopencv");
  expect_refused(result, 1, "9x6 are squares, every second one with a marker of 4x4_50");
  EXPECT_THAT(result.errors, HasSubstr("no markers of dictionary 4x4_50 are seen in any image"));
  expect_refused(calibrate(directory_.path(), "charuco:9x6:22mm:30mm"), 2,
                 "a marker of 30mm does not fit into a square of 22mm; give the square first");
}

TEST_F(CalibrateShutterCommand, AnImageOneColumnWide) {
  write_greys(directory_, 1, 48, steady(14));
  expect_refused(calibrate(directory_.path()), 1,
                 "its images are 1x48 px, too small for a pattern; expected 32 px or more a side");
}

TEST_F(CalibrateShutterCommand, StampsDoubledOrBackwards) {
  std::vector<double> stamps = steady(14);
  stamps[5] = stamps[4];
  write_greys(directory_, 64, 48, stamps);
  const std::string where = directory_.path() + ": time stamps do not increase: image 5 is of ";
  expect_refused(calibrate(directory_.path()), 1, where + "10.2 s, the one before of 10.2 s");
  stamps[5] = stamps[2];
  write_greys(directory_, 64, 48, stamps);
  expect_refused(calibrate(directory_.path()), 1, where + "10.1 s, the one before of 10.2 s");
}

// Codes without a container: when each picture was taken is nowhere.
TEST_F(CalibrateShutterCommand, StampsMissing) {
  const CodedStream coded = coded_stream({});
  std::string bytes;
  for (const std::string& picture : coded.pictures) bytes += picture;
  expect_refused(calibrate(directory_.write("raw.h264", bytes)), 1,
                 "raw.h264: its pictures have no time stamps; put it into a container");
}

TEST_F(CalibrateShutterCommand, AVariableFrameRateIsSaid) {
  // Slower in the dark; and now and then, about a mean.
  std::vector<double> slower = {10};
  std::vector<double> uneven = {10};
  while (slower.size() < 60) {
    slower.push_back(slower.back() + (slower.size() < 30 ? 0.033 : 0.052));
    uneven.push_back(uneven.back() + (uneven.size() % 5 < 2 ? 0.033 : 0.052));
  }
  for (const auto& [stamps, what] : {std::pair(slower, "the frame rate is not steady"),
                                     {uneven, "about a steady rate of 22."}}) {
    write_greys(directory_, 64, 48, stamps);
    const Result result = calibrate(directory_.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.errors, HasSubstr(what));
  }
}

TEST_F(CalibrateShutterCommand, InterlacedVideoIsSaid) {
  for (const bool interlaced : {false, true}) {
    CodedStreamOptions options;
    options.interlaced = interlaced;
    const std::string path = directory_.path() + "/video.ts";
    write_transport_stream(path, coded_stream(options));
    const Result result = calibrate(path);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.errors.find("the video is interlaced") != std::string::npos, interlaced)
        << result.errors;
  }
}

}  // namespace
}  // namespace alidade
