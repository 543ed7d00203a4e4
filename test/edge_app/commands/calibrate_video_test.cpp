// `alidade calibrate` on video: the built executable on recordings that alidade-simulate made, whole ones
// and spoilt ones. The virtual camera shares no code with what is tested.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "edge_app/storage/calibration_file.h"
#include "edge_app/storage/calibration_store.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

namespace fs = std::filesystem;

constexpr double kFocalLength = 900;  // px; 20 degrees wide
constexpr double kDistortion = 1.7;   // 7 % in the corners
constexpr double kLineDelay = 75e-6;  // s; 34 % of a frame's time
constexpr double kClockOffset = -0.0844;

std::string camera(const std::string& more) {
  return "seed: 3\n"
         "duration_s: 8\n"
         "image: {width: 320, height: 180, rate_hz: 25}\n"
         "camera: {focal_length_px: 900, radial_distortion: 1.7, line_delay_us: 75,\n"
         "  pan_axis_mrad: [-12, 5], tilt_axis_mrad: [-4, 14], clock_offset_ms: -84.4}\n"
         "path: {type: triple_cosine, amplitude: 1, period_s: 7}\n"
         "sensor: {exposure_ms: 1, read_noise: 1.5, jpeg_quality: 90}\n"
         "telemetry: {rate_hz: 50, sigma_rad: 2.0e-4}\n"
         "timing: {image_jitter: {sigma_ms: 0.3}, telemetry_jitter: {sigma_ms: 0.3}}\n" +
         more;
}

const char* const kTexture =
    "scene:\n"
    "  procedural:\n"
    "    - {width_deg: 360, height_deg: 180, projection: equirectangular}\n";

void film(const TemporaryDirectory& directory, const std::string& configuration,
          const std::string& name) {
  const std::string file = directory.write("camera.yaml", configuration);
  const Result result = run({ALIDADE_SIMULATE, "-c", file, "-o", directory.path() + "/" + name});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
}

// One recording for all tests, which write elsewhere.
class CalibrateVideo : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryDirectory;
    film(*shared_, camera(kTexture), "recording");
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }
  static std::string recording() { return shared_->path() + "/recording"; }

  // A copy to spoil.
  [[nodiscard]] std::string copy() const {
    fs::copy(recording(), path("copy"), fs::copy_options::recursive);
    return path("copy");
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return directory_.path() + "/" + name;
  }
  static Calibration load(const std::string& file) {
    Calibration calibration;
    std::string error;
    EXPECT_TRUE(load_calibration(file, &calibration, &error)) << error;
    return calibration;
  }

  TemporaryDirectory directory_;

 private:
  static TemporaryDirectory* shared_;
};

TemporaryDirectory* CalibrateVideo::shared_ = nullptr;

// |error| < 5 sigma fails a right program once in two million; a little more is left to what the patches of
// one landmark have in common.
void expect_near_truth(const Calibration& calibration) {
  const auto expect_near = [&](Parameter parameter, double value, double truth) {
    const double sigma = std::sqrt(calibration.covariance(index(parameter), index(parameter)));
    EXPECT_GT(sigma, 0) << to_string(parameter);
    EXPECT_LT(std::abs(value - truth), 6 * sigma) << to_string(parameter);
  };
  expect_near(Parameter::kFocalLength, calibration.camera.focal_length, kFocalLength);
  expect_near(Parameter::kRadialDistortion, calibration.camera.distortion.radial, kDistortion);
  expect_near(Parameter::kLineDelay, calibration.line_delay, kLineDelay);
  expect_near(Parameter::kClockOffset, calibration.clock_offset, kClockOffset);
  // Whatever the sigmas say.
  EXPECT_NEAR(calibration.camera.focal_length, kFocalLength, 1e-3 * kFocalLength);
  EXPECT_NEAR(calibration.camera.distortion.radial, kDistortion, 0.01 * kDistortion);
  EXPECT_NEAR(calibration.line_delay, kLineDelay, 0.5e-6);
}

TEST_F(CalibrateVideo, FindsTheCameraFromNothing) {
  for (const char* passes : {"1", "2"}) {
    SCOPED_TRACE(passes);
    const std::string out = path(passes);
    const Result result = calibrate_command({recording(), "--json", "--passes", passes, "-o", out});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    expect_near_truth(load(out + "/calibration.yaml"));
    const auto json = nlohmann::json::parse(result.output);
    EXPECT_EQ(json["files"]["tracks"], out + "/tracks.csv");
    for (const char* name : {"report.html", "map.bin", "tracks.csv"}) {
      EXPECT_TRUE(fs::exists(out + "/" + name)) << name;
    }
  }
  EXPECT_FALSE(fs::exists(recording() + "/tracks.csv"));
  EXPECT_FALSE(fs::exists(recording() + "/alidade"));
}

TEST_F(CalibrateVideo, StoresTheMapThatBelongsToTheCalibration) {
  const std::string out = path("out");
  ASSERT_EQ(calibrate_command({recording(), "-o", out}).exit_code, 0);
  // As a start of `alidade run` would.
  CalibrationStore store(out + "/calibration.yaml");
  EXPECT_THAT(store.load(320, 180), ElementsAre(HasSubstr("landmarks")));
  const StoredCalibration* stored = store.find({});
  ASSERT_NE(stored, nullptr);
  const MapState& map = stored->map;
  EXPECT_GT(map.landmarks.size(), 500U);
  // 400 samples of 2e-4 rad, up to twice that to be safe, and a tenth of a pixel of the trajectory's own.
  const double average = 2e-4 / std::sqrt(400);
  for (int axis = 0; axis < 2; ++axis) {
    const double sigma = std::sqrt(map.offset_covariance(axis, axis));
    EXPECT_GT(sigma, average);
    EXPECT_LT(sigma, 2 * average + 0.1 / kFocalLength);
  }
}

