// `alidade plane fit` as a person meets it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "core/ground/plane_fit.h"
#include "edge_app/commands/plane.h"
#include "edge_app/storage/plane_file.h"
#include "test/edge_app/commands/alidade_command.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

namespace fs = std::filesystem;

// A base at height 10 that stands level and faces north, above the origin.
constexpr const char* kYard = R"(format: 1
height: {height_m: 10, sigma_m: 0.05}
level: {sigma_deg: 0.1}
points:
  - {name: kerb, direction: [30, 0, 10], sigma_rad: 2e-4, x_m: 0, y_m: 30, sigma_m: 0.02}
  - {name: drain, direction: [20, 15, 10], sigma_rad: 2e-4, x_m: 15, y_m: 20, sigma_m: 0.02}
  - {name: pole, direction: [40, -20, 6], sigma_rad: 2e-4, x_m: -20, y_m: 40, z_m: 4, sigma_m: 0.02}
)";

class PlaneCommand : public testing::Test {
 protected:
  std::string write(const std::string& text, const std::string& name = "yard.yaml") const {
    const fs::path path = fs::path(directory_.path()) / name;
    std::ofstream(path) << text;
    return path.string();
  }
  [[nodiscard]] std::string in_directory(const std::string& name) const {
    return (fs::path(directory_.path()) / name).string();
  }
  static std::string changed(const std::string& old, const std::string& by) {
    std::string text = kYard;
    return text.replace(text.find(old), old.size(), by);
  }

 private:
  TemporaryDirectory directory_;
};

TEST_F(PlaneCommand, WritesThePlaneBesideTheDataAndTellsHowEachFits) {
  const Result result = alidade({"plane", "fit", write(kYard)});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("heading"));
  EXPECT_THAT(result.output, ContainsRegex("height +10\\.00+ ± 0\\.0[0-9]+ m\n"));
  EXPECT_THAT(result.output, Not(HasSubstr("-0.0")));
  for (const char* name : {"height", "level", "kerb", "drain", "pole"})
    EXPECT_THAT(result.output, HasSubstr(name));
  PlaneEstimate plane;
  std::string error;
  ASSERT_TRUE(load_plane(in_directory("plane.yaml"), &plane, &error)) << error;
  EXPECT_LT((plane.plane.position - Vector3<double>(0, 0, 10)).norm(), 1e-6);
  EXPECT_GT(plane.plane.covariance(5, 5), 0);
}

