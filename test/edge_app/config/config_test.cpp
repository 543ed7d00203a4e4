// The configuration is strict: whatever is wrong is refused in one line that names file, line and key.

#include "edge_app/config/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "edge_app/config/nearest_word.h"
#include "edge_app/config/noise_file.h"
#include "edge_app/config/plane_data.h"
#include "test/platform/support/head_kinds.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

// The smallest configuration that works; line numbers of the cases count from its end (line 3).
constexpr char kMinimal[] =
    "video: {type: rtsp, url: rtsp://camera/stream}\n"
    "pan_tilt: {type: vapix, url: http://camera}\n"
    "calibration: {file: calibration.yaml}\n";

class ConfigTest : public ::testing::Test {
 protected:
  // Returns the error; empty if the text was accepted.
  std::string load(const std::string& text) {
    path_ = directory_.write("alidade.yaml", text);
    std::string error;
    const bool ok = load_config(path_, &config_, &error);
    EXPECT_EQ(ok, error.empty());
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    return error;
  }

  TemporaryDirectory directory_;
  std::string path_;
  Config config_;
};

TEST_F(ConfigTest, MinimalConfigurationHasTheDocumentedDefaults) {
  ASSERT_THAT(load(kMinimal), IsEmpty());
  EXPECT_EQ(config_.video.type, VideoConfig::Type::kRtsp);
  EXPECT_EQ(config_.video.url, "rtsp://camera/stream");
  EXPECT_EQ(config_.video.transport, VideoConfig::Transport::kTcp);
  EXPECT_EQ(config_.pan_tilt.url, "http://camera");
  EXPECT_EQ(config_.pan_tilt.rate_hz, 30);
  EXPECT_FALSE(config_.pan_tilt.angle_sigma_rad);
  EXPECT_EQ(config_.realtime.priority, 0);
  EXPECT_EQ(config_.realtime.cpu, -1);
  EXPECT_FALSE(config_.realtime.lock_memory);
  EXPECT_EQ(config_.output.stdout_format, OutputFormat::kJson);
  EXPECT_FALSE(config_.output.http);
  EXPECT_THAT(config_.warnings, IsEmpty());
}

// As of a camera on a bench; what else is there is as strict as ever.
TEST_F(ConfigTest, VideoAloneIsEnoughWhereOnlyThatIsNeeded) {
  const auto error_of = [this](const std::string& text) {
    std::string error;
    const bool ok = parse_config(text, "camera.yaml", &config_, &error, ConfigScope::kVideo);
    EXPECT_EQ(ok, error.empty());
    return error;
  };
  const std::string video = "video: {type: v4l2, device: /dev/video3}\n";
  EXPECT_THAT(error_of(video), IsEmpty());
  EXPECT_EQ(config_.video.device, "/dev/video3");
  EXPECT_THAT(error_of(kMinimal), IsEmpty());
  EXPECT_THAT(error_of(video + "realtime: {max_extrapolation_s: 0.05}\n"), IsEmpty());
  EXPECT_THAT(error_of("camera: {focal_length_px: 3}\n"), HasSubstr("'video' is missing"));
  EXPECT_THAT(error_of(video + "pan_tlt: {type: vapix}\n"), HasSubstr("pan_tlt"));
  EXPECT_THAT(error_of(video + "pan_tilt: {type: vapx}\n"), HasSubstr("vapx"));
  EXPECT_THAT(error_of(video + "camera: {focal_length: 3}\n"), HasSubstr("focal_length"));
  EXPECT_THAT(load(video), HasSubstr("section 'pan_tilt' is missing; add it"));
}

TEST_F(ConfigTest, AMapThatIsKeptUpIsAFile) {
  EXPECT_THAT(load(std::string(kMinimal) + "scene_map: {update: true}\n"), HasSubstr("add file"));
  EXPECT_THAT(load(kMinimal), IsEmpty());
  EXPECT_FALSE(config_.scene_map.update);
}

TEST_F(ConfigTest, WithoutTelemetryTheSceneMapAndACalibrationAreNeeded) {
  const std::string none =
      "video: {type: rtsp, url: 'rtsp://camera/s'}\n"
      "pan_tilt: {type: none}\n";
  const std::string map = "scene_map: {file: scene.map}\n";
  const std::string calibrated = "calibration: {file: c.yaml}\n";
  ASSERT_THAT(load(none + map + calibrated), IsEmpty());
  EXPECT_EQ(config_.pan_tilt.type, PanTiltConfig::Type::kNone);
  EXPECT_FALSE(config_.calibration.automatic);
  EXPECT_THAT(load(none + calibrated), HasSubstr(":2: pan_tilt.type: none, but no scene map"));
  EXPECT_THAT(load(none + map),
              HasSubstr(":2: pan_tilt.type: none, but nothing can be calibrated"));
  EXPECT_THAT(load(none + map + "calibration: {file: c.yaml, auto: true}\n"),
              HasSubstr("set it to false"));
  EXPECT_THAT(load(none + map + "calibration: {file: c.yaml, auto: false}\n"), IsEmpty());
  EXPECT_THAT(load(none + map + calibrated + "realtime: {mode: PT}\n"), HasSubstr("set it to OE"));
  EXPECT_THAT(load("video: {type: recording, directory: film}\n"
                   "pan_tilt: {type: none}\n" +
                   map + calibrated),
              HasSubstr("is for live video"));
  EXPECT_THAT(load("video: {type: rtsp, url: 'rtsp://camera/s'}\n"
                   "pan_tilt: {type: none, rate_hz: 3}\n" +
                   map + calibrated),
              HasSubstr("rate_hz"));
}

TEST_F(ConfigTest, TheHttpServerHasAnAddressAndATokenFromElsewhere) {
  const std::string minimal = kMinimal;
  ASSERT_THAT(load(minimal + "output: {http: '127.0.0.1:8080'}\n"), IsEmpty());
  EXPECT_EQ(config_.output.http->host, "127.0.0.1");
  EXPECT_EQ(config_.output.http->port, 8080);
  EXPECT_EQ(config_.output.http->token, "");
  EXPECT_EQ(config_.output.stdout_format, OutputFormat::kJson);
  EXPECT_THAT(config_.warnings, IsEmpty());
  ASSERT_THAT(load(minimal + "output: {http: '[::1]:0', json: false}\n"), IsEmpty());
  EXPECT_EQ(config_.output.http->host, "::1");
  EXPECT_EQ(config_.output.http->port, 0);
  EXPECT_FALSE(config_.output.stdout_format);
  ::setenv("ALIDADE_TEST_TOKEN", "right-horse", 1);
  ASSERT_THAT(load(minimal + "output: {http: '0.0.0.0:80', token_env: ALIDADE_TEST_TOKEN}\n"),
              IsEmpty());
  EXPECT_EQ(config_.output.http->token, "right-horse");
  EXPECT_THAT(config_.warnings, IsEmpty());
  directory_.write("token", " other-horse \nignored\n");
  ASSERT_THAT(load(minimal + "output: {http: 'camera:80', token_file: token, csv: true}\n"),
              IsEmpty());
  EXPECT_EQ(config_.output.http->token, "other-horse");
  EXPECT_EQ(config_.output.stdout_format, OutputFormat::kCsv);
}

TEST_F(ConfigTest, TheHttpServerMayHaveTokensWithRightsAndACertificate) {
  const std::string minimal = kMinimal;
  directory_.write("tokens", "view my-horse-1\ncontrol my-horse-2\n");
  const std::string file = directory_.path() + "/tokens";
  ASSERT_EQ(::chmod(file.c_str(), 0640), 0);
  ASSERT_THAT(load(minimal + "output:\n  http: '0.0.0.0:80'\n  tokens_file: tokens\n"
                             "  tls: {certificate: server.pem, key: /etc/server.key}\n"),
              IsEmpty());
  const HttpServerOptions& http = *config_.output.http;
  ASSERT_EQ(http.tokens.size(), 2U);
  EXPECT_EQ(http.tokens[0].right, HttpRight::kView);
  EXPECT_EQ(http.tokens[1].right, HttpRight::kControl);
  EXPECT_EQ(http.token, "");
  EXPECT_EQ(http.token_file, file);
  ASSERT_TRUE(http.tls);
  EXPECT_EQ(http.tls->certificate, directory_.path() + "/server.pem");
  EXPECT_EQ(http.tls->key, "/etc/server.key");
  EXPECT_THAT(config_.warnings, IsEmpty());
  ASSERT_EQ(::chmod(file.c_str(), 0644), 0);
  ASSERT_THAT(load(minimal + "output: {http: '0.0.0.0:80', tokens_file: tokens}\n"), IsEmpty());
  ASSERT_THAT(config_.warnings, ::testing::SizeIs(1));
  EXPECT_THAT(
      config_.warnings[0],
      ::testing::AllOf(HasSubstr(":4: output.tokens_file: other users of this machine can read"),
                       HasSubstr("chmod o=")));
  directory_.write("tokens", "view my-horse-1\ncontrl my-horse-2\n");
  EXPECT_THAT(load(minimal + "output: {http: '0.0.0.0:80', tokens_file: tokens}\n"),
              ::testing::AllOf(HasSubstr(":4: output.tokens_file: "),
                               HasSubstr("tokens: line 2 names no right")));
}

TEST_F(ConfigTest, ABrokersPasswordMayStandInAFileAndIsToCrossNoNetworkInTheClear) {
  std::ofstream(directory_.path() + "/password") << "  open-sesame \nand more\n";
  const std::string login = ", user: eve, password_file: password}\n";
  ASSERT_THAT(load(kMinimal + ("mqtt: {url: 'mqtt://broker:1884/'" + login)), IsEmpty());
  EXPECT_EQ(config_.mqtt->name(), "mqtt://broker:1884");
  EXPECT_EQ(config_.mqtt->password, "open-sesame");
  EXPECT_THAT(config_.warnings,
              ::testing::ElementsAre(HasSubstr("mqtt.url: the password crosses the network")));
  ASSERT_THAT(load(kMinimal + ("mqtt: {url: 'mqtt://[::1]'" + login)), IsEmpty());
  EXPECT_EQ(config_.mqtt->name(), "mqtt://[::1]:1883");
  EXPECT_EQ(config_.mqtt->host, "::1");
  EXPECT_THAT(config_.warnings, IsEmpty());
  ASSERT_THAT(load(kMinimal + ("mqtt: {url: 'mqtts://broker'" + login)), IsEmpty());
  EXPECT_THAT(config_.warnings, IsEmpty());
}

TEST_F(ConfigTest, ACamerasPasswordMayStandInAFileBesideTheConfiguration) {
  directory_.write("password", "open-sesame\n");
  const std::string login = ", user: eve, password_file: password}\n";
  const std::string camera = "camera: {focal_length_px: 2500}\n";
  ASSERT_THAT(load("video: {type: rtsp, url: 'rtsp://camera/s'" + login +
                   "pan_tilt: {type: onvif, url: 'http://camera'" + login + camera),
              IsEmpty());
  EXPECT_EQ(config_.video.password, "open-sesame");
  EXPECT_EQ(config_.pan_tilt.password, "open-sesame");
  ASSERT_THAT(load("video: {type: mjpeg, url: 'http://camera/s'" + login +
                   "pan_tilt: {type: vapix, url: 'http://camera'" + login + camera),
              IsEmpty());
  EXPECT_EQ(config_.video.password, "open-sesame");
  EXPECT_EQ(config_.pan_tilt.password, "open-sesame");
}

