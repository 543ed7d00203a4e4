#include "test/simulator/recording_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "test/simulator/camera_model.h"
#include "test/simulator/pattern_board.h"
#include "test/simulator/pattern_camera.h"
#include "test/simulator/scene.h"
#include "test/support/temporary_directory.h"

extern "C" {
#include <libavformat/avformat.h>
}

namespace alidade::simulator {
namespace {

// Rows of numbers under the names of their columns.
using Table = std::vector<std::map<std::string, double>>;

Table read_csv(const std::string& file, const std::string& expected_header) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  EXPECT_EQ(line, expected_header) << file;
  std::vector<std::string> names;
  std::stringstream header(line);
  for (std::string name; std::getline(header, name, ',');) names.push_back(name);
  Table table;
  while (std::getline(stream, line)) {
    std::map<std::string, double> row;
    std::stringstream cells(line);
    for (const std::string& name : names) {
      std::string cell;
      EXPECT_TRUE(std::getline(cells, cell, ',')) << line;
      char* end = nullptr;
      row[name] = std::strtod(cell.c_str(), &end);
      EXPECT_EQ(*end, '\0') << line;
    }
    table.push_back(row);
  }
  return table;
}

class VirtualRecording : public testing::Test {
 protected:
  VirtualRecording() {
    config_.image = {160, 120, 25};
    config_.duration = 2;
    config_.camera.focal_length = 4321;
    config_.camera.line_delay = -20e-6;
    config_.camera.clock_offset = 0.2;
    config_.camera.pan_axis_offset = {-0.012, 0};
    config_.path.period = 4;
    config_.recording.images = RecordingConfig::Images::kNone;
  }

  std::string write() {
    write_recording(config_, directory());
    return directory() + "/";
  }
  std::string directory() const { return root_.path() + "/recording"; }

  TemporaryDirectory root_;
  Config config_;
};

TEST_F(VirtualRecording, HoldsTheParametersUnderTheNamesOfACalibration) {
  const YAML::Node truth = YAML::LoadFile(write() + "truth.yaml");
  EXPECT_EQ(truth["format"].as<int>(), 1);
  EXPECT_EQ(truth["image"]["width"].as<int>(), 160);
  EXPECT_EQ(truth["focal_length"]["value"].as<double>(), 4321);
  EXPECT_EQ(truth["aspect"]["value"].as<double>(), 1);
  EXPECT_EQ(truth["radial_distortion"]["value"].as<double>(), 0);
  EXPECT_EQ(truth["line_delay"]["value"].as<double>(), -20e-6);
  EXPECT_EQ(truth["clock_offset"]["value"].as<double>(), 0.2);
  EXPECT_EQ(truth["pan_scale"]["value"].as<double>(), 1);
  EXPECT_EQ(truth["tilt_scale"]["value"].as<double>(), 1);
  EXPECT_NEAR(truth["pan_axis"]["value"][0].as<double>(), std::sin(-0.012), 1e-12);
  EXPECT_NEAR(truth["tilt_axis"]["value"][1].as<double>(), 1, 1e-12);
  const YAML::Node recording = YAML::LoadFile(directory() + "/recording.yaml");
  EXPECT_EQ(recording["format"].as<int>(), 1);
  EXPECT_EQ(recording["height"].as<int>(), 120);
  EXPECT_EQ(YAML::LoadFile(directory() + "/guess.yaml")["focal_length"]["value"].as<double>(),
            4300);
}

TEST_F(VirtualRecording, StampsFramesOnTheImageClockAndTellsTheTrueAngles) {
  config_.timing.frame_loss = 0.2;
  config_.timing.image.exponential = 1e-3;
  config_.timing.image_clock_skew = 1e-4;
  const std::string recording = write();
  const Table frames =
      read_csv(recording + "frames.csv", "frame,receive_time_s,sender_time_s,sequence");
  const Table truth = read_csv(recording + "truth.csv",
                               "frame,time_s,pan_rad,tilt_rad,sequence,sender_time_s,stamp_time_s");
  ASSERT_EQ(frames.size(), truth.size());
  ASSERT_GT(frames.size(), 30U);
  ASSERT_LT(frames.size(), 50U);
  const auto path = make_path(config_);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double time = truth[i].at("time_s");
    EXPECT_EQ(frames[i].at("frame"), static_cast<double>(i));
    EXPECT_NEAR(time, frames[i].at("sequence") / 25, 1e-12);
    EXPECT_GE(frames[i].at("receive_time_s"), time);
    EXPECT_NEAR(frames[i].at("sender_time_s"), time * 1.0001, 1e-12);
    EXPECT_NEAR(truth[i].at("pan_rad"), path->at(time).pan, 1e-12);
    EXPECT_NEAR(truth[i].at("tilt_rad"), path->at(time).tilt, 1e-12);
  }
}

