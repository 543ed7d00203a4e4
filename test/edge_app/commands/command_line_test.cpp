// The executable as a person meets it: exit codes, one-line errors, and a replay whose truth comes from
// this file's own model of a crooked pan/tilt head, independent of core's.

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/pattern/calibrate_pattern.h"
#include "edge_app/output/detection_query.h"
#include "edge_app/storage/lens_file.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/support/process.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

// A port of the loopback on which nobody listens.
int refusing_port() {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  EXPECT_EQ(::bind(descriptor, generic, size), 0);
  EXPECT_EQ(::getsockname(descriptor, generic, &size), 0);
  ::close(descriptor);
  return ntohs(address.sin_port);
}

using Vector = std::array<double, 3>;

// v turned by angle about a unit axis (Rodrigues).
Vector turn(const Vector& axis, double angle, const Vector& v) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  const double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
  const Vector cross = {axis[1] * v[2] - axis[2] * v[1], axis[2] * v[0] - axis[0] * v[2],
                        axis[0] * v[1] - axis[1] * v[0]};
  Vector turned{};
  for (std::size_t i = 0; i < 3; ++i) {
    turned[i] = c * v[i] + s * cross[i] + (1 - c) * along * axis[i];
  }
  return turned;
}

// v turned by a unit quaternion x, y, z, w.
Vector turn_by_quaternion(const std::array<double, 4>& q, const Vector& v) {
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
  if (norm == 0) return v;
  return turn({q[0] / norm, q[1] / norm, q[2] / norm}, 2 * std::atan2(norm, q[3]), v);
}

// A crooked head on a slow, smooth path, and how it is recorded.
struct CrookedHead {
  Vector pan_axis = {0.012, -0.008, std::sqrt(1 - 0.012 * 0.012 - 0.008 * 0.008)};
  Vector tilt_axis = {0.014, std::sqrt(1 - 0.014 * 0.014 - 0.006 * 0.006), -0.006};
  double pan_scale = 1.01;
  double tilt_scale = 0.99;
  double clock_offset = -0.0844;
  double line_delay = -14.2e-6;

  [[nodiscard]] double pan(double t) const { return 1.1 + 0.3 * std::sin(0.7 * t); }
  [[nodiscard]] double tilt(double t) const { return -0.2 + 0.1 * std::cos(0.5 * t); }

  // Camera axis `which` (0 right, 1 down, 2 forward) in the base at image time t.
  [[nodiscard]] Vector camera_axis(std::size_t which, double t) const {
    const std::array<Vector, 3> at_rest = {{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}};
    return turn(pan_axis, pan(t), turn(tilt_axis, tilt(t), at_rest[which]));
  }

  [[nodiscard]] std::string calibration(int width = 1920, int height = 1080) const {
    std::ostringstream text;
    text.precision(17);
    text << "format: 1\nimage: {width: " << width << ", height: " << height << "}\n"
         << "focal_length: {value: 32008}\naspect: {value: 1}\nradial_distortion: {value: 55.4}\n"
         << "line_delay: {value: " << line_delay << "}\nclock_offset: {value: " << clock_offset
         << "}\n"
         << "pan_axis: {value: [" << pan_axis[0] << ", " << pan_axis[1] << ", " << pan_axis[2]
         << "]}\n"
         << "tilt_axis: {value: [" << tilt_axis[0] << ", " << tilt_axis[1] << ", " << tilt_axis[2]
         << "]}\n"
         << "pan_scale: {value: " << pan_scale << "}\ntilt_scale: {value: " << tilt_scale << "}\n";
    return text.str();
  }

  static double frame_time(int frame) { return 10 + 0.04 * frame; }

  // `frames` frames and 100 Hz telemetry, whose stamp of the head's state at image time t is t + d.
  void record(const TemporaryDirectory& directory, int frames) const {
    directory.write("recording.yaml", "format: 1\nwidth: 1920\nheight: 1080\n");
    std::ostringstream frames_csv;
    frames_csv.precision(17);
    frames_csv << "frame,receive_time_s\n";
    for (int i = 0; i < frames; ++i) frames_csv << i << "," << frame_time(i) << "\n";
    directory.write("frames.csv", frames_csv.str());
    directory.write("tracks.csv", "frame,landmark,u_px,v_px,sigma_px\n");
    std::ostringstream telemetry;
    telemetry.precision(17);
    telemetry << "receive_time_s,pan_rad,tilt_rad,earliest_time_s\n";
    for (double t = 9.5; t < frame_time(frames) + 0.5; t += 0.01) {
      const double stamp = t + clock_offset;
      telemetry << stamp + 0.001 << "," << pan_scale * pan(t) << "," << tilt_scale * tilt(t) << ","
                << stamp - 0.001 << "\n";
    }
    directory.write("telemetry.csv", telemetry.str());
  }
};

TEST(CommandLine, HelpAndVersionGoToStdout) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--help"},
                                                    {"run", "--help"},
                                                    {"record", "--help"},
                                                    {"replay", "--help"},
                                                    {"calibrate", "--help"},
                                                    {"check", "--help"}}) {
    const Result result = alidade(arguments);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.output, HasSubstr("Usage: alidade"));
    EXPECT_THAT(result.errors, IsEmpty());
  }
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--version"},
                                                    {"run", "--version"},
                                                    {"record", "--version"},
                                                    {"replay", "--version"},
                                                    {"calibrate", "--version"},
                                                    {"check", "--version"}}) {
    const Result result = alidade(arguments);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.output, StartsWith("alidade "));
  }
}

