// `alidade calibrate` over several zoom readings: the built executable on recordings with known truth.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "edge_app/storage/calibration_file.h"
#include "test/edge_app/alidade_command.h"
#include "test/edge_app/recording_files.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

namespace fs = std::filesystem;

test::Simulation at_zoom(double reading, std::uint64_t seed) {
  test::Simulation s;
  s.seed = seed;
  s.focal_length = 1500 * std::pow(2, reading);
  s.optical_centre_offset_px = {15, -9};
  s.image_rate_hz = 15;
  s.telemetry_rate_hz = 30;
  s.duration_s = 10;
  // Of one recording there is one period.
  s.image_period_sigma_s = 1e-8;
  s.telemetry_period_sigma_s = 1e-8;
  return s;
}

class CalibrateZooms : public ::testing::Test {
 protected:
  // A recording at one zoom in a folder of its own.
  std::string record(const std::string& name, double reading, std::uint64_t seed) {
    const TemporaryDirectory& folder = folders_[name];
    const CalibrationInput input = test::simulate(at_zoom(reading, seed));
    test::write_recording(folder, input);
    test::write_telemetry(folder, input, 1, std::vector<double>(input.telemetry.size(), reading));
    return folder.path();
  }
  [[nodiscard]] std::string output() const { return output_.path() + "/out"; }
  Result calibrate(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"-o", output()});
    return calibrate_command(arguments);
  }
  void expect_curve_of(const std::vector<double>& readings) {
    Calibration calibration;
    ZoomCurve curve;
    std::string error;
    ASSERT_TRUE(load_calibration(output() + "/calibration.yaml", &calibration, &error, &curve))
        << error;
    ASSERT_EQ(curve.content().nodes, static_cast<int>(readings.size()));
    EXPECT_EQ(calibration.zoom, readings.front());
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const Calibration c = curve.node(static_cast<int>(i));
      EXPECT_EQ(*c.zoom, readings[i]);
      const auto near_truth = [&](double value, double truth, Parameter p) {
        const double sigma = std::sqrt(c.covariance(index(p), index(p)));
        EXPECT_LT(std::abs(value - truth), 5 * sigma) << readings[i] << ' ' << to_string(p);
        EXPECT_GT(sigma, 0);
      };
      const test::Simulation truth = at_zoom(readings[i], 1);
      near_truth(c.camera.focal_length, truth.focal_length, Parameter::kFocalLength);
      near_truth(c.camera.centre_u, 15, Parameter::kCentreU);
      near_truth(c.camera.centre_v, -9, Parameter::kCentreV);
      near_truth(c.line_delay, truth.line_delay, Parameter::kLineDelay);
      near_truth(c.clock_offset, truth.clock_offset, Parameter::kClockOffset);
    }
    // Halfway, with what is usual of lenses alone.
    const double between = 0.5 * (readings[0] + readings[1]);
    ASSERT_TRUE(curve.at(between, &calibration));
    EXPECT_LT(std::abs(calibration.camera.focal_length - at_zoom(between, 1).focal_length),
              4 * std::sqrt(calibration.covariance(0, 0)));
  }

  std::map<std::string, TemporaryDirectory> folders_;
  TemporaryDirectory output_;
};

