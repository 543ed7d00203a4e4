// `alidade map` and `alidade localize`: the built executable on recordings that alidade-simulate made. The virtual camera shares no
// code with what is tested.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "test/edge_app/commands/alidade_command.h"
#include "test/edge_app/storage/forged_journal.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

namespace fs = std::filesystem;

// A slow walk around, a field to either side, a picture each second.
std::string walking_camera(const std::string& scene, const std::string& size = "640, height: 360") {
  return "seed: 5\n"
         "duration_s: 40\n"
         "image: {width: " +
         size +
         ", rate_hz: 1}\n"
         "camera: {focal_length_px: 800}\n"
         "path: {type: triple_cosine, amplitude: 0.5, period_s: 40}\n"
         "sensor: {read_noise: 1, jpeg_quality: 95}\n"
         "recording: {images: png}\n"
         "telemetry: {rate_hz: 5, sigma_rad: 2.0e-4}\n" +
         scene;
}

// The same at up to half a field a second, with a rolling shutter of which the map knows nothing: up to 10 px from first row to last.
std::string hurrying_camera(const std::string& scene, const std::string& line_delay_us) {
  return "seed: 5\n"
         "duration_s: 16\n"
         "image: {width: 640, height: 360, rate_hz: 1}\n"
         "camera: {focal_length_px: 800, line_delay_us: " +
         line_delay_us +
         "}\n"
         "path: {type: triple_cosine, amplitude: 0.5, period_s: 5.7}\n"
         "sensor: {read_noise: 1, jpeg_quality: 95}\n"
         "recording: {images: png}\n"
         "telemetry: {rate_hz: 20, sigma_rad: 2.0e-4}\n" +
         scene;
}

const char* const kMapTexture =
    "scene:\n"
    "  procedural:\n"
    "    - {width_deg: 360, height_deg: 180, projection: equirectangular}\n";

Result map_command(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "map");
  return alidade(arguments);
}

std::vector<nlohmann::json> lines_of(const std::string& text) {
  std::vector<nlohmann::json> out;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) out.push_back(nlohmann::json::parse(line));
  return out;
}

// One recording and one map for all tests, which write elsewhere.
class MapCommands : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    directory_ = new TemporaryDirectory;
    film("walk", walking_camera(kMapTexture));
    built_ = new Result(map_command(
        {"build", path("walk"), "-o", path("scene.map"), "--focal-length", "810", "--json"}));
  }
  static void TearDownTestSuite() {
    delete built_;
    delete directory_;
  }
  static void film(const std::string& name, const std::string& configuration) {
    const std::string file = directory_->write(name + ".yaml", configuration);
    const Result result = run({ALIDADE_SIMULATE, "-c", file, "-o", path(name)});
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  static std::string path(const std::string& name) { return directory_->path() + "/" + name; }

  static TemporaryDirectory* directory_;
  static Result* built_;
};
TemporaryDirectory* MapCommands::directory_ = nullptr;
Result* MapCommands::built_ = nullptr;

TEST_F(MapCommands, BuildTellsTheFocalLength) {
  ASSERT_EQ(built_->exit_code, 0) << built_->errors;
  const auto json = nlohmann::json::parse(built_->output);
  EXPECT_EQ(json["status"], "ok");
  EXPECT_GE(json["keyframes"].get<int>(), 5);
  const double f = json["levels"][0]["focal_length_px"][0].get<double>();
  EXPECT_NEAR(f, 800, 8);
}

TEST_F(MapCommands, InfoAndCheckReadIt) {
  const Result info = map_command({"info", path("scene.map")});
  EXPECT_EQ(info.exit_code, 0) << info.errors;
  EXPECT_THAT(info.output, StartsWith("640x360 px, "));
  const Result check = map_command({"check", path("scene.map")});
  EXPECT_EQ(check.exit_code, 0) << check.errors;
  EXPECT_THAT(check.output, HasSubstr("whole"));
}

TEST_F(MapCommands, EachRefusesAForgedJournalWhichDeletesNothing) {
  const std::string victim = directory_->write("victim", "of no concern to a map");
  const std::string map = path("beside.map");
  fs::copy(path("scene.map"), map);
  test::forge_journal(map + "-journal", victim);
  const std::string why = map + "-journal lies beside it, which this program did not put there";
  const std::vector<std::vector<std::string>> commands = {
      {"map", "info", map},
      {"map", "check", map},
      {"map", "export", map, "-o", path("no")},
      {"map", "build", path("walk"), "-o", map, "--focal-length", "810"},
      {"localize", map, path("walk") + "/frames/000000.png"}};
  for (const std::vector<std::string>& arguments : commands) {
    const Result result = alidade(arguments);
    EXPECT_NE(result.exit_code, 0) << arguments[1];
    EXPECT_THAT(last_line(result.errors), AllOf(HasSubstr(why), HasSubstr("remove it")));
  }
  EXPECT_EQ(directory_->read("victim"), "of no concern to a map");
  EXPECT_TRUE(fs::exists(map + "-journal"));
}

