// `alidade calibrate` as a person meets it: the built executable on recordings with known truth, whole
// ones and spoilt ones. Standard deviations are judged by chance: |error| < 5 sigma fails a right
// program once in two million.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/storage/calibration_file.h"
#include "edge_app/storage/lens_file.h"
#include "edge_app/storage/map_file.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/edge_app/commands/recording_files.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

namespace fs = std::filesystem;

// Line `number` (from 1) replaced; an empty one is removed.
std::string with_line(const std::string& text, int number, const std::string& replacement) {
  std::istringstream lines(text);
  std::string changed;
  int at = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string& kept = ++at == number ? replacement : line;
    if (!kept.empty()) changed += kept + "\n";
  }
  return changed;
}

void expect_near_truth(const Calibration& calibration, const test::Simulation& simulation) {
  const auto error = test::calibration_error(simulation, calibration);
  int estimated = 0;
  for (int i = 0; i < kParameterCount; ++i) {
    const double sigma = std::sqrt(calibration.covariance(i, i));
    if (sigma == 0) continue;
    ++estimated;
    EXPECT_LT(std::abs(error[i]), 5 * sigma) << to_string(static_cast<Parameter>(i));
  }
  EXPECT_GE(estimated, 10);
}

class CalibrateCommand : public ::testing::Test {
 protected:
  void record(const test::Simulation& simulation) {
    simulation_ = simulation;
    input_ = test::simulate(simulation);
    test::write_recording(directory_, input_);
  }
  [[nodiscard]] std::string path(const std::string& name = "") const {
    return name.empty() ? directory_.path() : directory_.path() + "/" + name;
  }
  [[nodiscard]] Calibration stored() const {
    Calibration calibration;
    std::string error;
    EXPECT_TRUE(load_calibration(path("alidade/calibration.yaml"), &calibration, &error)) << error;
    return calibration;
  }
  // One line that names the recording and ends the command, and no file.
  void expect_refused(const Result& result, int exit_code, const std::string& why) {
    EXPECT_EQ(result.exit_code, exit_code) << result.errors;
    const std::string line = last_line(result.errors);
    EXPECT_THAT(line, AllOf(StartsWith("alidade: " + path()), HasSubstr(why)));
    EXPECT_FALSE(fs::exists(path("alidade/calibration.yaml")));
  }

  TemporaryDirectory directory_;
  test::Simulation simulation_;
  CalibrationInput input_;
};

