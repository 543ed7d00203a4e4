// What a user, a slip or somebody else may put in the place of a file, and what a peer may put into a header: the executable neither
// waits nor takes memory for it, and its one line is shown as it is.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/calibration/calibration_text.h"
#include "platform/system/file_lock.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/support/process.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

namespace fs = std::filesystem;

class HostileFiles : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const {
    return directory_.path() + "/" + name;
  }
  [[nodiscard]] std::string pipe(const std::string& name) const {
    EXPECT_EQ(::mkfifo(path(name).c_str(), 0600), 0);
    return path(name);
  }
  // Of a camera that does not answer.
  [[nodiscard]] std::string config(const std::string& more) const {
    return directory_.write("alidade.yaml",
                            "video: {type: rtsp, url: 'rtsp://127.0.0.1:1/stream', width: 320, "
                            "height: 240}\npan_tilt: {type: vapix, url: 'http://127.0.0.1:1'}\n"
                            "camera: {focal_length_px: 3000}\n" +
                                more);
  }
  static void expect_refused(const std::vector<std::string>& arguments, const std::string& why) {
    const Result result = alidade(arguments);
    EXPECT_THAT(result.exit_code, ::testing::AnyOf(1, 2)) << why;
    EXPECT_THAT(last_line(result.errors), AllOf(StartsWith("alidade: "), HasSubstr(why)));
  }

  TemporaryDirectory directory_;
};

TEST_F(HostileFiles, APipeOrADeviceIsNoConfiguration) {
  expect_refused({"check", "-c", pipe("pipe.yaml")},
                 "pipe.yaml: cannot be read: not a file, but a pipe");
  expect_refused({"run", "-c", "/dev/zero"}, "/dev/zero: cannot be read: not a file, but a device");
  expect_refused({"run", "-c", directory_.path()}, "not a file, but a folder");
  const std::string endless = directory_.write("endless.yaml", "");
  fs::resize_file(endless, std::uintmax_t{1} << 40);
  expect_refused({"run", "-c", endless}, "larger than 4 MB; expected a YAML file");
}

TEST_F(HostileFiles, APipeOrADeviceIsNothingOfAConfiguration) {
  const std::string pipe_of = pipe("pipe");
  for (const auto& [section, what] :
       {std::pair("tracking: {plane: " + pipe_of + "}\n", "a pipe"),
        std::pair(std::string("tracking: {plane: /dev/zero}\n"), "a device"),
        std::pair("calibration: {prior: " + pipe_of + ", file: none.yaml}\n", "a pipe")}) {
    expect_refused({"run", "-c", config(section), "--duration", "0.1"},
                   std::string("not a file, but ") + what);
  }
  const std::string session = directory_.write(
      "session.yaml",
      "video: {type: rtp, url: pipe}\npan_tilt: {type: vapix, url: 'http://127.0.0.1:1'}\n"
      "calibration: {file: calibration.yaml}\n");
  expect_refused({"run", "-c", session}, "session.yaml:1: video.url: " + pipe_of);
}

TEST_F(HostileFiles, APipeIsNoRecordingsTableAndNoVideo) {
  directory_.write("recording.yaml", "format: 1\nwidth: 320\nheight: 240\n");
  fs::create_directory(path("frames"));
  ASSERT_EQ(::mkfifo(path("frames.csv").c_str(), 0600), 0);
  expect_refused(
      {"map", "build", directory_.path(), "-o", path("out.map"), "--focal-length", "400"},
      "frames.csv: cannot be read: not a file, but a pipe");
  expect_refused({"calibrate-shutter", pipe("film.mp4"), "--pattern", "aprilgrid:6x6:88mm:0.3"},
                 "not a file, but a pipe");
}

TEST_F(HostileFiles, ALineWithoutEndIsNotReadToItsEnd) {
  directory_.write("recording.yaml", "format: 1\nwidth: 320\nheight: 240\n");
  fs::create_directory(path("frames"));
  directory_.write("telemetry.csv", "receive_time_s,pan_rad,tilt_rad\n");
  const std::string frames = directory_.write("frames.csv", "frame,receive_time_s\n");
  fs::resize_file(frames, std::uintmax_t{1} << 36);
  expect_refused(
      {"map", "build", directory_.path(), "-o", path("out.map"), "--focal-length", "400"},
      "frames.csv:2: a line of more than 65536 bytes");
}