TEST_F(CalibrateVideo, StoresTheTracksItUsed) {
  const std::string from_video = path("from_video");
  ASSERT_EQ(calibrate_command({recording(), "--passes", "1", "-o", from_video}).exit_code, 0);
  const std::string given = copy();
  fs::remove(given + "/video.mkv");
  fs::copy(from_video + "/tracks.csv", given + "/tracks.csv");
  const std::string from_tracks = path("from_tracks");
  ASSERT_EQ(calibrate_command({given, "-o", from_tracks}).exit_code, 0);
  const Calibration first = load(from_video + "/calibration.yaml");
  const Calibration second = load(from_tracks + "/calibration.yaml");
  const int f = index(Parameter::kFocalLength);
  // Rounded to a ten thousandth of a pixel in the file.
  EXPECT_NEAR(first.camera.focal_length, second.camera.focal_length,
              0.05 * std::sqrt(first.covariance(f, f)));
  EXPECT_FALSE(fs::exists(from_tracks + "/tracks.csv"));
}

TEST_F(CalibrateVideo, TakesImagesInPlaceOfAVideo) {
  film(directory_, camera(std::string(kTexture) + "recording: {images: pgm}\n"), "pictures");
  const Result result = calibrate_command({"--passes", "1", path("pictures")});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_TRUE(fs::exists(path("pictures/alidade/calibration.yaml")));
}

TEST_F(CalibrateVideo, RefusesAVideoWithoutTexture) {
  film(directory_, camera("scene: {background: 0.4, detail: 0}\n"), "grey");
  const Result result = calibrate_command({path("grey")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(
      last_line(result.errors),
      AllOf(StartsWith("alidade: " + path("grey") + ": no point of the video could be followed"),
            HasSubstr("texture")));
  EXPECT_FALSE(fs::exists(path("grey/alidade/calibration.yaml")));
}

TEST_F(CalibrateVideo, RefusesAVideoOfAnotherSize) {
  const std::string spoilt = copy();
  directory_.write("copy/recording.yaml", "format: 1\nwidth: 640\nheight: 180\n");
  const Result result = calibrate_command({spoilt});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(last_line(result.errors), HasSubstr("640x180"));
}

TEST_F(CalibrateVideo, NamesAVideoThatCannotBeRead) {
  const std::string spoilt = copy();
  directory_.write("copy/video.mkv", "no video");
  const Result result = calibrate_command({spoilt});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(last_line(result.errors), StartsWith("alidade: " + spoilt + "/video.mkv: "));
}

TEST_F(CalibrateVideo, SaysThatTheVideoEndsBeforeItsTimesDo) {
  const std::string cut = copy();
  directory_.write("copy/frames.csv", directory_.read("copy/frames.csv") + "200,8,8,200\n");
  const Result result = calibrate_command({cut, "--passes", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("video: ends 1 frame before frames.csv does"));
}

TEST_F(CalibrateVideo, WantsOnePassOrTwo) {
  const Result result = calibrate_command({recording(), "--passes", "3"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, StartsWith("alidade: "));
}

// Two dwells and the movement between them; nothing is told but video and telemetry.
TEST_F(CalibrateVideo, WhatIsSeenWhileTheZoomMovesTellsTheFocalLengthBetween) {
  film(directory_,
       "seed: 4\n"
       "duration_s: 18\n"
       "image: {width: 320, height: 180, rate_hz: 15}\n"
       "camera: {line_delay_us: 75, clock_offset_ms: -84.4}\n"
       "zoom:\n"
       "  focal_length_px: {wide: 400, tele: 1000}\n"
       "  shape: 2\n"
       "  sigma_rep: 0\n"
       "  backlash: 0\n"
       "  speed_per_s: 0.5\n"
       "  path: {type: dwell, stops: [{focal_length_px: 450, rest_s: 8}, {focal_length_px: "
       "900, rest_s: 8}]}\n"
       "path: {type: triple_cosine, amplitude: 1, period_s: 7}\n"
       "sensor: {exposure_ms: 1, read_noise: 1.5, jpeg_quality: 90}\n"
       "telemetry: {rate_hz: 50, sigma_rad: 2.0e-4}\n"
       "timing: {image_jitter: {sigma_ms: 0.3}, telemetry_jitter: {sigma_ms: 0.3}}\n" +
           std::string(kTexture),
       "zooms");
  const Result result = calibrate_command({path("zooms"), "--json", "-o", path("out")});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(nlohmann::json::parse(result.output)["movements"], 1);
  EXPECT_THAT(result.errors, Not(HasSubstr("was never seen")));
  Calibration calibration;
  ZoomCurve curve;
  std::string error;
  ASSERT_TRUE(load_calibration(path("out/calibration.yaml"), &calibration, &error, &curve))
      << error;
  int between = 0;
  for (auto row : read_csv(directory_.read("zooms/truth.csv"))) {
    const double f = std::stod(row["focal_length_px"]);
    if (f < 500 || f > 800) continue;
    ++between;
    Calibration at;
    ASSERT_TRUE(curve.at(std::stod(row["zoom"]), &at));
    const double sigma = std::sqrt(at.covariance(0, 0));
    EXPECT_LT(std::abs(at.camera.focal_length - f), 4 * sigma) << f;
    // The dwells alone leave 3 % and more of it open.
    EXPECT_LT(sigma, 0.01 * f);
  }
  EXPECT_GT(between, 10);
}

}  // namespace
}  // namespace alidade