TEST_F(ConfigTest, TakesTheFocalLengthsOfALensThatZooms) {
  ASSERT_THAT(load("video: {type: rtsp, url: 'rtsp://camera/s'}\n"
                   "pan_tilt: {type: vapix, url: 'http://camera'}\n"
                   "camera: {focal_length_px: {wide: 1000, tele: 16000}}\n"),
              IsEmpty());
  ASSERT_TRUE(config_.camera.focal_length_range);
  EXPECT_EQ(config_.camera.focal_length_range->wide_px, 1000);
  EXPECT_EQ(config_.camera.focal_length_range->tele_px, 16000);
  EXPECT_DOUBLE_EQ(*config_.camera.focal_length_px, 4000);
}

TEST_F(ConfigTest, WarnsOfAnHttpServerThatIsOpenToAll) {
  ASSERT_THAT(load(std::string(kMinimal) + "output: {http: '0.0.0.0:8080'}\n"), IsEmpty());
  ASSERT_EQ(config_.warnings.size(), 1U);
  EXPECT_THAT(config_.warnings[0],
              HasSubstr(":4: output.http: listens to other machines without a token"));
}

TEST_F(ConfigTest, WarnsOfAPriorWhereNothingIsCalibrated) {
  const std::string live =
      "video: {type: rtsp, url: 'rtsp://camera/s'}\npan_tilt: {type: vapix, url: http://camera}\n";
  const std::string recorded =
      "video: {type: recording, directory: x}\npan_tilt: {type: recording, directory: x}\n";
  for (const std::string& text :
       {live + "calibration: {file: c.yaml, prior: lens.yaml, auto: false}\n",
        live + "calibration: {file: c.yaml, prior: lens.yaml}\nrealtime: {mode: PT}\n",
        recorded + "calibration: {file: c.yaml, prior: lens.yaml}\n"}) {
    ASSERT_THAT(load(text), IsEmpty());
    EXPECT_THAT(config_.warnings,
                ::testing::ElementsAre(HasSubstr(":3: calibration.prior: is not used")));
  }
  ASSERT_THAT(load(live + "calibration: {file: c.yaml, prior: lens.yaml}\n"), IsEmpty());
  EXPECT_THAT(config_.warnings, IsEmpty());
}

TEST_F(ConfigTest, DoesNotRepeatATokenThatIsOfNoUse) {
  ::setenv("ALIDADE_TEST_TOKEN", "short", 1);
  const std::string error = load(std::string(kMinimal) +
                                 "output: {http: '127.0.0.1:0', token_env: ALIDADE_TEST_TOKEN}\n");
  EXPECT_THAT(error, HasSubstr("gives no token that can be used"));
  EXPECT_THAT(error, ::testing::Not(HasSubstr("short")));
}