TEST(CommandLine, BadUsageIsOneLineAndExitCodeTwo) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{},
                                                    {"fly"},
                                                    {"run"},
                                                    {"run", "-c", "x", "--json", "--csv"},
                                                    {"replay"},
                                                    {"replay", "x", "--mode", "ORB"},
                                                    {"calibrate"},
                                                    {"record", "-c", "x"},
                                                    {"check", "-c", "x", "--duration", "-3"},
                                                    {"run", "-c", "none.yaml"},
                                                    {"check", "-c", "none.yaml"}}) {
    const Result result = alidade(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.errors;
    EXPECT_THAT(result.errors, StartsWith("alidade: "));
    EXPECT_EQ(result.errors.find('\n'), result.errors.size() - 1) << result.errors;
    EXPECT_THAT(result.output, IsEmpty());
  }
}

// In one short line, whatever the value, and before what else is missing.
TEST(CommandLine, NamesWhatWasMistypedAndWhatIsNearest) {
  struct Slip {
    std::vector<std::string> arguments;
    const char* line;
  };
  const char* not_above_0 = "is not a number of seconds above 0; see alidade run --help";
  for (const auto& [arguments, line] : {
           Slip{{"rnu"}, "unknown command 'rnu'; did you mean run?; see alidade --help"},
           Slip{{"chekc", "-c", "x"}, "unknown command 'chekc'; did you mean check?; see"},
           Slip{{"fly"},
                "unknown command 'fly'; expected one of discover, setup, run, record, replay, "
                "verify, "
                "calibrate, calibrate-shutter, plane, check, map, localize; see alidade --help"},
           Slip{{"run", "--confg", "x"},
                "unknown option '--confg'; did you mean --config?; see alidade run --help"},
           Slip{{"run", "-c", "x", "--duraton=3"},
                "unknown option '--duraton'; did you mean --duration?; see"},
           Slip{{"check", "-c", "x", "--duraton", "-3"},
                "unknown option '--duraton'; did you mean --duration?; see"},
           Slip{{"run", "-c", "x", "--wholly-new"}, "unknown option '--wholly-new'; see"},
           Slip{{"run"}, "To make one: alidade setup (in a browser), or alidade discover"},
           Slip{{"replay", "x", "y"}, "The following argument was not expected: y; see"},
           Slip{{"run", "-c", "x", "--duration", "-1"}, not_above_0},
           Slip{{"run", "-c", "x", "--duration", "0"}, not_above_0},
           Slip{{"run", "-c", "x", "--duration", "nan"}, not_above_0},
           Slip{{"run", "-c", "x", "--duration", "10s"}, not_above_0},
           Slip{
               {"calibrate-shutter", "-c", "x", "--pattern", "y", "--duration", "-1"},
               "'-1' is not a number of seconds above 0, up to 300; see alidade calibrate-shutter"},
           Slip{{"calibrate-shutter", "-c", "x", "--pattern", "y", "--duration", "301"},
                "'301' is not a number of seconds above 0, up to 300; see"},
           Slip{{"map", "bild", "x"},
                "unknown command 'bild'; did you mean build?; see alidade map --help"},
           Slip{{"map", "build", "x", "-o", "y", "--keyfames", "3"},
                "unknown option '--keyfames'; did you mean --keyframes?; see alidade map build "
                "--help"},
           Slip{{"calibrate", "x", "--angle-accuracy", "6"},
                "'6' is not a number of degrees from 0 to 5; see"},
           Slip{{"calibrate", "x", "--pupil", "0,0,5"},
                "'5' is not a number of metres from -1 to 1; see"},
           Slip{{"calibrate", "x", "--scene-distance", "0.5,20"},
                "'0.5' is not a number of metres, 1 or more; see"},
           Slip{{"calibrate", "x", "--scale-sigma", "2"}, "'2' is not a number from 0 to 1; see"},
       }) {
    const Result result = alidade(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr(line));
    EXPECT_LT(result.errors.size(), 180U) << result.errors;
    EXPECT_EQ(result.errors.find('\n'), result.errors.size() - 1) << result.errors;
  }
}

class CommandLineTest : public ::testing::Test {
 protected:
  // A configuration of recorded streams, which needs no camera.
  std::string recorded_config(const std::string& more = "") {
    return directory_.write("alidade.yaml",
                            "video: {type: recording, directory: .}\n"
                            "pan_tilt: {type: recording, directory: .}\n"
                            "calibration: {file: calibration.yaml}\n" +
                                more);
  }
  std::string live_config(const std::string& size = ", width: 320, height: 240",
                          const std::string& more = "camera: {focal_length_px: 30000}\n") {
    const std::string port = std::to_string(refusing_port());
    return directory_.write(
        "alidade.yaml", "video: {type: rtsp, url: 'rtsp://127.0.0.1:" + port + "/stream'" + size +
                            "}\npan_tilt: {type: vapix, url: 'http://127.0.0.1:" + port + "'}\n" +
                            more);
  }
  std::string path(const std::string& name) { return directory_.path() + "/" + name; }

  TemporaryDirectory directory_;
  CrookedHead head_;
};

TEST_F(CommandLineTest, ConfigurationMistakesAreNamedWithTheirLine) {
  const std::string config = recorded_config("realtime: {prioritty: 60}\n");
  for (const char* name : {"run", "check"}) {
    const Result result = alidade({name, "-c", config});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.errors,
                StartsWith("alidade: " + config + ":4: realtime.prioritty: unknown key"));
  }
}