TEST_F(CalibrateZooms, ManyRecordingsBecomeOneCurve) {
  const Result result =
      calibrate({record("a", 0, 1), record("b", 1, 2), record("c", 2.5, 3), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  expect_curve_of({0, 1, 2.5});
  const auto json = nlohmann::json::parse(result.output);
  EXPECT_EQ(json["zooms"].size(), 3U);
  EXPECT_EQ(json["zooms"][2]["zoom"], 2.5);
  EXPECT_TRUE(fs::exists(output() + "/report-3.html"));
  // The calibration of one zoom, as every command reads it.
  EXPECT_EQ(run({ALIDADE_EXECUTABLE, "replay", folders_["a"].path(), "--calibration",
                 output() + "/calibration.yaml"})
                .exit_code,
            0);
}

// One recording: it dwells, zooms in during two seconds, and dwells again.
TEST_F(CalibrateZooms, DwellsOfOneRecordingBecomeOne) {
  constexpr double kMovement_s = 2;
  CalibrationInput all = test::simulate(at_zoom(0, 4));
  CalibrationInput second = test::simulate(at_zoom(1, 5));
  std::vector<double> zoom(all.telemetry.size(), 0);
  const double shift_s = 12 + kMovement_s;  // telemetry is a second longer at either end
  const auto telemetry = static_cast<std::int64_t>(std::lround(shift_s * 30));
  const auto frames = static_cast<std::int64_t>(std::lround(shift_s * 15));
  for (int i = 1; i < 30 * kMovement_s; ++i) {
    CalibrationTelemetry moving = all.telemetry.back();
    moving.stamp_s += 1.0 / 30;
    ++*moving.sequence;
    all.telemetry.push_back(moving);
    zoom.push_back(i / (30 * kMovement_s));
  }
  for (CalibrationTelemetry sample : second.telemetry) {
    sample.stamp_s += shift_s;
    *sample.sequence += telemetry;
    all.telemetry.push_back(sample);
    zoom.push_back(1);
  }
  for (CalibrationFrame frame : second.frames) {
    frame.frame += 1000;
    frame.stamp_s += shift_s;
    *frame.sequence += frames;
    all.frames.push_back(frame);
  }
  for (CalibrationObservation seen : second.observations) {
    seen.frame += 1000;
    seen.landmark += 100000;
    all.observations.push_back(seen);
  }
  const TemporaryDirectory& folder = folders_["dwells"];
  test::write_recording(folder, all);
  test::write_telemetry(folder, all, 1, zoom);
  const Result result = calibrate({folder.path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  expect_curve_of({0, 1});
  EXPECT_THAT(result.output, HasSubstr("line_delay"));
}

TEST_F(CalibrateZooms, SaysWhatCannotBeOneCurve) {
  const std::string a = record("a", 0, 1);
  const std::string b = record("b", 1, 2);
  const auto refused = [&](const std::vector<std::string>& arguments, int exit_code,
                           const std::string& why) {
    const Result result = calibrate(arguments);
    EXPECT_EQ(result.exit_code, exit_code) << result.errors;
    EXPECT_THAT(last_line(result.errors), HasSubstr(why));
    EXPECT_FALSE(fs::exists(output() + "/calibration.yaml"));
  };
  refused({a, b, "--focal-length", "1500"}, 2, "--focal-length holds at one zoom");
  refused({a, a}, 1,
          "2 of 2 stretches of constant zoom could be calibrated: calibrations at two "
          "zoom readings or more are needed");
  refused({a, b, "--zoom-tolerance", "-1"}, 2, "--zoom-tolerance");
  const CalibrationInput input = test::simulate(at_zoom(2, 9));
  test::write_recording(folders_["no zoom"], input);
  refused({a, folders_["no zoom"].path()}, 2, "telemetry.csv has no zoom reading");
  std::vector<double> creeping;
  for (std::size_t i = 0; i < input.telemetry.size(); ++i)
    creeping.push_back(0.01 * static_cast<double>(i));
  test::write_recording(folders_["creeping"], input);
  test::write_telemetry(folders_["creeping"], input, 1, creeping);
  refused({folders_["creeping"].path()}, 2, "the zoom reading never stands still for 6 s");
  // Another camera: another line delay.
  test::Simulation other = at_zoom(2, 11);
  other.line_delay *= -1;
  other.line_delay -= 5e-6;
  const CalibrationInput of_other = test::simulate(other);
  test::write_recording(folders_["other"], of_other);
  test::write_telemetry(folders_["other"], of_other, 1,
                        std::vector<double>(of_other.telemetry.size(), 2));
  refused({a, b, folders_["other"].path()}, 1, "does not share line delay, axes and clock offset");
}

}  // namespace
}  // namespace alidade