TEST_F(VirtualRecording, PutsTelemetryOnItsOwnClockAheadByTheOffset) {
  config_.telemetry.rate_hz = 50;
  config_.telemetry.sigma = 1e-5;
  const Table telemetry =
      read_csv(write() + "telemetry.csv", "receive_time_s,pan_rad,tilt_rad,sequence");
  ASSERT_EQ(telemetry.size(), 200U);
  const auto path = make_path(config_);
  const auto misfit = [&](double offset) {
    double sum = 0;
    for (const auto& row : telemetry) {
      const Angles truth = path->at(row.at("receive_time_s") - offset);
      sum +=
          std::pow(row.at("pan_rad") - truth.pan, 2) + std::pow(row.at("tilt_rad") - truth.tilt, 2);
    }
    return sum / static_cast<double>(2 * telemetry.size());
  };
  // 400 squares of N(0, 1e-5): the mean is within 4 sqrt(2 / 400) of 1e-10.
  EXPECT_NEAR(misfit(0.2), 1e-10, 1e-10 * 4 * std::sqrt(2.0 / 400));
  EXPECT_GT(misfit(-0.2), 1e-6);
  EXPECT_GT(misfit(0.201), 2e-10);
  EXPECT_GT(misfit(0.199), 2e-10);
  EXPECT_NEAR(telemetry.front().at("receive_time_s"), -0.8, 1e-12);
}

TEST_F(VirtualRecording, ProjectsLandmarksOfAGridIntoTracks) {
  config_.recording.pixel_sigma = 0;
  config_.camera.tilt_axis_offset = {0, 0.014};
  const Table tracks = read_csv(write() + "tracks.csv", "frame,landmark,u_px,v_px,sigma_px");
  const auto path = make_path(config_);
  const CameraModel camera(config_.camera, config_.image, *path);
  // Any landmark is one direction, whichever frame it is seen in.
  std::map<double, Eigen::Vector3d> directions;
  std::map<double, int> per_frame;
  int seen_again = 0;
  for (const auto& row : tracks) {
    const double v = row.at("v_px");
    const double time = row.at("frame") / 25 + v * config_.camera.line_delay;
    const Eigen::Vector2d slope = camera.slope(row.at("u_px"), v);
    const Eigen::Vector3d d_base =
        (camera.base_from_camera_at(time) * Eigen::Vector3d(slope.x(), slope.y(), 1)).normalized();
    const auto [first, is_new] = directions.emplace(row.at("landmark"), d_base);
    EXPECT_LT((first->second - d_base).norm(), 1e-8);
    seen_again += is_new ? 0 : 1;
    ++per_frame[row.at("frame")];
  }
  EXPECT_GT(seen_again, 1000);
  ASSERT_EQ(per_frame.size(), 50U);
  // A tenth of the field apart: about 10 x 7.5 in a picture of 4:3.
  for (const auto& [frame, count] : per_frame) EXPECT_NEAR(count, 75, 25) << frame;
}