TEST_F(CommandLineTest, MissingCalibrationIsABadConfiguration) {
  head_.record(directory_, 10);
  const Result result = alidade({"run", "-c", recorded_config()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr(path("calibration.yaml")));
}

TEST_F(CommandLineTest, RunWithNothingToBeginWithSaysWhatIsMissing) {
  const std::string size = ", width: 320, height: 240";
  const std::string data_sheet = "camera: {focal_length_px: 30000}\n";
  const std::string not_there = "calibration: {file: calibration.yaml}\n";
  const std::string not_there_and_not_auto = "calibration: {file: calibration.yaml, auto: false}\n";
  const std::string not_auto = "calibration: {auto: false}\n";
  const std::string file = path("calibration.yaml");
  struct Case {
    std::string size;
    std::string more;
    std::string what;
    std::string remedy;
  };
  for (const Case& c : {
           Case{size, not_there, "camera.focal_length_px is missing: " + file, "give it"},
           Case{"", not_there, "camera.focal_length_px is missing: " + file, "give it"},
           Case{"", not_there + data_sheet, "video.width and video.height are missing",
                "give them, or set realtime.mode: PT"},
           Case{"", data_sheet, "video.width and video.height are missing", "give them"},
           Case{"", not_auto + data_sheet, "video.width and video.height are missing", "give them"},
           Case{size, not_there_and_not_auto, "calibration.file " + file + " holds no calibration",
                "set calibration.auto: true"},
           Case{size, not_there_and_not_auto + data_sheet,
                "calibration.file " + file + " holds no calibration", "set calibration.auto: true"},
           Case{size, "", "neither a calibration nor a data sheet is given",
                "set calibration.file or camera.focal_length_px"},
           Case{size, not_auto, "neither a calibration nor a data sheet is given",
                "set calibration.file or camera.focal_length_px"},
           Case{", width: 320", data_sheet, "video.width: is given alone", "give width and height"},
       }) {
    const std::string config = live_config(c.size, c.more);
    const Result result = alidade({"run", "-c", config});
    EXPECT_EQ(result.exit_code, 2) << config;
    EXPECT_THAT(result.errors, AllOf(StartsWith("alidade: " + config + ":"), HasSubstr(c.what),
                                     HasSubstr(c.remedy)))
        << c.size << "\n"
        << c.more;
    EXPECT_EQ(result.errors.find('\n'), result.errors.size() - 1) << result.errors;
    EXPECT_THAT(result.output, IsEmpty());
  }
}

// None to begin with, but one for each zoom that the head may report.
TEST_F(CommandLineTest, RunWithoutCalibratingTakesCalibrationsOfSeveralZooms) {
  for (const char* zoom : {"1", "2"}) {
    directory_.write(std::string("calibration.zoom-") + zoom + ".yaml",
                     head_.calibration() + "zoom: " + zoom + "\n");
  }
  const std::string config = live_config(", width: 1920, height: 1080",
                                         "camera: {focal_length_px: 30000}\n"
                                         "calibration: {file: calibration.yaml, auto: false}\n");
  const Result result = alidade({"run", "-c", config, "--duration", "0.1"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, AllOf(HasSubstr("zoom 1"), HasSubstr("zoom 2")));
}

// A warning that belongs to a run that begins: an error of the configuration stays one line.
TEST_F(CommandLineTest, RunWarnsThatWithoutAFileItsCalibrationIsLost) {
  const char* words = "is lost when the program ends";
  const std::string camera = "camera: {focal_length_px: 30000}\n";
  for (const auto& [more, warns] : {std::pair(camera, true),
                                    {camera + "calibration: {file: calibration.yaml}\n", false},
                                    {"realtime: {mode: PT}\n" + camera, false}}) {
    const std::string config = live_config(", width: 1920, height: 1080", more);
    const Result result = alidade({"run", "-c", config, "--duration", "0.1"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_EQ(result.errors.find(words) != std::string::npos, warns) << more << result.errors;
  }
}

// What run stored under its zoom, without a data sheet.
TEST_F(CommandLineTest, CheckTakesTheCalibrationThatRunTakes) {
  const std::string stored = head_.calibration() + "zoom: 1\n";
  directory_.write("calibration.zoom-1.yaml", stored);
  const std::string config =
      live_config(", width: 1920, height: 1080", "calibration: {file: calibration.yaml}\n");
  const Result check = alidade({"check", "-c", config, "--duration", "0.1"});
  EXPECT_THAT(check.output,
              HasSubstr("calibration    " + path("calibration.zoom-1.yaml") + ": 1920x1080 px"));
  EXPECT_THAT(check.errors,
              AllOf(Not(HasSubstr("cannot be read")), Not(HasSubstr("no calibration yet"))));
  // Of another size: it is not used, and stays.
  const std::string other =
      live_config(", width: 640, height: 480",
                  "camera: {focal_length_px: 30000}\ncalibration: {file: calibration.yaml}\n");
  const Result of_another_size = alidade({"check", "-c", other, "--duration", "0.1"});
  EXPECT_THAT(of_another_size.output, HasSubstr("calibration    data sheet: not calibrated"));
  EXPECT_THAT(of_another_size.errors, HasSubstr("it stays until another calibration is stored"));
  EXPECT_EQ(directory_.read("calibration.zoom-1.yaml"), stored);
  // Nothing at all: the reason is run's.
  const std::string nothing =
      live_config(", width: 320, height: 240", "calibration: {file: elsewhere.yaml}\n");
  for (const char* name : {"run", "check"}) {
    const Result result = alidade({name, "-c", nothing, "--duration", "0.1"});
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_THAT(result.errors, HasSubstr("camera.focal_length_px is missing: " +
                                         path("elsewhere.yaml") + " holds no calibration"));
  }
}

TEST_F(CommandLineTest, CalibrateShutterTakesOneVideo) {
  const std::string live = live_config();
  const auto calibrate = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"calibrate-shutter", "--pattern", "chessboard:9x6:25mm"});
    return alidade(arguments);
  };
  for (const auto& [arguments, what] :
       {std::pair(std::vector<std::string>{}, "no video; give a recording's directory or a video"),
        {{"video.mp4", "-c", live}, "video.mp4 and -c name a video; give a recording or a file"},
        {{"video.mp4", "--duration", "3"}, "--duration is for a live video, with -c"},
        {{"-c", path("none.yaml")}, "none.yaml: cannot be read"},
        {{"-c", recorded_config()},
         "video.type: a recording is not live video; give its directory"}}) {
    const Result result = calibrate(arguments);
    EXPECT_EQ(result.exit_code, 2) << what;
    EXPECT_THAT(result.errors, AllOf(StartsWith("alidade: "), HasSubstr(what)));
    EXPECT_EQ(result.errors.find('\n'), result.errors.size() - 1) << result.errors;
    EXPECT_THAT(result.output, IsEmpty());
  }
}

TEST_F(CommandLineTest, CalibrateShutterSaysThatNoCameraAnswers) {
  const std::string port = std::to_string(refusing_port());
  const std::string config =
      directory_.write("bench.yaml", "video: {type: mjpeg, url: 'http://127.0.0.1:" + port +
                                         "/x', timeout_s: 0.1, max_backoff_s: 0.2}\n");
  const Result result =
      alidade({"calibrate-shutter", "-c", config, "--pattern", "chessboard:9x6:25mm"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("; trying again"));
  EXPECT_THAT(last_line(result.errors),
              AllOf(StartsWith("alidade: http://127.0.0.1:" + port), HasSubstr("connect")));
}

// The line delay of each record is the bench's until there is a calibration.
TEST_F(CommandLineTest, RunBeginsWithTheLensOfItsConfiguration) {
  const std::string config = live_config(", width: 320, height: 240",
                                         "camera: {focal_length_px: 300}\n"
                                         "calibration: {prior: lens.yaml}\n");
  for (const auto& [text, what] :
       {std::pair(std::string(), "lens.yaml: cannot be read: No such file or directory"),
        {"format: 1\nfocal: 3\n", "lens.yaml:2: unknown key focal"}}) {
    if (!text.empty()) directory_.write("lens.yaml", text);
    const Result result = alidade({"run", "-c", config});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.errors, AllOf(StartsWith("alidade: "), HasSubstr(what)));
    EXPECT_EQ(result.errors.find('\n'), result.errors.size() - 1) << result.errors;
  }
  PatternCalibration bench;
  bench.lens << 300, 301, 160, 120, -0.1, 0, 0, 0, -43e-6;
  LensVector sigma;
  sigma << 0.1, 0.1, 0.1, 0.1, 1e-3, 1e-3, 1e-4, 1e-4, 1e-7;
  bench.covariance = sigma.cwiseAbs2().asDiagonal();
  directory_.write("lens.yaml", format_lens(bench, {"chessboard:9x6:25mm", 320, 240}));
  Process process(command({"run", "-c", config}));
  const std::string record = process.read_line();
  EXPECT_NEAR(nlohmann::json::parse(record)["line_delay_s"].get<double>(), -43e-6, 1e-12) << record;
}

// What the error recommends.
TEST_F(CommandLineTest, RunInPtModeNeedsNoSizeOfTheImage) {
  const std::string config =
      live_config("", "camera: {focal_length_px: 30000}\nrealtime: {mode: PT}\n");
  const Result result = alidade({"run", "-c", config, "--duration", "0.1"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
}

TEST_F(CommandLineTest, VideoSizeOtherThanTheCalibrationsIsABadConfiguration) {
  directory_.write("calibration.yaml", head_.calibration());
  const std::string config = directory_.write(
      "alidade.yaml",
      "video: {type: rtsp, url: 'rtsp://127.0.0.1:9/stream', width: 1280, height: 720}\n"
      "pan_tilt: {type: vapix, url: 'http://127.0.0.1:9'}\n"
      "calibration: {file: calibration.yaml}\n");
  const Result result = alidade({"run", "-c", config});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("1920x1080"),
                                   HasSubstr("video.width and video.height are 1280 and 720")));
}

TEST_F(CommandLineTest, CheckNamesAnUnreachableCameraByItsAddress) {
  const Result result = alidade({"check", "-c", live_config()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("alidade: rtsp://127.0.0.1:"),
                                   HasSubstr("alidade: http://127.0.0.1:")));
  EXPECT_THAT(result.output, AllOf(HasSubstr("configuration"), HasSubstr("failed")));
}

TEST_F(CommandLineTest, RunGoesOnWithoutACameraAndSaysNone) {
  Process process(command({"run", "-c", live_config()}));
  const auto record = nlohmann::json::parse(process.read_line());
  EXPECT_EQ(record["mode"], "none");
  EXPECT_EQ(record["status"], "video lost");
  EXPECT_TRUE(record["frame"].is_null());
  EXPECT_EQ(record["calibrated"], false);
  process.send(SIGTERM);
  static_cast<void>(process.read_all());
  EXPECT_EQ(process.wait(), 0) << process.errors();
}

TEST_F(CommandLineTest, RecordWithoutACameraFailsAndStoresNoRecording) {
  const Result result =
      alidade({"record", "-c", live_config(), "-o", path("new"), "--duration", "0.1"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("no frame came"));
  EXPECT_FALSE(std::filesystem::exists(path("new/recording.yaml")));
}

TEST_F(CommandLineTest, ReplayWithoutACalibrationNamesBothWaysToOne) {
  head_.record(directory_, 10);
  const Result result = alidade({"replay", directory_.path()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(
      last_line(result.errors),
      AllOf(HasSubstr("has no calibration"),
            HasSubstr("`alidade calibrate " + directory_.path() + "`"),
            HasSubstr("calibration.file of `alidade run`"), HasSubstr("--calibration FILE")));
  // What run has stored is one that it takes.
  directory_.write("stored.yaml", head_.calibration());
  EXPECT_EQ(alidade({"replay", directory_.path(), "--calibration", path("stored.yaml")}).exit_code,
            0);
}

TEST_F(CommandLineTest, RecordRefusesADirectoryThatHoldsARecording) {
  directory_.write("old/frames.csv", "frame,receive_time_s\n");
  const Result result = alidade({"record", "-c", live_config(), "-o", path("old")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, AllOf(HasSubstr(path("old")), HasSubstr("already holds a recording")));
  EXPECT_EQ(directory_.read("old/frames.csv"), "frame,receive_time_s\n");
}

TEST_F(CommandLineTest, ReplayGivesTheTrueOrientationOfACrookedHead) {
  constexpr int kFrames = 250;
  head_.record(directory_, kFrames);
  directory_.write("alidade/calibration.yaml", head_.calibration());
  const Result result = alidade({"replay", directory_.path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, IsEmpty());
  const auto rows = read_csv(directory_.read("alidade/orientation.csv"));
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) {
    const std::map<std::string, std::string>& row = rows[static_cast<std::size_t>(i)];
    ASSERT_EQ(row.at("mode"), "PT") << i;
    const auto number = [&row](const char* name) { return std::stod(row.at(name)); };
    const double t = head_.frame_time(i);
    EXPECT_EQ(number("time_s"), t);
    EXPECT_EQ(row.at("calibrated"), "true");
    EXPECT_EQ(row.at("latency_s"), "");
    // Without noise the angles of the middle row are exact but for the interpolation. Row 0 is half
    // the read-out, 7.7 ms, away at a constant rate: half the acceleration (0.15 rad/s^2) times the
    // square of that is 4.4e-6 rad.
    const double to_middle_s = 540 * number("line_delay_s");
    const double middle = t + to_middle_s;
    EXPECT_NEAR(number("pan_rad") + to_middle_s * number("pan_rate_rad_s"), head_.pan(middle), 1e-7)
        << i;
    EXPECT_NEAR(number("tilt_rad") + to_middle_s * number("tilt_rate_rad_s"), head_.tilt(middle),
                1e-7)
        << i;
    EXPECT_NEAR(number("pan_rate_rad_s"), 0.3 * 0.7 * std::cos(0.7 * middle), 1e-4) << i;
    const std::array<double, 4> q = {number("q_x"), number("q_y"), number("q_z"), number("q_w")};
    const std::array<Vector, 3> axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (std::size_t which = 0; which < 3; ++which) {
      const Vector stated = turn_by_quaternion(q, axes[which]);
      const Vector truth = head_.camera_axis(which, t);
      for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(stated[j], truth[j], 5e-6) << i << which << j;
    }
  }
}

// A relay that stood still when the recording began, and a poll that stood still later. What waited is as old in a replay as
// it was live.
TEST_F(CommandLineTest, ReplayOfARecordingOfStallsIsNotConfidentlyWrong) {
  constexpr int kFrames = 500;
  constexpr int kWaited = 50;
  head_.record(directory_, kFrames);
  directory_.write("alidade/calibration.yaml", head_.calibration());
  std::ostringstream frames;
  frames.precision(17);
  frames << "frame,receive_time_s,sender_time_s\n";
  for (int i = 0; i < kFrames; ++i) {
    const double received_s =
        i < kWaited ? head_.frame_time(kWaited) - 1e-3 * (kWaited - i) : head_.frame_time(i);
    frames << i << "," << received_s << "," << 500 + 0.04 * i << "\n";
  }
  directory_.write("frames.csv", frames.str());
  std::istringstream before(directory_.read("telemetry.csv"));
  std::ostringstream telemetry;
  for (std::string line; std::getline(before, line);) {
    const double stamp_s = std::atof(line.c_str());
    if (stamp_s > 20 && stamp_s < 20.4) continue;
    // Asked before the stall, true behind it.
    if (stamp_s >= 20.4 && stamp_s < 20.41) line = line.substr(0, line.rfind(',')) + ",20.0";
    telemetry << line << "\n";
  }
  directory_.write("telemetry.csv", telemetry.str());

  const Result result = alidade({"replay", directory_.path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto rows = read_csv(directory_.read("alidade/orientation.csv"));
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(kFrames));
  int answered = 0;
  for (int i = 0; i < kFrames; ++i) {
    const std::map<std::string, std::string>& row = rows[static_cast<std::size_t>(i)];
    if (i < kWaited) {
      EXPECT_EQ(row.at("status"), "picture time unknown") << i;
    }
    if (row.at("mode") == "none") continue;
    ++answered;
    const auto number = [&row](const char* name) { return std::stod(row.at(name)); };
    const double t = head_.frame_time(i);
    EXPECT_LT(std::abs(number("pan_rad") - head_.pan(t)), 5 * number("orientation_sigma_rad_1"))
        << i;
    EXPECT_LT(std::abs(number("tilt_rad") - head_.tilt(t)), 5 * number("orientation_sigma_rad_0"))
        << i;
  }
  EXPECT_GT(answered, 400);
}

std::string middle_box(int frame) {
  return R"({"frame": )" + std::to_string(frame) +
         R"(, "boxes": [{"u": 950, "v": 530, "width": 20, "height": 20, "class": "drone"}]})" +
         "\n";
}

TEST_F(CommandLineTest, ReplayTracksWhatADetectorFoundWithTheSameBytesEachTime) {
  head_.record(directory_, 60);
  const std::string calibration = directory_.write("c.yaml", head_.calibration());
  // Who stays in the middle of a picture that turns turns as sharply.
  const std::string agile =
      directory_.write("agile.yaml", "tracking: {acceleration_density_rad2_s3: 0.01}\n");
  std::string late_lines;
  std::string in_order;
  for (int i = 20; i < 60; ++i) {
    if (i != 30) late_lines += middle_box(i);
    if (i == 40) late_lines += middle_box(30);  // late
    in_order += middle_box(i);
  }
  const std::string file = directory_.write("d.jsonl", in_order + middle_box(1000));
  const Result from_file = alidade({"replay", directory_.path(), "--calibration", calibration,
                                    "--detections", file, "--tracking", agile, "-o", path("a")});
  ASSERT_EQ(from_file.exit_code, 0) << from_file.errors;
  EXPECT_THAT(from_file.errors, HasSubstr("1 refused (later than the newest frame)"));
  directory_.write("late.jsonl", late_lines);
  for (const char* where : {"b", "c"}) {
    const Result result =
        run({"/bin/sh", "-c",
             "exec \"$0\" replay \"$1\" --calibration \"$2\" --detections - --tracking \"$4\" -o "
             "\"$3\" < \"$1\"/late.jsonl",
             ALIDADE_EXECUTABLE, directory_.path(), calibration, path(where), agile});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("40 frames of detections (1 late)"));
  }
  const std::string late = directory_.read("b/targets.jsonl");
  EXPECT_EQ(directory_.read("c/targets.jsonl"), late);
  const auto last = nlohmann::json::parse(last_line(directory_.read("a/targets.jsonl")));
  EXPECT_EQ(nlohmann::json::parse(last_line(late)), last);
  EXPECT_EQ(last["frame"], 59);
  EXPECT_EQ(last["space"], "sphere");
  ASSERT_EQ(last["targets"].size(), 1U);
  EXPECT_EQ(last["targets"][0]["class"], "drone");
  EXPECT_NEAR(last["targets"][0]["pixel"][0], 960, 5);
  EXPECT_NEAR(last["targets"][0]["pixel"][1], 540, 5);
  EXPECT_NEAR(last["targets"][0]["box"]["width"], 20, 0.1);
}

TEST_F(CommandLineTest, ReplayNamesTheLineOfDetectionsThatItCannotUse) {
  head_.record(directory_, 30);
  directory_.write("alidade/calibration.yaml", head_.calibration());
  const std::string plain = directory_.write("plain.yaml", "output: {json: true}\n");
  const std::string groundless = directory_.write("groundless.yaml", "tracking: {space: plane}\n");
  const struct {
    std::string lines;
    std::vector<std::string> more;
    int exit_code;
    const char* saying;
  } slips[] = {
      {middle_box(20) + "{\"frame\": 21}\n", {}, 1, "d.jsonl:2: boxes must be an array"},
      {middle_box(20) + "\n\nx\n", {}, 1, "d.jsonl:4: the body must be a JSON object"},
      {R"({"frame": 20, "boxes": [{"u": 1, "v": 1, "width": 9, "height": 9, "class": ")" +
           std::string(33, 'x') + R"("}]})",
       {},
       1,
       "d.jsonl:1: boxes: item 0: class must be a text of at most 32 bytes"},
      {std::string(300000, ' '), {}, 1, "d.jsonl:1: is longer than"},
      {middle_box(20), {"--tracking", plain}, 2, "plain.yaml: has no section tracking"},
      {middle_box(20), {"--tracking", groundless}, 2, "groundless.yaml:1: tracking.space"},
  };
  for (const auto& slip : slips) {
    const std::string file = directory_.write("d.jsonl", slip.lines);
    std::vector<std::string> arguments = {"replay", directory_.path(), "--detections", file};
    arguments.insert(arguments.end(), slip.more.begin(), slip.more.end());
    const Result result = alidade(arguments);
    EXPECT_EQ(result.exit_code, slip.exit_code) << slip.saying;
    EXPECT_THAT(last_line(result.errors), HasSubstr(slip.saying));
    EXPECT_FALSE(std::filesystem::exists(path("alidade/targets.jsonl")));
    EXPECT_FALSE(std::filesystem::exists(path("alidade/orientation.csv")));
  }
  EXPECT_THAT(alidade({"replay", directory_.path(), "--tracking", plain}).errors,
              HasSubstr("--detections"));
  EXPECT_THAT(alidade({"replay", directory_.path(), "--detections", path("nowhere")}).errors,
              HasSubstr("nowhere: cannot be read"));
}