TEST_F(MapCommands, ExportWritesKeyframesPicturesAndAPanorama) {
  const Result result = map_command({"export", path("scene.map"), "-o", path("out")});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto rows = read_csv(directory_->read("out/keyframes.csv"));
  ASSERT_GE(rows.size(), 5U);
  EXPECT_NEAR(std::stod(rows[0].at("focal_length_px")), 800, 8);
  EXPECT_TRUE(fs::exists(path("out/keyframes/000001.jpg")));
  EXPECT_THAT(directory_->read("out/panorama.png"), StartsWith("\x89PNG"));
}

TEST_F(MapCommands, LocalizeFindsFramesWithoutTelemetry) {
  const Result result =
      alidade({"localize", path("scene.map"), "--no-telemetry", "--every", "6", path("walk")});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto truth = read_csv(directory_->read("walk/truth.csv"));
  const auto lines = lines_of(result.output);
  ASSERT_EQ(lines.size(), 7U);
  for (const auto& line : lines) {
    ASSERT_EQ(line["status"], "ok") << line;
    const auto& row = truth.at(line["frame"].get<std::size_t>());
    // The axes are not known: without a calibration the map's base is.
    EXPECT_NEAR(line["pan_rad"].get<double>(), std::stod(row.at("pan_rad")), 1e-2);
    EXPECT_NEAR(line["tilt_rad"].get<double>(), std::stod(row.at("tilt_rad")), 1e-2);
    EXPECT_NEAR(line["focal_length_px"].get<double>(), 800, 8);
  }
}

// Mean square of f's errors in their sigmas: of independent ones chi-square, 4 sigmas of its mean. What all have in common, the map's own
// error, has one more number's.
void expect_honest_focal_lengths(const std::vector<nlohmann::json>& lines, std::size_t count) {
  ASSERT_EQ(lines.size(), count);
  double squares = 0;
  for (const auto& line : lines) {
    ASSERT_EQ(line["status"], "ok") << line;
    EXPECT_EQ(line["reference_row"], 180);
    const double off = line["focal_length_px"].get<double>() - 800;
    const double sigma = line["focal_length_sigma_px"].get<double>();
    squares += std::pow(off / sigma, 2);
    // One in a million is further off.
    EXPECT_LT(std::abs(off), 5 * sigma) << line;
  }
  const double n = static_cast<double>(count);
  EXPECT_LT(squares / n, 1 + 4 * std::sqrt(2 / n));
}

TEST_F(MapCommands, LocalizeOfPicturesThatMovedIsAsGoodAsItSays) {
  for (const char* const line_delay_us : {"50", "-50"}) {
    SCOPED_TRACE(line_delay_us);
    const std::string name = std::string("hurry") + line_delay_us;
    film(name, hurrying_camera(kMapTexture, line_delay_us));
    std::vector<std::string> pictures = {"localize", path("scene.map")};
    for (int i = 0; i < 16; ++i) {
      pictures.push_back(
          path(name + "/frames/0000" + (i < 10 ? "0" : "") + std::to_string(i) + ".png"));
    }
    const Result by_pictures = alidade(pictures);
    ASSERT_EQ(by_pictures.exit_code, 0) << by_pictures.errors;
    expect_honest_focal_lengths(lines_of(by_pictures.output), 16);

    // With telemetry, which bounds the motion, and with what a calibration tells of it.
    const Result by_telemetry = alidade({"localize", path("scene.map"), path(name)});
    ASSERT_EQ(by_telemetry.exit_code, 0) << by_telemetry.errors;
    expect_honest_focal_lengths(lines_of(by_telemetry.output), 16);
    const Result calibrated = alidade(
        {"localize", path("scene.map"), "--calibration", path(name + "/truth.yaml"), path(name)});
    ASSERT_EQ(calibrated.exit_code, 0) << calibrated.errors;
    expect_honest_focal_lengths(lines_of(calibrated.output), 16);
  }
}

TEST_F(MapCommands, LocalizeTakesPictures) {
  const Result result = alidade({"localize", path("scene.map"), path("walk/frames/000007.png")});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(lines_of(result.output).at(0)["status"], "ok");
}

// A recording has its telemetry: test/system/scene_map_test.py is without.
TEST_F(MapCommands, CheckOfLinksLooksForTheLastPicture) {
  const std::string config =
      "video: {type: recording, directory: walk}\n"
      "pan_tilt: {type: recording, directory: walk}\n"
      "calibration: {file: walk/truth.yaml}\n";
  const auto check = [&](const std::string& map) {
    return nlohmann::json::parse(
        alidade({"check", "--json", "--duration", "2", "-c",
                 directory_->write("check.yaml", config + "scene_map: {file: " + map + "}\n")})
            .output);
  };
  const auto json = check("scene.map");
  EXPECT_TRUE(json["scene_map"]["error"].is_null());
  const auto& last = json["scene_map"]["last"];
  ASSERT_EQ(last["status"], "ok") << json;
  const auto truth = read_csv(directory_->read("walk/truth.csv"));
  const auto& row = truth.at(last["frame"].get<std::size_t>());
  // The map's base is telemetry's, to its 0.2 mrad; f to 0.2 %.
  EXPECT_NEAR(last["pan_rad"].get<double>(), std::stod(row.at("pan_rad")), 1e-3);
  EXPECT_NEAR(last["tilt_rad"].get<double>(), std::stod(row.at("tilt_rad")), 1e-3);
  EXPECT_NEAR(last["focal_length_px"].get<double>(), 800, 2);

  const auto without = check("none.map");
  EXPECT_EQ(without["ok"], false);
  EXPECT_THAT(without["scene_map"]["error"].get<std::string>(), HasSubstr("there is no such file"));
  EXPECT_TRUE(without["scene_map"]["last"].is_null());
}