TEST_F(VirtualRecording, LandmarksAtADistanceAreSeenFromThePupil) {
  config_.recording.pixel_sigma = 0;
  config_.recording.landmark_distance = DistanceConfig{20, 500, 0, 0.1};
  config_.camera.pupil = {0.02, 0.03, 0.08};
  const std::string recording = write();
  const Table tracks = read_csv(recording + "tracks.csv", "frame,landmark,u_px,v_px,sigma_px");
  const Table landmarks =
      read_csv(recording + "truth_landmarks.csv", "landmark,inverse_distance_per_m");
  std::map<double, double> inverse;
  for (const auto& row : landmarks) {
    inverse[row.at("landmark")] = row.at("inverse_distance_per_m");
    EXPECT_GE(inverse[row.at("landmark")], 1 / 500.0 - 1e-12);
    EXPECT_LE(inverse[row.at("landmark")], 1 / 20.0 + 1e-12);
  }
  const auto path = make_path(config_);
  const CameraModel camera(config_.camera, config_.image, *path);
  // All rays of a landmark meet in one place at its distance.
  std::map<double, Eigen::Vector3d> places;
  for (const auto& row : tracks) {
    const double v = row.at("v_px");
    const double time = row.at("frame") / 25 + v * config_.camera.line_delay;
    const Eigen::Matrix3d turn = camera.base_from_camera_at(time);
    const Eigen::Vector3d from = turn * config_.camera.pupil;
    const Eigen::Vector3d ray = (turn * camera.slope(row.at("u_px"), v).homogeneous()).normalized();
    const double distance = 1 / inverse.at(row.at("landmark"));
    const double along = from.dot(ray);
    const double length =
        std::sqrt(distance * distance - from.squaredNorm() + along * along) - along;
    const Eigen::Vector3d place = from + length * ray;
    EXPECT_LT((places.emplace(row.at("landmark"), place).first->second - place).norm(),
              1e-6 * distance);
  }
  EXPECT_EQ(places.size(), landmarks.size());
  EXPECT_EQ(YAML::LoadFile(recording + "truth.yaml")["departures"]["pupil"][2].as<double>(), 0.08);
}

TEST_F(VirtualRecording, TellsTheZoomInTelemetryAndItsLensInTheTruth) {
  ZoomConfig& zoom = config_.zoom.emplace();
  zoom.centre = {5, -2};
  zoom.sigma_rep = 1e-3;
  zoom.path.type = ZoomPathConfig::Type::kSweep;
  zoom.path.duration = 4.5;
  config_.telemetry.rate_hz = 50;
  const std::string recording = write();
  const Zoom expected(config_);
  const Table telemetry =
      read_csv(recording + "telemetry.csv", "receive_time_s,pan_rad,tilt_rad,zoom,sequence");
  ASSERT_EQ(telemetry.size(), 200U);
  for (const auto& row : telemetry) {
    EXPECT_EQ(row.at("zoom"), std::round(row.at("zoom")));
    EXPECT_EQ(row.at("zoom"), expected.reported(row.at("receive_time_s") - 0.2));
  }
  const Table truth = read_csv(recording + "truth.csv",
                               "frame,time_s,pan_rad,tilt_rad,sequence,sender_time_s,stamp_time_s,"
                               "focal_length_px,radial_distortion,centre_u_px,centre_v_px,zoom");
  ASSERT_EQ(truth.size(), 50U);
  for (const auto& row : truth) {
    const Lens lens = expected.lens(row.at("time_s"));
    EXPECT_NEAR(row.at("focal_length_px"), lens.focal_length, 1e-9);
    EXPECT_NEAR(row.at("centre_u_px"), lens.centre.x(), 1e-9);
    EXPECT_NEAR(row.at("centre_v_px"), lens.centre.y(), 1e-9);
    EXPECT_NEAR(row.at("zoom"), expected.reading(row.at("time_s")), 1e-9);
  }
  EXPECT_GT(truth.back().at("focal_length_px"), 2 * truth.front().at("focal_length_px"));
  const YAML::Node yaml = YAML::LoadFile(recording + "truth.yaml");
  EXPECT_NEAR(yaml["focal_length"]["value"].as<double>(), truth.front().at("focal_length_px"),
              1e-9);
  EXPECT_EQ(yaml["zoom"].as<double>(), 1);
  EXPECT_EQ(yaml["centre_offset"]["value"][1].as<double>(), -2);
  const YAML::Node curve = yaml["zoom_samples"];
  ASSERT_GT(curve.size(), 60U);
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const Lens lens = expected.nominal_lens(curve[i]["zoom"].as<double>());
    EXPECT_NEAR(curve[i]["focal_length"].as<double>(), lens.focal_length, 1e-6);
    EXPECT_NEAR(curve[i]["centre_offset"][0].as<double>(), lens.centre.x() - 80, 1e-6);
  }
  EXPECT_NEAR(curve[curve.size() - 1]["focal_length"].as<double>(), 24000, 1e-6);
}