// A detector's file of another system, with a box in it whose middle is beyond the picture, one without a size and one without a place.
TEST_F(CommandLineTest, ReplayLeavesOutBoxesThatAreOfNoUseAndCountsThem) {
  head_.record(directory_, 40);
  std::string right;
  std::string spoilt;
  for (int i = 20; i < 40; ++i) {
    const std::string line = middle_box(i);
    right += line;
    std::string bad = R"({"u": 1915, "v": 530, "width": 20, "height": 20}, )";
    if (i == 30) bad += R"({"u": 9, "v": 9, "width": 0, "height": 20}, )";
    if (i == 35) bad += R"({"u": null, "v": null, "width": 5, "height": 20}, )";
    spoilt += line.substr(0, line.find('[') + 1) + bad + line.substr(line.find('[') + 1);
    spoilt.insert(spoilt.size() - 1, "\r");
  }
  directory_.write("right.jsonl", right);
  directory_.write("spoilt.jsonl", spoilt + "\r\n");
  for (const char* name : {"right", "spoilt"}) {
    const Result result = alidade({"replay", directory_.path(), "--calibration",
                                   directory_.write("c.yaml", head_.calibration()), "--detections",
                                   path(std::string(name) + ".jsonl"), "-o", path(name)});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    if (name == std::string("right")) {
      EXPECT_THAT(result.errors, Not(HasSubstr("left out")));
    } else {
      EXPECT_THAT(result.errors,
                  HasSubstr("20 frames of detections; boxes left out: 1 (a number of it is not "
                            "finite), 1 (its width or height is not above 0), 20 (its middle"));
    }
  }
  EXPECT_EQ(directory_.read("spoilt/targets.jsonl"), directory_.read("right/targets.jsonl"));
}

