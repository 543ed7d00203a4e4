// The tag's test judged by what is known of it: exact records leave the detector's noise alone, and a line delay that is not
// told leaves what the head moves between the first row and the tag's.

#include "test/accuracy/tag_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "test/accuracy/statistics.h"
#include "test/simulator/path.h"
#include "test/simulator/renderer.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPeriod = 0.04;  // s
constexpr double kNoise = 0.05;   // px, of a corner's coordinate
constexpr double kHalfTag = 30;   // px
constexpr int kFrames = 200;
constexpr double kChance = 0.9999;  // of a statistic within its interval; the seed is fixed

// Pan and tilt swing about the tag, with different periods, and reach rates of half a field of view a second.
class TagTable : public testing::Test {
 protected:
  TagTable() {
    for (int i = 0; i < kFrames; ++i) {
      const double t = i * kPeriod;
      RecordedOrientation at;
      at.frame = i;
      at.time_s = 100 + t;
      at.camera = {21338, 1, {55}, 1280, 720};
      at.mechanics.tilt_axis = Vector3d(0.006, 1, 0.014).normalized();
      at.line_delay = -21e-6;
      at.motion.angle = {0.012 * std::sin(2.1 * t), 0.008 * std::cos(3.3 * t)};
      at.motion.rate = {0.012 * 2.1 * std::cos(2.1 * t), -0.008 * 3.3 * std::sin(3.3 * t)};
      at.sigma_rad = {3e-5, 4e-5};
      truth_.push_back(at);
    }
    std::mt19937 generator(1);
    std::normal_distribution<double> noise(0, kNoise);
    for (const RecordedOrientation& at : truth_) {
      TagSighting sighting{at.frame, {}};
      for (std::size_t n = 0; n < 4; ++n) {
        const double turn = 0.3 + 0.5 * kPi * static_cast<double>(n);
        const double reach = std::sqrt(2.0) * kHalfTag / at.camera.focal_length;
        const Vector3d corner =
            Vector3d(1, reach * std::cos(turn), reach * std::sin(turn)).normalized();
        Vector2d& pixel = sighting.corners.at(n);
        EXPECT_EQ(rolling_shutter_project(at.camera, at.mechanics, at.line_delay, at.motion, corner,
                                          &pixel),
                  ProjectionStatus::kOk);
        pixel += Vector2d(noise(generator), noise(generator));
      }
      sightings_.push_back(sighting);
    }
  }

  std::vector<RecordedOrientation> truth_;
  std::vector<TagSighting> sightings_;
};

TEST_F(TagTable, ExactRecordsLeaveTheDetectorsNoise) {
  TagScatter scatter;
  std::string error;
  ASSERT_TRUE(scatter_of(sightings_, {{"truth", truth_}}, 0, &scatter, &error)) << error;
  ASSERT_EQ(scatter.frames.size(), static_cast<std::size_t>(kFrames));
  // Each diagonal moves across itself by the mean of its ends, and the crossing moves with both.
  const double sigma = kNoise / std::sqrt(2.0);
  const Interval interval = root_mean_square_interval(kFrames - 1, kChance);
  const TagRowResult& row = scatter.rows.front();
  EXPECT_TRUE(interval.contains(row.deviation.x() / sigma)) << row.deviation.x() / sigma;
  EXPECT_TRUE(interval.contains(row.deviation.y() / sigma)) << row.deviation.y() / sigma;
  // The length of two equal Gaussian components has the median sqrt(2 ln 2).
  EXPECT_NEAR(row.median_distance, sigma * std::sqrt(2 * std::log(2.0)), 0.2 * sigma);
  EXPECT_NEAR(row.told.x(), 4e-5 * 21338, 1e-9);
  EXPECT_NEAR(row.told.y(), 3e-5 * 21338, 1e-9);
}