TEST_F(VirtualRecording, TellsWhatACameraIsBeyondACalibrationsNames) {
  config_.camera.radial_distortion_2 = 3;
  config_.camera.tangential = {1e-3, -2e-3};
  config_.camera.centre = {10, -8};
  config_.camera.breathing = {Breathing::Type::kLinear, 1e-3, 2};
  config_.telemetry.pan_gear = {{2e-4, 0.1, 0.5}};
  config_.telemetry.play = {1e-4, 0, PlayConfig::Encoder::kOutput};
  const std::string recording = write();
  const YAML::Node yaml = YAML::LoadFile(recording + "truth.yaml");
  EXPECT_EQ(yaml["centre_offset"]["value"][0].as<double>(), 10);
  const YAML::Node departures = yaml["departures"];
  EXPECT_EQ(departures["radial_distortion_2"].as<double>(), 3);
  EXPECT_EQ(departures["tangential_distortion"][1].as<double>(), -2e-3);
  EXPECT_EQ(departures["breathing"]["part"].as<double>(), 1e-3);
  EXPECT_EQ(departures["gear"]["pan"][0]["period"].as<double>(), 0.1);
  EXPECT_EQ(departures["gear"]["tilt"].size(), 0U);
  EXPECT_EQ(departures["play"]["encoder"].as<std::string>(), "output");
  const Table truth = read_csv(recording + "truth.csv",
                               "frame,time_s,pan_rad,tilt_rad,sequence,sender_time_s,stamp_time_s,"
                               "focal_length_px,radial_distortion,centre_u_px,centre_v_px");
  EXPECT_NEAR(truth[25].at("focal_length_px"), 4321 * (1 + 0.5e-3), 1e-6);
  EXPECT_EQ(truth[25].at("centre_u_px"), 90);
}

TEST_F(VirtualRecording, LandmarksOfATrackAreThereAtEveryZoomUnderTheSameNumber) {
  config_.duration = 5;
  config_.image.rate_hz = 5;
  config_.path.amplitude = 0;
  config_.recording.pixel_sigma = 0;
  ZoomConfig& zoom = config_.zoom.emplace();
  zoom.sigma_rep = 1e-3;
  zoom.distortion = {-0.04, 0.02};
  zoom.path.type = ZoomPathConfig::Type::kSweep;
  zoom.path.duration = 4.6;
  zoom.path.factor = 20;
  const Table tracks = read_csv(write() + "tracks.csv", "frame,landmark,u_px,v_px,sigma_px");
  const auto path = make_path(config_);
  const CameraModel camera(config_.camera, config_.image, *path, make_zoom(config_));
  std::map<double, Eigen::Vector3d> directions;
  std::map<double, double> shortest;
  std::map<double, double> longest;
  std::map<double, int> per_frame;
  for (const auto& row : tracks) {
    const double v = row.at("v_px");
    const double time = row.at("frame") / 5 + v * config_.camera.line_delay;
    const Lens lens = camera.lens_at(time);
    const Eigen::Vector3d d_base =
        (camera.base_from_camera_at(time) * lens.slope(row.at("u_px"), v).homogeneous())
            .normalized();
    const double landmark = row.at("landmark");
    EXPECT_LT((directions.emplace(landmark, d_base).first->second - d_base).norm(), 1e-8);
    shortest.emplace(landmark, lens.focal_length);
    longest[landmark] = lens.focal_length;
    ++per_frame[row.at("frame")];
  }
  // Different landmarks are different directions.
  for (auto a = directions.begin(); a != directions.end(); ++a) {
    for (auto b = std::next(a); b != directions.end(); ++b) {
      ASSERT_GT((a->second - b->second).norm(), 1e-6);
    }
  }
  ASSERT_EQ(per_frame.size(), 25U);
  // 75 where the spacing is as asked for; it may be off by the root of 2 either way, and a grid of 7 x 5 has its luck.
  for (const auto& [frame, count] : per_frame) {
    EXPECT_GE(count, 30) << frame;
    EXPECT_LE(count, 180) << frame;
  }
  double most = 0;
  for (const auto& [landmark, first] : shortest) most = std::max(most, longest[landmark] / first);
  EXPECT_GT(most, 4);
  EXPECT_LT(most, 9.5);
}

