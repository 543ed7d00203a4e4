// The endpoints where a running camera does not lead: before the first record, without an orientation, and with a
// client that is too slow.

#include "edge_app/output/http_api.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "edge_app/output/detection_query.h"
#include "platform/system/clock.h"
#include "test/edge_app/output/http_client.h"
#include "test/edge_app/taps/kept_frame.h"
#include "test/edge_app/tracking/detected_scene.h"
#include "test/support/temporary_directory.h"
#include "test/support/zoom_by_formula.h"

namespace alidade {
namespace {

using nlohmann::json;
using test::Client;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr std::size_t kLines = 4;

LiveStateOptions few_lines() {
  LiveStateOptions options;
  options.max_lines = kLines;
  return options;
}

class HttpApiTest : public ::testing::Test {
 protected:
  explicit HttpApiTest(std::shared_ptr<const PlaneEstimate> plane = nullptr,
                       TargetFeed* feed = nullptr, TargetLines* lines = nullptr,
                       std::function<SceneReport()> scene = {}, LiveRecorder* recorder = nullptr) {
    HttpApiSources sources;
    sources.recorder = recorder;
    sources.verify_recording = [this](const std::string& recording) {
      const bool begins = verification_.state != RecordingVerification::State::kRunning;
      verification_ = {RecordingVerification::State::kRunning, recording, "", "", "", ""};
      return begins;
    };
    sources.verification = [this] { return verification_; };
    sources.targets = feed;
    sources.target_lines = lines;
    sources.live = &live_;
    sources.summary = [this] { return summary_; };
    sources.video_losses = [] { return FrameSourceCounters{3, 4, 5, 6, 7}; };
    sources.ask_for_calibration = [this] { return asked_ = calibrating_; };
    sources.zoom_curve = [this] { return curve_; };
    sources.telemetry_error = [this] { return telemetry_error_; };
    sources.calibration_progress = [this] { return progress_; };
    sources.plane = std::move(plane);
    sources.fit_plane = [](const std::string& body, std::string* answer, std::string* why) {
      *answer = "{\"status\": \"ok\"}\n";
      *why = "not today";
      return body == "{}";
    };
    sources.scene = std::move(scene);
    if (sources.scene) sources.scene_outlines = &outlines_;
    sources.version = "1.2.3";
    sources.camera = "a camera";
    add_api_routes(&server_, sources);
    std::string error;
    EXPECT_TRUE(server_.start(&error)) << error;
  }

  std::string ask(const std::string& method, const std::string& path, const std::string& body) {
    Client client(server_);
    client.send(method + " " + path + " HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
                std::to_string(body.size()) + "\r\n\r\n" + body);
    return client.receive();
  }
  std::string get(const std::string& path) { return ask("GET", path, ""); }
  std::string post(const std::string& path, const std::string& body) {
    return ask("POST", path, body);
  }
  static json body_of(const std::string& answer) {
    return json::parse(answer.substr(answer.find("\r\n\r\n") + 4));
  }