TEST_F(TagTable, UntoldLineDelayScattersByTheMotionUpToTheTagsRow) {
  std::vector<RecordedOrientation> global_shutter = truth_;
  for (RecordedOrientation& at : global_shutter) at.line_delay = 0;
  TagScatter scatter;
  std::string error;
  ASSERT_TRUE(scatter_of(sightings_, {{"truth", truth_}, {"no line delay", global_shutter}}, 0,
                         &scatter, &error))
      << error;
  // rate * row * line delay, in px: right for pan, up for tilt.
  std::vector<Vector2d> shifts;
  Vector2d mean = Vector2d::Zero();
  for (std::size_t i = 0; i < truth_.size(); ++i) {
    double row = 0;
    for (const Vector2d& corner : sightings_[i].corners) row += corner.y() / 4;
    const double scale = 21338 * row * -21e-6;
    shifts.push_back({-scale * truth_[i].motion.rate.pan, scale * truth_[i].motion.rate.tilt});
    mean += shifts.back() / kFrames;
  }
  Vector2d squares = Vector2d::Zero();
  for (const Vector2d& shift : shifts) squares += (shift - mean).cwiseAbs2() / (kFrames - 1);
  const TagRowResult& noise = scatter.rows[0];
  const TagRowResult& untold = scatter.rows[1];
  ASSERT_GT(squares.minCoeff(), 1);
  // The small-angle formula leaves out distortion, at most 5 % here.
  EXPECT_NEAR(untold.deviation.x() / std::sqrt(squares.x()), 1, 0.05);
  EXPECT_NEAR(untold.deviation.y() / std::sqrt(squares.y()), 1, 0.05);
  EXPECT_NEAR(TagScatter::beyond(untold, noise) / std::sqrt(squares.sum()), 1, 0.05);
}

TEST_F(TagTable, MatchesRecordsOfAnotherProcessByTime) {
  std::vector<RecordedOrientation> live(truth_.begin() + 50, truth_.end());
  for (RecordedOrientation& at : live) {
    at.frame -= 50;
    at.time_s += 1e-3;
  }
  TagScatter scatter;
  std::string error;
  ASSERT_TRUE(scatter_of(sightings_, {{"truth", truth_}, {"live", live}}, 0, &scatter, &error))
      << error;
  ASSERT_EQ(scatter.frames.size(), static_cast<std::size_t>(kFrames - 50));
  EXPECT_EQ(scatter.frames.front(), 50);
  for (std::size_t i = 0; i < scatter.frames.size(); ++i) {
    EXPECT_EQ(scatter.rows[0].places[i], scatter.rows[1].places[i]);
  }
}

TEST_F(TagTable, RefusesTooFewCommonFrames) {
  const std::vector<RecordedOrientation> few(truth_.begin(), truth_.begin() + 5);
  TagScatter scatter;
  std::string error;
  EXPECT_FALSE(scatter_of(sightings_, {{"truth", truth_}, {"few", few}}, 0, &scatter, &error));
  EXPECT_NE(error.find("200 frames, 5 of which"), std::string::npos) << error;
}

TEST(TagRecords, OfTheModeAskedForAreRead) {
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/records.jsonl";
  nlohmann::json record{{"frame", 7},
                        {"time_s", 12.5},
                        {"mode", "OE"},
                        {"pan_rad", 0.1},
                        {"tilt_rad", 0.2},
                        {"pan_rate_rad_s", 0.3},
                        {"tilt_rate_rad_s", 0.4},
                        {"pan_acceleration_rad_s2", 0.5},
                        {"tilt_acceleration_rad_s2", 0.6},
                        {"orientation_sigma_rad", {1e-5, 2e-5, 3e-5}},
                        {"line_delay_s", -2e-5},
                        {"focal_length_px", 2000.0},
                        {"aspect", 1.01},
                        {"radial_distortion", 3.0}};
  std::ofstream stream(file);
  stream << R"({"frame":6,"time_s":12.46,"mode":"none","pan_rad":null})"
         << "\n"
         << record << "\n";
  record["mode"] = "PT";
  record["time_s"] = 12.54;
  stream << record << "\n";
  stream.close();

  Calibration calibration;
  calibration.camera.width = 640;
  calibration.mechanics.pan_axis = Vector3d(0.01, 0, 1).normalized();
  std::vector<RecordedOrientation> read;
  std::string error;
  ASSERT_TRUE(read_orientations(file, "OE", calibration, &read, &error)) << error;
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].frame, 7);
  EXPECT_EQ(read[0].time_s, 12.5);
  EXPECT_EQ(read[0].camera.focal_length, 2000);
  EXPECT_EQ(read[0].camera.aspect, 1.01);
  EXPECT_EQ(read[0].camera.width, 640);
  EXPECT_EQ(read[0].mechanics.pan_axis, calibration.mechanics.pan_axis);
  EXPECT_EQ(read[0].motion.rate.tilt, 0.4);
  EXPECT_EQ(read[0].motion.acceleration.pan, 0.5);
  EXPECT_EQ(read[0].sigma_rad, Vector2d(1e-5, 2e-5));

  std::ofstream(file) << "{\"mode\":\"OE\"}\n";
  EXPECT_FALSE(read_orientations(file, "OE", calibration, &read, &error));
  EXPECT_NE(error.find("records.jsonl:1"), std::string::npos) << error;
}