TEST_F(PlaneCommand, GivesJsonAndWritesWhereItIsTold) {
  const std::string file = in_directory("here.yaml");
  const Result result = alidade({"plane", "fit", write(kYard), "-o", file, "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json json = nlohmann::json::parse(result.output);
  EXPECT_EQ(json["status"], "ok");
  EXPECT_NEAR(json["height"]["value"].get<double>(), 10, 1e-6);
  EXPECT_EQ(json["data"].size(), 5u);
  EXPECT_TRUE(fs::exists(file));
  EXPECT_FALSE(fs::exists(in_directory("plane.yaml")));
}

TEST_F(PlaneCommand, NamesWhatDoesNotFitAndWritesNothing) {
  const Result result =
      alidade({"plane", "fit", write(changed("x_m: 15, y_m: 20", "x_m: 15, y_m: 22"))});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, HasSubstr("<- does not fit"));
  EXPECT_THAT(last_line(result.errors), HasSubstr("drain does not fit"));
  EXPECT_FALSE(fs::exists(in_directory("plane.yaml")));
}

TEST_F(PlaneCommand, RefusesWhatIsNotDeterminedWithWhatWouldHelp) {
  const Result result =
      alidade({"plane", "fit",
               write("format: 1\nheight: {height_m: 10, sigma_m: 0.1}\nhorizon:\n"
                     "  - {name: sea, direction: [1, 0, 0], sigma_rad: 1e-4}\n")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.output, IsEmpty());
  EXPECT_THAT(last_line(result.errors), HasSubstr("tilt is not determined: give the base's level"));
}

// As the status page sends it: height and level are enough, and one point more takes nothing away.
TEST_F(PlaneCommand, TakesHeightAndLevelAlsoWithOnePointAndWithoutAny) {
  const std::string known =
      "format: 1\nheight: {height_m: 10, sigma_m: 0.05}\nlevel: {sigma_deg: 0.1}\n";
  for (const char* points :
       {"points: []\n",
        "points: [{name: kerb, direction: [30, 0, 10], sigma_rad: 2e-4, x_m: 100, "
        "y_m: 30, sigma_m: 0.02}]\n"}) {
    const Result result = alidade({"plane", "fit", write(known + points)});
    EXPECT_EQ(result.exit_code, 0) << points << result.errors;
    EXPECT_THAT(result.output, HasSubstr("the direction of north is not given"));
    EXPECT_TRUE(fs::exists(in_directory("plane.yaml")));
  }
  PlaneEstimate plane;
  std::string error;
  ASSERT_TRUE(load_plane(in_directory("plane.yaml"), &plane, &error)) << error;
  EXPECT_NEAR(plane.plane.position.x(), 100, 0.01);
  EXPECT_NEAR(plane.plane.position.z(), 10, 1e-6);
  // Of the earth a place has a north, which nothing tells here.
  const Result north = alidade(
      {"plane", "fit",
       write(known +
             "origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}\npoints: [{name: kerb, "
             "direction: [30, 0, 10], sigma_rad: 2e-4, latitude_deg: 48, longitude_deg: "
             "11, height_m: 500, sigma_m: 0.02}]\n")});
  EXPECT_EQ(north.exit_code, 1);
  EXPECT_THAT(last_line(north.errors),
              HasSubstr("heading and place are not determined: give a heading"));
}

TEST_F(PlaneCommand, ASlipIsBadUsageWithFileAndLine) {
  const std::string file = write(changed("sigma_m: 0.05", "sigma_mm: 50"));
  const Result result = alidade({"plane", "fit", file});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(last_line(result.errors), StartsWith("alidade: " + file + ":2: "));
  EXPECT_EQ(alidade({"plane", "fit", in_directory("none.yaml")}).exit_code, 2);
  EXPECT_EQ(alidade({"plane", "fold", file}).exit_code, 2);
  EXPECT_EQ(alidade({"plane", "fit"}).exit_code, 2);
  // The data stay what they are.
  const Result onto = alidade({"plane", "fit", write(kYard, "plane.yaml")});
  EXPECT_EQ(onto.exit_code, 2);
  EXPECT_THAT(last_line(onto.errors), HasSubstr("is the data file itself"));
}

// As kYard.
nlohmann::json yard() {
  const auto point = [](const char* name, double forward, double right, double down, double z) {
    return nlohmann::json{{"name", name},   {"direction", {forward, right, down}},
                          {"x_m", right},   {"y_m", forward},
                          {"z_m", z},       {"sigma_rad", 2e-4},
                          {"sigma_m", 0.02}};
  };
  return {{"format", 1},
          {"height", {{"height_m", 10}, {"sigma_m", 0.05}}},
          {"points",
           {point("kerb", 30, 0, 10, 0), point("drain \u00e9", 20, 15, 10, 0),
            point("pole", 40, -20, 6, 4)}}};
}

nlohmann::json fitted(const nlohmann::json& data) {
  std::string answer;
  std::string error;
  EXPECT_TRUE(answer_plane_fit(data.dump(), &answer, &error)) << error;
  return nlohmann::json::parse(answer);
}

TEST(PlaneFitRequest, AnswersWithTheFileThatRunTakes) {
  const nlohmann::json fit = fitted(yard());
  EXPECT_EQ(fit["status"], "ok");
  EXPECT_EQ(fit["message"], "");
  EXPECT_NEAR(fit["height"]["value"].get<double>(), 10, 0.1);
  EXPECT_LT(fit["height"]["sigma"].get<double>(), 0.05);
  ASSERT_EQ(fit["data"].size(), 4U);
  EXPECT_EQ(fit["data"][2]["name"], "drain \u00e9");
  PlaneEstimate plane;
  std::string error;
  ASSERT_TRUE(parse_plane(fit["plane_yaml"].get<std::string>(), "plane.yaml", &plane, &error))
      << error;
  EXPECT_NEAR(plane.plane.position.z(), fit["height"]["value"].get<double>(), 1e-9);
}

TEST(PlaneFitRequest, SaysWhichPointIsWrongAndWhatIsMissing) {
  nlohmann::json data = yard();
  data["points"][1]["x_m"] = 18;
  const nlohmann::json wrong = fitted(data);
  EXPECT_EQ(wrong["status"], to_string(PlaneFitStatus::kMisfit));
  EXPECT_THAT(wrong["message"].get<std::string>(), HasSubstr("drain"));
  EXPECT_TRUE(wrong["plane_yaml"].is_null());
  EXPECT_GT(wrong["data"][2]["misfit"].get<double>(), 5);
  data = yard();
  data["points"].erase(2);
  data["points"].erase(1);
  const nlohmann::json open = fitted(data);
  EXPECT_NE(open["status"], "ok");
  EXPECT_NE(open["message"], "");
  EXPECT_TRUE(open["plane_yaml"].is_null());
}

TEST(PlaneFitRequest, RefusesInALineWhatItCannotRead) {
  const auto error_of = [](const std::string& body) {
    std::string answer;
    std::string error;
    EXPECT_FALSE(answer_plane_fit(body, &answer, &error)) << body;
    EXPECT_THAT(error, ::testing::Not(HasSubstr("\n")));
    return error;
  };
  EXPECT_THAT(error_of("points: []"), ::testing::Not(IsEmpty()));
  EXPECT_THAT(error_of(R"({"format":1,"houses":[]})"), HasSubstr("unknown key"));
  EXPECT_THAT(error_of(R"({"format":1,"points":[{"name":"a","direction":[1,0,0]}]})"),
              HasSubstr("x_m"));
  EXPECT_THAT(
      error_of(R"({"format":1,"points":)" + std::string(200, '[') + std::string(200, ']') + "}"),
      ::testing::Not(IsEmpty()));
  nlohmann::json many = yard();
  for (int i = 0; i < 100; ++i) {
    many["points"].push_back(many["points"][0]);
    many["points"].back()["name"] = std::to_string(i);
  }
  EXPECT_THAT(error_of(many.dump()), HasSubstr("expected at most 100"));
  // Each is an orientation more to estimate.
  nlohmann::json album = yard();
  album["image"] = {{"width", 1280}, {"height", 720}};
  const nlohmann::json record = {
      {"focal_length_px", 1000},
      {"focal_length_sigma_px", 1},
      {"aspect", 1},
      {"radial_distortion", 0},
      {"centre_offset_px", {0, 0}},
      {"line_delay_s", 0},
      {"pan_rad", 0},
      {"tilt_rad", 0},
      {"pan_rate_rad_s", 0},
      {"tilt_rate_rad_s", 0},
      {"pan_acceleration_rad_s2", 0},
      {"tilt_acceleration_rad_s2", 0},
      {"q_base_from_camera", {0.5, -0.5, 0.5, -0.5}},
      {"orientation_covariance_rad2", {1e-8, 0, 0, 0, 1e-8, 0, 0, 0, 1e-8}}};
  for (int i = 0; i < 9; ++i) {
    album["pictures"].push_back({{"name", std::to_string(i)}, {"record", record}});
  }
  EXPECT_THAT(error_of(album.dump()), HasSubstr("pictures: 9; expected at most 8"));
}

}  // namespace
}  // namespace alidade