  LiveState live_{few_lines()};
  PipelineSummary summary_;
  std::vector<SceneOutline> outlines_;
  std::shared_ptr<const ZoomCurve> curve_;
  std::shared_ptr<const TelemetryError> telemetry_error_;
  std::shared_ptr<const CalibrationProgress> progress_;
  RecordingVerification verification_;
  bool calibrating_ = false;
  bool asked_ = false;
  HttpServer server_{HttpServerOptions{}};
};

PlaneEstimate some_ground() {
  PlaneEstimate out;
  out.plane.R_base_from_world = R_base_from_world_of(0.5, 0.1, 0);
  out.plane.position = {1, 2, 12};
  out.plane.covariance.diagonal().setConstant(1e-4);
  return out;
}

class HttpApiWithPlaneTest : public HttpApiTest {
 protected:
  HttpApiWithPlaneTest() : HttpApiTest(std::make_shared<const PlaneEstimate>(some_ground())) {}
};

OrientationRecord record_without_orientation(std::int64_t frame) {
  OrientationRecord record;
  record.frame = frame;
  record.time_s = 100 + 0.04 * static_cast<double>(frame);
  record.status = RecordStatus::kTelemetryMissing;
  return record;
}

TEST_F(HttpApiTest, StatusTellsHowFarACalibrationIs) {
  const auto told = [this] { return body_of(get("/api/v1/status"))["calibration"]["progress"]; };
  EXPECT_TRUE(told().is_null());
  CalibrationProgress progress;
  progress.goals = calibration_goals(Camera<double>{2000, 1, {0}, 1920, 1080});
  progress.travel = travel_limits(2000, 1920);
  progress_ = std::make_shared<const CalibrationProgress>(progress);
  json first = told();
  EXPECT_EQ(first["attempts"], 0);
  EXPECT_TRUE(first["refusal"].is_null());
  ASSERT_EQ(first["parameters"].size(), 4U);
  EXPECT_EQ(first["parameters"][0],
            json::parse(R"({"name": "focal_length", "unit": "px", "sigma": null, "wanted": 100,
    "reached": false, "helps": "move farther on both axes"})"));
  EXPECT_TRUE(first["coverage"]["pan_rad"].is_null());
  EXPECT_EQ(first["coverage"]["points"].size(), 48U);
  EXPECT_DOUBLE_EQ(first["asked_range_rad"].get<double>(), 0.24);

  progress.attempts = 3;
  progress.refusal = "not calibrated yet (too uncertain): ...";
  progress.goals[0].sigma = 40;
  progress.goals[0].reached = true;
  progress.coverage.range = AngleRange{{-0.1, 0}, {0.2, 0.05}};
  progress.coverage.path = {{-0.1, 0}, {0.2, 0.05}};
  progress_ = std::make_shared<const CalibrationProgress>(progress);
  first = told();
  EXPECT_EQ(first["refusal"], progress.refusal);
  EXPECT_EQ(first["parameters"][0]["sigma"], 40);
  EXPECT_EQ(first["parameters"][0]["reached"], true);
  EXPECT_EQ(first["coverage"]["pan_rad"], json({-0.1, 0.2}));
  EXPECT_EQ(first["coverage"]["tilt_rad"], json({0, 0.05}));
  EXPECT_EQ(first["coverage"]["path_rad"], json::parse("[[-0.1, 0], [0.2, 0.05]]"));
}

TEST_F(HttpApiTest, BeforeTheFirstRecordThereIsNothingAndThatIsSaid) {
  for (const char* path : {"/api/v1/orientation", "/api/v1/calibration"})
    EXPECT_THAT(get(path), StartsWith("HTTP/1.1 404 ")) << path;
  EXPECT_THAT(post("/api/v1/direction", R"({"pixels":[[1,2]]})"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(post("/api/v1/pixel", R"({"frame":1,"directions":[[1,0,0]]})"),
              StartsWith("HTTP/1.1 404 "));
  const json status = body_of(get("/api/v1/status"));
  EXPECT_EQ(status["alidade"], "1.2.3");
  EXPECT_EQ(status["camera"], "a camera");
  EXPECT_TRUE(status["mode"].is_null());
  EXPECT_TRUE(status["latency_s"].is_null());
  EXPECT_EQ(status["frames"]["damaged"], 3);
  EXPECT_EQ(status["frames"]["not_fetched"], 4);
  EXPECT_EQ(status["video_faults"],
            json({{"unstamped", 5}, {"foreign_packets", 6}, {"garbage_bytes", 7}}));
  EXPECT_THAT(get("/metrics"), AllOf(HasSubstr("\nalidade_frames_unstamped_total 5\n"),
                                     HasSubstr("\nalidade_video_foreign_packets_total 6\n"),
                                     HasSubstr("\nalidade_video_garbage_bytes_total 7\n")));
  EXPECT_EQ(body_of(get("/api/v1/history"))["time_s"], json::array());
  EXPECT_THAT(get("/metrics"), HasSubstr("\nalidade_frames_total 0\n"));
}

TEST_F(HttpApiTest, SaysHowEachLinkDoes) {
  const json unknown = body_of(get("/api/v1/status"))["links"]["video"];
  EXPECT_EQ(unknown, json::parse(R"({"connected": false, "reason": null, "reconnections": 0,
                                     "age_s": null, "rate_hz": null})"));
  EXPECT_THAT(get("/metrics"), Not(HasSubstr("alidade_link_rate_hertz{")));
  summary_.video_link = {false, "rtsp://camera: refused", 2, 7.5, 0.125};
  summary_.pan_tilt_link = {true, "", 0, 0.25, 30.0};
  const json links = body_of(get("/api/v1/status"))["links"];
  EXPECT_EQ(links["video"], json::parse(R"({"connected": false, "reason": "rtsp://camera: refused",
                            "reconnections": 2, "age_s": 7.5, "rate_hz": 0.125})"));
  EXPECT_EQ(links["pan_tilt"],
            json::parse(R"({"connected": true, "reason": null, "reconnections": 0, "age_s": 0.25,
                            "rate_hz": 30.0})"));
  const std::string metrics = get("/metrics");
  for (const char* line :
       {"alidade_link_connected{link=\"video\"} 0", "alidade_link_connected{link=\"pan_tilt\"} 1",
        "alidade_link_reconnections_total{link=\"video\"} 2",
        "alidade_link_last_sample_age_seconds{link=\"video\"} 7.5",
        "alidade_link_rate_hertz{link=\"pan_tilt\"} 30"}) {
    EXPECT_THAT(metrics, HasSubstr(std::string("\n") + line + "\n"));
  }
}

TEST_F(HttpApiTest, SaysWhatIsWrongWithTheVideosTimesAndPictures) {
  EXPECT_TRUE(body_of(get("/api/v1/status"))["video_clock"]["left_out_rate_error"].is_null());
  summary_.repeated = 375;
  EXPECT_EQ(body_of(get("/api/v1/status"))["reasons"], json::object());
  OrientationRecord withheld;
  withheld.status = RecordStatus::kImageRepeated;
  summary_.reasons.add(withheld);
  withheld.status = RecordStatus::kNotCalibrated;
  for (int i = 0; i < 2; ++i) summary_.reasons.add(withheld);
  summary_.delay_wander_s = 0.034;
  summary_.stamps_left_out = -0.02;
  const json status = body_of(get("/api/v1/status"));
  EXPECT_EQ(status["frames"]["repeated"], 375);
  EXPECT_EQ(status["reasons"], (json{{"picture repeated", 1}, {"not calibrated", 2}}));
  EXPECT_EQ(status["video_clock"]["wander_s"], 0.034);
  EXPECT_EQ(status["video_clock"]["left_out_rate_error"], -0.02);
  const std::string metrics = get("/metrics");
  for (const char* line : {"alidade_records_withheld_total{status=\"not calibrated\"} 2",
                           "alidade_records_withheld_total{status=\"too few landmarks\"} 0",
                           "alidade_repeated_pictures_total 375", "alidade_video_stamps_left_out 1",
                           "alidade_video_clock_wander_seconds 0.034"}) {
    EXPECT_THAT(metrics, HasSubstr(std::string("\n") + line + "\n"));
  }
}

TEST_F(HttpApiTest, SaysHowLateTelemetryIsAgainstTheCalibration) {
  EXPECT_TRUE(body_of(get("/api/v1/status"))["link_delay"].is_null());
  EXPECT_THAT(get("/metrics"), Not(HasSubstr("alidade_link_delay")));
  summary_.link_delay = LinkDelayReport{LinkDelayState::kOpen, 0, 0.15};
  summary_.link_delay_since_s = monotonic_now_s() - 100;
  json told = body_of(get("/api/v1/status"))["link_delay"];
  EXPECT_EQ(told["state"], "open");
  EXPECT_EQ(told["delay_s"], 0.0);
  EXPECT_EQ(told["sigma_s"], 0.15);
  EXPECT_GE(told["age_s"], 100.0);
  EXPECT_THAT(get("/metrics"), HasSubstr("\nalidade_link_delay_open 1\n"));
  summary_.link_delay = LinkDelayReport{LinkDelayState::kFound, -0.085, 0.002};
  told = body_of(get("/api/v1/status"))["link_delay"];
  EXPECT_EQ(told["state"], "found");
  EXPECT_EQ(told["delay_s"], -0.085);
  const std::string metrics = get("/metrics");
  for (const char* line : {"alidade_link_delay_seconds -0.085",
                           "alidade_link_delay_sigma_seconds 0.002", "alidade_link_delay_open 0"}) {
    EXPECT_THAT(metrics, HasSubstr(std::string("\n") + line + "\n"));
  }
}

TEST_F(HttpApiTest, AFrameWithoutAnOrientationHasNoDirectionsAndSaysWhy) {
  EXPECT_TRUE(live_.write(record_without_orientation(7)));
  const std::string answer = post("/api/v1/direction", R"({"frame":7,"pixels":[[1,2]]})");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 409 "));
  EXPECT_EQ(body_of(answer)["error"], "frame 7 has no orientation: too little telemetry");
  EXPECT_THAT(post("/api/v1/pixel", R"({"time_s":100.28,"directions":[[1,0,0]]})"),
              StartsWith("HTTP/1.1 409 "));
  EXPECT_THAT(get("/api/v1/calibration"), StartsWith("HTTP/1.1 404 "));
}

TEST_F(HttpApiTest, TellsTheLastMinuteOrTheLastHour) {
  for (std::int64_t frame = 0; frame < 2500; ++frame) {  // 100 s
    OrientationRecord record = record_without_orientation(frame);
    if (frame < 250) {  // one row of the hour
      record.orientation = OrientationRecord::Orientation{};
      record.orientation->sigma_rad = {1e-6, 2e-6, 1e-6};
      record.telemetry_error = PanTilt<double>{3e-4, 4e-4};
      record.calibrated = true;
      record.camera.clock_offset = 0.25;
    }
    EXPECT_TRUE(live_.write(record));
  }
  const json hour = body_of(get("/api/v1/history?span=hour"));
  ASSERT_EQ(hour["time_s"].size(), 10U);
  for (const auto& column : hour) EXPECT_EQ(column.size(), 10U);
  EXPECT_EQ(hour["sigma_rad"][0], 2e-6);
  EXPECT_EQ(hour["clock_offset_s"][0], 0.25);
  EXPECT_EQ(hour["clock_offset_sigma_s"][0], 0.0);
  EXPECT_NEAR(hour["pan_error_rad"][0].get<double>(), 3e-4, 1e-12);
  EXPECT_NEAR(hour["tilt_error_rad"][0].get<double>(), 4e-4, 1e-12);
  for (const char* column :
       {"sigma_rad", "clock_offset_s", "clock_offset_sigma_s", "pan_error_rad", "tilt_error_rad"})
    EXPECT_TRUE(hour[column][1].is_null()) << column;
  EXPECT_GT(body_of(get("/api/v1/history?span=minute"))["time_s"].size(), 400U);
  EXPECT_GT(body_of(get("/api/v1/history"))["time_s"].size(), 400U);
  const std::string refusal = get("/api/v1/history?span=day");
  EXPECT_THAT(refusal, StartsWith("HTTP/1.1 400 "));
  EXPECT_EQ(body_of(refusal)["error"], "span must be minute or hour");
}

TEST_F(HttpApiTest, HoldsAFrameAndAnswersWithItsRecord) {
  OrientationRecord record = record_without_orientation(7);
  EXPECT_TRUE(live_.write(record));
  EXPECT_THAT(post("/api/v1/hold", R"({"frame":7})"), StartsWith("HTTP/1.1 409 "));
  EXPECT_THAT(post("/api/v1/hold", R"({"frame":8})"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(post("/api/v1/hold", R"({"frames":8})"), StartsWith("HTTP/1.1 400 "));
  record.frame = 8;
  record.orientation = OrientationRecord::Orientation{};
  EXPECT_TRUE(live_.write(record));
  EXPECT_EQ(post("/api/v1/hold", R"({"frame":8})").substr(0, 12), "HTTP/1.1 200");
  const json held = body_of(post("/api/v1/hold", "{}"));
  EXPECT_EQ(held["frame"], 8);
  EXPECT_EQ(held["time_s"], *record.time_s);
  // Long after that.
  record = record_without_orientation(1000);
  EXPECT_TRUE(live_.write(record));
  OrientationRecord found;
  EXPECT_EQ(live_.find(7, &found), FrameSearch::kNotKept);
  EXPECT_EQ(live_.find(8, &found), FrameSearch::kFound);
  EXPECT_THAT(post("/api/v1/pixel", R"({"frame":7,"directions":[[1,0,0]]})"),
              StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(post("/api/v1/pixel", R"({"frame":8,"directions":[[1,0,0]]})"),
              StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpApiTest, WithoutAPlaneSaysHowToHaveOne) {
  const std::string answer = get("/api/v1/plane");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(body_of(answer)["error"].get<std::string>(), HasSubstr("set tracking.plane"));
}

TEST_F(HttpApiWithPlaneTest, TellsThePlane) {
  const json told = body_of(get("/api/v1/plane"));
  EXPECT_EQ(told["height"]["value"], 12.0);
  EXPECT_EQ(told["height"]["sigma"], 0.01);
  EXPECT_NEAR(told["heading"]["value"].get<double>(), 0.5, 1e-12);
  EXPECT_TRUE(told["origin"].is_null());
  EXPECT_EQ(told["covariance"]["names"].size(), 6U);
  EXPECT_EQ(told["covariance"]["matrix"][5][5], 1e-4);
}

TEST_F(HttpApiTest, FitsAPlaneToWhatAClientKnows) {
  EXPECT_EQ(body_of(post("/api/v1/plane/fit", "{}"))["status"], "ok");
  const std::string refusal = post("/api/v1/plane/fit", "{]");
  EXPECT_THAT(refusal, StartsWith("HTTP/1.1 400 "));
  EXPECT_EQ(body_of(refusal)["error"], "not today");
}

TEST_F(HttpApiTest, WithoutASceneMapSaysHowToHaveOne) {
  const std::string answer = get("/api/v1/map");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(body_of(answer)["error"].get<std::string>(), HasSubstr("set scene_map.file"));
  EXPECT_THAT(get("/api/v1/map/views"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(get("/metrics"), Not(HasSubstr("alidade_scene_map")));
}

TEST_F(HttpApiTest, BeginsNoRecordingWithoutAPlaceForIt) {
  EXPECT_TRUE(body_of(get("/api/v1/status"))["recording"].is_null());
  for (const char* path :
       {"/api/v1/recording", "/api/v1/recording/end", "/api/v1/recording/verify"}) {
    const std::string answer = post(path, R"({"duration_s": 10})");
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 409"));
    EXPECT_THAT(answer, HasSubstr("set output.recordings to a directory"));
  }
}

struct RecordedStream {
  TemporaryDirectory directory;
  LiveRecorder recorder{{directory.path(), {}}};
};

// The stream comes first: the server must not outlive it.
class HttpApiWithRecorderTest : private RecordedStream, public HttpApiTest {
 protected:
  HttpApiWithRecorderTest() : HttpApiTest(nullptr, nullptr, nullptr, {}, &recorder) {}
  using RecordedStream::directory;
  using RecordedStream::recorder;
};

TEST_F(HttpApiWithRecorderTest, BeginsAndEndsARecording) {
  EXPECT_EQ(body_of(get("/api/v1/status"))["recording"],
            json::parse(R"({"under_way": false, "directory": null, "asked_s": null, "length_s": 0.0,
                            "frames": 0, "samples": 0, "left_out": 0, "error": null,
                            "verification": {"state": "none", "recording": null, "verdict": null,
                                             "sentence": null, "report": null, "error": null}})"));
  EXPECT_THAT(post("/api/v1/recording/verify", ""), HasSubstr("there is no recording yet"));
  EXPECT_THAT(post("/api/v1/recording/end", ""), StartsWith("HTTP/1.1 409"));
  for (const char* wrong : {"", "{}", "[]", R"({"duration_s": "10"})", R"({"duration_s": 0})",
                            R"({"duration_s": 1e9})", R"({"duration_s": 10, "x": 1})"}) {
    EXPECT_THAT(post("/api/v1/recording", wrong), StartsWith("HTTP/1.1 400")) << wrong;
  }
  const std::string begun = post("/api/v1/recording", R"({"duration_s": 10})");
  EXPECT_THAT(begun, StartsWith("HTTP/1.1 202"));
  EXPECT_THAT(body_of(begun)["directory"], StartsWith(directory.path()));
  EXPECT_EQ(body_of(begun)["asked_s"], 10);
  EXPECT_THAT(post("/api/v1/recording", R"({"duration_s": 10})"), StartsWith("HTTP/1.1 409"));
  EXPECT_THAT(post("/api/v1/recording/verify", ""), HasSubstr("end it first"));
  for (int i = 0; i < 5; ++i) recorder.take(test::kept_frame(i, 7 + 0.1 * i));
  const std::string ended = post("/api/v1/recording/end", "");
  EXPECT_THAT(ended, StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(body_of(ended)["frames"], 5);
  EXPECT_EQ(body_of(ended)["under_way"], false);
  EXPECT_EQ(body_of(get("/api/v1/status"))["recording"], body_of(ended));

  const std::string verifying = post("/api/v1/recording/verify", "");
  EXPECT_THAT(verifying, StartsWith("HTTP/1.1 202"));
  EXPECT_EQ(body_of(verifying)["verification"]["state"], "running");
  EXPECT_EQ(body_of(verifying)["verification"]["recording"], body_of(ended)["directory"]);
  EXPECT_THAT(post("/api/v1/recording/verify", ""), StartsWith("HTTP/1.1 409"));
  verification_.state = RecordingVerification::State::kDone;
  verification_.verdict = "holds";
  verification_.sentence = "sigmas hold";
  const json told = body_of(get("/api/v1/status"))["recording"]["verification"];
  EXPECT_EQ(told["state"], "done");
  EXPECT_EQ(told["verdict"], "holds");
  EXPECT_EQ(told["sentence"], "sigmas hold");
  EXPECT_TRUE(told["error"].is_null());
}

class HttpApiWithSceneMapTest : public HttpApiTest {
 protected:
  HttpApiWithSceneMapTest() : HttpApiTest(nullptr, nullptr, nullptr, [this] { return report_; }) {}

  SceneReport report_;
};

TEST_F(HttpApiWithSceneMapTest, TellsWhatEachKeyframeShows) {
  EXPECT_EQ(body_of(get("/api/v1/map/views")), json::parse(R"({"keyframes": []})"));
  // Forward, to the right, down.
  outlines_.push_back({7, 1200, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
  const json told = body_of(get("/api/v1/map/views"))["keyframes"];
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0]["keyframe"], 7);
  EXPECT_EQ(told[0]["focal_length_px"], 1200);
  EXPECT_EQ(told[0]["border_rad"][0], json::parse("[0.0, 0.0]"));
  EXPECT_NEAR(told[0]["border_rad"][1][0].get<double>(), kPi / 2, 1e-12);
  EXPECT_NEAR(told[0]["border_rad"][2][1].get<double>(), -kPi / 2, 1e-12);
}

TEST_F(HttpApiWithSceneMapTest, TellsWhatLocalizationHasDone) {
  report_.name = "scene.map";
  report_.landmarks = 1234;
  json told = body_of(get("/api/v1/map"));
  EXPECT_EQ(told["file"], "scene.map");
  EXPECT_FALSE(told["ready"].get<bool>());
  EXPECT_TRUE(told["last"].is_null());
  EXPECT_TRUE(told["offset"].is_null());
  EXPECT_TRUE(told["upkeep"].is_null());
  EXPECT_THAT(get("/metrics"), Not(HasSubstr("upkeep")));
  report_.ready = true;
  report_.pictures = 5;
  report_.found = 3;
  report_.found_by_hint = 2;
  report_.ambiguous = 2;
  report_.last = SceneReport::Last{77, 1, 0.25, "ok", 60, true, {1e-4, 2e-4}};
  report_.offset = BaseOffset{{5e-3, -1e-3}, 1e-8 * Matrix2<double>::Identity(), 2e-4};
  report_.moved = report_.offset;
  report_.movements = 1;
  report_.uncorrected = true;
  report_.upkeep = UpkeepReport{9, 8, 700, 600, 5, 40, 30, 3, 2, true};
  told = body_of(get("/api/v1/map"));
  EXPECT_EQ(told["pictures"]["found"], 3);
  EXPECT_EQ(told["pictures"]["ambiguous"], 2);
  EXPECT_EQ(told["last"]["status"], "ok");
  EXPECT_EQ(told["last"]["sigma_rad"][1], 2e-4);
  EXPECT_GT(told["last"]["age_s"].get<double>(), 0);
  EXPECT_EQ(told["offset"]["pan_rad"], 5e-3);
  EXPECT_EQ(told["offset"]["sigma_rad"][0], 1e-4);
  EXPECT_EQ(told["moved"]["roll_rad"], 2e-4);
  EXPECT_TRUE(told["uncorrected"].get<bool>());
  EXPECT_EQ(told["upkeep"], json::parse(R"({"pictures": 9, "updates": 8, "expected": 700,
    "updated": 600, "beyond_gate": 5, "born": 40, "died": 30, "not_close": 3, "hidden": 2,
    "stopped": true})"));
  EXPECT_EQ(body_of(get("/api/v1/status"))["scene_map"]["upkeep"], told["upkeep"]);
  const std::string metrics = get("/metrics");
  EXPECT_THAT(metrics, HasSubstr("\nalidade_scene_map_upkeep_landmarks_total{what=\"born\"} 40\n"));
  EXPECT_THAT(metrics, HasSubstr("\nalidade_scene_map_upkeep_pictures_total{what=\"seen\"} 7\n"));
  EXPECT_THAT(metrics, HasSubstr("\nalidade_scene_map_updates_total 8\n"));
  EXPECT_THAT(metrics,
              HasSubstr("\nalidade_scene_map_telemetry_offset_radians{axis=\"pan\"} 0.005\n"));
  EXPECT_THAT(metrics,
              HasSubstr("\nalidade_scene_map_pictures_total{result=\"found_in_all\"} 1\n"));
  EXPECT_THAT(metrics, HasSubstr("\nalidade_scene_map_movements_total 1\n"));
}

TEST_F(HttpApiTest, TellsForWhichDistancesTheCalibrationHolds) {
  Calibration calibration = test::zoom_curve().node(0);
  const int f = index(Parameter::kFocalLength);
  calibration.covariance(f, f) = std::pow(2e-4 * calibration.camera.focal_length, 2);
  OrientationRecord record = record_without_orientation(1);
  record.calibrated = true;
  record.camera = pack(calibration);
  ASSERT_TRUE(live_.write(record));
  // The usual pupil, 5 cm.
  EXPECT_NEAR(body_of(get("/api/v1/calibration"))["holds_beyond_m"].get<double>(), 250, 1e-3);
  calibration.covariance.setZero();
  record.frame = 2;
  record.camera = pack(calibration);
  ASSERT_TRUE(live_.write(record));
  EXPECT_FALSE(body_of(get("/api/v1/calibration")).contains("holds_beyond_m"));
}

TEST_F(HttpApiTest, TellsTheZoomCurveWithTheCalibration) {
  OrientationRecord record = record_without_orientation(1);
  record.calibrated = true;
  const ZoomCurve curve = test::zoom_curve();
  record.camera = pack(curve.node(2));
  ASSERT_TRUE(live_.write(record));
  EXPECT_FALSE(body_of(get("/api/v1/calibration")).contains("zoom_curve"));
  EXPECT_THAT(get("/metrics"), HasSubstr("\nalidade_zoom_curve_nodes 0\n"));
  curve_ = std::make_shared<const ZoomCurve>();
  EXPECT_FALSE(body_of(get("/api/v1/calibration")).contains("zoom_curve")) << "an empty one";
  curve_ = std::make_shared<const ZoomCurve>(curve);
  const json told = body_of(get("/api/v1/calibration"))["zoom_curve"];
  ASSERT_EQ(told["nodes"].size(), 5U);
  for (int i = 0; i < 5; ++i) {
    const Calibration c = curve.node(i);
    const json& node = told["nodes"][static_cast<std::size_t>(i)];
    EXPECT_EQ(node["reading"], *c.zoom);
    EXPECT_EQ(node["focal_length"]["value"], c.camera.focal_length);
    EXPECT_EQ(node["focal_length"]["sigma"], std::sqrt(c.covariance(0, 0)));
    EXPECT_EQ(node["centre_offset"]["value"][0], c.camera.centre_u);
  }
  const json& samples = told["samples"];
  ASSERT_EQ(samples["reading"].size(), samples["focal_length_px"].size());
  ASSERT_GE(samples["reading"].size(), 20U);
  EXPECT_EQ(samples["reading"].front(), 1000);
  EXPECT_EQ(samples["reading"].back(), 2000);
  for (std::size_t i = 0; i < samples["reading"].size(); ++i) {
    Calibration c;
    ASSERT_TRUE(curve.at(samples["reading"][i], &c));
    EXPECT_EQ(samples["focal_length_px"][i], c.camera.focal_length);
    EXPECT_EQ(samples["focal_length_sigma_px"][i], std::sqrt(c.covariance(0, 0)));
  }
  const std::string metrics = get("/metrics");
  EXPECT_THAT(metrics, HasSubstr("\nalidade_zoom_curve_nodes 5\n"));
  EXPECT_THAT(metrics, HasSubstr("\nalidade_calibration_zoom_reading 1500\n"));
  EXPECT_THAT(metrics, HasSubstr("\nalidade_zoom_curve_reading{end=\"last\"} 2000\n"));
}

TEST_F(HttpApiTest, TellsWhatTelemetryIsOffByWithTheCalibration) {
  OrientationRecord record = record_without_orientation(1);
  record.calibrated = true;
  ASSERT_TRUE(live_.write(record));
  TelemetryError error;
  telemetry_error_ = std::make_shared<const TelemetryError>(error);
  const json none = body_of(get("/api/v1/calibration"));
  for (const char* key : {"pan_error", "tilt_error", "pan_play_rad", "tilt_play_rad"}) {
    EXPECT_FALSE(none.contains(key)) << key;
  }
  error.pan.first_rad = -0.1;
  error.pan.spacing_rad = 0.05;
  error.pan.count = 5;
  for (std::size_t i = 0; i < 5; ++i) {
    error.pan.values[i] = 1e-4 * static_cast<double>(i);
    error.pan.sigmas[i] = 1e-5;
  }
  error.pan.length_rad = 0.1;
  error.pan.unseen_sigma_rad = 2e-4;
  error.tilt.unseen_sigma_rad = 3e-4;
  error.pan_play = {5e-4, 2e-5, PlayKind::kMotor};
  telemetry_error_ = std::make_shared<const TelemetryError>(error);
  const json told = body_of(get("/api/v1/calibration"));
  const json& pan = told["pan_error"];
  EXPECT_EQ(pan["knots_rad"], (json{{"first", -0.1}, {"spacing", 0.05}}));
  ASSERT_EQ(pan["values_rad"].size(), 5U);
  EXPECT_EQ(pan["values_rad"][4], error.pan.values[4]);
  EXPECT_EQ(pan["sigma_rad"].size(), 5U);
  EXPECT_EQ(pan["length_rad"], 0.1);
  EXPECT_EQ(pan["unseen_sigma_rad"], 2e-4);
  const json& samples = pan["samples"];
  ASSERT_GE(samples["angle_rad"].size(), 20U);
  ASSERT_EQ(samples["error_rad"].size(), samples["angle_rad"].size());
  EXPECT_EQ(samples["angle_rad"].front(), -0.1);
  EXPECT_NEAR(samples["angle_rad"].back().get<double>(), 0.1, 1e-12);
  for (std::size_t i = 0; i < samples["angle_rad"].size(); ++i) {
    EXPECT_EQ(samples["error_rad"][i], error.pan.at(samples["angle_rad"][i]));
    EXPECT_EQ(samples["sigma_rad"][i], error.pan.sigma(samples["angle_rad"][i]));
  }
  EXPECT_EQ(told["tilt_error"], (json{{"length_rad", 0.0}, {"unseen_sigma_rad", 3e-4}}));
  EXPECT_EQ(told["pan_play_rad"], (json{{"value", 5e-4}, {"sigma", 2e-5}, {"kind", "motor"}}));
  EXPECT_FALSE(told.contains("tilt_play_rad"));
}

TEST_F(HttpApiTest, PassesOnThatAFreshCalibrationIsWanted) {
  EXPECT_THAT(post("/api/v1/calibrate", ""), StartsWith("HTTP/1.1 409 "));
  EXPECT_FALSE(asked_);
  calibrating_ = true;
  EXPECT_THAT(post("/api/v1/calibrate", ""), StartsWith("HTTP/1.1 202 "));
  EXPECT_TRUE(asked_);
}

TEST_F(HttpApiTest, AFreshCalibrationIsNotBegunAnewBeforeItCanBeDone) {
  calibrating_ = true;
  EXPECT_THAT(post("/api/v1/calibrate", ""), StartsWith("HTTP/1.1 202 "));
  for (int i = 0; i < 3; ++i) {
    asked_ = false;
    const std::string again = post("/api/v1/calibrate", "");
    EXPECT_THAT(again, AllOf(StartsWith("HTTP/1.1 429 "), HasSubstr("\r\nRetry-After: 1")));
    EXPECT_THAT(
        body_of(again)["error"].get<std::string>(),
        AllOf(StartsWith("a fresh calibration was begun "), HasSubstr("the next may be in 1")));
    EXPECT_FALSE(asked_);
  }
}

TEST_F(HttpApiTest, ABrowserGetsTheTicketThatItsStreamNeeds) {
  const std::string answer = post("/api/v1/stream/ticket", "{}");
  EXPECT_THAT(answer, AllOf(StartsWith("HTTP/1.1 200 "), HasSubstr("Cache-Control: no-store")));
  const json ticket = body_of(answer);
  EXPECT_EQ(ticket["valid_s"], 10);
  const auto follow = [this](const std::string& query) {
    Client client(server_);
    client.send("GET /api/v1/stream" + query +
                " HTTP/1.1\r\nHost: 192.0.2.1\r\nUser-Agent: Mozilla/5.0\r\n\r\n");
    return client.receive("\r\n\r\n");
  };
  EXPECT_THAT(follow(""), StartsWith("HTTP/1.1 403 "));
  const std::string query = "?ticket=" + ticket["ticket"].get<std::string>();
  EXPECT_THAT(follow(query), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(follow(query), StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(get("/api/v1/stream/ticket"), StartsWith("HTTP/1.1 405 "));
  Client foreign(server_);
  foreign.send(
      "POST /api/v1/stream/ticket HTTP/1.1\r\nHost: 192.0.2.1\r\nOrigin: http://evil.example\r\n"
      "Content-Length: 0\r\n\r\n");
  EXPECT_THAT(foreign.receive(), StartsWith("HTTP/1.1 403 "));
}

TEST_F(HttpApiTest, WithoutTrackingThereAreNoTargets) {
  EXPECT_THAT(post("/api/v1/detections", R"({"frame": 1, "boxes": []})"),
              AllOf(StartsWith("HTTP/1.1 409 "), HasSubstr("section tracking")));
  EXPECT_THAT(get("/api/v1/targets"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(get("/metrics"), Not(HasSubstr("alidade_targets")));
}

// Not started: what is offered waits.
struct Feed {
  static TargetOptions few_boxes() {
    TargetOptions options = default_target_options(TargetSpace::kPlane);
    options.tracker.max_detections = 2;
    return options;
  }
  TargetFeed feed{few_boxes(), test::mast_plane()};
  TargetLines lines{nullptr};
};

class HttpApiWithTargetsTest : protected Feed, public HttpApiTest {
 protected:
  HttpApiWithTargetsTest() : HttpApiTest(test::mast_plane(), &feed, &lines) {
    feed.add_on_news([this](const auto& state) { lines.take(*state); });
    for (std::int64_t i = 0; i < 60; ++i) {
      OrientationRecord record =
          test::record_of(i, test::swinging_frame(test::watching_calibration(), i));
      if (i == 50) record.orientation.reset();
      EXPECT_TRUE(live_.write(record));
    }
  }
  ~HttpApiWithTargetsTest() override {
    feed.stop();
    server_.stop();
  }
  void start() { ASSERT_TRUE(feed.start()); }
  const Vector2<double> stands_at_ =
      test::place_in_view(test::mast(), test::swinging_frame(test::watching_calibration(), 0));
  std::string send_frame(std::int64_t frame) {
    const FrameOrientation seen_by = test::swinging_frame(test::watching_calibration(), frame);
    const DetectionBox box = test::box_with_foot(test::foot_of(test::mast(), seen_by, stands_at_));
    const json body{{"frame", frame},
                    {"boxes",
                     {{{"u", box.u},
                       {"v", box.v},
                       {"width", box.width},
                       {"height", box.height},
                       {"class", "person"}}}}};
    return post("/api/v1/detections", body.dump());
  }
};

TEST_F(HttpApiWithTargetsTest, RefusesEachKindOfBadDetectionsWithItsReason) {
  const std::string box = R"({"u": 900, "v": 500, "width": 20, "height": 50})";
  const struct {
    std::string body;
    const char* status;
    const char* reason;
  } refusals[] = {
      {"not JSON", "400", "must be a JSON object"},
      {R"({"frame": 1, "boxes": [{"u": NaN, "v": 1, "width": 1, "height": 1}]})", "400",
       "object; NaN is not a JSON number"},
      {R"({"frame": 1, "boxes": [{"u": 1e999, "v": 1, "width": 1, "height": 1}]})", "400",
       "object"},
      {R"({"boxes": []})", "400", "frame or time_s is missing"},
      {R"({"frame": 1, "time_s": 2, "boxes": []})", "400", "exclude each other"},
      {R"({"frame": -1, "boxes": []})", "400", "frame must be an integer"},
      {R"({"frame": 1})", "400", "boxes must be an array"},
      {R"({"frame": 1, "boxes": {}})", "400", "boxes must be an array"},
      {R"({"frame": 1, "boxes": [3]})", "400", "item 0: must be an object"},
      {R"({"frame": 1, "boxes": [{"u": 1, "v": 1, "width": 1}]})", "400",
       "item 0: height must be a number and is missing"},
      {R"({"frame": 1, "boxes": [{"u": "1", "v": 1, "width": 1, "height": 1}]})", "400",
       "item 0: u must be a number"},
      {R"({"frame": 1, "boxes": [{"x": 1}]})", "400", "unknown key"},
      {R"({"frame": 1, "boxes": [[[[[1]]]]]})", "400", "nested"},
      {R"({"frame": 1, "boxes": [{"u": 1, "v": 1, "width": 1, "height": 1, "class": 7}]})", "400",
       "class must be a text"},
      {R"({"frame": 1, "boxes": [{"u": 1, "v": 1, "width": 1, "height": 1, "class": "a\nb"}]})",
       "400", "class must be a text"},
      {R"({"frame": 1, "boxes": [{"u": 1, "v": 1, "width": 1, "height": 1, "class": ")" +
           std::string(33, 'x') + R"("}]})",
       "400", "class must be a text"},
      {R"({"frame": 1, "boxes": [)" + box + "," + box + "," + box + "]}", "400",
       "more boxes than tracking.max_detections"},
      {R"({"frame": 60, "boxes": []})", "404", "later than the newest frame"},
      {R"({"frame": 9223372036854775807, "boxes": []})", "404", "later than the newest frame"},
      {R"({"frame": 9223372036854775808, "boxes": []})", "400", "0 or more, below 2^63"},
      {R"({"time_s": 86500, "boxes": []})", "404", "later than the newest frame"},
      {R"({"time_s": 50, "boxes": []})", "404", "no such frame"},
      {R"({"frame": 50, "boxes": []})", "409", "no orientation"},
  };
  for (const auto& one : refusals) {
    const std::string answer = post("/api/v1/detections", one.body);
    EXPECT_THAT(answer, StartsWith(std::string("HTTP/1.1 ") + one.status + " ")) << one.body;
    EXPECT_THAT(answer, HasSubstr(one.reason)) << one.body;
  }
  EXPECT_THAT(post("/api/v1/detections", std::string(kMaxDetectionBytes + 1, ' ')),
              StartsWith("HTTP/1.1 413 "));
  EXPECT_THAT(get("/api/v1/targets?frame=x"), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(get("/api/v1/targets?frame=1000"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(get("/api/v1/targets?frame=9223372036854775807"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(get("/api/v1/targets?frame=9223372036854775808"), HasSubstr("below 2^63"));
  const json targets = body_of(get("/api/v1/targets"));
  EXPECT_EQ(targets["targets"], json::array());
  EXPECT_TRUE(targets["frame"].is_null());
  EXPECT_EQ(targets["detections"]["frames"]["malformed"], 17);
  EXPECT_EQ(targets["detections"]["frames"]["not_yet"], 3);
  EXPECT_THAT(get("/metrics"),
              HasSubstr("alidade_detection_frames_total{outcome=\"no_orientation\"} 1\n"));
}

TEST_F(HttpApiWithTargetsTest, LeavesOutABoxThatIsOfNoUseAndSaysWhich) {
  start();
  const std::string good = R"({"u": 900, "v": 500, "width": 20, "height": 50})";
  const struct {
    std::string box;
    const char* outcome;
    const char* reason;
  } bad[] = {
      {R"({"u": 1900, "v": 5, "width": 50, "height": 9})", "outside", "middle is not in the"},
      {R"({"u": 1, "v": 1, "width": -1, "height": 1})", "no_size", "width or height is not above"},
      {R"({"u": 1, "v": 1, "width": 1, "height": 1, "score": 2})", "score", "score is not from 0"},
      {R"({"u": null, "v": 1, "width": 1, "height": 1})", "not_finite", "a number of it is not"}};
  std::int64_t frame = 0;
  for (const auto& one : bad) {
    const std::string number = std::to_string(++frame);
    const std::string answer =
        post("/api/v1/detections",
             R"({"frame": )" + number + R"(, "boxes": [)" + good + "," + one.box + "]}\r\n");
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 202 ")) << one.box;
    const json told = body_of(answer);
    EXPECT_EQ(told["boxes"], 1);
    ASSERT_EQ(told["left_out"].size(), 1U);
    EXPECT_EQ(told["left_out"][0]["box"], 1);
    EXPECT_THAT(told["left_out"][0]["reason"].get<std::string>(), HasSubstr(one.reason));
  }
  while (feed.snapshot().counters.of(DetectionStatus::kTaken) < frame) std::this_thread::yield();
  const std::string metrics = get("/metrics");
  for (const auto& one : bad) {
    EXPECT_THAT(metrics, HasSubstr(std::string("alidade_detection_boxes_total{outcome=\"") +
                                   one.outcome + "\"} 1\n"));
  }
  const json boxes = body_of(get("/api/v1/targets"))["detections"]["boxes"];
  EXPECT_EQ(boxes["taken"], 4);
  EXPECT_EQ(boxes["outside"], 1);
}

TEST_F(HttpApiWithTargetsTest, TenThousandBoxesInOneBodyAreRefusedAndCostTheTargetsNothing) {
  start();
  TargetStage alone(feed.options(), test::mast_plane());
  const auto send = [&](std::int64_t i) {
    ASSERT_THAT(send_frame(i), StartsWith("HTTP/1.1 202 ")) << i;
    const FrameOrientation seen_by = test::swinging_frame(test::watching_calibration(), i);
    const DetectionBox box = test::box_with_foot(test::foot_of(test::mast(), seen_by, stands_at_));
    ASSERT_EQ(alone.add(test::detected(i, seen_by, {box})).status, DetectionStatus::kTaken);
    while (feed.snapshot().counters.of(DetectionStatus::kTaken) <= i) std::this_thread::yield();
  };
  const auto body_of_boxes = [](const std::string& box, int count) {
    std::string body = R"({"frame": 20, "boxes": [)" + box;
    for (int i = 1; i < count; ++i) body += "," + box;
    return body + "]}";
  };
  constexpr int kMany = 10'000;
  const std::string box = R"({"u":9,"v":9,"width":9,"height":9})";
  const struct {
    std::string body;
    const char* status;
    const char* reason;
  } floods[] = {
      {body_of_boxes(box, kMany), "413", "the body is too large; at most 131072 bytes"},
      {body_of_boxes(box, 3700), "400", "more boxes than tracking.max_detections"},
      {body_of_boxes("{}", kMany), "400", "boxes: item 0: u must be a number and is missing"},
      {body_of_boxes("0", kMany), "400", "boxes: item 0: must be an object"},
      {body_of_boxes("[]", kMany), "400", "boxes: item 0: must be an object"},
  };
  for (std::int64_t i = 0; i < 20; ++i) send(i);
  ASSERT_EQ(feed.snapshot().newest->targets.size(), 1U);
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    for (const auto& flood : floods) {
      const std::string answer = post("/api/v1/detections", flood.body);
      EXPECT_THAT(answer, StartsWith(std::string("HTTP/1.1 ") + flood.status + " "));
      const std::string error = body_of(answer)["error"];
      EXPECT_THAT(error, AllOf(HasSubstr(flood.reason), Not(HasSubstr("\n"))));
    }
  }
  // By its head alone, so that none of it is kept.
  Client client(server_);
  client.send("POST /api/v1/detections HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
              std::to_string(floods[0].body.size()) + "\r\n\r\n");
  EXPECT_THAT(client.receive(), StartsWith("HTTP/1.1 413 "));
  for (std::int64_t i = 20; i < 40; ++i) send(i);
  const auto flooded = feed.snapshot().newest;
  const TargetsState quiet = alone.state();
  ASSERT_EQ(flooded->targets.size(), 1U);
  ASSERT_EQ(quiet.targets.size(), 1U);
  EXPECT_EQ(flooded->targets[0].target.identity, quiet.targets[0].target.identity);
  EXPECT_EQ(flooded->targets[0].target.state.mean, quiet.targets[0].target.state.mean);
  EXPECT_EQ(flooded->targets[0].target.state.cov, quiet.targets[0].target.state.cov);
  EXPECT_EQ(feed.snapshot().counters.of(DetectionStatus::kTooManyBoxes), kRounds);
}

TEST_F(HttpApiWithTargetsTest, SaysWhenItsQueueIsFull) {
  const auto most = static_cast<std::int64_t>(TargetFeed::kMostWaiting);
  for (std::int64_t i = 0; i < most; ++i) ASSERT_THAT(send_frame(i), StartsWith("HTTP/1.1 202 "));
  EXPECT_THAT(send_frame(3), AllOf(StartsWith("HTTP/1.1 409 "), HasSubstr("already")));
  EXPECT_THAT(send_frame(most),
              AllOf(StartsWith("HTTP/1.1 503 "), HasSubstr("Retry-After: 1\r\n")));
  EXPECT_EQ(body_of(get("/api/v1/targets"))["detections"]["waiting"], most);
  EXPECT_THAT(get("/metrics"), HasSubstr("alidade_detection_frames_waiting 32\n"));
}

TEST_F(HttpApiWithTargetsTest, TellsTargetsWhenAskedAndAsEvents) {
  Client client(server_);
  client.send("GET /api/v1/stream HTTP/1.1\r\nHost: localhost\r\n\r\n");
  static_cast<void>(client.receive("event: clock"));
  start();
  // In the past when the newest came: what is late is taken.
  for (std::int64_t i = 20; i < 49; ++i)
    if (i != 30) {
      ASSERT_THAT(send_frame(i), StartsWith("HTTP/1.1 202 ")) << i;
    }
  ASSERT_THAT(send_frame(30), StartsWith("HTTP/1.1 202 "));
  json targets;
  do {
    targets = body_of(get("/api/v1/targets"));
  } while (targets["detections"]["frames"]["late"] == 0);
  EXPECT_EQ(targets["frame"], 48);
  EXPECT_EQ(targets["space"], "plane");
  ASSERT_EQ(targets["targets"].size(), 1U);
  const json& target = targets["targets"][0];
  EXPECT_EQ(target["identity"], 1);
  EXPECT_EQ(target["class"], "person");
  EXPECT_NEAR(target["position_m"][0], stands_at_.x(), 0.1);
  EXPECT_NEAR(target["position_m"][1], stands_at_.y(), 0.1);
  EXPECT_EQ(target["covariance"].size(), 4U);
  EXPECT_FALSE(target["box"].is_null());
  const json later = body_of(get("/api/v1/targets?frame=59"));
  EXPECT_EQ(later["frame"], 59);
  EXPECT_EQ(later["detected_frame"], 48);
  EXPECT_GT(later["targets"][0]["covariance"][0][0], target["covariance"][0][0]);
  EXPECT_THAT(get("/api/v1/targets?frame=50"), StartsWith("HTTP/1.1 409 "));
  EXPECT_THAT(get("/metrics"), HasSubstr("\nalidade_targets 1\n"));
  // What comes with its first line may be all of it.
  std::string event = client.receive("event: targets");
  event.erase(0, event.find("event: targets"));
  if (event.find("\n\n") == std::string::npos) event += client.receive("\n\n");
  EXPECT_THAT(event, HasSubstr("\"targets\":["));
}

TEST_F(HttpApiTest, AClientThatIsTooSlowIsToldWhatItLost) {
  Client client(server_);
  client.send("GET /api/v1/stream HTTP/1.1\r\nHost: localhost\r\n\r\n");
  std::string text = client.receive("event: clock");
  // Its connection takes some, then it loses the oldest.
  std::int64_t written = 0;
  while (live_.lost_by_readers() == 0) {
    EXPECT_TRUE(live_.write(record_without_orientation(++written)));
    std::this_thread::yield();
  }
  EXPECT_TRUE(live_.write(record_without_orientation(++written)));
  text += client.receive("id: " + std::to_string(written) + "\n");
  const std::string end = "\n\n";
  if (text.compare(text.size() - end.size(), end.size(), end) != 0) text += client.receive(end);
  std::istringstream lines(text.substr(text.find("\r\n\r\n") + 4));
  std::int64_t last = 0;
  std::int64_t lost = 0;
  std::string name;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("event: ", 0) == 0) name = line.substr(7);
    if (line.rfind("id: ", 0) == 0) {
      EXPECT_EQ(std::stoll(line.substr(4)), last + 1);
      ++last;
    }
    if (line.rfind("data: ", 0) == 0 && name == "lost") {
      const std::int64_t records = json::parse(line.substr(6))["records"];
      EXPECT_GT(records, 0);
      lost += records;
      last += records;
    }
    if (line.rfind("data: ", 0) == 0 && name == "orientation") {
      EXPECT_EQ(json::parse(line.substr(6))["frame"], last);
    }
  }
  EXPECT_EQ(last, written);
  EXPECT_EQ(lost, live_.lost_by_readers());
}

}  // namespace
}  // namespace alidade