TEST_F(VirtualRecording, WritesVideoThatLibavReads) {
  config_.recording.images = RecordingConfig::Images::kVideo;
  config_.duration = 0.4;
  const std::string file = write() + "video.mkv";
  AVFormatContext* video = nullptr;
  ASSERT_EQ(avformat_open_input(&video, file.c_str(), nullptr, nullptr), 0);
  AVPacket* packet = av_packet_alloc();
  int frames = 0;
  for (; av_read_frame(video, packet) >= 0; ++frames) {
    const cv::Mat bytes(1, packet->size, CV_8U, packet->data);
    const cv::Mat picture = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
    EXPECT_EQ(picture.size(), cv::Size(160, 120));
    EXPECT_NEAR(picture.at<std::uint8_t>(60, 80), 128, 1);
    EXPECT_NEAR(static_cast<double>(packet->pts) * av_q2d(video->streams[0]->time_base),
                frames / 25.0, 1e-3);
    av_packet_unref(packet);
  }
  EXPECT_EQ(frames, 10);
  av_packet_free(&packet);
  avformat_close_input(&video);
}

TEST_F(VirtualRecording, KeepsVideoAtTheRateAskedFor) {
  config_.image = {320, 240, 25};
  config_.camera.focal_length = 1000;
  config_.path.period = 20;
  config_.duration = 5;
  config_.sensor.read_noise = 6;
  PatchConfig patch;
  patch.width = patch.height = 1;
  config_.scene.procedural = {patch};
  config_.recording.images = RecordingConfig::Images::kVideo;
  for (const auto codec : {VideoCodec::kH264, VideoCodec::kH265}) {
    config_.recording.encoding = {codec, 800, 50};
    const std::string folder = root_.path() + (codec == VideoCodec::kH264 ? "/h264" : "/h265");
    write_recording(config_, folder);
    const auto bytes = static_cast<double>(std::filesystem::file_size(folder + "/video.mkv"));
    EXPECT_NEAR(bytes * 8 / 5 / 1000, 800, 160);
    AVFormatContext* video = nullptr;
    ASSERT_EQ(avformat_open_input(&video, (folder + "/video.mkv").c_str(), nullptr, nullptr), 0);
    EXPECT_EQ(video->streams[0]->codecpar->codec_id,
              codec == VideoCodec::kH264 ? AV_CODEC_ID_H264 : AV_CODEC_ID_HEVC);
    EXPECT_GT(video->streams[0]->codecpar->extradata_size, 0);
    AVPacket* packet = av_packet_alloc();
    int frames = 0;
    for (; av_read_frame(video, packet) >= 0; ++frames) {
      EXPECT_EQ((packet->flags & AV_PKT_FLAG_KEY) != 0, frames % 50 == 0) << frames;
      // In the order of capture: no B pictures.
      EXPECT_NEAR(static_cast<double>(packet->pts) * av_q2d(video->streams[0]->time_base),
                  frames / 25.0, 1e-3);
      av_packet_unref(packet);
    }
    EXPECT_EQ(frames, 125);
    av_packet_free(&packet);
    avformat_close_input(&video);
  }
}

TEST_F(VirtualRecording, WritesNumberedPictures) {
  for (const auto& [images, extension] : {std::pair(RecordingConfig::Images::kPng, "png"),
                                          std::pair(RecordingConfig::Images::kPgm, "pgm")}) {
    config_.recording.images = images;
    config_.duration = 0.2;
    const std::string last = root_.path() + "/" + extension + "/frames/000004." + extension;
    write_recording(config_, root_.path() + "/" + extension);
    EXPECT_EQ(cv::imread(last, cv::IMREAD_UNCHANGED).size(), cv::Size(160, 120)) << last;
  }
}

