// `alidade replay`, and `run` of a recording, with a zoom curve: a camera that stands at another zoom than the curve's first, as
// the virtual camera rendered it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "core/calibration/zoom_fit.h"
#include "edge_app/storage/calibration_file.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/simulator/config.h"
#include "test/simulator/recording_writer.h"
#include "test/simulator/zoom.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kFilmed = 40;        // frames
constexpr double kStandsAt = 940;  // px

// At 12.5 frames a second; the zoom stands. What is left out is what the others have in common.
constexpr const char* kZooming =
    "seed: 7\n"
    "duration_s: 3.2\n"
    "image: {width: 480, height: 270, rate_hz: 12.5}\n"
    "camera: {line_delay_us: -56.8, clock_offset_ms: -20}\n"
    "zoom: {focal_length_px: {wide: 400, tele: 2500}, distortion: {wide: -0.02, tele: 0.01}, "
    "sigma_rep: 0.001, speed_per_s: 0.8, acceleration_per_s2: 4, "
    "path: {type: dwell, stops: [{focal_length_px: 940, rest_s: 4}]}}\n"
    "path: {type: triple_cosine, amplitude: 0.3, period_s: 8}\n"
    "scene: {background: 0.6, detail: 1, procedural: [{azimuth_deg: 0, elevation_deg: 0, "
    "width_deg: 70, height_deg: 45}]}\n"
    "sensor: {exposure_ms: 1, shot_noise: 0.02, read_noise: 0.7, jpeg_quality: 90}\n"
    "telemetry: {rate_hz: 50, sigma_rad: 2.0e-4}\n"
    "recording: {images: video}\n";

class ReplayZoom : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    rendered_ = std::make_unique<TemporaryDirectory>();
    config_ = std::make_unique<simulator::Config>(
        simulator::load_config(rendered_->write("c.yaml", kZooming)));
    simulator::write_recording(*config_, recording());
  }
  static void TearDownTestSuite() {
    config_.reset();
    rendered_.reset();
  }
  static std::string recording() { return rendered_->path() + "/recording"; }

  static double reading_of(double focal_length) {
    const simulator::Zoom zoom(*config_);
    double low = config_->zoom->reading.wide;
    double high = config_->zoom->reading.tele;
    for (int step = 0; step < 40; ++step) {
      const double middle = (low + high) / 2;
      (zoom.nominal_lens(middle).focal_length < focal_length ? low : high) = middle;
    }
    return std::round(low);
  }

  // As `alidade calibrate` of dwells at these focal lengths writes it, the first of them foremost.
  std::string curve_of(const std::vector<double>& focal_lengths) {
    const simulator::Zoom zoom(*config_);
    std::vector<Calibration> nodes;
    for (const double f : focal_lengths) {
      Calibration node;
      node.zoom = reading_of(f);
      const simulator::Lens lens = zoom.nominal_lens(*node.zoom);
      node.camera = {lens.focal_length, 1, {lens.radial_distortion}, 480, 270, 0, 0};
      node.line_delay = config_->camera.line_delay;
      node.clock_offset = config_->camera.clock_offset;
      const auto set = [&node](Parameter p, double sigma) {
        node.covariance(index(p), index(p)) = sigma * sigma;
      };
      set(Parameter::kFocalLength, 1e-3 * lens.focal_length);
      set(Parameter::kRadialDistortion, 0.02);
      for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) set(p, 0.5);
      for (const Parameter p : {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0,
                                Parameter::kTiltAxis1, Parameter::kClockOffset}) {
        set(p, 1e-4);
      }
      set(Parameter::kLineDelay, 1e-7);
      nodes.push_back(node);
    }
    ZoomFit fit;
    std::string error;
    EXPECT_TRUE(fit_zoom(nodes, {}, &fit, &error)) << error;
    CalibrationNotes notes;
    notes.zoom_curve = fit.curve;
    const std::string path = directory_.path() + "/calibration.yaml";
    EXPECT_TRUE(save_calibration(path, fit.curve.node(0), notes, &error)) << error;
    return path;
  }

  Result replay(const std::string& calibration) {
    return alidade(
        {"replay", recording(), "--calibration", calibration, "-o", directory_.path(), "--json"});
  }
  static std::vector<nlohmann::json> records_of(const Result& result) {
    std::vector<nlohmann::json> records;
    std::istringstream lines(result.output);
    for (std::string line; std::getline(lines, line);)
      records.push_back(nlohmann::json::parse(line));
    return records;
  }
  // Of OE mode but for the first frame, with the true focal length, and the others say why.
  static void expect_oe(const Result& result) {
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const std::vector<nlohmann::json> records = records_of(result);
    ASSERT_EQ(records.size(), static_cast<std::size_t>(kFilmed));
    int held = 0;
    for (const nlohmann::json& record : records) {
      if (record["mode"] != "OE") {
        EXPECT_NE(record["status"], "ok") << record;
        continue;
      }
      ++held;
      EXPECT_LT(std::abs(record["focal_length_px"].get<double>() - kStandsAt),
                5 * record["focal_length_sigma_px"].get<double>() + 0.002 * kStandsAt)
          << record;
    }
    EXPECT_GE(held, kFilmed - 2) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("not in OE mode: 1 record 'too few landmarks'"));
  }

  static std::unique_ptr<TemporaryDirectory> rendered_;
  static std::unique_ptr<simulator::Config> config_;
  TemporaryDirectory directory_;
};

std::unique_ptr<TemporaryDirectory> ReplayZoom::rendered_;
std::unique_ptr<simulator::Config> ReplayZoom::config_;

TEST_F(ReplayZoom, ADwellThatIsNotTheCurvesFirstIsInOeMode) {
  expect_oe(replay(curve_of({450, kStandsAt, 2025})));
}

TEST_F(ReplayZoom, SoIsOneBetweenItsNodes) { expect_oe(replay(curve_of({450, 850, 1100, 2025}))); }

TEST_F(ReplayZoom, SoIsItsLast) { expect_oe(replay(curve_of({450, 650, kStandsAt}))); }

TEST_F(ReplayZoom, RunOverTheRecordingDoesTheSame) {
  const std::string calibration = curve_of({450, kStandsAt, 2025});
  const std::string config = directory_.write(
      "run.yaml", "video: {type: recording, directory: " + recording() +
                      "}\npan_tilt: {type: recording, directory: " + recording() +
                      "}\ncalibration: {file: " + calibration + ", auto: false}\n");
  expect_oe(alidade({"run", "-c", config, "--json"}));
}

TEST_F(ReplayZoom, WhatLiesOutsideTheCurveIsSaidWithTheReadings) {
  const Result result = replay(curve_of({1600, 1800, 2025}));
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const nlohmann::json& record : records_of(result)) {
    EXPECT_EQ(record["mode"], "none");
    EXPECT_EQ(record["status"], "no calibration for this zoom");
    EXPECT_EQ(record["calibrated"], false);
  }
  const auto text = [](double focal_length) {
    return std::to_string(static_cast<int>(reading_of(focal_length)));
  };
  EXPECT_THAT(result.errors,
              AllOf(HasSubstr("not in OE mode: 40 records 'no calibration for this zoom' (zoom "
                              "reading " +
                              text(kStandsAt) + ")"),
                    HasSubstr("the zoom curve has readings " + text(1600) + " to " + text(2025))));
}

}  // namespace
}  // namespace alidade