// load() itself wants one line.
TEST_F(ConfigTest, ErrorsStayOnOneBearableLineWhateverTheFileHolds) {
  EXPECT_THAT(load("video: {type: \"rt\\n\\e[2Jsp\"}\npan_tilt: {}\n"),
              HasSubstr("'rt??[2Jsp' is"));
  EXPECT_THAT(load(std::string(kMinimal) + "\"a\\nb\": 1\n"), HasSubstr("a?b: unknown key"));
  EXPECT_THAT(load("video: \"\\\x01\"\n"), HasSubstr("not YAML"));
  EXPECT_LT(load("video: {type: " + std::string(100'000, 'x') + "}\npan_tilt: {}\n").size(), 1100U);
}

TEST_F(ConfigTest, RelativePathsStartAtTheConfigurationsFolder) {
  ASSERT_THAT(load(kMinimal), IsEmpty());
  EXPECT_EQ(config_.calibration.file, directory_.path() + "/calibration.yaml");
}

TEST_F(ConfigTest, EveryKeyIsRead) {
  ::setenv("ALIDADE_TEST_PASSWORD", "secret", 1);
  ASSERT_THAT(
      load(
          "video: {type: rtsp, url: 'rtsp://camera/s', transport: udp, user: eve,\n"
          "        password_env: ALIDADE_TEST_PASSWORD, timeout_s: 2.5, max_backoff_s: 8,\n"
          "        width: 1280, height: 720}\n"
          "pan_tilt: {type: vapix, url: 'https://camera', user: eve, camera: 2, rate_hz: 12.5,\n"
          "           password_env: ALIDADE_TEST_PASSWORD, timeout_s: 0.5, max_backoff_s: 9,\n"
          "           angle_sigma_rad: 2e-5, angle_quantum_rad: 1e-4, angle_accuracy_deg: 0.05}\n"
          "camera: {focal_length_px: 30000, aspect: 1.01, radial_distortion: -2.5,\n"
          "         centre_sigma_px: 2, line_delay_s: 1.5e-5, upside_down: true, zoom: fixed,\n"
          "         pupil_m: [0.01, -0.02, 0.06]}\n"
          "scene: {nearest_m: 20, farthest_m: 400}\n"
          "calibration: {file: /etc/c.yaml, prior: bench/lens.yaml, auto: false, zoom_tolerance: "
          "2.5, clock_offset_sigma_ms: 20}\n"
          "realtime: {mode: PT, priority: 60, cpu: 3, lock_memory: true, max_extrapolation_s: "
          "0.5}\n"
          "scene_map: {file: scene.map, interval_s: 3, zero_sigma_rad: 2e-4, on_moved_base: "
          "report, update: true}\n"
          "tracking: {plane: ground/plane.yaml, space: plane, detection_sigma_px: 3,\n"
          "           false_alarms_per_frame: 0.5, detection_probability: 0.8, least_score: 0.25,\n"
          "           acceleration_density_m2_s3: 2, first_velocity_sigma_m_s: 5,\n"
          "           most_sigma_m: 40, association: cheap, birth_hits: 2, birth_looks: 4,\n"
          "           lose_after_s: 1.5, forget_after_s: 30, history_s: 3, history_frames: 90,\n"
          "           max_targets: 64, max_detections: 100}\n"
          "mqtt: {url: 'mqtts://broker', ca_file: ca.pem, certificate_file: own.pem,\n"
          "       key_file: own.key, user: eve, password_env: ALIDADE_TEST_PASSWORD,\n"
          "       prefix: site/mast, client_id: mast, qos: 2, keep_alive_s: 20, timeout_s: 3,\n"
          "       max_backoff_s: 60, orientation_rate_hz: 0.5}\n"
          "output: {csv: true, json: false, http: '127.0.0.1:0', targets: targets.jsonl, "
          "recordings: kept}\n"),
      IsEmpty());
  EXPECT_EQ(config_.video.transport, VideoConfig::Transport::kUdp);
  EXPECT_EQ(config_.video.user, "eve");
  EXPECT_EQ(config_.video.password, "secret");
  EXPECT_EQ(config_.video.width, 1280);
  EXPECT_EQ(config_.video.height, 720);
  EXPECT_EQ(config_.video.timeout_s, 2.5);
  EXPECT_EQ(config_.video.max_backoff_s, 8);
  EXPECT_EQ(config_.pan_tilt.camera, 2);
  EXPECT_EQ(config_.pan_tilt.rate_hz, 12.5);
  EXPECT_EQ(config_.pan_tilt.password, "secret");
  EXPECT_EQ(config_.pan_tilt.timeout_s, 0.5);
  EXPECT_EQ(config_.pan_tilt.max_backoff_s, 9);
  EXPECT_EQ(config_.pan_tilt.angle_sigma_rad, 2e-5);
  EXPECT_EQ(config_.pan_tilt.angle_quantum_rad, 1e-4);
  EXPECT_EQ(config_.pan_tilt.angle_accuracy_deg, 0.05);
  EXPECT_EQ(config_.camera.focal_length_px, 30000);
  EXPECT_EQ(config_.camera.aspect, 1.01);
  EXPECT_EQ(config_.camera.radial_distortion, -2.5);
  EXPECT_EQ(config_.camera.centre_sigma_px, 2);
  EXPECT_EQ(config_.camera.line_delay_s, 1.5e-5);
  EXPECT_TRUE(config_.camera.upside_down);
  EXPECT_EQ(config_.camera.pupil.place_m, Vector3<double>(0.01, -0.02, 0.06));
  EXPECT_EQ(config_.camera.pupil.sigma_m.maxCoeff(), kStatedPupilSigma_m);
  ASSERT_TRUE(config_.scene);
  EXPECT_EQ(config_.scene->nearest_m, 20);
  EXPECT_EQ(config_.scene->farthest_m, 400);
  EXPECT_EQ(config_.calibration.file, "/etc/c.yaml");
  EXPECT_EQ(config_.calibration.prior, directory_.path() + "/bench/lens.yaml");
  EXPECT_FALSE(config_.calibration.automatic);
  EXPECT_EQ(config_.calibration.zoom_tolerance, 2.5);
  EXPECT_EQ(config_.calibration.clock_offset_sigma_s, 0.02);
  EXPECT_EQ(config_.scene_map.file, directory_.path() + "/scene.map");
  EXPECT_EQ(config_.scene_map.interval_s, 3);
  EXPECT_EQ(config_.scene_map.zero_sigma_rad, 2e-4);
  EXPECT_FALSE(config_.scene_map.correct_moved_base);
  EXPECT_TRUE(config_.scene_map.update);
  EXPECT_EQ(config_.tracking.plane, directory_.path() + "/ground/plane.yaml");
  ASSERT_TRUE(config_.tracking.targets);
  const TargetOptions& targets = *config_.tracking.targets;
  EXPECT_EQ(targets.detection_sigma_px, 3);
  EXPECT_EQ(targets.false_alarms, 0.5);
  EXPECT_EQ(targets.least_score, 0.25);
  EXPECT_EQ(targets.tracker.space, TargetSpace::kPlane);
  EXPECT_EQ(targets.tracker.association, AssociationMethod::kCheap);
  EXPECT_EQ(targets.tracker.acceleration_density, 2);
  EXPECT_EQ(targets.tracker.sigma_first_velocity, 5);
  EXPECT_EQ(targets.tracker.most_sigma, 40);
  EXPECT_EQ(targets.tracker.detection_probability, 0.8);
  EXPECT_EQ(targets.tracker.birth_hits, 2);
  EXPECT_EQ(targets.tracker.birth_looks, 4);
  EXPECT_EQ(targets.tracker.lose_after_s, 1.5);
  EXPECT_EQ(targets.tracker.forget_after_s, 30);
  EXPECT_EQ(targets.tracker.history_s, 3);
  EXPECT_EQ(targets.tracker.history_frames, 90);
  EXPECT_EQ(targets.tracker.max_targets, 64);
  EXPECT_EQ(targets.tracker.max_detections, 100);
  EXPECT_EQ(config_.output.targets, directory_.path() + "/targets.jsonl");
  EXPECT_EQ(config_.output.recordings, directory_.path() + "/kept");
  EXPECT_FALSE(config_.realtime.landmarks);
  EXPECT_EQ(config_.realtime.priority, 60);
  EXPECT_EQ(config_.realtime.cpu, 3);
  EXPECT_TRUE(config_.realtime.lock_memory);
  EXPECT_EQ(config_.realtime.max_extrapolation_s, 0.5);
  EXPECT_EQ(config_.output.stdout_format, OutputFormat::kCsv);
  ASSERT_TRUE(config_.mqtt);
  const MqttOptions& mqtt = *config_.mqtt;
  EXPECT_EQ(mqtt.name(), "mqtts://broker:8883");
  EXPECT_EQ(mqtt.ca_file, directory_.path() + "/ca.pem");
  EXPECT_EQ(mqtt.certificate_file, directory_.path() + "/own.pem");
  EXPECT_EQ(mqtt.key_file, directory_.path() + "/own.key");
  EXPECT_EQ(mqtt.user, "eve");
  EXPECT_EQ(mqtt.password, "secret");
  EXPECT_EQ(mqtt.prefix, "site/mast");
  EXPECT_EQ(mqtt.client_id, "mast");
  EXPECT_EQ(mqtt.qos, 2);
  EXPECT_EQ(mqtt.keep_alive_s, 20);
  EXPECT_EQ(mqtt.timeout_s, 3);
  EXPECT_EQ(mqtt.max_backoff_s, 60);
  EXPECT_EQ(mqtt.orientation_rate_hz, 0.5);
}

TEST_F(ConfigTest, TargetsAreTrackedWhereThereIsTheSection) {
  ASSERT_THAT(load(kMinimal), IsEmpty());
  EXPECT_FALSE(config_.tracking.targets);
  ASSERT_THAT(load(std::string(kMinimal) + "tracking:\n"), IsEmpty());
  ASSERT_TRUE(config_.tracking.targets);
  EXPECT_EQ(config_.tracking.targets->tracker.space, TargetSpace::kSphere);
  ASSERT_THAT(load(std::string(kMinimal) + "tracking: {plane: p.yaml}\n"), IsEmpty());
  EXPECT_EQ(config_.tracking.targets->tracker.space, TargetSpace::kPlane);
  ASSERT_THAT(
      load(std::string(kMinimal) + "tracking: {plane: p.yaml, space: sphere, most_sigma_rad: 0.5,\n"
                                   "           acceleration_density_rad2_s3: 1e-4, "
                                   "first_velocity_sigma_rad_s: 0.1}\n"),
      IsEmpty());
  EXPECT_EQ(config_.tracking.targets->tracker.space, TargetSpace::kSphere);
  EXPECT_EQ(config_.tracking.targets->tracker.most_sigma, 0.5);
  EXPECT_EQ(config_.tracking.targets->tracker.acceleration_density, 1e-4);
  EXPECT_EQ(config_.tracking.targets->tracker.sigma_first_velocity, 0.1);
  std::string error;
  ASSERT_TRUE(parse_config("tracking: {least_score: 0.5}\n", path_, &config_, &error,
                           ConfigScope::kTracking))
      << error;
  EXPECT_EQ(config_.tracking.targets->least_score, 0.5);
}

TEST_F(ConfigTest, ADetectorIsOffUnlessItIsThere) {
  ASSERT_THAT(load(kMinimal), IsEmpty());
  EXPECT_FALSE(config_.detectors.any());
  ASSERT_THAT(load(std::string(kMinimal) + "tracking: {}\ndetectors: {motion: {}}\n"
                                           "output: {targets: targets.jsonl}\n"),
              IsEmpty());
  ASSERT_TRUE(config_.detectors.motion);
  EXPECT_FALSE(config_.detectors.people);
  EXPECT_EQ(config_.detectors.motion->exposure_s, MotionOptions().exposure_s);
  ASSERT_THAT(load(std::string(kMinimal) +
                   "tracking: {plane: p.yaml}\n"
                   "detectors: {motion: {exposure_s: 0.001, least_size_px: 4, most_size_px: 50},\n"
                   "            people: {height_m: 1.6, least_height_px: 60, most_height_px: 300,\n"
                   "                     threshold: 0.5}}\n"),
              IsEmpty());
  EXPECT_EQ(config_.detectors.motion->exposure_s, 0.001);
  EXPECT_EQ(config_.detectors.motion->change.least_size_px, 4);
  EXPECT_EQ(config_.detectors.motion->change.most_size_px, 50);
  ASSERT_TRUE(config_.detectors.people);
  EXPECT_EQ(config_.detectors.people->height_m, 1.6);
  EXPECT_EQ(config_.detectors.people->least_height_px, 60);
  EXPECT_EQ(config_.detectors.people->most_height_px, 300);
  EXPECT_EQ(config_.detectors.people->threshold, 0.5);
}

TEST_F(ConfigTest, ANetworkIsLookedForBesideTheConfiguration) {
  ASSERT_THAT(load(std::string(kMinimal) +
                   "tracking: {}\n"
                   "detectors: {onnx: {model: nets/a.onnx, labels: /a/names.txt, width_px: 320,\n"
                   "                   height_px: 192, threshold: 0.4, most_overlap: 0.6}}\n"),
              IsEmpty());
  ASSERT_TRUE(config_.detectors.onnx);
  const NetworkFiles& onnx = *config_.detectors.onnx;
  EXPECT_EQ(onnx.model, directory_.path() + "/nets/a.onnx");
  EXPECT_EQ(onnx.labels, "/a/names.txt");
  EXPECT_EQ(onnx.options.width_px, 320);
  EXPECT_EQ(onnx.options.height_px, 192);
  EXPECT_EQ(onnx.options.threshold, 0.4);
  EXPECT_EQ(onnx.options.most_overlap, 0.6);
}

TEST_F(ConfigTest, WidthWithoutHeightIsRefused) {
  const std::string error = load(
      "video:\n  type: rtsp\n  url: rtsp://camera/s\n  width: 1280\n"
      "pan_tilt: {type: vapix, url: http://camera}\n"
      "camera: {focal_length_px: 1000}\n");
  EXPECT_EQ(error, path_ + ":4: video.width: is given alone; give width and height");
}

TEST_F(ConfigTest, RecordingAndRtpSourcesAreRead) {
  ASSERT_THAT(load("video: {type: recording, directory: tour}\n"
                   "pan_tilt: {type: recording, directory: /tour}\n"
                   "camera: {focal_length_px: 1000}\n"),
              IsEmpty());
  EXPECT_EQ(config_.video.directory, directory_.path() + "/tour");
  EXPECT_EQ(config_.pan_tilt.directory, "/tour");
  ASSERT_THAT(load("video: {type: rtp, url: 'rtp://@:5004', format: H265}\n"
                   "pan_tilt: {type: vapix, url: http://camera}\n"
                   "camera: {focal_length_px: 1000}\n"),
              IsEmpty());
  EXPECT_EQ(config_.video.format, "H265");
  ASSERT_THAT(load("video: {type: rtp, url: camera.sdp}\n"
                   "pan_tilt: {type: vapix, url: http://camera}\n"
                   "camera: {focal_length_px: 1000}\n"),
              IsEmpty());
  EXPECT_EQ(config_.video.url, directory_.path() + "/camera.sdp");
}

TEST_F(ConfigTest, RtspOverTlsIsRead) {
  ASSERT_THAT(load("video: {type: rtsp, url: 'rtsps://camera/s', certificate_file: camera.pem}\n"
                   "pan_tilt: {type: vapix, url: http://camera}\n"
                   "camera: {focal_length_px: 1000}\n"),
              IsEmpty());
  EXPECT_EQ(config_.video.url, "rtsps://camera/s");
  EXPECT_EQ(config_.video.certificate_file, directory_.path() + "/camera.pem");
}

TEST_F(ConfigTest, MjpegAndOnvifSourcesAreRead) {
  ::setenv("ALIDADE_TEST_PASSWORD", "secret", 1);
  const std::string login = "user: eve, password_env: ALIDADE_TEST_PASSWORD";
  ASSERT_THAT(
      load("video: {type: mjpeg, url: 'http://camera/v?a=b', width: 640, height: 480, " + login +
           "}\n"
           "pan_tilt: {type: onvif, url: http://camera, profile: main, rate_hz: 5, " +
           login +
           ",\n           pan_range_deg: [-180, 180], tilt_range_deg: [30, -90],\n"
           "           pan_scale: [0, 360], tilt_scale: [10, 190], ptz_path: /a/ptz}\n"
           "camera: {focal_length_px: 1000}\n"),
      IsEmpty());
  EXPECT_EQ(config_.video.type, VideoConfig::Type::kMjpeg);
  EXPECT_EQ(config_.video.url, "http://camera/v?a=b");
  EXPECT_EQ(config_.video.user, "eve");
  EXPECT_EQ(config_.video.password, "secret");
  EXPECT_EQ(config_.video.width, 640);
  EXPECT_EQ(config_.pan_tilt.type, PanTiltConfig::Type::kOnvif);
  EXPECT_EQ(config_.pan_tilt.password, "secret");
  EXPECT_EQ(config_.pan_tilt.profile, "main");
  EXPECT_EQ(config_.pan_tilt.rate_hz, 5);
  ASSERT_TRUE(config_.pan_tilt.pan_range_deg && config_.pan_tilt.tilt_range_deg);
  EXPECT_EQ(config_.pan_tilt.pan_range_deg->front(), -180);
  EXPECT_EQ(config_.pan_tilt.tilt_range_deg->back(), -90);
  ASSERT_TRUE(config_.pan_tilt.pan_scale && config_.pan_tilt.tilt_scale);
  EXPECT_EQ(config_.pan_tilt.pan_scale->back(), 360);
  EXPECT_EQ(config_.pan_tilt.tilt_scale->front(), 10);
  EXPECT_EQ(config_.pan_tilt.ptz_path, "/a/ptz");
  ASSERT_THAT(load("video: {type: mjpeg, url: 'http://camera/v'}\n"
                   "pan_tilt: {type: onvif, url: http://camera}\n"
                   "camera: {focal_length_px: 1000}\n"),
              IsEmpty());
  EXPECT_EQ(config_.pan_tilt.rate_hz, 10);
  EXPECT_FALSE(config_.pan_tilt.pan_range_deg);
  ASSERT_THAT(load("video: {type: mjpeg, url: 'http://camera/v'}\n"
                   "pan_tilt: {type: onvif, url: http://camera, ptz_path: ':8080/ptz'}\n"
                   "camera: {focal_length_px: 1000}\n"),
              IsEmpty());
  EXPECT_EQ(config_.pan_tilt.ptz_path, ":8080/ptz");
}

// Between polls, at rest and behind a late link, the newest angle of a slow link is older.
TEST_F(ConfigTest, ASlowLinkMayHaveOlderAngles) {
  const auto limit_at = [this](const std::string& rate) {
    EXPECT_THAT(load("video: {type: mjpeg, url: 'http://camera/v'}\n"
                     "pan_tilt: {type: onvif, url: http://camera" +
                     rate + "}\ncamera: {focal_length_px: 1000}\n"),
                IsEmpty());
    return config_.realtime.max_extrapolation_s;
  };
  EXPECT_DOUBLE_EQ(limit_at(""), 0.4);
  EXPECT_DOUBLE_EQ(limit_at(", rate_hz: 30"), 0.25);
  EXPECT_DOUBLE_EQ(limit_at(", rate_hz: 1"), 0.5);
}

TEST_F(ConfigTest, SaysWhereALoginGoesAndHow) {
  for (const std::string video :
       {"rtsp, url: 'rtsp://camera/s'", "mjpeg, url: 'http://camera/v'"}) {
    for (const std::string head : {"vapix", "onvif"}) {
      const auto load_with = [&](const std::string& keys) {
        return load("video: {type: " + video + keys + "}\npan_tilt: {type: " + head +
                    ", url: http://camera" + keys + "}\ncamera: {focal_length_px: 1000}\n");
      };
      ASSERT_THAT(load_with(""), IsEmpty());
      for (const LinkRules& rules : {config_.video.rules, config_.pan_tilt.rules}) {
        EXPECT_EQ(rules.redirects, LinkRules::Redirects::kSameHost);
        EXPECT_FALSE(rules.auth);
      }
      ASSERT_THAT(load_with(", follow_redirects: any, auth: any"), IsEmpty());
      for (const LinkRules& rules : {config_.video.rules, config_.pan_tilt.rules}) {
        EXPECT_EQ(rules.redirects, LinkRules::Redirects::kAny);
        EXPECT_EQ(rules.auth, LinkRules::Auth::kAny);
      }
      ASSERT_THAT(load_with(", follow_redirects: same-host, auth: digest"), IsEmpty());
      EXPECT_EQ(config_.video.rules.redirects, LinkRules::Redirects::kSameHost);
      EXPECT_EQ(config_.pan_tilt.rules.auth, LinkRules::Auth::kDigest);
      EXPECT_THAT(load_with(", auth: basic"), HasSubstr("expected one of digest, any"));
      EXPECT_THAT(load_with(", follow_redirects: all"),
                  HasSubstr("expected one of same-host, any"));
    }
  }
}

TEST_F(ConfigTest, CamerasCountToTheRightAndUpUnlessToldOtherwise) {
  for (const std::string type : {"vapix", "onvif"}) {
    const auto load_with = [&](const std::string& keys) {
      return load("video: {type: mjpeg, url: 'http://camera/v'}\npan_tilt: {type: " + type +
                  ", url: http://camera" + keys + "}\ncamera: {focal_length_px: 1000}\n");
    };
    ASSERT_THAT(load_with(""), IsEmpty());
    EXPECT_EQ(config_.pan_tilt.axes.pan.sign, 1);
    EXPECT_EQ(config_.pan_tilt.axes.tilt.sign, 1);
    EXPECT_EQ(config_.pan_tilt.axes.tilt.zero_deg, 0);
    ASSERT_THAT(load_with(", pan_positive: left, pan_zero_deg: 90, tilt_positive: down"),
                IsEmpty());
    EXPECT_EQ(config_.pan_tilt.axes.pan.sign, -1);
    EXPECT_EQ(config_.pan_tilt.axes.pan.zero_deg, 90);
    EXPECT_EQ(config_.pan_tilt.axes.tilt.sign, -1);
    EXPECT_THAT(load_with(", tilt_positive: left"), HasSubstr("expected one of up, down"));
  }
}

#define CAMERA "camera: {focal_length_px: 1000}\n"
#define HEAD "pan_tilt: {type: vapix, url: http://camera}\n"

TEST_F(ConfigTest, V4l2SourcesAreRead) {
  ASSERT_THAT(load("video: {type: v4l2, device: /dev/video2, format: MJPG, width: 1280,\n"
                   "  height: 720, rate_hz: 29.97, timeout_s: 2, max_backoff_s: 1}\n" HEAD CAMERA),
              IsEmpty());
  EXPECT_EQ(config_.video.type, VideoConfig::Type::kV4l2);
  EXPECT_EQ(config_.video.device, "/dev/video2");
  EXPECT_EQ(config_.video.pixel_format, V4l2Format::kMjpg);
  EXPECT_EQ(config_.video.width, 1280);
  EXPECT_EQ(config_.video.rate_hz, 29.97);
  EXPECT_EQ(config_.video.timeout_s, 2);
  EXPECT_EQ(config_.video.max_backoff_s, 1);
  ASSERT_THAT(load("video: {type: v4l2, device: camera}\n" HEAD CAMERA), IsEmpty());
  EXPECT_EQ(config_.video.device, directory_.path() + "/camera");
  EXPECT_FALSE(config_.video.pixel_format);
  EXPECT_EQ(config_.video.rate_hz, 0);
}

TEST_F(ConfigTest, TheExampleOfACameraOnUsbIsRead) {
  std::string error;
  EXPECT_TRUE(load_config(ALIDADE_USB_EXAMPLE, &config_, &error)) << error;
}

// The service may write nowhere else, and its stdout is the journal.
TEST_F(ConfigTest, TheExampleOfTheServiceIsReadAndKeepsToItsOwnFolder) {
  std::string error;
  ASSERT_TRUE(load_config(ALIDADE_SERVICE_EXAMPLE, &config_, &error)) << error;
  EXPECT_EQ(config_.calibration.file, "/var/lib/alidade/calibration.yaml");
  EXPECT_FALSE(config_.output.stdout_format);
  EXPECT_TRUE(config_.output.http);
}

#define RTSP "video: {type: rtsp, url: rtsp://camera/stream}\n"

TEST_F(ConfigTest, PelcoDHasTheProtocolsOwnUnitsAndRate) {
  ASSERT_THAT(load(RTSP "pan_tilt: {type: pelco_d, device: /dev/ttyUSB0}\n" CAMERA), IsEmpty());
  const PanTiltConfig& pan_tilt = config_.pan_tilt;
  EXPECT_EQ(pan_tilt.type, PanTiltConfig::Type::kHead);
  EXPECT_EQ(pan_tilt.head.link.address, "/dev/ttyUSB0");
  EXPECT_EQ(pan_tilt.head.link.baud, 9600);
  EXPECT_EQ(pan_tilt.axes.pan.sign, 1);
  EXPECT_EQ(pan_tilt.axes.tilt.sign, -1);
  EXPECT_EQ(pan_tilt.rate_hz, 30);
  const auto& pelco_d = std::get<PelcoDOptions>(pan_tilt.head.protocol);
  EXPECT_EQ(pelco_d.address, 1);
  EXPECT_EQ(pelco_d.tilt_deg_per_step, 0.01);
  EXPECT_STREQ(make_protocol(pan_tilt.head.protocol)->name(), "Pelco-D");
  ASSERT_THAT(load(RTSP "pan_tilt: {type: pelco_d, device: line, baud: 2400, address: 3,\n"
                        "  tilt_positive: up, pan_positive: left, pan_zero_deg: 90,\n"
                        "  read_zoom: true}\n" CAMERA),
              IsEmpty());
  EXPECT_EQ(config_.pan_tilt.head.link.address, directory_.path() + "/line");
  EXPECT_EQ(config_.pan_tilt.axes.pan.sign, -1);
  EXPECT_EQ(config_.pan_tilt.axes.pan.zero_deg, 90);
  EXPECT_EQ(config_.pan_tilt.axes.tilt.sign, 1);
  EXPECT_NEAR(config_.pan_tilt.rate_hz, 2400.0 / 280, 1e-9);
  EXPECT_EQ(std::get<PelcoDOptions>(config_.pan_tilt.head.protocol).address, 3);
  EXPECT_TRUE(std::get<PelcoDOptions>(config_.pan_tilt.head.protocol).read_zoom);
}

TEST_F(ConfigTest, ViscaAndPtuAreRead) {
  ASSERT_THAT(load(RTSP "pan_tilt: {type: visca, url: 'udp://camera:52381', header: true,\n"
                        "  pan_deg_per_step: 0.0042, tilt_deg_per_step: 0.00195,\n"
                        "  pan_positive: right, tilt_positive: up, rate_hz: 100}\n" CAMERA),
              IsEmpty());
  const auto& visca = std::get<ViscaOptions>(config_.pan_tilt.head.protocol);
  EXPECT_EQ(config_.pan_tilt.head.link.address, "udp://camera:52381");
  EXPECT_TRUE(visca.header);
  EXPECT_EQ(visca.pan_deg_per_step, 0.0042);
  EXPECT_EQ(visca.tilt_deg_per_step, 0.00195);
  EXPECT_EQ(config_.pan_tilt.rate_hz, 100);
  EXPECT_STREQ(make_protocol(config_.pan_tilt.head.protocol)->name(), "VISCA");
  ASSERT_THAT(load(RTSP "pan_tilt: {type: ptu, url: 'tcp://10.0.0.2:4000', feedback: terse,\n"
                        "  pan_positive: left, tilt_positive: up}\n" CAMERA),
              IsEmpty());
  const auto& ptu = std::get<PtuOptions>(config_.pan_tilt.head.protocol);
  EXPECT_FALSE(ptu.verbose);
  EXPECT_FALSE(ptu.pan_deg_per_step);
  EXPECT_EQ(config_.pan_tilt.axes.pan.sign, -1);
  EXPECT_STREQ(make_protocol(config_.pan_tilt.head.protocol)->name(), "PTU");
}

// With the keys that they require, and no signs but where the protocol does not define them.
TEST_F(ConfigTest, EveryHeadIsReadAndUnusualSignsAreRequired) {
  for (const HeadKind& kind : all_head_kinds()) {
    const Head& head = head_of(kind.head->type);
    const bool serial = kind.link == HeadServer::Link::kSerial;
    const std::string address = serial                                ? "/dev/ttyUSB0"
                                : kind.link == HeadServer::Link::kTcp ? "tcp://10.0.0.2:4000"
                                                                      : "udp://10.0.0.2:4000";
    const auto error_with = [&](const std::string& signs) {
      return load(RTSP "pan_tilt: {" + settings_of(kind, address) + signs + "}\n" CAMERA);
    };
    ASSERT_THAT(error_with(", pan_positive: left, tilt_positive: down"), IsEmpty()) << kind.name();
    EXPECT_EQ(config_.pan_tilt.type, PanTiltConfig::Type::kHead);
    EXPECT_EQ(config_.pan_tilt.head.protocol.index(), static_cast<std::size_t>(head.type));
    EXPECT_EQ(config_.pan_tilt.head.link.address, address);
    EXPECT_EQ(config_.pan_tilt.axes.pan.sign, -1);
    EXPECT_EQ(config_.pan_tilt.axes.tilt.sign, -1);
    ASSERT_THAT(error_with(signs_of(kind)), IsEmpty()) << kind.name();
    EXPECT_EQ(config_.pan_tilt.axes.pan.sign, pan_axis_of(kind).sign);
    EXPECT_EQ(config_.pan_tilt.axes.tilt.sign, tilt_axis_of(kind).sign);
    if (!signs_of(kind).empty()) {
      EXPECT_THAT(error_with(""), HasSubstr("_positive: is missing")) << kind.name();
    }
  }
}

// 0: each answer of the device is fresh, so nothing ages while the head rests.
TEST_F(ConfigTest, FreshAnswersGoWithAnyExtrapolation) {
  EXPECT_THAT(load(RTSP "pan_tilt: {type: vapix, url: http://camera, max_repeat_s: 0}\n" CAMERA
                        "realtime: {max_extrapolation_s: 0}\n"),
              IsEmpty());
  EXPECT_THAT(load(RTSP "pan_tilt: {type: vapix, url: http://camera, max_repeat_s: 0.3}\n" CAMERA
                        "realtime: {max_extrapolation_s: 0.5}\n"),
              IsEmpty());
}

TEST_F(ConfigTest, TheExampleOfHeadsIsRead) {
  std::string error;
  EXPECT_TRUE(load_config(ALIDADE_HEAD_EXAMPLE, &config_, &error)) << error;
}

// Of a seed that is refused, the fuzzer would not get to the keys behind the slip.
TEST_F(ConfigTest, TheFuzzersSeedWithEveryKeyIsRead) {
  std::string error;
  EXPECT_TRUE(load_config(ALIDADE_CONFIG_SEED, &config_, &error)) << error;
}

TEST_F(ConfigTest, TheExampleIsReadAndShowsTheDefaults) {
  ::setenv("CAMERA_PASSWORD", "secret", 1);
  Config example;
  std::string error;
  ASSERT_TRUE(load_config(ALIDADE_EXAMPLE, &example, &error)) << error;
  ASSERT_THAT(load(kMinimal), IsEmpty());
  EXPECT_EQ(example.video.timeout_s, config_.video.timeout_s);
  EXPECT_EQ(example.video.max_backoff_s, config_.video.max_backoff_s);
  EXPECT_EQ(example.pan_tilt.rate_hz, config_.pan_tilt.rate_hz);
  EXPECT_EQ(example.pan_tilt.timeout_s, config_.pan_tilt.timeout_s);
  EXPECT_EQ(example.pan_tilt.max_backoff_s, config_.pan_tilt.max_backoff_s);
  EXPECT_EQ(example.pan_tilt.angle_quantum_rad, config_.pan_tilt.angle_quantum_rad);
  EXPECT_EQ(example.pan_tilt.angle_accuracy_deg, config_.pan_tilt.angle_accuracy_deg);
  EXPECT_EQ(example.pan_tilt.acceleration_sigma_rad_s2, config_.pan_tilt.acceleration_sigma_rad_s2);
  EXPECT_EQ(example.pan_tilt.max_repeat_s, config_.pan_tilt.max_repeat_s);
  EXPECT_EQ(example.camera.aspect, config_.camera.aspect);
  EXPECT_EQ(example.camera.line_delay_s, config_.camera.line_delay_s);
  EXPECT_EQ(example.realtime.priority, config_.realtime.priority);
  EXPECT_EQ(example.realtime.max_extrapolation_s, config_.realtime.max_extrapolation_s);
}

// "section.key" of each line of an example, commented out or not. Keys of a section within a
// section count as the outer one's.
std::set<std::string> keys_of_example(const char* path) {
  const std::string kOfWords = "abcdefghijklmnopqrstuvwxyz_0123456789";
  std::set<std::string> keys;
  std::ifstream file(path);
  std::string section;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("# ", 0) == 0) line.erase(0, 2);
    const std::size_t begin = line.find_first_not_of(" #");
    const std::size_t end = line.find_first_not_of(kOfWords, begin);
    if (end == std::string::npos || end == begin || line[end] != ':') continue;
    if (begin == 0) section = line.substr(0, end);
    keys.insert(section + "." + line.substr(begin, end - begin));
  }
  return keys;
}

TEST_F(ConfigTest, TheExamplesShowEveryKey) {
  std::set<std::string> shown;
  for (const char* example : {ALIDADE_EXAMPLE, ALIDADE_HEAD_EXAMPLE, ALIDADE_USB_EXAMPLE})
    shown.merge(keys_of_example(example));
  const std::string head = "pan_positive: left, tilt_positive: up";
  const std::string steps = ", pan_deg_per_step: 1, tilt_deg_per_step: 1, header: true";
  // Each kind of section with a key that does not exist.
  const std::vector<std::pair<std::string, std::string>> sections = {
      {"video", "{type: rtsp, url: 'rtsp://c/s', zzz: 1}"},
      {"video", "{type: rtp, url: 'rtp://@:5004', zzz: 1}"},
      {"video", "{type: mjpeg, url: 'http://c', zzz: 1}"},
      {"video", "{type: recording, directory: film, zzz: 1}"},
      {"video", "{type: v4l2, device: /dev/video0, zzz: 1}"},
      {"pan_tilt", "{type: vapix, url: 'http://c', zzz: 1}"},
      {"pan_tilt", "{type: onvif, url: 'http://c', zzz: 1}"},
      {"pan_tilt", "{type: recording, directory: film, zzz: 1}"},
      {"pan_tilt", "{type: none, zzz: 1}"},
      {"pan_tilt", "{type: pelco_d, device: /dev/ttyS0, zzz: 1}"},
      {"pan_tilt", "{type: visca, url: 'udp://c:1', " + head + steps + ", zzz: 1}"},
      {"pan_tilt", "{type: ptu, url: 'tcp://c:1', " + head + ", zzz: 1}"},
      {"camera", "{zzz: 1}"},
      {"scene", "{zzz: 1}"},
      {"calibration", "{zzz: 1}"},
      {"realtime", "{zzz: 1}"},
      {"scene_map", "{zzz: 1}"},
      {"tracking", "{zzz: 1}"},
      {"detectors", "{zzz: 1}"},
      {"detectors", "{motion: {zzz: 1}}"},
      {"detectors", "{people: {zzz: 1}}"},
      {"detectors", "{onnx: {model: m, zzz: 1}}"},
      {"mqtt", "{url: 'mqtts://b', zzz: 1}"},
      {"output", "{zzz: 1}"},
      {"output", "{http: '127.0.0.1:0', tls: {certificate: c, key: k, zzz: 1}}"}};
  for (const auto& [section, content] : sections) {
    std::map<std::string, std::string> text = {{"video", "{type: rtsp, url: 'rtsp://c/s'}"},
                                               {"pan_tilt", "{type: vapix, url: 'http://c'}"}};
    text[section] = content;
    std::string whole;
    for (const auto& [name, value] : text) whole.append(name).append(": ").append(value) += '\n';
    const std::string error = load(whole);
    const std::string before = "unknown key; known here: ";
    const std::size_t at = error.find(before);
    ASSERT_NE(at, std::string::npos) << section << ": " << error;
    std::istringstream known(error.substr(at + before.size()));
    for (std::string key; known >> key;) {
      if (key.back() == ',') key.pop_back();
      EXPECT_EQ(shown.count(section + "." + key), 1U)
          << "no line of an example shows " << section << "." << key;
    }
  }
}

TEST_F(ConfigTest, MissingFileAndDirectoryInItsPlaceAreRefused) {
  std::string error;
  EXPECT_FALSE(load_config(directory_.path() + "/none.yaml", &config_, &error));
  EXPECT_THAT(error, StartsWith(directory_.path() + "/none.yaml: cannot be read"));
  EXPECT_FALSE(load_config(directory_.path(), &config_, &error));
  EXPECT_THAT(error, StartsWith(directory_.path() + ": cannot be read"));
}

TEST_F(ConfigTest, EmptyFileLacksSections) {
  const std::string error = load("");
  EXPECT_EQ(error, path_ + ": section 'video' is missing; add it");
}

TEST_F(ConfigTest, PasswordStaysOutOfEveryError) {
  ::setenv("ALIDADE_TEST_PASSWORD", "open-sesame", 1);
  const std::string error = load(
      "video: {type: rtsp, url: rtsp://camera/s, user: u, password_env: ALIDADE_TEST_PASSWORD, x: "
      "1}\n"
      "pan_tilt: {type: vapix, url: http://camera}\n");
  EXPECT_THAT(error, Not(IsEmpty()));
  EXPECT_THAT(error, Not(HasSubstr("open-sesame")));
}

// One mistake, where it is, and words that the message must hold.
struct Mistake {
  const char* name;
  const char* text;   // of the file
  const char* where;  // ":LINE: KEY" or ": " for the file as a whole
  const char* saying;
};

void PrintTo(const Mistake& mistake, std::ostream* out) { *out << mistake.name; }

class ConfigMistake : public ConfigTest, public ::testing::WithParamInterface<Mistake> {};

TEST_P(ConfigMistake, IsNamedWithItsLine) {
  const Mistake& mistake = GetParam();
  const std::string error = load(mistake.text);
  EXPECT_THAT(error, StartsWith(path_ + mistake.where));
  EXPECT_THAT(error, HasSubstr(mistake.saying));
}

#define VIDEO "video: {type: rtsp, url: rtsp://camera/stream}\n"
#define PAN_TILT "pan_tilt: {type: vapix, url: http://camera}\n"
#define CALIBRATION "calibration: {file: c.yaml}\n"
#define MINIMAL VIDEO PAN_TILT CALIBRATION

INSTANTIATE_TEST_SUITE_P(
    Each, ConfigMistake,
    ::testing::Values(
        Mistake{"NotYaml", "video: {type: rtsp\npan_tilt: x\n", ":2: ", "not YAML"},
        Mistake{"TopIsAList", "- video\n", ":1: configuration", "expected a mapping"},
        Mistake{"SectionIsAWord", MINIMAL "camera: wide\n", ":4: camera", "expected a mapping"},
        Mistake{"UnknownSection", MINIMAL "audio: {}\n", ":4: audio",
                "unknown key; known here: video,"},
        Mistake{"MistypedSection", "vidoe: {type: rtsp, url: rtsp://camera/s}\n" PAN_TILT,
                ":1: vidoe", "output; did you mean video?"},
        Mistake{"UnknownSectionWhereOneIsMissing", VIDEO "head: {type: vapix}\n", ":2: head",
                "unknown key; known here: video, pan_tilt"},
        Mistake{"MistypedType", "video: {tpye: rtsp, url: rtsp://camera/s}\n" PAN_TILT,
                ":1: video.tpye", "unknown key; did you mean type?"},
        Mistake{"MistypedUrl", "video: {type: rtsp, ulr: rtsp://camera/s}\n" PAN_TILT,
                ":1: video.ulr", "unknown key; did you mean url?"},
        Mistake{"MistypedKey", MINIMAL "camera: {focal_lenght_px: 30}\n",
                ":4: camera.focal_lenght_px", "; did you mean focal_length_px?"},
        Mistake{"UnknownKey", MINIMAL "camera:\n  focal_length_mm: 30\n",
                ":5: camera.focal_length_mm", "unknown key; known here: focal_length_px"},
        Mistake{"KeyOfAnotherType",
                "video: {type: rtsp, url: rtsp://c/s, device: /dev/video0}\n" PAN_TILT,
                ":1: video.device", "unknown key"},
        Mistake{"DoubledKey", MINIMAL "camera:\n  aspect: 1\n  aspect: 1\n", ":6: camera",
                "is given twice"},
        Mistake{"TargetsOnNoPlane", MINIMAL "tracking: {space: plane}\n", ":4: tracking.space",
                "add plane: plane.yaml"},
        Mistake{"MetresOnTheSphere", MINIMAL "tracking:\n  most_sigma_m: 3\n",
                ":5: tracking.most_sigma_m", "expected the key with rad"},
        Mistake{"RadiansOnThePlane",
                MINIMAL "tracking:\n  plane: p.yaml\n  acceleration_density_rad2_s3: 1\n",
                ":6: tracking.acceleration_density_rad2_s3", "expected the key with m"},
        Mistake{"MoreHitsThanLooks", MINIMAL "tracking:\n  birth_hits: 6\n",
                ":5: tracking.birth_hits", "asks for 6 hits in 5 looks"},
        Mistake{"FewerLooksThanHits", MINIMAL "tracking:\n  birth_looks: 2\n",
                ":5: tracking.birth_looks", "asks for 3 hits in 2 looks"},
        Mistake{"ForgottenBeforeLost", MINIMAL "tracking:\n  forget_after_s: 0.5\n",
                ":5: tracking.forget_after_s", "forgets after 0.5 s, but loses after 1 s"},
        Mistake{"LostAfterForgotten", MINIMAL "tracking:\n  lose_after_s: 90\n",
                ":5: tracking.lose_after_s", "forgets after 60 s, but loses after 90 s"},
        Mistake{"NoiselessDetector", MINIMAL "tracking: {detection_sigma_px: 0}\n",
                ":4: tracking.detection_sigma_px", "px"},
        Mistake{"HistoryBeyondTheRecords", MINIMAL "tracking: {history_s: 10}\n",
                ":4: tracking.history_s", "9"},
        Mistake{"TooManyBoxes", MINIMAL "tracking: {max_detections: 10000}\n",
                ":4: tracking.max_detections", "500"},
        Mistake{"DetectorWithoutTracking", MINIMAL "detectors: {motion: {}}\n",
                ":4: detectors.motion", "add tracking"},
        Mistake{"DetectorInPtMode",
                MINIMAL "tracking: {}\nrealtime: {mode: PT}\ndetectors: {motion: {}}\n",
                ":6: detectors.motion", "set it to OE"},
        Mistake{"PeopleWithoutGround", MINIMAL "tracking: {}\ndetectors: {people: {}}\n",
                ":5: detectors.people", "add tracking.plane"},
        Mistake{"UnknownDetector", MINIMAL "detectors: {birds: {}}\n", ":4: detectors.birds",
                "known here: motion, people, onnx"},
        Mistake{"LeastAboveMost",
                MINIMAL "tracking: {}\ndetectors:\n  motion:\n    least_size_px: 300\n",
                ":7: detectors.motion.least_size_px", "leaves 300 to 200 px"},
        Mistake{"NetworkWithoutModel",
                MINIMAL "tracking: {}\ndetectors: {onnx: {threshold: 0.5}}\n",
                ":5: detectors.onnx.model", "expected the path of a network"},
        Mistake{"NetworkThatIsSureOfNothing",
                MINIMAL "tracking: {}\ndetectors: {onnx: {model: a.onnx, threshold: 1.5}}\n",
                ":5: detectors.onnx.threshold", "0.999"},
        Mistake{"DetectorIsAWord", MINIMAL "detectors: {motion: true}\n", ":4: detectors.motion",
                "expected a mapping"},
        Mistake{"ExposureOfHours", MINIMAL "detectors: {motion: {exposure_s: 60}}\n",
                ":4: detectors.motion.exposure_s", "s"},
        Mistake{"NoBroker", MINIMAL "mqtt: {qos: 1}\n", ":4: mqtt.url",
                "expected for example url: mqtt://broker"},
        Mistake{"BrokerOverHttp", MINIMAL "mqtt: {url: 'http://broker'}\n", ":4: mqtt.url",
                "starts with mqtt://, mqtts://"},
        Mistake{"BrokerWithAPath", MINIMAL "mqtt: {url: 'mqtt://broker/a'}\n", ":4: mqtt.url",
                "set the topics by mqtt.prefix"},
        Mistake{"PasswordInTheBrokersUrl", MINIMAL "mqtt: {url: 'mqtt://u:p@broker'}\n",
                ":4: mqtt.url", "give them as user and password_env"},
        Mistake{"AuthorityWithoutTls", MINIMAL "mqtt: {url: 'mqtt://broker', ca_file: ca.pem}\n",
                ":4: mqtt.ca_file", "is for mqtts:// only"},
        Mistake{"CertificateWithoutAKey",
                MINIMAL "mqtt: {url: 'mqtts://broker', certificate_file: a.pem}\n",
                ":4: mqtt.certificate_file", "give certificate_file and key_file"},
        Mistake{"TopicWithAWildcard", MINIMAL "mqtt: {url: 'mqtt://broker', prefix: 'a/#'}\n",
                ":4: mqtt.prefix", "expected for example site/mast"},
        Mistake{"ServiceBeyondTwo", MINIMAL "mqtt: {url: 'mqtt://broker', qos: 3}\n",
                ":4: mqtt.qos", "quality of service"},
        Mistake{"PasswordFileForNobody", MINIMAL "mqtt: {url: 'mqtt://broker', password_file: p}\n",
                ":4: mqtt.password_file", "is given without a user"},
        Mistake{"PasswordFileThatIsNotThere",
                MINIMAL "mqtt: {url: 'mqtt://broker', user: u, password_file: none}\n",
                ":4: mqtt.password_file", "put the password there"},
        Mistake{"UnknownAssociation", MINIMAL "tracking: {association: best}\n",
                ":4: tracking.association", "expected one of exact, cheap, nearest"},
        Mistake{"TargetsUntracked", MINIMAL "output: {http: '127.0.0.1:0', targets: t.jsonl}\n",
                ":4: output.targets", "add tracking"},
        Mistake{"TargetsWithoutHttp", MINIMAL "tracking: {}\noutput: {targets: t.jsonl}\n",
                ":5: output.targets", "add http"},
        Mistake{"RecordingsWithoutHttp", MINIMAL "output: {recordings: kept}\n",
                ":4: output.recordings", "add http"},
        Mistake{"RecordingsOfARecording",
                "video: {type: recording, directory: d}\n"
                "pan_tilt: {type: recording, directory: d}\n" CALIBRATION
                "output: {http: '127.0.0.1:0', recordings: kept}\n",
                ":4: output.recordings", "which is stored already"},
        Mistake{"RecordingsWithoutTelemetry",
                VIDEO "pan_tilt: {type: none}\n"
                      "calibration: {file: c.yaml, auto: false}\n"
                      "scene_map: {file: s.map}\n"
                      "output: {http: '127.0.0.1:0', recordings: kept}\n",
                ":5: output.recordings", "needs telemetry"},
        Mistake{"NoVideo", PAN_TILT CALIBRATION, ": ", "section 'video' is missing"},
        Mistake{"NoPanTilt", VIDEO CALIBRATION, ": ", "section 'pan_tilt' is missing"},
        Mistake{"NoCalibrationAndNoDataSheet", VIDEO PAN_TILT, ": ",
                "set calibration.file or camera.focal_length_px"},
        Mistake{"NoVideoType", "video: {url: rtsp://camera/s}\n" PAN_TILT, ":1: video.type",
                "is missing"},
        Mistake{"MistypedVideoType", "video: {type: rstp, url: x}\n" PAN_TILT, ":1: video.type",
                "v4l2, recording; did you mean rtsp?"},
        Mistake{"UnknownVideoType", "video: {type: film, url: x}\n" PAN_TILT, ":1: video.type",
                "'film' is unknown; expected one of rtsp, rtp, mjpeg, v4l2, recording"},
        Mistake{"V4l2WithoutDevice", "video: {type: v4l2}\n" PAN_TILT, ":1: video.device",
                "is missing; expected for example device: /dev/video0"},
        Mistake{"UnusablePixelFormat",
                "video: {type: v4l2, device: /dev/video0, format: RGB3}\n" PAN_TILT,
                ":1: video.format",
                "'RGB3' is unknown; expected one of GREY, NV12, YUYV, UYVY, MJPG"},
        Mistake{"UdpOverTls", "video: {type: rtsp, url: rtsps://c/s, transport: udp}\n" PAN_TILT,
                ":1: video.transport", "udp does not go with rtsps://"},
        Mistake{"CertificateWithoutTls",
                "video: {type: rtsp, url: rtsp://c/s, certificate_file: c.pem}\n" PAN_TILT,
                ":1: video.certificate_file", "is for rtsps:// only"},
        Mistake{"RateOfANetworkCamera",
                "video: {type: rtsp, url: rtsp://c/s, rate_hz: 30}\n" PAN_TILT, ":1: video.rate_hz",
                "unknown key"},
        Mistake{"HeadWithoutLine", VIDEO "pan_tilt: {type: pelco_d}\n", ":2: pan_tilt.device",
                "is missing; expected for example device: /dev/ttyUSB0, or url: tcp://"},
        Mistake{"HeadOnTwoLines", VIDEO "pan_tilt: {type: ptu, device: /dev/x, url: tcp://h:1}\n",
                ":2: pan_tilt.url", "and device exclude each other; keep one"},
        Mistake{"HeadWithoutPort", VIDEO "pan_tilt: {type: ptu, url: tcp://head}\n",
                ":2: pan_tilt.url", "is not an address tcp://host:port or udp://host:port"},
        Mistake{"OddBaud", VIDEO "pan_tilt: {type: pelco_d, device: /dev/x, baud: 9601}\n",
                ":2: pan_tilt.baud", "is not a speed of a serial line"},
        Mistake{"BaudOfASocket", VIDEO "pan_tilt: {type: pelco_d, url: tcp://h:1, baud: 9600}\n",
                ":2: pan_tilt.baud", "unknown key"},
        Mistake{"MoreThanTheLineCarries",
                VIDEO "pan_tilt: {type: pelco_d, device: /dev/x, baud: 2400, rate_hz: 10}\n",
                ":2: pan_tilt.rate_hz",
                "10 Hz is more than the line carries at 2400 baud; expected at most 8.6"},
        Mistake{"ViscaWithoutSteps", VIDEO "pan_tilt: {type: visca, device: /dev/x}\n",
                ":2: pan_tilt.pan_deg_per_step", "is missing; expected the model's"},
        Mistake{"ViscaOfUdpWithoutHeader",
                VIDEO "pan_tilt: {type: visca, url: udp://c:1, pan_deg_per_step: 0.01,\n"
                      "  tilt_deg_per_step: 0.01}\n",
                ":2: pan_tilt.header", "is missing; expected true (datagrams begin with"},
        Mistake{"ViscaHeaderOfASerialLine",
                VIDEO "pan_tilt: {type: visca, device: /dev/x, pan_deg_per_step: 0.01,\n"
                      "  tilt_deg_per_step: 0.01, pan_positive: right, tilt_positive: up,\n"
                      "  header: true}\n",
                ":4: pan_tilt.header", "unknown key"},
        Mistake{"ViscaAddress", VIDEO "pan_tilt: {type: visca, device: /dev/x, address: 8}\n",
                ":2: pan_tilt.address", "from 1 to 7"},
        Mistake{"PtuWithoutSigns", VIDEO "pan_tilt: {type: ptu, device: /dev/x}\n",
                ":2: pan_tilt.pan_positive",
                "is missing; expected right or left: where the head turns while its pan grows"},
        Mistake{"SignIsANumber", VIDEO "pan_tilt: {type: ptu, device: /dev/x, pan_positive: -1}\n",
                ":2: pan_tilt.pan_positive", "expected one of right, left"},
        Mistake{"UnknownPanTiltType", VIDEO "pan_tilt: {type: pelco_p}\n", ":2: pan_tilt.type",
                "'pelco_p' is unknown; expected one of vapix, onvif, "},
        Mistake{"NoPanTiltType", VIDEO "pan_tilt: {url: http://camera}\n", ":2: pan_tilt.type",
                "is missing; expected one of vapix, onvif, "},
        Mistake{"RepeatsLongerThanExtrapolation",
                VIDEO
                "pan_tilt: {type: vapix, url: http://camera,\n  max_repeat_s: 0.25}\n" CALIBRATION,
                ":3: pan_tilt.max_repeat_s",
                "is 0.25 s, no less than realtime.max_extrapolation_s (0.25 s), so a head at rest "
                "never has an angle that is new enough; expected less than 0.25, or "
                "realtime.max_extrapolation_s more than 0.25"},
        Mistake{"ExtrapolationShorterThanRepeats",
                MINIMAL "realtime: {max_extrapolation_s: 0.05}\n",
                ":4: realtime.max_extrapolation_s",
                "is 0.05 s, no more than pan_tilt.max_repeat_s (0.1 s), so a head at rest never "
                "has an angle that is new enough; expected more than 0.1, or pan_tilt.max_repeat_s "
                "less "
                "than 0.05"},
        Mistake{"NoExtrapolationAndRepeats", MINIMAL "realtime: {max_extrapolation_s: 0}\n",
                ":4: realtime.max_extrapolation_s",
                "expected more than 0.1, or pan_tilt.max_repeat_s 0"},
        Mistake{"UnknownMode", MINIMAL "realtime: {mode: OF}\n", ":4: realtime.mode",
                "'OF' is unknown; expected one of OE, PT"},
        Mistake{"HttpWithoutPort", MINIMAL "output: {http: 127.0.0.1}\n", ":4: output.http",
                "'127.0.0.1' is not ADDRESS:PORT; expected for example 127.0.0.1:8080"},
        Mistake{"HttpWithoutAddress", MINIMAL "output: {http: ':8080'}\n", ":4: output.http",
                "is not ADDRESS:PORT"},
        Mistake{"HttpPortTooHigh", MINIMAL "output: {http: '127.0.0.1:65536'}\n", ":4: output.http",
                "is not ADDRESS:PORT"},
        Mistake{"HttpBareIpv6", MINIMAL "output: {http: '::1:8080'}\n", ":4: output.http",
                "[::1]:8080"},
        Mistake{"HttpUrl", MINIMAL "output: {http: 'http://127.0.0.1:8080/'}\n", ":4: output.http",
                "is not ADDRESS:PORT"},
        Mistake{"TokenWithoutHttp", MINIMAL "output: {token_env: HOME}\n", ":4: output.token_env",
                "is given without http"},
        Mistake{"TwoTokens",
                MINIMAL "output: {http: '127.0.0.1:0', token_env: HOME, token_file: t}\n",
                ":4: output.token_file", "keep one"},
        Mistake{"NoTokenVariable",
                MINIMAL "output: {http: '127.0.0.1:0', token_env: ALIDADE_TEST_UNSET}\n",
                ":4: output.token_env", "has no variable 'ALIDADE_TEST_UNSET'"},
        Mistake{"NoTokenFile", MINIMAL "output: {http: '127.0.0.1:0', token_file: nowhere}\n",
                ":4: output.token_file", "nowhere: cannot be read: No such file"},
        Mistake{"TokensBesideAToken",
                MINIMAL "output: {http: '127.0.0.1:0', token_file: t, tokens_file: u}\n",
                ":4: output.tokens_file", "and token_file exclude each other; keep one"},
        Mistake{"NoTokensFile", MINIMAL "output: {http: '127.0.0.1:0', tokens_file: nowhere}\n",
                ":4: output.tokens_file", "nowhere: cannot be read: No such file"},
        Mistake{"TlsWithoutHttp", MINIMAL "output: {tls: {certificate: c, key: k}}\n",
                ":4: output.tls", "is given without http; add http"},
        Mistake{"TlsWithoutKey", MINIMAL "output: {http: '127.0.0.1:0', tls: {certificate: c}}\n",
                ":4: output.tls.key", "is missing"},
        Mistake{"TlsOfADevice",
                MINIMAL "output: {http: '127.0.0.1:0', tls: {certificate: /dev/zero, key: k}}\n",
                ":4: output.tls.certificate",
                "/dev/zero: cannot be read: not a file, but a device"},
        Mistake{"TokenOfADevice", MINIMAL "output: {http: '127.0.0.1:0', token_file: /dev/zero}\n",
                ":4: output.token_file", "/dev/zero: cannot be read: not a file, but a device"},
        Mistake{"BothFormats", MINIMAL "output: {json: true, csv: true}\n", ":4: output.csv",
                "keep one"},
        Mistake{"NoUrl", "video: {type: rtsp}\n" PAN_TILT, ":1: video.url", "is missing"},
        Mistake{"EmptyUrl", "video: {type: rtsp, url: ''}\n" PAN_TILT, ":1: video.url", "is empty"},
        Mistake{"NullUrl", "video:\n  type: rtsp\n  url:\n" PAN_TILT, ":3: video.url",
                "has no value"},
        Mistake{"WrongScheme", "video: {type: rtsp, url: http://camera}\n" PAN_TILT,
                ":1: video.url", "is not an address that starts with rtsp://"},
        Mistake{"NoHost", "video: {type: rtsp, url: 'rtsp:///stream'}\n" PAN_TILT, ":1: video.url",
                "is not an address"},
        Mistake{"PasswordInUrl", "video: {type: rtsp, url: 'rtsp://u:p@camera/s'}\n" PAN_TILT,
                ":1: video.url", "give them as user and password_env"},
        Mistake{"PasswordWithoutUser",
                "video: {type: rtsp, url: rtsp://c/s, password_env: HOME}\n" PAN_TILT,
                ":1: video.password_env", "add user"},
        Mistake{"PasswordFileOfACameraForNobody",
                "video: {type: rtsp, url: rtsp://c/s, password_file: p}\n" PAN_TILT,
                ":1: video.password_file", "is given without a user"},
        Mistake{"PasswordFileOfACameraThatIsNotThere",
                "video: {type: rtsp, url: rtsp://c/s, user: u, password_file: none}\n" PAN_TILT,
                ":1: video.password_file", "put the password there"},
        Mistake{"TwoPasswords",
                "video: {type: rtsp, url: rtsp://c/s, user: u, password_file: p, password_env: "
                "HOME}\n" PAN_TILT,
                ":1: video.password_file", "exclude each other"},
        Mistake{"UnsetPassword",
                "video: {type: rtsp, url: rtsp://c/s, user: u, password_env: "
                "ALIDADE_NO_SUCH_VARIABLE}\n" PAN_TILT,
                ":1: video.password_env",
                "the environment has no variable 'ALIDADE_NO_SUCH_VARIABLE'"},
        Mistake{"UnknownTransport",
                "video: {type: rtsp, url: rtsp://c/s, transport: sctp}\n" PAN_TILT,
                ":1: video.transport", "expected one of tcp, udp"},
        Mistake{"RecordingWithoutDirectory", "video: {type: recording}\n" PAN_TILT,
                ":1: video.directory", "is missing"},
        Mistake{"LiveAndRecorded", "video: {type: recording, directory: d}\n" PAN_TILT CALIBRATION,
                ": ", "no common clock"},
        Mistake{"MjpegOverRtsp", "video: {type: mjpeg, url: rtsp://camera}\n" PAN_TILT,
                ":1: video.url", "is not an address that starts with http://, https://"},
        Mistake{"OneRangeAlone",
                VIDEO "pan_tilt: {type: onvif, url: http://c, tilt_range_deg: [-90, 90]}\n",
                ":2: pan_tilt", "give pan_range_deg and tilt_range_deg, or neither"},
        Mistake{"RangeOfOneAngle",
                VIDEO "pan_tilt: {type: onvif, url: http://c, pan_range_deg: [9, 9], "
                      "tilt_range_deg: [0, 1]}\n",
                ":2: pan_tilt.pan_range_deg", "spans no angle"},
        Mistake{"OneScaleAlone",
                VIDEO "pan_tilt: {type: onvif, url: http://c, pan_scale: [0, 360]}\n",
                ":2: pan_tilt", "give pan_scale and tilt_scale, or neither"},
        Mistake{"ScaleWithoutAngles",
                VIDEO "pan_tilt: {type: onvif, url: http://c, pan_scale: [0, 360], "
                      "tilt_scale: [0, 180]}\n",
                ":2: pan_tilt.pan_scale", "pan_range_deg, which is missing"},
        Mistake{"ScaleOfOneValue",
                VIDEO "pan_tilt: {type: onvif, url: http://c, pan_scale: [9, 9], "
                      "tilt_scale: [0, 1]}\n",
                ":2: pan_tilt.pan_scale", "spans nothing"},
        Mistake{"PtzPathOfAnotherHost",
                VIDEO "pan_tilt: {type: onvif, url: http://c, ptz_path: 'http://d/ptz'}\n",
                ":2: pan_tilt.ptz_path", "the host is that of url"},
        Mistake{"PtzPathThatChangesTheHost",
                VIDEO "pan_tilt: {type: onvif, url: http://c, ptz_path: '.evil:80/ptz'}\n",
                ":2: pan_tilt.ptz_path", "the host is that of url"},
        Mistake{"PtzPathWithAUser",
                VIDEO "pan_tilt: {type: onvif, url: http://c, ptz_path: ':80@evil/ptz'}\n",
                ":2: pan_tilt.ptz_path", "the host is that of url"},
        Mistake{"OnvifHasNoCameraNumber",
                VIDEO "pan_tilt: {type: onvif, url: http://c, camera: 1}\n", ":2: pan_tilt.camera",
                "unknown key"},
        Mistake{"NumberWithUnit", VIDEO "pan_tilt: {type: vapix, url: http://c, rate_hz: 30 Hz}\n",
                ":2: pan_tilt.rate_hz", "'30 Hz' is not a plain number from 0.1 to 1000 (Hz)"},
        Mistake{"PupilInCentimetres",
                MINIMAL "camera: {focal_length_px: 1000, pupil_m: [0, 0, 5]}\n",
                ":4: camera.pupil_m", "from -1 to 1 (m)"},
        Mistake{"SceneNearerThanAMetre", MINIMAL CAMERA "scene: {nearest_m: 0.5}\n",
                ":5: scene.nearest_m", "from 1 to 1000000000 (m)"},
        Mistake{"SceneTheWrongWayRound", MINIMAL CAMERA "scene: {nearest_m: 50, farthest_m: 20}\n",
                ":5: scene.farthest_m", "farthest_m is the larger of the two"},
        Mistake{"SceneWithoutNearest", MINIMAL CAMERA "scene: {farthest_m: 20}\n",
                ":5: scene.nearest_m", "give how near the nearest thing in view is"},
        Mistake{"NumberIsText", MINIMAL "camera: {focal_length_px: long}\n",
                ":4: camera.focal_length_px", "'long' is not a plain number"},
        Mistake{"NumberIsQuoted", MINIMAL "camera: {focal_length_px: '30000'}\n",
                ":4: camera.focal_length_px", "quoted text"},
        Mistake{"NumberIsAList", MINIMAL "camera: {focal_length_px: [1, 2]}\n",
                ":4: camera.focal_length_px", "not a list or mapping"},
        Mistake{"NumberIsNotFinite", MINIMAL "camera: {focal_length_px: .inf}\n",
                ":4: camera.focal_length_px", "not a plain number"},
        Mistake{"NumberOverflows", MINIMAL "camera: {focal_length_px: 1e999}\n",
                ":4: camera.focal_length_px", "not a plain number"},
        Mistake{"NumberOutOfRange", MINIMAL "camera: {focal_length_px: -5}\n",
                ":4: camera.focal_length_px", "from 1 to 100000000 (px)"},
        Mistake{"RangeWithoutTele", MINIMAL "camera: {focal_length_px: {wide: 1200}}\n",
                ":4: camera.focal_length_px.tele", "is missing; give wide and tele, px"},
        Mistake{"RangeTurnedRound",
                MINIMAL "camera: {focal_length_px: {wide: 24000, tele: 1200}}\n",
                ":4: camera.focal_length_px.tele",
                "is 1200 px and wide is 24000 px; wide is the shorter of the two"},
        Mistake{"RangeOfOne", MINIMAL "camera: {focal_length_px: {wide: 1200, tele: 1200}}\n",
                ":4: camera.focal_length_px.tele", "wide is the shorter of the two"},
        Mistake{"RangeFromZero", MINIMAL "camera: {focal_length_px: {wide: 0, tele: 1200}}\n",
                ":4: camera.focal_length_px.wide", "from 1 to 100000000 (px)"},
        Mistake{"RangeToNaN", MINIMAL "camera: {focal_length_px: {wide: 1200, tele: .nan}}\n",
                ":4: camera.focal_length_px.tele", "not a plain number"},
        Mistake{"RangeWithAThird",
                MINIMAL "camera: {focal_length_px: {wide: 1, tele: 2, middle: 1.5}}\n",
                ":4: camera.focal_length_px.middle", "unknown key"},
        Mistake{"LineDelayInMicroseconds", MINIMAL "camera: {line_delay_s: 14.2}\n",
                ":4: camera.line_delay_s", "(s/row)"},
        Mistake{"FractionForAWholeNumber", MINIMAL "realtime: {priority: 1.5}\n",
                ":4: realtime.priority", "not a whole number"},
        Mistake{"PriorityOutOfRange", MINIMAL "realtime: {priority: 100}\n",
                ":4: realtime.priority", "from 0 to 99"},
        Mistake{"TruthIsYes", MINIMAL "realtime: {lock_memory: yes}\n", ":4: realtime.lock_memory",
                "'yes' is not true or false"},
        Mistake{"TruthIsANumber", MINIMAL "camera: {upside_down: 1}\n", ":4: camera.upside_down",
                "is not true or false"},
        Mistake{"ZoomIsNotFixed", MINIMAL "camera: {zoom: auto}\n", ":4: camera.zoom",
                "expected one of fixed"}),
    [](const ::testing::TestParamInfo<Mistake>& tested) { return std::string(tested.param.name); });

TEST(NearestWord, ForgivesOneSlipInThreeLetters) {
  const std::vector<std::string> known = {"run", "record", "replay", "calibrate", "check"};
  for (const auto& [typed, meant] :
       {std::pair("rnu", "run"), std::pair("rum", "run"), std::pair("runn", "run"),
        std::pair("recrod", "record"), std::pair("calibarte", "calibrate"),
        std::pair("calbrat", "calibrate"), std::pair("relpay", "replay")}) {
    EXPECT_EQ(nearest_word(typed, known), std::optional<std::string>(meant)) << typed;
  }
  for (const char* typed : {"", "r", "fly", "rut2", "calib", "checkers-board"}) {
    EXPECT_EQ(nearest_word(typed, known), std::nullopt) << typed;
  }
  EXPECT_EQ(nearest_word("rep", {"red", "reps"}), "red") << "the first of those as near";
  EXPECT_EQ(did_you_mean("rnu", known), "; did you mean run?");
  EXPECT_EQ(did_you_mean("fly", known), "");
}

TEST(NoiseFile, IsOptional) {
  const TemporaryDirectory directory;
  RecordingNoise noise;
  std::string error;
  ASSERT_TRUE(load_noise(directory.path(), &noise, &error)) << error;
  EXPECT_FALSE(noise.image_stamp_sigma_s);
}

TEST(NoiseFile, GivesItsValuesAndNamesItsMistakes) {
  const TemporaryDirectory directory;
  RecordingNoise noise;
  std::string error;
  directory.write("noise.yaml",
                  "image_stamp_sigma_s: 2e-4\npan_tilt_sigma_rad: 1e-5\npixel_sigma_px: 0.3\n"
                  "pan_tilt_scale_sigma: 0.01\n"
                  "pan_tilt_accuracy_rad: 0.001\npan_tilt_quantum_rad: 3e-4\n");
  ASSERT_TRUE(load_noise(directory.path(), &noise, &error)) << error;
  EXPECT_EQ(noise.image_stamp_sigma_s, 2e-4);
  EXPECT_EQ(noise.pan_tilt_sigma_rad, 1e-5);
  EXPECT_EQ(noise.pan_tilt_scale_sigma, 0.01);
  EXPECT_EQ(noise.pan_tilt_accuracy_rad, 0.001);
  EXPECT_EQ(noise.pan_tilt_quantum_rad, 3e-4);
  EXPECT_FALSE(noise.telemetry_stamp_sigma_s);
  const std::string path =
      directory.write("noise.yaml", "pixel_sigma_px: 0.3\nimage_stamp_sigma_s: small\n");
  EXPECT_FALSE(load_noise(directory.path(), &noise, &error));
  EXPECT_THAT(error, StartsWith(path + ":2: image_stamp_sigma_s: 'small' is not a plain number"));
}

std::string manual(const char* page) {
  std::ifstream file(std::string(ALIDADE_MANUAL) + "/" + page);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(VideoTypes, AreInTheManual) {
  const std::string page = manual("reference/links.md");
  for (const char* name : video_type_names())
    EXPECT_NE(page.find("\n`type: " + std::string(name) + "`"), std::string::npos) << name;
}

struct ManualBlock {
  std::string page;
  std::string kind;  // the class of the block, as "plane"; empty: a whole configuration
  std::string text;
};

// The YAML in the pages of the manual.
std::vector<ManualBlock> yaml_of_the_manual() {
  std::vector<ManualBlock> blocks;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(ALIDADE_MANUAL)) {
    if (entry.path().extension() != ".md") continue;
    std::ifstream file(entry.path());
    bool inside = false;
    for (std::string line; std::getline(file, line);) {
      const std::string kind = ":class: ";
      if (!inside && (line == "```yaml" || line == "```{code-block} yaml")) {
        inside = true;
        blocks.push_back({entry.path().filename(), "", ""});
      } else if (inside && line == "```") {
        inside = false;
      } else if (inside && line.rfind(kind, 0) == 0) {
        blocks.back().kind = line.substr(kind.size());
      } else if (inside) {
        blocks.back().text += line + "\n";
      }
    }
  }
  return blocks;
}

TEST(Manual, ShowsConfigurationsThatCanBeRead) {
  ::setenv("CAMERA_PASSWORD", "secret", 1);
  const TemporaryDirectory folder;
  folder.write("tokens", "view 0123456789abcdef0123456789abcdef\n");
  folder.write("password", "secret\n");
  const std::string device =
      "pan_tilt: {type: vapix, url: \"http://camera\"}\nvideo: {type: rtsp, url: \"rtsp://c/v\"}\n"
      "camera: {focal_length_px: 3000}\n";
  int whole = 0;
  int parts = 0;
  int planes = 0;
  for (const ManualBlock& block : yaml_of_the_manual()) {
    std::string error;
    if (block.kind == "elsewhere") continue;  // of another program
    if (block.kind == "plane") {
      PlaneData data;
      EXPECT_TRUE(parse_plane_data(block.text, block.page, &data, &error)) << error;
      ++planes;
      continue;
    }
    const bool is_part = block.kind == "part";
    ++(is_part ? parts : whole);
    Config config;
    const std::string path = folder.path() + "/" + block.page;
    EXPECT_TRUE(parse_config((is_part ? device : "") + block.text, path, &config, &error)) << error;
  }
  EXPECT_GT(whole, 15);
  EXPECT_GT(parts, 0);
  EXPECT_GT(planes, 0);
}

TEST(VideoTypes, AreAllNamedToWhoMistypesOne) {
  Config config;
  std::string error;
  EXPECT_FALSE(parse_config("video: {url: x}\n", "x.yaml", &config, &error, ConfigScope::kVideo));
  for (const char* name : video_type_names())
    EXPECT_NE(error.find(name), std::string::npos) << name << ": " << error;
}

TEST(Detectors, AreInTheManual) {
  const std::string page = manual("reference/configuration.md");
  std::ifstream file(ALIDADE_EXAMPLE);
  const std::string example(std::istreambuf_iterator<char>(file), {});
  for (const DetectorKindRow& row : kDetectorKinds) {
    EXPECT_NE(page.find("\n### " + std::string(row.name) + "\n"), std::string::npos) << row.name;
    EXPECT_NE(example.find("\n#   " + std::string(row.name) + ":"), std::string::npos) << row.name;
  }
}

}  // namespace
}  // namespace alidade