TEST_F(VirtualRecording, TellsTheNoiseThatIsThere) {
  config_.timing.telemetry.sigma = 3e-3;
  config_.timing.image.exponential = 2e-3;
  config_.timing.image_period_sigma = 20e-6;
  config_.telemetry.sigma = 1e-4;
  config_.recording.pixel_sigma = 0.4;
  const YAML::Node noise = YAML::LoadFile(write() + "noise.yaml");
  EXPECT_DOUBLE_EQ(noise["telemetry_stamp_sigma_s"].as<double>(), 3e-3);
  EXPECT_FALSE(noise["image_stamp_sigma_s"]);  // late, not to both sides
  EXPECT_DOUBLE_EQ(noise["image_period_sigma_s"].as<double>(), 20e-6);
  EXPECT_NEAR(noise["image_period_s"].as<double>(), 0.04, 5 * 20e-6);
  EXPECT_NE(noise["image_period_s"].as<double>(), 0.04);
  EXPECT_FALSE(noise["telemetry_period_s"]);
  EXPECT_DOUBLE_EQ(noise["pan_tilt_sigma_rad"].as<double>(), 1e-4);
  EXPECT_DOUBLE_EQ(noise["pixel_sigma_px"].as<double>(), 0.4);
}

TEST_F(VirtualRecording, RefusesADirectoryThatHoldsSomething) {
  root_.write("recording/other.txt", "");
  EXPECT_THROW(write_recording(config_, directory()), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(directory() + "/truth.yaml"));
}

TEST_F(VirtualRecording, NeedsADuration) {
  config_.duration = 0;
  EXPECT_THROW(write_recording(config_, directory()), ConfigError);
}

TEST_F(VirtualRecording, TellsLensAndPoseBeforeAPattern) {
  config_.pattern.emplace();
  config_.recording.images = RecordingConfig::Images::kPgm;
  config_.duration = 0.4;
  config_.timing.image.sigma = 1e-3;
  const std::string recording = write();
  const YAML::Node lens = YAML::LoadFile(recording + "truth.yaml");
  EXPECT_EQ(lens["line_delay"]["value"].as<double>(), -20e-6);
  EXPECT_EQ(lens["focal_length_v"]["value"].as<double>(), 602);
  EXPECT_EQ(lens["optical_centre_u"]["value"].as<double>(), 380);
  EXPECT_EQ(lens["k2"]["value"].as<double>(), 0.08);
  const Table frames = read_csv(recording + "frames.csv", "frame,receive_time_s,sequence");
  const Table truth = read_csv(recording + "truth.csv",
                               "frame,time_s,x_m,y_m,z_m,q_x,q_y,q_z,q_w,sequence,stamp_time_s");
  ASSERT_EQ(truth.size(), 10U);
  ASSERT_EQ(frames.size(), truth.size());
  const PatternBoard board(*config_.pattern);
  const PatternCamera camera(config_, board.centre());
  double jitter = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto& row = truth[i];
    EXPECT_NEAR(row.at("time_s"), static_cast<double>(i) / 25, 1e-12);
    EXPECT_EQ(frames[i].at("receive_time_s"), row.at("stamp_time_s"));
    jitter = std::max(jitter, std::abs(row.at("stamp_time_s") - row.at("time_s")));
    // A place of the board seen from the pose that is told.
    const Eigen::Quaterniond q(row.at("q_w"), row.at("q_x"), row.at("q_y"), row.at("q_z"));
    const Eigen::Vector3d place(board.points().back().x(), board.points().back().y(), 0);
    const Eigen::Vector3d p =
        q.conjugate() * (place - Eigen::Vector3d(row.at("x_m"), row.at("y_m"), row.at("z_m")));
    const CameraPose pose = camera.pose(row.at("time_s"));
    EXPECT_LT((p - pose.R_camera_from_pattern * place - pose.pattern_in_camera).norm(), 1e-9);
  }
  EXPECT_GT(jitter, 1e-4);
  EXPECT_EQ(cv::imread(recording + "frames/000009.pgm", cv::IMREAD_GRAYSCALE).cols, 160);
}

}  // namespace
}  // namespace alidade::simulator
