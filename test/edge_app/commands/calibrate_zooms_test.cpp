// `alidade calibrate` over several zoom readings: the built executable on recordings with known truth.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "edge_app/storage/calibration_file.h"
#include "platform/system/whole_file.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/edge_app/commands/recording_files.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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
  // One recording that dwells for 12 s at each zoom and moves for two seconds between. told: the reading, of a zoom that
  // was reached upwards (1) or downwards (-1).
  std::string record_dwells(const std::string& name, const std::vector<double>& zooms,
                            const std::function<double(double, double)>& told) {
    constexpr int kMoving = 60;  // telemetry samples
    CalibrationInput all;
    std::vector<double> readings;
    double direction = 1;
    for (std::size_t i = 0; i < zooms.size(); ++i) {
      const CalibrationInput dwell = test::simulate(at_zoom(zooms[i], 4 + i));
      const double shift_s =
          14.0 * static_cast<double>(i);  // telemetry is a second longer at either end
      if (i == 0) {
        all = dwell;
        all.frames.clear();
        all.telemetry.clear();
        all.observations.clear();
      } else {
        direction = zooms[i] > zooms[i - 1] ? 1 : -1;
        for (int k = 1; k < kMoving; ++k) {
          CalibrationTelemetry moving = all.telemetry.back();
          moving.stamp_s += 1.0 / 30;
          ++*moving.sequence;
          all.telemetry.push_back(moving);
          const double part = k / static_cast<double>(kMoving);
          readings.push_back(told(zooms[i - 1] + part * (zooms[i] - zooms[i - 1]), direction));
        }
      }
      for (CalibrationTelemetry sample : dwell.telemetry) {
        sample.stamp_s += shift_s;
        *sample.sequence += std::lround(shift_s * 30);
        all.telemetry.push_back(sample);
        readings.push_back(told(zooms[i], direction));
      }
      for (CalibrationFrame frame : dwell.frames) {
        frame.frame += static_cast<std::int64_t>(1000 * i);
        frame.stamp_s += shift_s;
        *frame.sequence += std::lround(shift_s * 15);
        all.frames.push_back(frame);
      }
      for (CalibrationObservation seen : dwell.observations) {
        seen.frame += static_cast<std::int64_t>(1000 * i);
        seen.landmark += static_cast<std::int64_t>(100000 * i);
        all.observations.push_back(seen);
      }
    }
    const TemporaryDirectory& folder = folders_[name];
    test::write_recording(folder, all);
    test::write_telemetry(folder, all, 1, readings);
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
  std::string report;
  std::string error;
  ASSERT_TRUE(read_file(json["files"]["report"].get<std::string>(), &report, &error)) << error;
  EXPECT_THAT(report, HasSubstr("from 3 dwells and 0 movements"));
  EXPECT_THAT(report, HasSubstr("report-3.html"));
  // The calibration of one zoom, as every command reads it.
  EXPECT_EQ(run({ALIDADE_EXECUTABLE, "replay", folders_["a"].path(), "--calibration",
                 output() + "/calibration.yaml"})
                .exit_code,
            0);
}

// One recording: it dwells, zooms in during two seconds, and dwells again.
TEST_F(CalibrateZooms, DwellsOfOneRecordingBecomeOne) {
  const Result result =
      calibrate({record_dwells("dwells", {0, 1}, [](double zoom, double) { return zoom; })});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  expect_curve_of({0, 1});
  EXPECT_THAT(result.output, HasSubstr("line_delay"));
  EXPECT_THAT(result.errors, Not(HasSubstr("jitters")));
}

// A device of 10,000 readings whose potentiometer jitters by one of them and has play; one that tells 0 to 1; one whose
// reading lies between two steps.
class JitteringZoom : public CalibrateZooms, public ::testing::WithParamInterface<int> {};