// A frame of so many boxes, in one line.
std::string crowd(int frame, int boxes) {
  std::string line = R"({"frame": )" + std::to_string(frame) + R"(, "boxes": [)";
  for (int i = 0; i < boxes; ++i)
    line += std::string(i == 0 ? "" : ",") + R"({"u":9,"v":9,"width":9,"height":9})";
  return line + "]}\n";
}

TEST_F(CommandLineTest, ReplayRefusesAFrameOfTenThousandBoxesHoweverItsLineComes) {
  head_.record(directory_, 60);
  directory_.write("alidade/calibration.yaml", head_.calibration());
  // Who stays in the middle of a picture that turns turns as sharply.
  const std::string agile =
      directory_.write("agile.yaml", "tracking: {acceleration_density_rad2_s3: 0.01}\n");
  // Of that length without its end.
  const auto padded = [](std::string line, std::size_t bytes) {
    line.insert(line.size() - 1, bytes + 1 - line.size(), ' ');
    return line;
  };
  const std::string ten_thousand = crowd(40, 10'000);
  ASSERT_GT(ten_thousand.size(), 300'000U);
  directory_.write("crowd.jsonl", middle_box(20) + ten_thousand);
  directory_.write("over.jsonl", middle_box(20) + padded(middle_box(40), kMaxDetectionBytes + 1));
  directory_.write("most.jsonl", middle_box(20) + padded(middle_box(40), kMaxDetectionBytes));
  for (const char* piece : {"100", "5000", "65536", "1000000"}) {
    const auto replayed = [&](const char* name) {
      return run({"/bin/sh", "-c",
                  "dd if=\"$1/$2.jsonl\" bs=\"$3\" status=none | "
                  "\"$0\" replay \"$1\" --detections - -o \"$4\"",
                  ALIDADE_EXECUTABLE, directory_.path(), name, piece, path("out")});
    };
    for (const char* name : {"crowd", "over"}) {
      const Result result = replayed(name);
      EXPECT_EQ(result.exit_code, 1) << name << ' ' << piece;
      EXPECT_EQ(last_line(result.errors),
                "alidade: stdin:2: is longer than 131072 bytes; expected one frame a line\n")
          << name << ' ' << piece;
    }
    EXPECT_EQ(replayed("most").exit_code, 0) << piece;
  }

  // As many as a line holds are refused with their frame, and those about it are what they would have been.
  std::string usual;
  std::string disturbed;
  for (int i = 20; i < 60; ++i) {
    if (i != 40) usual += middle_box(i);
    disturbed += i == 40 ? crowd(i, 3500) : middle_box(i);
  }
  directory_.write("quiet.jsonl", usual);
  directory_.write("loud.jsonl", disturbed);
  const auto tracked = [&](const char* name) {
    const Result result =
        alidade({"replay", directory_.path(), "--detections", path(std::string(name) + ".jsonl"),
                 "--tracking", agile, "-o", path(name)});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return std::pair(result.errors, directory_.read(std::string(name) + "/targets.jsonl"));
  };
  const auto [says, targets] = tracked("loud");
  EXPECT_THAT(says, HasSubstr("1 refused (more boxes than tracking.max_detections)"));
  EXPECT_EQ(targets, tracked("quiet").second);
  EXPECT_EQ(nlohmann::json::parse(last_line(targets))["targets"].size(), 1U);
}

TEST_F(CommandLineTest, ReplayGivesTheSameBytesAtAnySpeed) {
  head_.record(directory_, 25);
  const std::string calibration = directory_.write("c.yaml", head_.calibration());
  for (const char* where : {"a", "b"}) {
    const Result result =
        alidade({"replay", directory_.path(), "--calibration", calibration, "-o", path(where)});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  const Result paced = alidade({"replay", directory_.path(), "--calibration", calibration, "-o",
                                path("c"), "--realtime", "--csv"});
  ASSERT_EQ(paced.exit_code, 0) << paced.errors;
  const std::string once = directory_.read("a/orientation.csv");
  EXPECT_THAT(once, Not(IsEmpty()));
  EXPECT_EQ(directory_.read("b/orientation.csv"), once);
  EXPECT_EQ(directory_.read("c/orientation.csv"), once);
  EXPECT_EQ(paced.output, once);
}

TEST_F(CommandLineTest, ReplayWithoutACalibrationSaysWhatToDo) {
  head_.record(directory_, 5);
  const Result result = alidade({"replay", directory_.path()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("--calibration FILE"));
}

TEST_F(CommandLineTest, ReplayInOeModeRefusesARecordingWithoutImages) {
  head_.record(directory_, 5);
  directory_.write("alidade/calibration.yaml", head_.calibration());
  const Result result = alidade({"replay", directory_.path(), "--mode", "OE"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, AllOf(StartsWith("alidade: " + directory_.path()),
                                   HasSubstr("has no pictures"), HasSubstr("--mode PT")));
  EXPECT_EQ(result.errors.find('\n'), result.errors.size() - 1) << result.errors;
  EXPECT_FALSE(std::filesystem::exists(path("alidade/orientation.csv")));
}

TEST_F(CommandLineTest, ReplayRefusesACalibrationOfAnotherSize) {
  head_.record(directory_, 5);
  directory_.write("alidade/calibration.yaml", head_.calibration(1280, 720));
  const Result result = alidade({"replay", directory_.path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors,
              AllOf(HasSubstr("1920x1080"), HasSubstr("calibration.yaml is for 1280x720 px"),
                    HasSubstr("video.width and video.height")));
  EXPECT_FALSE(std::filesystem::exists(path("alidade/orientation.csv")));
}

TEST_F(CommandLineTest, ReplayNamesFileAndLineOfDamagedTables) {
  head_.record(directory_, 5);
  directory_.write("alidade/calibration.yaml", head_.calibration());
  directory_.write("telemetry.csv",
                   "receive_time_s,pan_rad,tilt_rad\n9.9,0.1,0.2\n10.1,east,0.2\n");
  Result result = alidade({"replay", directory_.path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("telemetry.csv:3: "));
  directory_.write("telemetry.csv", "receive_time_s,pan_rad,tilt_rad\n9.9,0.1,0.2\n10.1,0.");
  result = alidade({"replay", directory_.path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("telemetry.csv"));
  EXPECT_FALSE(std::filesystem::exists(path("alidade/orientation.csv")));
  EXPECT_FALSE(std::filesystem::exists(path("alidade/orientation.csv.partial")));
}

TEST_F(CommandLineTest, ReplayOfAMissingDirectoryNamesIt) {
  const Result result = alidade({"replay", path("nowhere")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr(path("nowhere")));
}

TEST_F(CommandLineTest, ReplaySaysNoneWithZeroOrOneSample) {
  head_.record(directory_, 5);
  directory_.write("alidade/calibration.yaml", head_.calibration());
  for (const char* row : {"", "10.0,0.1,0.2\n"}) {
    directory_.write("telemetry.csv", std::string("receive_time_s,pan_rad,tilt_rad\n") + row);
    const Result result = alidade({"replay", directory_.path()});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const auto rows = read_csv(directory_.read("alidade/orientation.csv"));
    ASSERT_EQ(rows.size(), 5U);
    for (const auto& record : rows) {
      EXPECT_EQ(record.at("mode"), "none");
      EXPECT_EQ(record.at("status"), "too little telemetry");
      EXPECT_EQ(record.at("pan_rad"), "");
    }
  }
}

TEST_F(CommandLineTest, ReplayOfEqualAndJumpingStampsGivesARecordForEach) {
  head_.record(directory_, 5);
  directory_.write("alidade/calibration.yaml", head_.calibration());
  directory_.write(
      "frames.csv",
      "frame,receive_time_s,sender_time_s,sequence\n"
      "0,10.0,5,0\n1,10.0,5,0\n2,10.04,5,0\n3,9.0,900000,-7\n4,10.1,5.1,2\n5,1e9,5.2,3\n");
  const Result result = alidade({"replay", directory_.path()});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto rows = read_csv(directory_.read("alidade/orientation.csv"));
  ASSERT_EQ(rows.size(), 6U);
  for (const auto& record : rows) {
    const bool known = record.at("status") != "picture time unknown";
    EXPECT_EQ(known, !record.at("time_s").empty());
    if (known) {
      EXPECT_TRUE(std::isfinite(std::stod(record.at("time_s"))));
    }
    EXPECT_EQ(record.at("mode") == "PT", !record.at("pan_rad").empty());
  }
}

TEST_F(CommandLineTest, RunOverARecordingEndsWithItAndGivesEachFrame) {
  head_.record(directory_, 25);
  directory_.write("calibration.yaml", head_.calibration());
  const Result result = alidade({"run", "-c", recorded_config()});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  std::istringstream lines(result.output);
  int frames = 0;
  for (std::string line; std::getline(lines, line); ++frames) {
    const auto record = nlohmann::json::parse(line);
    EXPECT_EQ(record["frame"], frames);
    EXPECT_TRUE(record["latency_s"].is_null());
  }
  EXPECT_EQ(frames, 25);
  EXPECT_THAT(result.errors, HasSubstr("25 frames"));
}

TEST_F(CommandLineTest, RunEndsWhenFramesAreNotOfTheCalibrationsSize) {
  head_.record(directory_, 25);
  directory_.write("calibration.yaml", head_.calibration(1280, 720));
  const Result result = alidade({"run", "-c", recorded_config()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors,
              AllOf(HasSubstr("1920x1080"), HasSubstr("calibration.yaml is for 1280x720 px"),
                    HasSubstr("video.width and video.height")));
}

TEST_F(CommandLineTest, CheckReportsBothStreamsAndTheSizes) {
  head_.record(directory_, 100);
  directory_.write("calibration.yaml", head_.calibration());
  Result result = alidade({"check", "-c", recorded_config(), "--duration", "0.5"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, AllOf(HasSubstr("1920x1080 px (as expected), 25.00 Hz"),
                                   HasSubstr("100.00 Hz"), HasSubstr("known to 2.00 ms median")));
  directory_.write("calibration.yaml", head_.calibration(1280, 720));
  result = alidade({"check", "-c", recorded_config(), "--duration", "0.5"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors,
              AllOf(HasSubstr("1920x1080"), HasSubstr("calibration.yaml is for 1280x720 px"),
                    HasSubstr("video.width and video.height")));
}

// Streams of an hour, so that only the event under test ends the program.
class EndlessRunTest : public CommandLineTest {
 protected:
  void SetUp() override {
    head_.record(directory_, 2);
    directory_.write("calibration.yaml", head_.calibration());
    std::ostringstream frames;
    frames << "frame,receive_time_s\n";
    for (int i = 0; i < 90000; ++i) frames << i << "," << 0.04 * i << "\n";
    directory_.write("frames.csv", frames.str());
  }
};

TEST_F(EndlessRunTest, SignalsEndItCleanly) {
  for (const int signal : {SIGINT, SIGTERM}) {
    Process process(command({"run", "-c", recorded_config(), "--csv"}));
    EXPECT_THAT(process.read_line(), StartsWith("frame,time_s"));
    EXPECT_THAT(process.read_line(), StartsWith("0,"));
    process.send(signal);
    EXPECT_THAT(process.read_all(), AnyOf(IsEmpty(), EndsWith("\n")));  // no half record
    EXPECT_EQ(process.wait(), 0) << process.errors();
    EXPECT_THAT(process.errors(), HasSubstr("frames"));
  }
}

TEST_F(EndlessRunTest, EndsCleanlyWhenTheReaderGoes) {
  Process process(command({"run", "-c", recorded_config()}));
  EXPECT_THAT(process.read_line(), Not(IsEmpty()));
  process.close_output();
  EXPECT_EQ(process.wait(), 0) << process.errors();
}

TEST_F(EndlessRunTest, EndsAfterTheTimeAskedFor) {
  const Result result = alidade({"run", "-c", recorded_config(), "--duration", "0.3"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
}

TEST_F(EndlessRunTest, AFullDiskIsAFailure) {
  const std::string shell =
      "exec '" ALIDADE_EXECUTABLE "' run -c '" + recorded_config() + "' > /dev/full";
  Process process({"/bin/sh", "-c", shell});
  EXPECT_EQ(process.wait(), 1);
  EXPECT_THAT(process.errors(), HasSubstr("stdout: cannot write a record: No space left"));
}

}  // namespace
}  // namespace alidade