TEST_F(HostileFiles, APictureSizeThatNoCameraHasIsRefused) {
  directory_.write("recording.yaml", "format: 1\nwidth: 2147483647\nheight: 2147483647\n");
  expect_refused(
      {"map", "build", directory_.path(), "-o", path("out.map"), "--focal-length", "400"},
      "recording.yaml:2: width is larger than 16384 px");
}

TEST_F(HostileFiles, AGearThatTheHeadsStepsCannotShowIsRefused) {
  Calibration calibration;
  calibration.camera.width = 320;
  calibration.camera.height = 240;
  calibration.camera.focal_length = 3000;
  CalibrationNotes notes;
  AngleErrorCurve& curve = notes.telemetry_error.tilt;
  curve.count = 3;
  curve.spacing_rad = 2e-4;
  curve.length_rad = 1e-4;
  curve.unseen_sigma_rad = 1e-5;
  directory_.write("gear.yaml", format_calibration(calibration, notes));
  const std::string file = directory_.write(
      "steps.yaml",
      "video: {type: rtsp, url: 'rtsp://127.0.0.1:1/stream', width: 320, height: 240}\n"
      "pan_tilt: {type: vapix, url: 'http://127.0.0.1:1', angle_quantum_rad: 1e-3}\n"
      "camera: {focal_length_px: 3000}\ncalibration: {file: gear.yaml, auto: false}\n");
  expect_refused({"run", "-c", file, "--duration", "0.1"},
                 "gear.yaml: tilt_error has a period of 0.000628 rad, shorter than the steps");
}

// The first keeps its calibration; the second says who it is; nothing is left that a third would stumble over.
TEST_F(HostileFiles, OneProcessKeepsItsCalibrationInAFile) {
  const std::string file = config("calibration: {file: kept/calibration.yaml}\n");
  Process first(command({"run", "-c", file, "--duration", "600"}));
  while (directory_.read("kept/calibration.yaml.lock").empty()) std::this_thread::yield();
  const std::string holder = directory_.read("kept/calibration.yaml.lock");
  expect_refused({"run", "-c", file, "--duration", "0.1"},
                 "kept/calibration.yaml: in use by process " + holder.substr(0, holder.find('\n')));
  EXPECT_THAT(holder, HasSubstr("run -c " + file));
  expect_refused({"calibrate", directory_.path(), "-o", path("kept")},
                 "give another place with -o");
  first.send(SIGKILL);
  EXPECT_EQ(first.wait(), 128 + SIGKILL);
  const Result third = alidade({"run", "-c", file, "--duration", "0.1"});
  EXPECT_EQ(third.exit_code, 0) << third.errors;
}

TEST_F(HostileFiles, ACertificateThatCannotBeUsedEndsTheStart) {
  const auto run = [&](const std::string& tls) {
    return std::vector<std::string>{"run", "-c",
                                    config("output: {http: '127.0.0.1:0', tls: {" + tls + "}}\n"),
                                    "--duration", "1"};
  };
  expect_refused(run("certificate: none.pem, key: none.key"),
                 "HTTP: " + path("none.pem") + ": cannot be read: No such file");
  directory_.write("words.pem", "words\n");
  expect_refused(run("certificate: words.pem, key: words.pem"),
                 "words.pem: holds no certificate; expected one as PEM");
  expect_refused(run("certificate: " + pipe("pipe.pem") + ", key: words.pem"),
                 ":4: output.tls.certificate: " + path("pipe.pem") +
                     ": cannot be read: not a file, but a pipe");
}