TEST(TagTruth, RatesAndAccelerationsAreThoseOfThePath) {
  const TemporaryDirectory directory;
  std::ofstream(directory.path() + "/truth.yaml")
      << "format: 1\nimage: {width: 640, height: 480}\n"
         "focal_length: {value: 2000, sigma: 0}\nradial_distortion: {value: 1, sigma: 0}\n"
         "line_delay: {value: 1e-5, sigma: 0}\npan_axis: {value: [0, 0, 1], sigma: [0, 0]}\n"
         "tilt_axis: {value: [0, 1, 0], sigma: [0, 0]}\npan_scale: {value: 1, sigma: 0}\n"
         "tilt_scale: {value: 1, sigma: 0}\nclock_offset: {value: -0.1, sigma: 0}\n";
  const auto pan = [](double t) { return 3.1 + 0.1 * std::sin(0.6 * t); };
  std::ofstream csv(directory.path() + "/truth.csv");
  csv.precision(15);
  csv << "frame,time_s,pan_rad,tilt_rad\n";
  for (int i = 0; i < 40; ++i) {
    const double t = i * kPeriod;
    csv << i << "," << 1000 + t << "," << wrap_angle(pan(t)) << "," << 0.02 * t * t << "\n";
  }
  csv.close();
  std::vector<RecordedOrientation> truth;
  std::string error;
  ASSERT_TRUE(read_true_orientations(directory.path(), &truth, &error)) << error;
  ASSERT_EQ(truth.size(), 36U);
  for (const RecordedOrientation& at : truth) {
    const double t = at.time_s - 1000.1;  // less the clock offset
    EXPECT_NEAR(wrap_angle(at.motion.angle.pan - pan(t)), 0, 1e-9);
    // Fourth order: h^4 / 30 of the fifth derivative, besides the rounding of 15 digits.
    EXPECT_NEAR(at.motion.rate.pan, 0.06 * std::cos(0.6 * t), 1e-8);
    EXPECT_NEAR(at.motion.acceleration.pan, -0.036 * std::sin(0.6 * t), 1e-7);
    EXPECT_NEAR(at.motion.rate.tilt, 0.04 * t, 1e-8);
    EXPECT_NEAR(at.motion.acceleration.tilt, 0.04, 1e-7);
  }
}

TEST(TagDetector, FindsTheTagWhereTheVirtualCameraShowsIt) {
  simulator::Config config;
  config.image = {640, 480, 25};
  config.camera.focal_length = 8000;
  config.path.amplitude = 0;
  config.sensor.exposure = 0;
  config.scene.background = 0.5;
  config.scene.detail = 0;
  simulator::PatchConfig tag;
  tag.file = std::string(ALIDADE_TEST_DATA) + "/april_tag.png";
  tag.width = 100 / config.camera.focal_length;
  tag.azimuth = 0.0123;
  tag.elevation = 0.0071;
  config.scene.photos.push_back(tag);
  const auto path = simulator::make_path(config);
  const simulator::Renderer renderer(config, *path);
  const std::vector<std::uint8_t> image = renderer.render(0, 0);

  const auto corners = test::TagDetector(0).find(
      {image.data(), config.image.width, config.image.height, config.image.width});
  ASSERT_TRUE(corners.has_value());
  // At rest, forward, without distortion: tangents times f. The diagonals cross in the middle of the photo.
  RecordedOrientation at;
  at.camera = {8000, 1, {0}, 640, 480};
  const Vector2d expected(320 + 8000 * std::tan(tag.azimuth),
                          240 - 8000 * std::tan(tag.elevation) / std::cos(tag.azimuth));
  Vector2d centre = Vector2d::Zero();
  for (const Vector2d& corner : *corners) centre += corner / 4;
  EXPECT_LT((centre - expected).norm(), 0.05) << centre.transpose() << ", " << expected.transpose();
  // The photo's black square is 256 of its 400 px wide.
  EXPECT_NEAR((corners->at(1) - corners->at(0)).norm(), 64, 0.2);
  EXPECT_FALSE(
      test::TagDetector(1)
          .find({image.data(), config.image.width, config.image.height, config.image.width})
          .has_value());
}

}  // namespace
}  // namespace alidade::test