TEST_F(CalibrateCommand, WritesCalibrationMapAndReport) {
  record(test::Simulation());
  const Result result = calibrate_command({path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Calibration calibration = stored();
  expect_near_truth(calibration, simulation_);
  MapContent content;
  std::string error;
  ASSERT_TRUE(load_map(path("alidade/map.bin"), calibration, &content, &error)) << error;
  EXPECT_GT(content.points.size(), 100U);
  EXPECT_TRUE(content.map.landmarks.empty());
  EXPECT_THAT(directory_.read("alidade/report.html"), HasSubstr("<strong>Calibrated</strong>"));
  EXPECT_THAT(directory_.read("alidade/calibration.yaml"),
              AllOf(HasSubstr("weakest_direction:"), HasSubstr("landmarks: \"map.bin\"")));
  EXPECT_THAT(result.output, AllOf(StartsWith("parameter"), HasSubstr("\nfocal_length "),
                                   HasSubstr("\nclock_offset ")));
  const auto files = fs::directory_iterator(path("alidade"));
  EXPECT_EQ(std::distance(begin(files), end(files)), 3);
}

TEST_F(CalibrateCommand, GivesReplayWhatItNeeds) {
  record(test::Simulation());
  ASSERT_EQ(calibrate_command({path()}).exit_code, 0);
  EXPECT_EQ(run({ALIDADE_EXECUTABLE, "replay", path()}).exit_code, 0);
}

TEST_F(CalibrateCommand, JsonIsOneLineWithTheBitsOfTheFile) {
  record(test::Simulation());
  const std::string elsewhere = path("deep/er");
  const Result result = calibrate_command({path(), "--json", "-o", elsewhere});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.output.find('\n'), result.output.size() - 1);
  const auto json = nlohmann::json::parse(result.output);
  EXPECT_EQ(json["status"], "ok");
  EXPECT_EQ(json["files"]["calibration"], elsewhere + "/calibration.yaml");
  Calibration calibration;
  std::string error;
  ASSERT_TRUE(load_calibration(elsewhere + "/calibration.yaml", &calibration, &error)) << error;
  EXPECT_EQ(json["calibration"]["focal_length"]["value"], calibration.camera.focal_length);
  EXPECT_EQ(json["calibration"]["tilt_axis"]["value"][0], calibration.mechanics.tilt_axis[0]);
  EXPECT_FALSE(fs::exists(path("alidade")));
}

TEST_F(CalibrateCommand, StatesAndUsesThePriorsOfItsOptions) {
  test::Simulation simulation;
  simulation.aspect = 1.01;
  record(simulation);
  const Result result =
      calibrate_command({path(), "--json", "--aspect", "free", "--line-delay", "1e-6",
                         "--clock-offset", "0.02,0.0001", "--scale-sigma", "0.001"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Calibration calibration = stored();
  expect_near_truth(calibration, simulation_);
  const auto variance = [&](Parameter p) { return calibration.covariance(index(p), index(p)); };
  EXPECT_GT(variance(Parameter::kAspect), 0);
  EXPECT_EQ(variance(Parameter::kLineDelay), 0);
  EXPECT_EQ(calibration.line_delay, 1e-6);
  EXPECT_LE(variance(Parameter::kClockOffset), 1e-8);
  const auto priors = nlohmann::json::parse(result.output)["priors"];
  EXPECT_FALSE(priors.contains("aspect"));
  EXPECT_EQ(priors["clock_offset"]["sigma"], 0.0001);
  EXPECT_EQ(priors["pan_scale"]["sigma"], 0.001);
}

TEST_F(CalibrateCommand, FindsTheOpticalCentreUnlessItIsStatedExact) {
  test::Simulation simulation;
  simulation.radial_distortion = 0.4;  // 3 % in the corner
  simulation.optical_centre_offset_px = {24, -15};
  record(simulation);
  ASSERT_EQ(calibrate_command({path()}).exit_code, 0);
  const Calibration found = stored();
  EXPECT_NEAR(found.camera.centre_u, 24, 5);
  EXPECT_NEAR(found.camera.centre_v, -15, 5);
  EXPECT_EQ(parameter_sigma(found, Parameter::kCentreU), 0);
  EXPECT_NEAR(found.camera.distortion.radial, 0.4,
              5 * parameter_sigma(found, Parameter::kRadialDistortion));
  ASSERT_EQ(calibrate_command({path(), "--centre-sigma", "0"}).exit_code, 0);
  EXPECT_FALSE(stored().has_centre());
}

TEST_F(CalibrateCommand, TakesTheMiddleForTheCentreWhereTheDataShowNoOther) {
  record(test::Simulation());
  ASSERT_EQ(calibrate_command({path()}).exit_code, 0);
  EXPECT_FALSE(stored().has_centre());
  expect_near_truth(stored(), simulation_);
}

// The lens.yaml of the simulated camera, for images of this size.
std::string lens_file_of(const test::Simulation& simulation, int width, int height,
                         double line_delay_sigma) {
  const double scale = static_cast<double>(width) / simulation.width;
  PatternCalibration bench;
  bench.lens << scale * simulation.focal_length,
      scale * simulation.focal_length * simulation.aspect, width / 2.0, height / 2.0,
      simulation.radial_distortion, 0, 0, 0, simulation.line_delay / scale;
  LensVector sigma;
  sigma << 0.005, 0.005, 0.05, 0.05, 1e-3, 1e-3, 1e-5, 1e-5, line_delay_sigma;
  bench.covariance = sigma.cwiseAbs2().asDiagonal();
  return format_lens(bench, {"chessboard:9x6:25mm", width, height});
}

TEST_F(CalibrateCommand, TakesALensFromTheBenchAsPrior) {
  record(test::Simulation());
  const std::string lens =
      directory_.write("bench/lens.yaml", lens_file_of(simulation_, 1920, 1080, 1e-9));
  ASSERT_EQ(calibrate_command({path(), "-o", path("alone")}).exit_code, 0);
  Calibration alone;
  std::string error;
  ASSERT_TRUE(load_calibration(path("alone/calibration.yaml"), &alone, &error)) << error;
  const Result result = calibrate_command({path(), "--json", "--prior", lens});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, Not(HasSubstr("contradicts")));
  const Calibration calibration = stored();
  expect_near_truth(calibration, simulation_);
  for (const Parameter p : {Parameter::kLineDelay, Parameter::kFocalLength}) {
    EXPECT_LT(calibration.covariance(index(p), index(p)),
              0.25 * alone.covariance(index(p), index(p)))
        << to_string(p);
  }
  const auto priors = nlohmann::json::parse(result.output)["priors"];
  EXPECT_EQ(priors["line_delay"]["value"], 1e-6);
  EXPECT_TRUE(priors.contains("focal_length") && priors.contains("radial_distortion"));
}

TEST_F(CalibrateCommand, ScalesALensOfAnotherSizeAndRefusesOneOfAnotherShape) {
  record(test::Simulation());
  const std::string half = directory_.write("half.yaml", lens_file_of(simulation_, 960, 540, 2e-9));
  const Result result = calibrate_command({path(), "--json", "--prior", half});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors,
              HasSubstr("half.yaml: is for images of 960x540 px and is scaled to 1920x1080"));
  const auto priors = nlohmann::json::parse(result.output)["priors"];
  EXPECT_NEAR(priors["line_delay"]["value"].get<double>(), 1e-6, 1e-12);
  EXPECT_NEAR(priors["focal_length"]["value"].get<double>(), 4000, 1e-3);
  const std::string square =
      directory_.write("square.yaml", lens_file_of(simulation_, 1440, 1080, 1e-9));
  fs::remove_all(path("alidade"));
  const Result refused = calibrate_command({path(), "--prior", square});
  expect_refused(refused, 2,
                 "is for images of 1440x1080 px, but these have 1920x1080 px and another shape");
}

TEST_F(CalibrateCommand, OptionsGoBeforeTheLensFileAndItIsSaid) {
  record(test::Simulation());
  const std::string lens =
      directory_.write("lens.yaml", lens_file_of(simulation_, 1920, 1080, 1e-9));
  const Result result = calibrate_command(
      {path(), "--json", "--prior", lens, "--line-delay", "1e-6", "--focal-length", "free"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors,
              HasSubstr("its line delay is not used, as --line-delay 1e-6 is given"));
  EXPECT_THAT(result.errors,
              HasSubstr("its focal length is not used, as --focal-length free is given"));
  const auto priors = nlohmann::json::parse(result.output)["priors"];
  EXPECT_EQ(priors["line_delay"]["sigma"], 0);
  EXPECT_FALSE(priors.contains("focal_length"));
  EXPECT_TRUE(priors.contains("radial_distortion"));
}

TEST_F(CalibrateCommand, SaysWhichPartOfALensFileContradictsTheRecording) {
  record(test::Simulation());
  test::Simulation other = simulation_;
  other.line_delay = 30e-6;
  other.focal_length = 1300;
  const std::string lens = directory_.write("lens.yaml", lens_file_of(other, 1920, 1080, 1e-9));
  const Result result = calibrate_command({path(), "--prior", lens});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const char* what :
       {"line delay contradicts the recording and is left out: 30.0000 +- 0.0015 us/row is known",
        "focal length and distortion were found at another zoom and are not used"}) {
    EXPECT_THAT(result.errors, HasSubstr(what));
    EXPECT_THAT(directory_.read("alidade/report.html"), HasSubstr(what));
  }
  expect_near_truth(stored(), simulation_);
}

TEST_F(CalibrateCommand, NamesTheLineOfABadLensFile) {
  record(test::Simulation());
  expect_refused(calibrate_command({path(), "--prior", path("none.yaml")}), 2,
                 "none.yaml: cannot be read: No such file or directory");
  directory_.write("lens.yaml", "format: 1\nfocal: 3\n");
  expect_refused(calibrate_command({path(), "--prior", path("lens.yaml")}), 2,
                 "lens.yaml:2: unknown key focal");
}

TEST_F(CalibrateCommand, CountsLostFramesBySenderTimes) {
  test::Simulation simulation;
  simulation.lost_frames = 0.1;
  simulation.one_sided_stamps = true;
  simulation.with_noise = false;  // live stamps: late only
  record(simulation);
  std::ostringstream frames;
  frames.precision(17);
  frames << "frame,receive_time_s,sender_time_s\n";
  for (const CalibrationFrame& frame : input_.frames) {
    // The clock of RTP, from any start.
    const double sender =
        std::round((1e5 + static_cast<double>(*frame.sequence) / simulation.image_rate_hz) * 9e4) /
        9e4;
    frames << frame.frame << ',' << frame.stamp_s << ',' << sender << '\n';
  }
  directory_.write("frames.csv", frames.str());
  const Result result = calibrate_command({path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  expect_near_truth(stored(), simulation_);
}

TEST_F(CalibrateCommand, TakesPolledTelemetryInTheMiddleOfItsInterval) {
  test::Simulation simulation;
  simulation.telemetry_stamp_sigma_s = 1e-7;
  record(simulation);
  std::ostringstream telemetry;
  telemetry.precision(17);
  telemetry << "receive_time_s,pan_rad,tilt_rad,earliest_time_s\n";
  for (const CalibrationTelemetry& sample : input_.telemetry) {
    telemetry << sample.stamp_s + 2e-3 << ',' << sample.pan_rad << ',' << sample.tilt_rad << ','
              << sample.stamp_s - 2e-3 << '\n';
  }
  directory_.write("telemetry.csv", telemetry.str());
  input_.noise.telemetry_stamp_sigma_s.reset();
  test::write_noise(directory_, input_.noise);
  const Result result = calibrate_command({path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  expect_near_truth(stored(), simulation_);
}

TEST_F(CalibrateCommand, UsesTheLongestPartBetweenReconnectionsAndSaysSo) {
  record(test::Simulation());
  std::ostringstream frames;
  frames.precision(17);
  frames << "frame,receive_time_s,sequence,restarted\n";
  // The first 20 frames came over an earlier connection, whose count was another.
  for (std::size_t i = 0; i < input_.frames.size(); ++i) {
    const CalibrationFrame& frame = input_.frames[i];
    frames << frame.frame << ',' << frame.stamp_s << ',' << (i < 20 ? 5000 : 0) + *frame.sequence
           << ',' << (i == 0 || i == 20 ? 1 : 0) << '\n';
  }
  directory_.write("frames.csv", frames.str());
  const Result result = calibrate_command({path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("the longest part without that is used"));
  expect_near_truth(stored(), simulation_);
}

TEST_F(CalibrateCommand, RefusesAHeadThatStandsStillAndKeepsTheOldCalibration) {
  test::Simulation simulation;
  simulation.path = [](double) { return Eigen::Vector2d(0.1, 0.2); };
  record(simulation);
  directory_.write("alidade/calibration.yaml", "the old one");
  const Result result = calibrate_command({path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(last_line(result.errors),
              AllOf(StartsWith("alidade: " + path() + ": no motion: "), HasSubstr("pan and tilt")));
  EXPECT_THAT(result.output, IsEmpty());
  EXPECT_EQ(directory_.read("alidade/calibration.yaml"), "the old one");
}

TEST_F(CalibrateCommand, ShowsAWeakResultInTheReportAndKeepsTheOldCalibration) {
  test::Simulation simulation;
  simulation.telemetry_stamp_sigma_s = 0.4;  // the mean of 720 stamps: 15 ms
  record(simulation);
  directory_.write("alidade/calibration.yaml", "the old one");
  const Result result = calibrate_command({path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(last_line(result.errors),
              AllOf(HasSubstr(path() + ": too uncertain: "), HasSubstr("clock offset")));
  EXPECT_THAT(directory_.read("alidade/report.html"), HasSubstr("no calibration was written"));
  EXPECT_EQ(directory_.read("alidade/calibration.yaml"), "the old one");
  EXPECT_FALSE(fs::exists(path("alidade/map.bin")));
}

TEST_F(CalibrateCommand, NamesTheLineOfAMalformedTrack) {
  record(test::Simulation());
  const std::string tracks = test::tracks_text(input_);
  for (const auto& [row, what] : {std::pair("0,1,2", "fewer cells"),
                                  {"0,1,2,3,0.5,6", "more cells"},
                                  {"0,1,nan,3,0.5", "'nan' in column u_px is not a number"},
                                  {"0,1,2,x,0.5", "'x' in column v_px is not a number"}}) {
    directory_.write("tracks.csv", with_line(tracks, 100, row));
    expect_refused(calibrate_command({path()}), 2, what);
    EXPECT_THAT(calibrate_command({path()}).errors,
                StartsWith("alidade: " + path("tracks.csv") + ":100: "));
  }
}

TEST_F(CalibrateCommand, NamesTheFileThatIsMissingAndWhatItIsFor) {
  record(test::Simulation());
  for (const auto& [name, what] :
       {std::pair("tracks.csv", "no tracks.csv in it; a calibration needs keypoint tracks"),
        {"telemetry.csv", "no telemetry.csv in it"},
        {"frames.csv", "no frames.csv in it"},
        {"recording.yaml", "recording.yaml: cannot be read"}}) {
    fs::rename(path(name), path("aside"));
    expect_refused(calibrate_command({path()}), 2, what);
    fs::rename(path("aside"), path(name));
  }
}

TEST_F(CalibrateCommand, NamesTheLineOfABadSideFile) {
  record(test::Simulation());
  directory_.write("guess.yaml", "focal_length: {value: 4000}\nradial: {value: 0}\n");
  expect_refused(calibrate_command({path()}), 2, "guess.yaml:2: radial: unknown key");
  directory_.write("guess.yaml", "focal_length: {value: 4000}\n");
  directory_.write("noise.yaml", "pan_tilt_sigma_rad: 5e-5\nimage_period_s: nan\n");
  expect_refused(calibrate_command({path()}), 2, "noise.yaml:2: image_period_s: 'nan'");
}

TEST_F(CalibrateCommand, DoesWithoutWhatItCannotUseAndSaysSo) {
  record(test::Simulation());
  std::string tracks = test::tracks_text(input_);
  tracks = with_line(tracks, 2, "0,900001,100,100,0.3");  // seen once
  tracks += "0,900002,5,5,0\n1,900002,5,5,0\n";           // sigma 0
  tracks += "0,900003,-500,5,0.3\n";                      // outside
  tracks += "123456,900004,5,5,0.3\n";                    // of no frame
  tracks += "3,900005,7,7,0.3\n3,900005,900,7,0.3\n";     // twice in one frame
  directory_.write("tracks.csv", tracks);
  const Result result = calibrate_command({path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  for (const char* line :
       {"observations of landmarks seen only once", "2 observations whose sigma is not positive",
        "1 observations outside the image", "1 observations in frames without a stamp",
        "2 observations of a landmark seen twice in one frame"}) {
    EXPECT_THAT(result.output, HasSubstr(line));
    EXPECT_THAT(directory_.read("alidade/report.html"), HasSubstr(line));
    EXPECT_THAT(directory_.read("alidade/calibration.yaml"), HasSubstr(line));
  }
  expect_near_truth(stored(), simulation_);
}

TEST_F(CalibrateCommand, LeavesOutFramesThatNoTelemetryAccompanies) {
  record(test::Simulation());
  auto& telemetry = input_.telemetry;
  telemetry.resize(telemetry.size() * 2 / 3);
  test::write_telemetry(directory_, input_);
  const Result result = calibrate_command({path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("frames outside the telemetry's time span"));
  expect_near_truth(stored(), simulation_);
}

TEST_F(CalibrateCommand, NoticesTracksOfALargerImage) {
  record(test::Simulation());
  directory_.write("recording.yaml", "format: 1\nwidth: 960\nheight: 540\n");
  expect_refused(calibrate_command({path()}), 2, "lie outside the 960x540 px of recording.yaml");
}

TEST_F(CalibrateCommand, NoticesDegreesInAColumnOfRadians) {
  record(test::Simulation());
  test::write_telemetry(directory_, input_, kPi / 180);
  expect_refused(calibrate_command({path()}), 1, "degrees");
}

TEST_F(CalibrateCommand, RefusesTracksThatAllHaveASigmaOfZero) {
  record(test::Simulation());
  for (CalibrationObservation& o : input_.observations) o.sigma_px = 0;
  directory_.write("tracks.csv", test::tracks_text(input_));
  const Result result = calibrate_command({path()});
  expect_refused(result, 1, "too few landmarks");
  EXPECT_THAT(result.errors, HasSubstr("observations whose sigma is not positive"));
}

TEST_F(CalibrateCommand, SaysWhereItCannotWrite) {
  record(test::Simulation());
  const std::string file = directory_.write("file", "");
  const Result result = calibrate_command({path(), "-o", file + "/below"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(last_line(result.errors),
              AllOf(StartsWith("alidade: " + file + "/below: cannot be made"), HasSubstr("-o")));
}

TEST_F(CalibrateCommand, ADiskWithoutRoomLeavesTheOldFilesWhole) {
  record(test::Simulation());
  for (const char* name : {"report.html", "map.bin", "calibration.yaml"}) {
    directory_.write(std::string("alidade/") + name, "old");
  }
  // No file may grow beyond one block, as if the disk were full.
  const Result result =
      run({"/bin/sh", "-c", "trap '' XFSZ; ulimit -f 1; exec \"$0\" calibrate \"$1\"",
           ALIDADE_EXECUTABLE, path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(last_line(result.errors),
              HasSubstr("alidade/report.html: cannot be written: File too large"));
  for (const char* name : {"report.html", "map.bin", "calibration.yaml"}) {
    EXPECT_EQ(directory_.read(std::string("alidade/") + name), "old");
  }
  const auto files = fs::directory_iterator(path("alidade"));
  EXPECT_EQ(std::distance(begin(files), end(files)), 3);
}

TEST_F(CalibrateCommand, BadOptionsAreOneLineAndExitCodeTwo) {
  record(test::Simulation());
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{},
                                                    {path(), path()},
                                                    {path(), "--aspect", "square"},
                                                    {path(), "--aspect", "1,"},
                                                    {path(), "--aspect", "1,0.1,2"},
                                                    {path(), "--focal-length", "4000,-1"},
                                                    {path(), "--focal-length", "-4000"},
                                                    {path(), "--line-delay", "nan"},
                                                    {path(), "--scale-sigma", "2"},
                                                    {path(), "--centre-sigma", "-1"},
                                                    {path("none")}}) {
    const Result result = calibrate_command(arguments);
    EXPECT_EQ(result.exit_code, 2) << ::testing::PrintToString(arguments);
    EXPECT_THAT(result.errors, StartsWith("alidade: "));
    EXPECT_EQ(result.errors.find('\n'), result.errors.size() - 1) << result.errors;
  }
}

TEST_F(CalibrateCommand, EndsCleanlyWhenInterrupted) {
  record(test::Simulation());
  Process process({ALIDADE_EXECUTABLE, "calibrate", path()});
  while (!process.blocks(SIGINT)) std::this_thread::yield();  // then it listens to it
  process.send(SIGINT);
  EXPECT_EQ(process.wait(), 1);
  EXPECT_THAT(process.errors(), EndsWith(path() + ": calibration interrupted; nothing stored\n"));
  EXPECT_FALSE(fs::exists(path("alidade")));
}

}  // namespace
}  // namespace alidade