// Before it reads anything: what it would make at length would be the other's loss.
TEST_F(HostileFiles, OneCommandAtATimeWritesToAPlace) {
  const std::string usual = "in use by process " + std::to_string(::getpid()) + " (";
  fs::create_directories(path("out"));
  FileLock calibrating;
  FileLock finding_a_lens;
  FileLock mapping;
  std::string why;
  ASSERT_EQ(calibrating.take(path("out/calibration.yaml"), &why), FileLock::Result::kTaken) << why;
  ASSERT_EQ(finding_a_lens.take(path("out/lens.yaml"), &why), FileLock::Result::kTaken) << why;
  ASSERT_EQ(mapping.take(path("out.map"), &why), FileLock::Result::kTaken) << why;
  expect_refused({"calibrate", directory_.path(), "-o", path("out")},
                 path("out/calibration.yaml") + ": " + usual);
  expect_refused({"calibrate-shutter", directory_.path(), "--pattern", "chessboard:9x6:20mm", "-o",
                  path("out")},
                 path("out/lens.yaml") + ": " + usual);
  const std::vector<std::string> map_build = {
      "map", "build", directory_.path(), "-o", path("out.map"), "--focal-length", "400"};
  expect_refused(map_build, path("out.map") + ": " + usual);
  mapping.release_and_remove();
  EXPECT_THAT(alidade(map_build).errors, Not(HasSubstr("in use")));
  EXPECT_FALSE(fs::exists(path("out.map.lock")));
  // What is refused leaves nothing behind.
  EXPECT_NE(alidade({"calibrate", path("nowhere"), "-o", path("deep/er")}).exit_code, 0);
  EXPECT_FALSE(fs::exists(path("deep")));
}

TEST_F(HostileFiles, WhatATerminalWouldObeyIsShownInErrorsAndLog) {
  const std::string name = path("\x1b[31m\xc2\x9b\nred gr\u00fcn.yaml");
  const std::string seen = path("\\x1b[31m\\u009b\\nred gr\u00fcn.yaml");
  expect_refused({"run", "-c", name}, seen + ": cannot be read: No such file");
  expect_refused({"\x1b[31m"}, "'\\x1b[31m'");
  // In the log: what lies in a calibration's place is named.
  const std::string file = config("calibration: {file: \"\\e[31m/calibration.yaml\"}\n");
  fs::create_directories(path("\x1b[31m/calibration.yaml"));
  const Result result = alidade({"run", "-c", file, "--duration", "0.1"});
  EXPECT_THAT(result.errors,
              AllOf(HasSubstr("\\x1b[31m/calibration.yaml: not a file"), Not(HasSubstr("\x1b["))));
}

// One byte of a network was changed: with each of them OpenCV reads memory that is not its own, and most often crashes.
TEST_F(HostileFiles, ANetworkThatEndsTheLibraryIsRefusedByName) {
  std::ifstream whole(std::string(ALIDADE_TEST_DATA) + "/bright_cells_v8.onnx", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(whole), {}};
  ASSERT_FALSE(bytes.empty());
  const auto with = [&](const std::string& model) {
    return config("tracking: {}\nrealtime: {mode: OE}\ndetectors: {onnx: {model: " + model +
                  ", width_px: 64, height_px: 64}}\n");
  };
  for (const auto& [at, byte] :
       {std::pair(349, '\x52'), std::pair(373, '\x2b'), std::pair(584, '\x5c')}) {
    std::string forged = bytes;
    forged.at(static_cast<std::size_t>(at)) = byte;
    const std::string model = directory_.write("forged.onnx", forged);
    expect_refused({"run", "-c", with(model), "--duration", "0.1"},
                   "detectors.onnx: " + model + ": ");
  }
  // One that was cut off is told as it was; the whole one is taken.
  const std::string cut = directory_.write("cut.onnx", bytes.substr(0, bytes.size() / 2));
  expect_refused({"run", "-c", with(cut), "--duration", "0.1"},
                 cut + ": is not an ONNX network that OpenCV can read");
  const Result taken =
      alidade({"run", "-c", with(std::string(ALIDADE_TEST_DATA) + "/bright_cells_v8.onnx"),
               "--duration", "0.1"});
  EXPECT_EQ(taken.exit_code, 0) << taken.errors;
}

}  // namespace
}  // namespace alidade