TEST_P(JitteringZoom, CostsNoDwell) {
  struct Device {
    double scale;  // of a reading of at_zoom(), which is a factor of two
    double offset;
    double sigma;
    double play;
    double step;
  };
  const std::vector<Device> devices = {
      {2000, 3000, 1, 5, 1}, {0.2, 0.3, 3e-4, 0, 0}, {2000.25, 3000.5, 0.3, 0, 1}};
  const Device& d = devices[static_cast<std::size_t>(GetParam())];
  std::mt19937 random(7);
  std::normal_distribution<double> jitter(0, d.sigma);
  const std::vector<double> zooms = {0, 1, 0.5};
  const Result result =
      calibrate({record_dwells("dwells", zooms,
                               [&](double zoom, double direction) {
                                 const double told = d.offset + d.scale * zoom +
                                                     direction * d.play / 2 + jitter(random);
                                 return d.step > 0 ? d.step * std::round(told / d.step) : told;
                               }),
                 "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("the zoom reading jitters by"));
  EXPECT_THAT(result.errors, Not(HasSubstr("only the")));
  Calibration any;
  ZoomCurve curve;
  std::string error;
  ASSERT_TRUE(load_calibration(output() + "/calibration.yaml", &any, &error, &curve)) << error;
  ASSERT_EQ(curve.content().nodes, 3);
  int at = 0;
  for (const double zoom : {0.0, 0.5, 1.0}) {
    const Calibration node = curve.node(at++);
    EXPECT_NEAR(*node.zoom, d.offset + d.scale * zoom, d.play / 2 + d.sigma + d.step / 2) << zoom;
    EXPECT_LT(std::abs(node.camera.focal_length - at_zoom(zoom, 1).focal_length),
              5 * std::sqrt(node.covariance(0, 0)))
        << zoom;
  }
  // All of each dwell but the second at either end, which nobody can tell from the movement.
  for (int dwell = 1; dwell <= 3; ++dwell) {
    std::string report;
    ASSERT_TRUE(
        read_file(output() + "/report-" + std::to_string(dwell) + ".html", &report, &error));
    EXPECT_THAT(report, HasSubstr("jitters"));
  }
  // The same rule: every frame of a dwell has its direction, with the curve's lens.
  const Result replayed = run({ALIDADE_EXECUTABLE, "replay", folders_["dwells"].path(),
                               "--calibration", output() + "/calibration.yaml", "--json"});
  ASSERT_EQ(replayed.exit_code, 0) << replayed.errors;
  std::istringstream lines(replayed.output);
  int frames = 0;
  int with_direction = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto record = nlohmann::json::parse(line);
    ++frames;
    with_direction += record["mode"] == "PT" ? 1 : 0;
  }
  EXPECT_GE(with_direction, 0.97 * frames) << replayed.errors;
}

INSTANTIATE_TEST_SUITE_P(Devices, JitteringZoom, ::testing::Values(0, 1, 2));

// Reached from either side a reading differs by the play; the two visits are of one zoom, as near as a lens comes back.
TEST_F(CalibrateZooms, AReadingThatIsReachedFromEitherSideIsOnTheCurveTwice) {
  std::mt19937 random(7);
  std::normal_distribution<double> jitter(0, 1);
  const Result result =
      calibrate({record_dwells("dwells", {0, 1, 0}, [&](double zoom, double direction) {
        return std::round(3000 + 2000 * zoom + 2.5 * direction + jitter(random));
      })});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  Calibration any;
  ZoomCurve curve;
  std::string error;
  ASSERT_TRUE(load_calibration(output() + "/calibration.yaml", &any, &error, &curve)) << error;
  for (const double zoom : {0.0, 0.25, 0.5, 1.0}) {
    ASSERT_TRUE(curve.at(3000 + 2000 * zoom, &any));
    EXPECT_LT(std::abs(any.camera.focal_length - at_zoom(zoom, 1).focal_length),
              4 * std::sqrt(any.covariance(0, 0)))
        << zoom;
  }
}

// The virtual camera that is there to be tried rests as long at each zoom as a refusal asks for.
TEST(ZoomCameraExample, DwellsAsLongAsIsAskedFor) {
  constexpr double kAsked_s = 10;
  const YAML::Node camera =
      YAML::LoadFile(ALIDADE_TEST_DATA "/../simulator/examples/zoom_camera.yaml");
  double rests_s = 0;
  for (const YAML::Node& stop : camera["zoom"]["path"]["stops"]) {
    EXPECT_GE(stop["rest_s"].as<double>(), kAsked_s);
    rests_s += stop["rest_s"].as<double>();
  }
  EXPECT_GT(camera["duration_s"].as<double>(), rests_s) << "and all of them are seen";
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
  refused({a, b, "--focal-length", "1500"}, 2, "--focal-length is valid at one zoom only");
  refused(
      {a, a}, 2,
      "all 2 stretches of constant zoom are of reading 0: recordings are calibrated together to "
      "make a zoom curve only; calibrate the longest one alone");
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
