#include "test/simulator/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "test/simulator/path.h"
#include "test/simulator/pattern_board.h"
#include "test/simulator/resize.h"
#include "test/support/temporary_directory.h"

namespace alidade::simulator {
namespace {

class VirtualCameraConfig : public testing::Test {
 protected:
  Config load(const std::string& text) {
    return load_config(directory_.write("camera.yaml", text));
  }

  // The one-line error, without the directory.
  std::string error_of(const std::string& text) {
    try {
      (void)make_path(load(text));
    } catch (const ConfigError& error) {
      const std::string what = error.what();
      EXPECT_EQ(what.find('\n'), std::string::npos);
      EXPECT_EQ(what.rfind(directory_.path() + "/", 0), 0U) << what;
      return what.substr(directory_.path().size() + 1);
    }
    return "no error";
  }

  TemporaryDirectory directory_;
};

TEST_F(VirtualCameraConfig, ConvertsTheUnitsOfItsKeys) {
  const Config config = load(
      "camera: {line_delay_us: -14.2, clock_offset_ms: -84.4, pan_axis_mrad: [-12, 3]}\n"
      "telemetry: {quantum_deg: 180}\n"
      "sensor: {exposure_ms: 2}\n");
  EXPECT_DOUBLE_EQ(config.camera.line_delay, -14.2e-6);
  EXPECT_DOUBLE_EQ(config.camera.clock_offset, -84.4e-3);
  EXPECT_DOUBLE_EQ(config.camera.pan_axis_offset.x(), -12e-3);
  EXPECT_DOUBLE_EQ(config.camera.pan_axis_offset.y(), 3e-3);
  EXPECT_DOUBLE_EQ(config.telemetry.quantum, 3.14159265358979323846);
  EXPECT_DOUBLE_EQ(config.sensor.exposure, 2e-3);
}

TEST_F(VirtualCameraConfig, FindsFilesBesideItself) {
  const Config config = load("scene: {photos: [{file: a/b.jpg, width_deg: 20}]}\ntruth_dir: t\n");
  EXPECT_EQ(config.scene.photos.at(0).file, directory_.path() + "/a/b.jpg");
  EXPECT_EQ(config.truth_dir, directory_.path() + "/t");
}

TEST_F(VirtualCameraConfig, NamesFileAndLineOfEveryMistake) {
  struct Mistake {
    const char* text;
    const char* error;
  };
  for (const Mistake& mistake : {
           Mistake{"seed: 1\nfoo: 2\n", "camera.yaml:2: unknown key 'foo' in the configuration"},
           Mistake{"camera:\n  focal_length_px: 1000\n  focal_length: 2\n",
                   "camera.yaml:3: unknown key 'focal_length' in camera"},
           Mistake{"camera:\n  focal_length_px: long\n",
                   "camera.yaml:2: focal_length_px must be a number"},
           Mistake{"camera:\n  focal_length_px: .nan\n",
                   "camera.yaml:2: focal_length_px must be a number"},
           Mistake{"\ncamera: {focal_length_px: -3}\n",
                   "camera.yaml:2: focal_length_px is -3, must be more than 0"},
           Mistake{"image: {width: 640.5}\n", "camera.yaml:1: width must be a whole number"},
           Mistake{"sensor: {jpeg_quality: 101}\n",
                   "camera.yaml:1: jpeg_quality is 101, must be between 1 and 100"},
           Mistake{"camera: 7\n", "camera.yaml:1: 'camera' must hold keys with values"},
           Mistake{"camera: {pan_axis_mrad: 3}\n",
                   "camera.yaml:1: pan_axis_mrad must be two numbers: [a, b]"},
           Mistake{"path: {type: circle}\n",
                   "camera.yaml:1: type must be one of: triple_cosine, sweep, jerky, csv"},
           Mistake{"path: {type: csv}\n",
                   "camera.yaml:1: path needs 'file' with 'type: csv', and only then"},
           Mistake{"path: {type: csv, file: none.csv}\n", "none.csv: cannot be read"},
           Mistake{"scene:\n  photos:\n    - {file: a.jpg}\n",
                   "camera.yaml:3: width_deg is missing"},
           Mistake{"scene: {photos: 3}\n", "camera.yaml:1: photos must be a list"},
           Mistake{"live: {codec: h264, mjpeg_port: 0}\n",
                   "camera.yaml:1: mjpeg_port needs codec: mjpeg"},
           Mistake{"live: {user: me}\n", "camera.yaml:1: user and password_env come together"},
           Mistake{"pattern: {kind: dots}\n",
                   "camera.yaml:1: kind must be one of: chessboard, circles, symmetric_circles, "
                   "april_grid, charuco"},
           Mistake{"pattern:\n  kind: april_grid\n  columns: 30\n  rows: 30\n",
                   "camera.yaml:2: pattern has more than the 587 tags of family 36h11"},
           Mistake{"pattern: {corner_squares: 2}\n",
                   "camera.yaml:1: corner_squares must be true or false"},
           Mistake{"pattern: {}\nrecording: {images: none}\n",
                   "camera.yaml:1: recording: a pattern needs images: video, png or pgm"},
           Mistake{"zoom: {}\ncamera:\n  focal_length_px: 1000\n",
                   "camera.yaml:3: focal_length_px belongs to a lens without zoom: zoom has its "
                   "own"},
           Mistake{"zoom:\n  focal_length_px: {wide: 2000, tele: 1000}\n",
                   "camera.yaml:2: focal_length_px: tele must be more than wide"},
           Mistake{"zoom:\n  focal_length_px: {wide: 2000, long: 1000}\n",
                   "camera.yaml:2: unknown key 'long' in focal_length_px"},
           Mistake{"zoom: {reading: {wide: 3, tele: 3}}\n",
                   "camera.yaml:1: wide and tele must differ"},
           Mistake{"zoom: {shape: 9}\n", "camera.yaml:1: shape is 9, must be between 0.25 and 4"},
           Mistake{"zoom: {path: {type: dwell}}\n",
                   "camera.yaml:1: path needs 'stops' with 'type: dwell', and only then"},
           Mistake{"zoom:\n  path:\n    type: dwell\n    stops: [{rest_s: 2}]\n",
                   "camera.yaml:4: a stop needs zoom or focal_length_px, and only one of them"},
           Mistake{"zoom: {path: {type: sweep, round_s: 30}}\n",
                   "camera.yaml:1: path: round_s goes with 'type: dwell' only"},
           Mistake{
               "zoom: {path: {type: dwell, round_s: 3, stops: [{zoom: 1, rest_s: 2}, {zoom: "
               "9, rest_s: 2}]}}\n",
               "camera.yaml:1: path: a round_s of 3 is too short for stops and movements, which "
               "take 4.09769"},
           Mistake{"path: {follows_zoom: true}\n",
                   "camera.yaml:1: path: follows_zoom needs a 'zoom' section"},
           Mistake{"zoom: {}\npath: {follows_zoom: true, focal_length_px: 900}\n",
                   "camera.yaml:2: follows_zoom: neither 'type: csv' nor focal_length_px goes "
                   "with it"},
           Mistake{"zoom: {path: {type: sweep, factor: 30}}\n",
                   "camera.yaml:1: path: a focal length of 36000 px is not between 1200 and 24000"},
           Mistake{"zoom: {path: {type: still, zoom: 0}}\n",
                   "camera.yaml:1: path: zoom 0 is not between 1 and 9999"},
           Mistake{"zoom: {path: {type: csv, file: none.csv}}\n", "none.csv: cannot be read"},
           Mistake{"telemetry: {gear: {pan: [{amplitude_mrad: -1}]}}\n",
                   "camera.yaml:1: amplitude_mrad is -1, must be between 0 and 100"},
           Mistake{"telemetry: {gear: {roll: []}}\n", "camera.yaml:1: unknown key 'roll' in gear"},
           Mistake{"telemetry: {quantum_deg: 0.1, gear: {tilt: [{period_deg: 0.1}]}}\n",
                   "camera.yaml:1: period_deg must be more than quantum_deg"},
           Mistake{"telemetry: {play: {encoder: none}}\n",
                   "camera.yaml:1: encoder must be one of: motor, output"},
           Mistake{"zoom: {}\ncamera: {centre_px: [1, 2]}\n",
                   "camera.yaml:2: centre_px belongs to a lens without zoom: zoom has its own"},
           Mistake{"camera: {centre_px: [0, -361]}\n",
                   "camera.yaml:1: camera: centre_px is beyond the image's border"},
           Mistake{"camera: {breathing: {part: 0.1}}\n",
                   "camera.yaml:1: part is 0.1, must be between -0.05 and 0.05"},
           Mistake{"camera: {pupil_cm: [0, 0]}\n",
                   "camera.yaml:1: pupil_cm must be three numbers: [a, b, c]"},
           Mistake{"camera: {pupil_cm: [0, 0, 500]}\n",
                   "camera.yaml:1: pupil_cm is 500, must be between -50 and 50"},
           Mistake{"scene: {flat: [{width_deg: 1, height_deg: 1, distance_m: 0.1}]}\n",
                   "camera.yaml:1: distance_m is 0.1, must be between 0.6 and 1e+06"},
           Mistake{"scene: {procedural: [{width_deg: 1, height_deg: 1, distance_m: {nearest: 9, "
                   "farthest: 3}}]}\n",
                   "camera.yaml:1: distance_m needs nearest, and farthest that is not less"},
           Mistake{"live: {kbit_s: 500}\n",
                   "camera.yaml:1: kbit_s and gop need codec: h264 or h265"},
           Mistake{"recording: {images: png, codec: h264}\n",
                   "camera.yaml:1: codec needs images: video"},
           Mistake{"sensor: {noise_reduction: 0.99}\n",
                   "camera.yaml:1: noise_reduction is 0.99, must be between 0 and 0.95"},
           Mistake{"scene: {clouds: {rate_px_s: 1, rate_deg_s: 1}}\n",
                   "camera.yaml:1: clouds have rate_deg_s or rate_px_s, not both"},
           Mistake{"camera: {sway: [{axis: up}]}\n",
                   "camera.yaml:1: axis must be one of: forward, right, down"},
           Mistake{"pattern: {}\nzoom: {}\n", "camera.yaml:1: a pattern is seen without zoom"},
           Mistake{"camera: {line_delay_us: 60}\n",
                   "camera.yaml:1: camera: reading out all rows (line_delay_us x height) outlasts "
                   "a frame"},
       }) {
    EXPECT_EQ(error_of(mistake.text), mistake.error);
  }
  EXPECT_THAT(error_of("camera: {a: [}\n"), testing::StartsWith("camera.yaml:1: "));
  EXPECT_THROW((void)load_config(directory_.path() + "/none.yaml"), ConfigError);
}

TEST_F(VirtualCameraConfig, ACharucoBoardsMarkersFit) {
  const std::string head = "pattern:\n  kind: charuco\n";
  if (!PatternBoard::has_charuco()) {
    EXPECT_EQ(error_of(head),
              "camera.yaml:2: this build has no ChArUco boards, which need "
              "libopencv-contrib-dev");
    return;
  }
  EXPECT_EQ(error_of(head + "  marker_mm: 30\n"),
            "camera.yaml:2: marker_mm is not smaller than size_mm");
  EXPECT_EQ(error_of(head + "  columns: 12\n  rows: 9\n"),
            "camera.yaml:2: pattern has more markers than its dictionary");
  const Config config = load(head + "  columns: 12\n  rows: 9\n  dictionary: 1\n");
  EXPECT_EQ(config.pattern->kind, PatternConfig::Kind::kCharuco);
}

TEST_F(VirtualCameraConfig, NamesTheLineOfABrokenPathFile) {
  const std::string config = "path: {type: csv, file: path.csv}\n";
  directory_.write("path.csv", "time_s,pan_rad,tilt_rad\n0,0,0\n1,x,0\n");
  EXPECT_EQ(error_of(config), "path.csv:3: a path needs a number in time_s, pan_rad and tilt_rad");
  directory_.write("path.csv", "time_s,pan_rad,tilt_rad\n0,0,0\n1,0\n");
  EXPECT_EQ(error_of(config), "path.csv:3: a path needs a number in time_s, pan_rad and tilt_rad");
  directory_.write("path.csv", "time_s,pan_rad,tilt_rad\n0,0,0\n0,0,0\n");
  EXPECT_EQ(error_of(config), "path.csv:3: time_s must increase");
  directory_.write("path.csv", "time_s,pan_deg,tilt_rad\n0,0,0\n0,0,0\n");
  EXPECT_EQ(error_of(config), "path.csv:1: column pan_rad is missing");
  directory_.write("path.csv", "time_s,pan_rad,tilt_rad\n0,0,0\n");
  EXPECT_EQ(error_of(config), "path.csv: a path needs two points or more");
}

TEST_F(VirtualCameraConfig, TakesThePasswordFromTheEnvironment) {
  ASSERT_EQ(setenv("ALIDADE_TEST_PASSWORD", "secret", 1), 0);
  const Config config = load("live: {user: root, password_env: ALIDADE_TEST_PASSWORD}\n");
  EXPECT_EQ(config.live.password, "secret");
  EXPECT_EQ(
      error_of("live: {user: root, password_env: ALIDADE_TEST_NO_PASSWORD}\n"),
      "camera.yaml:1: environment variable ALIDADE_TEST_NO_PASSWORD (password_env) is not set");
}

TEST_F(VirtualCameraConfig, FollowsThePapersTripleInfinity) {
  const Config config = load("camera: {focal_length_px: 640}\npath: {pan_deg: 90, amplitude: 2}\n");
  const auto path = make_path(config);
  // 90 degrees wide: s = pi / 2.
  const double pi = 3.14159265358979323846;
  EXPECT_NEAR(path->at(2.5).pan, pi / 2 + 2 * 9.0 / 4, 1e-12);
  EXPECT_NEAR(path->at(2.5).tilt, 0, 1e-12);
  EXPECT_NEAR(path->at(0).tilt, -2 * 3.0 / 4, 1e-12);
  EXPECT_EQ(path->period_s(), 10);
}

TEST_F(VirtualCameraConfig, MovesSmoothlyAndClosesTheLoopOnEveryPeriodicPath) {
  for (const char* type : {"triple_cosine", "sweep", "jerky"}) {
    const Config config = load("path: {type: " + std::string(type) + ", period_s: 8}\n");
    const auto path = make_path(config);
    double length = 0;
    Angles last = path->at(-8);
    const Angles start = last;
    for (int i = 1; i <= 8000; ++i) {
      const Angles now = path->at(-8 + 1e-3 * i);
      const double step = std::hypot(now.pan - last.pan, now.tilt - last.tilt);
      // Nothing jumps: at most 20 fields of view a second.
      EXPECT_LT(step, 20e-3 * horizontal_field_of_view(config)) << type << " " << i;
      length += step;
      last = now;
    }
    EXPECT_NEAR(last.pan, start.pan, 1e-9) << type;
    EXPECT_NEAR(last.tilt, start.tilt, 1e-9) << type;
    EXPECT_GT(length, 4 * horizontal_field_of_view(config)) << type;
  }
}

TEST_F(VirtualCameraConfig, RestsBetweenTheMovesOfASweep) {
  const auto path = make_path(load("path: {type: sweep, period_s: 8, stop_s: 0.5}\n"));
  EXPECT_EQ(path->at(1.6).pan, path->at(1.9).pan);
  EXPECT_NE(path->at(1.0).pan, path->at(1.4).pan);
}

TEST_F(VirtualCameraConfig, FollowsACsvPathThroughItsPointsAndAcrossHalfATurn) {
  directory_.write("path.csv",
                   "frame,time_s,pan_rad,tilt_rad\n0,0,3.1,0\n1,1,-3.08318530717958647692,0.1\n");
  const auto path = make_path(load("path: {type: csv, file: path.csv}\n"));
  EXPECT_NEAR(path->at(0).pan, 3.1, 1e-12);
  EXPECT_NEAR(path->at(0.5).pan, 3.15, 1e-12);
  EXPECT_NEAR(path->at(1).pan, 3.2, 1e-12);
  EXPECT_NEAR(path->at(9).pan, 3.2, 1e-12);
  EXPECT_NEAR(path->at(1).tilt, 0.1, 1e-12);
}

TEST_F(VirtualCameraConfig, AnotherSizeIsTheSameCamera) {
  const Config before = load(
      "image: {width: 1280, height: 720}\n"
      "camera: {line_delay_us: -14.2}\n"
      "zoom: {focal_length_px: {wide: 1200, tele: 24000}, centre_px: [4, -3], path: {type: dwell, "
      "stops: [{focal_length_px: 2400, rest_s: 1}]}}\n"
      "guess: {focal_length_px: 1300}\n");
  Config config = before;
  resize("320x180", &config);
  EXPECT_EQ(config.image.width, 320);
  EXPECT_EQ(config.image.height, 180);
  EXPECT_NEAR(horizontal_field_of_view(config), horizontal_field_of_view(before), 1e-12);
  EXPECT_DOUBLE_EQ(config.zoom->focal_length.tele, 6000);
  EXPECT_DOUBLE_EQ(config.zoom->path.stops.at(0).focal_length.value(), 600);
  EXPECT_DOUBLE_EQ(config.zoom->centre.x(), 1);
  EXPECT_DOUBLE_EQ(config.guess_focal_length.value(), 325);
  // Reading out a frame takes as long.
  EXPECT_DOUBLE_EQ(config.camera.line_delay * 180, before.camera.line_delay * 720);

  Config fixed = load(
      "image: {width: 1280, height: 720}\n"
      "camera: {focal_length_px: 5000, radial_distortion: 3}\n");
  resize("320x180", &fixed);
  EXPECT_DOUBLE_EQ(fixed.camera.focal_length, 1250);
  EXPECT_DOUBLE_EQ(fixed.camera.radial_distortion, 3);
  for (const char* size : {"", "320", "320x", "x180", "0x0", "320x180x", "9999x9999"}) {
    EXPECT_THROW(resize(size, &config), ConfigError) << size;
  }
}

}  // namespace
}  // namespace alidade::simulator