TEST_F(MapCommands, BuildAddsWhatIsNewToAMap) {
  std::string further = walking_camera(kMapTexture);
  further.replace(further.find("period_s: 40"), 12, "period_s: 40, pan_deg: 35");
  film("further", further);
  const Result result = map_command({"build", path("further"), "--add", path("scene.map"), "-o",
                                     path("more.map"), "--focal-length", "810", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto before = nlohmann::json::parse(built_->output);
  const auto after = nlohmann::json::parse(result.output);
  EXPECT_GT(after["keyframes"].get<int>(), before["keyframes"].get<int>() + 1);
  EXPECT_GT(after["levels"][0]["pan_rad"][1].get<double>(),
            before["levels"][0]["pan_rad"][1].get<double>() + 0.3);
  EXPECT_NEAR(after["levels"][0]["focal_length_px"][0].get<double>(), 800, 8);
}

// What `alidade calibrate` asks for: ten seconds along a figure that crosses some fields of view. Most of its pictures move by more than 10 px
// while they are read out.
TEST_F(MapCommands, BuildTakesTheRecordingThatCalibrateAsksForOnceItIsCalibrated) {
  film("figure",
       "seed: 3\nduration_s: 10\nimage: {width: 480, height: 270, rate_hz: 12}\n"
       "camera: {focal_length_px: 700, line_delay_us: 50, clock_offset_ms: -30}\n"
       "path: {type: triple_cosine, amplitude: 1.2, period_s: 10}\n"
       "sensor: {read_noise: 1, jpeg_quality: 95}\nrecording: {images: png}\n"
       "telemetry: {rate_hz: 30, sigma_rad: 5.0e-5}\n" +
           std::string(kMapTexture));
  const auto build = [](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"build", path("figure"), "-o", path("figure.map"),
                                          "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return map_command(arguments);
  };
  // What would help, in numbers: 10 px in a read-out that is a guess.
  const Result slow = build({"--focal-length", "700"});
  EXPECT_EQ(slow.exit_code, 1);
  EXPECT_THAT(
      last_line(slow.errors),
      AllOf(HasSubstr("frames moved too fast"), HasSubstr("at most 10 px in the 30 ms"),
            HasSubstr("27 deg/s at a focal length of 700 px"), HasSubstr("`alidade calibrate`")));
  const Result built = build({"--calibration", path("figure/truth.yaml")});
  ASSERT_EQ(built.exit_code, 0) << built.errors;
  const auto json = nlohmann::json::parse(built.output);
  EXPECT_GE(json["keyframes"].get<int>(), 15);
  EXPECT_NEAR(json["levels"][0]["focal_length_px"][0].get<double>(), 700, 2);
  // All of the figure: three fields of view to either side.
  EXPECT_LT(json["levels"][0]["pan_rad"][0].get<double>(), -0.6);
  EXPECT_GT(json["levels"][0]["pan_rad"][1].get<double>(), 0.6);
  EXPECT_LT(json["residual_px"].get<double>(), 1);
}

TEST_F(MapCommands, PicturesOfAnotherSizeAndNoneAreRefused) {
  film("small", walking_camera(kMapTexture, "240, height: 136"));
  const Result size = alidade({"localize", path("scene.map"), path("small/frames/000000.png")});
  EXPECT_EQ(size.exit_code, 2);
  EXPECT_THAT(last_line(size.errors), HasSubstr("240x136 px"));
  const Result none = alidade({"localize", path("scene.map"), path("walk/truth.csv")});
  EXPECT_EQ(none.exit_code, 2);
  const Result both = map_command({"build", path("walk"), path("small"), "-o", path("x.map")});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(last_line(both.errors), HasSubstr("one size"));
}

TEST_F(MapCommands, WhatHasNoTextureIsRefused) {
  film("blank", walking_camera("scene: {background: 0.5}\n"));
  const Result result =
      map_command({"build", path("blank"), "-o", path("blank.map"), "--focal-length", "800"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(last_line(result.errors), HasSubstr("texture"));
  EXPECT_FALSE(fs::exists(path("blank.map")));
}

TEST_F(MapCommands, WhatIsNoMapIsRefused) {
  directory_->write("no.map", "this is no map");
  for (const char* command : {"info", "check"}) {
    const Result result = map_command({command, path("no.map")});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(last_line(result.errors), HasSubstr("no.map"));
  }
  EXPECT_EQ(map_command({"info", path("none.map")}).exit_code, 2);
  EXPECT_EQ(map_command({}).exit_code, 2);
}

}  // namespace
}  // namespace alidade
