// Requests for directions and pixels: what is refused, and that answers are true, inverse to each other, and as
// uncertain as they say.

#include "edge_app/output/pixel_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "core/model/direction.h"
#include "edge_app/record/frame_geometry.h"
#include "test/support/parameter_changes.h"

namespace alidade {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr double kTime = 1234.5;

Calibration calibration() {
  Calibration out;
  out.camera = {2667.5, 1.001, {13.9}, 1280, 720};
  out.line_delay = -30e-6;
  out.mechanics.pan_axis = Vector3<double>(0.012, 0.003, 1).normalized();
  out.mechanics.tilt_axis = Vector3<double>(-0.004, 1, 0.014).normalized();
  out.mechanics.pan_scale = 1.01;
  out.mechanics.tilt_scale = 0.99;
  out.clock_offset = -84.4e-3;
  out.zoom = 7;
  // Every parameter moves the image by some hundredths of a pixel, and two of them together.
  const test::ParameterVector sigma = 0.03 * test::parameter_steps(out.camera);
  ParameterCovariance<double> correlation = ParameterCovariance<double>::Identity();
  correlation(index(Parameter::kLineDelay), index(Parameter::kClockOffset)) = -0.8;
  correlation(index(Parameter::kClockOffset), index(Parameter::kLineDelay)) = -0.8;
  out.covariance = sigma.asDiagonal() * correlation * sigma.asDiagonal();
  return out;
}

FrameOrientation frame() {
  const FrameMotion<double> motion{{0.7, -0.2}, {0.3, -0.4}, 360, {2, -5}};
  MotionCovariance covariance = MotionCovariance::Zero();
  covariance.diagonal() << 4e-10, 1e-10, 1e-6, 4e-6, 1e-3, 1e-3;
  covariance(0, 2) = covariance(2, 0) = 1e-8;
  FrameOrientation out;
  EXPECT_TRUE(make_frame_orientation(calibration(), kTime, OrientationMode::kOe, 100, motion,
                                     covariance,
                                     telemetry_sensitivity(calibration().mechanics, motion), &out));
  return out;
}

OrientationRecord record() {
  OrientationRecord out;
  out.frame = 7;
  out.time_s = kTime;
  out.mode = RecordMode::kOe;
  out.calibrated = true;
  out.camera = pack(calibration());
  out.orientation = OrientationRecord::Orientation{};
  out.orientation->geometry = pack(frame());
  return out;
}

DirectionQuery direction_query(const std::string& body) {
  DirectionQuery query;
  std::string error;
  EXPECT_TRUE(parse_direction_query(body, &query, &error)) << error;
  return query;
}

json directions_of(const std::string& body) {
  return json::parse(direction_answer(record(), direction_query(body)));
}

json directions_on(const PlaneEstimate& plane, const std::string& body) {
  return json::parse(direction_answer(record(), direction_query(body), &plane));
}

json pixels_of(const std::string& body) {
  PixelQuery query;
  std::string error;
  EXPECT_TRUE(parse_pixel_query(body, &query, &error)) << error;
  return json::parse(pixel_answer(record(), query));
}

template <int n>
Eigen::Matrix<double, n, 1> vector_of(const json& array) {
  Eigen::Matrix<double, n, 1> out;
  for (int i = 0; i < n; ++i) out[i] = array.at(static_cast<std::size_t>(i)).get<double>();
  return out;
}

Matrix2<double> matrix_of(const json& rows) {
  Matrix2<double> out;
  out << vector_of<2>(rows.at(0)).transpose(), vector_of<2>(rows.at(1)).transpose();
  return out;
}

// The place is that of the plane's own geometry, its covariance that of the direction and the plane.
TEST(DirectionQuery, WithAPlaneADirectionHasItsPlaceOnIt) {
  PlaneEstimate estimate;
  // The frame looks down by 0.2 rad at the middle; the base faces east.
  estimate.plane.R_base_from_world = R_base_from_world_of(kPi / 2, 0.01, -0.02);
  estimate.plane.position = {3, 4, 20};
  estimate.plane.covariance.diagonal() << 1e-8, 1e-8, 1e-6, 0.01, 0.01, 0.0025;
  const std::string body = R"({"pixels": [[100, 600], [640, 360]], "pixel_sigma_px": 0.5})";
  const json answer = directions_on(estimate, body)["directions"];
  for (const json& item : answer) {
    PlanePoint expected;
    ASSERT_EQ(plane_point(estimate.plane, vector_of<3>(item["direction"]),
                          matrix_of(item["covariance"]), {}, &expected),
              PlaneStatus::kOk);
    const json& plane = item["plane"];
    EXPECT_LT((vector_of<2>(plane["position_m"]) - expected.position).norm(), 1e-9);
    EXPECT_LT((matrix_of(plane["covariance_m2"]) - expected.covariance).norm(), 1e-12);
    EXPECT_GT(plane["position_m"][0].get<double>(), 20);  // east of the camera
    EXPECT_NEAR(plane["distance_m"].get<double>(), expected.distance, 1e-9);
    EXPECT_FALSE(plane.contains("latitude_deg"));
  }
  EXPECT_FALSE(directions_of(body)["directions"][0].contains("plane"));
  estimate.origin = GeodeticPosition{0.8, 0.2, 100};
  const json on_earth = directions_on(estimate, body)["directions"][0]["plane"];
  EXPECT_NEAR(on_earth["latitude_deg"].get<double>(), 0.8 * 180 / kPi, 0.01);
  // A base that looks up sees no ground.
  estimate.plane.R_base_from_world = R_base_from_world_of(0, 0.6, 0);
  EXPECT_EQ(directions_on(estimate, body)["directions"][1]["plane"]["error"], "above the horizon");
}

TEST(DirectionQuery, OfAThingAtAKnownDistanceIsToldFromTheAxes) {
  const std::string pixels = R"({"pixels": [[100, 600], [640, 360]])";
  const json far = directions_of(pixels + "}")["directions"];
  const json near = directions_of(pixels + R"(, "distance_m": 10})")["directions"];
  Pupil pupil;
  pupil.place_m = {0.03, 0.02, 0.06};
  pupil.sigma_m.setZero();
  const json stated = json::parse(direction_answer(
      record(), direction_query(pixels + R"(, "distance_m": 10})"), nullptr, pupil))["directions"];
  for (std::size_t i = 0; i < far.size(); ++i) {
    const Vector3<double> seen = vector_of<3>(far[i]["direction"]);
    // The usual pupil is in the middle, and uncertain.
    EXPECT_LT((vector_of<3>(near[i]["direction"]) - seen).norm(), 1e-12);
    EXPECT_NEAR(matrix_of(near[i]["covariance"]).trace(),
                matrix_of(far[i]["covariance"]).trace() + 2 * std::pow(0.05 / 10, 2), 1e-9);
    // A stated one is not: pixel i looks along t = (r d - R o), R near that of row 0.
    const Vector3<double> place = 10 * vector_of<3>(stated[i]["direction"]);
    const Vector3<double> from_pupil = place - frame().R_base_from_camera * pupil.place_m;
    EXPECT_LT((from_pupil.normalized() - seen).norm(), 1e-3 * 0.07 / 10 * 50);
    EXPECT_GT((vector_of<3>(stated[i]["direction"]) - seen).norm(), 0.5 * 0.03 / 10);
  }
}

// A calibration of the scene already has what the pupil does at the scene's distance.
TEST(DirectionQuery, OfAThingAtTheScenesDistanceStaysWhereTheSceneIs) {
  const std::string body = R"({"pixels": [[100, 600], [1200, 90]], "distance_m": 30})";
  Pupil pupil;
  pupil.place_m = {0, 0, 0.06};
  const json far = directions_of(R"({"pixels": [[100, 600], [1200, 90]]})")["directions"];
  const auto at = [&](double nearness) {
    return json::parse(
        direction_answer(record(), direction_query(body), nullptr, pupil, nearness))["directions"];
  };
  const json of_scene = at(0.06 / 30);
  const json of_far_things = at(0);
  for (std::size_t i = 0; i < far.size(); ++i) {
    const Vector3<double> plain = vector_of<3>(far[i]["direction"]);
    const double moved = (vector_of<3>(of_far_things[i]["direction"]) - plain).norm();
    EXPECT_GT(moved, 1e-6);
    EXPECT_LT((vector_of<3>(of_scene[i]["direction"]) - plain).norm(), 0.05 * moved);
  }
}

TEST(FrameGeometry, PackedAndUnpackedIsTheSame) {
  const FrameOrientation before = frame();
  const FrameOrientation after = unpack(pack(before), pack(before.calibration));
  EXPECT_EQ(after.calibration.zoom, before.calibration.zoom);
  EXPECT_EQ(after.calibration.covariance, before.calibration.covariance);
  EXPECT_EQ(after.calibration.camera.width, 1280);
  EXPECT_EQ(after.calibration.camera.height, 720);
  EXPECT_EQ(after.motion_covariance, before.motion_covariance);
  EXPECT_EQ(after.motion_sensitivity, before.motion_sensitivity);
  const Vector2<double> u(100, 700);
  Vector3<double> d_before;
  Vector3<double> d_after;
  Matrix2<double> cov_before;
  Matrix2<double> cov_after;
  ASSERT_EQ(before.direction(u, &d_before, &cov_before), ProjectionStatus::kOk);
  ASSERT_EQ(after.direction(u, &d_after, &cov_after), ProjectionStatus::kOk);
  EXPECT_EQ(d_after, d_before);
  EXPECT_EQ(cov_after, cov_before);
}

TEST(PixelQuery, AnswersAtThePixelsOwnRowTime) {
  const json answer = directions_of(R"({"pixels":[[640,360],[3,0],[3,720]]})");
  EXPECT_EQ(answer["frame"], 7);
  EXPECT_EQ(answer["time_s"], kTime);
  EXPECT_EQ(answer["mode"], "OE");
  EXPECT_EQ(answer["calibrated"], true);
  const json& directions = answer["directions"];
  ASSERT_EQ(directions.size(), 3u);
  for (const json& one : directions) {
    const Vector2<double> u = vector_of<2>(one["pixel"]);
    Vector3<double> d;
    ASSERT_EQ(frame().direction(u, &d), ProjectionStatus::kOk);
    EXPECT_LT((vector_of<3>(one["direction"]) - d).norm(), 1e-15);
    EXPECT_DOUBLE_EQ(one["time_s"].get<double>(), kTime - 30e-6 * u.y());
  }
  // Between the first and the last row the head has turned.
  const double turned = direction_minus<double>(vector_of<3>(directions[2]["direction"]),
                                                vector_of<3>(directions[1]["direction"]))
                            .norm();
  EXPECT_GT(std::abs(turned - 720 / 2667.5), 0.3 * 720 * 30e-6);
}

TEST(PixelQuery, AzimuthIsPositiveToTheRightAndElevationUpwards) {
  const json answer = directions_of(R"({"pixels":[[640,360]]})");
  const json& one = answer["directions"][0];
  const Vector3<double> d = vector_of<3>(one["direction"]);
  const double azimuth = one["azimuth_rad"];
  const double elevation = one["elevation_rad"];
  EXPECT_NEAR(azimuth, 0.7, 0.05);     // pan
  EXPECT_NEAR(elevation, -0.2, 0.05);  // tilt
  EXPECT_LT((Vector3<double>(std::cos(elevation) * std::cos(azimuth),
                             std::cos(elevation) * std::sin(azimuth), -std::sin(elevation)) -
             d)
                .norm(),
            1e-15);
}

TEST(PixelQuery, DirectionAndPixelAreInverse) {
  int compared = 0;
  for (double u = 0; u <= 1280; u += 80) {
    for (double v = 0; v <= 720; v += 72) {
      const json to = directions_of(json{{"pixels", {{u, v}}}}.dump())["directions"][0];
      const json from =
          pixels_of(json{{"directions", {to["direction"]}}, {"frame", 7}}.dump())["pixels"][0];
      EXPECT_TRUE(from["inside"].is_boolean());
      EXPECT_LT((vector_of<2>(from["pixel"]) - Vector2<double>(u, v)).norm(), 1e-6);
      EXPECT_NEAR(from["time_s"].get<double>(), to["time_s"].get<double>(), 1e-9);
      const json again =
          directions_of(json{{"pixels",
                              {{std::min(std::max(from["pixel"][0].get<double>(), 0.0), 1280.0),
                                std::min(std::max(from["pixel"][1].get<double>(), 0.0), 720.0)}}}}
                            .dump())["directions"][0];
      EXPECT_LT((vector_of<3>(again["direction"]) - vector_of<3>(to["direction"])).norm(), 1e-9);
      ++compared;
    }
  }
  EXPECT_EQ(compared, 17 * 11);
}

// 4000 draws of calibration, motion and pixel: an entry of their covariance has the standard deviation
// sqrt((C_ii C_jj + C_ij^2) / 4000), and five of them are allowed.
class Draws {
 public:
  template <typename Sample>
  Matrix2<double> covariance(const Sample& sample) {
    Matrix2<double> sum = Matrix2<double>::Zero();
    for (int i = 0; i < kDraws; ++i) {
      const Vector2<double> x = sample(*this);
      sum += x * x.transpose();
    }
    return sum / kDraws;
  }

  static void expect_agreement(const Matrix2<double>& drawn, const Matrix2<double>& said) {
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        const double sigma =
            std::sqrt((said(i, i) * said(j, j) + said(i, j) * said(i, j)) / kDraws);
        EXPECT_NEAR(drawn(i, j), said(i, j), 5 * sigma) << i << " " << j;
      }
    }
  }

  // The frame as another calibration and other noise would have made it.
  FrameOrientation changed() {
    FrameOrientation out = frame();
    const test::ParameterVector e = calibration_root_ * normal<kParameterCount>();
    out.calibration = test::plus(out.calibration, e);
    const Matrix<double, 6, 1> x = motion_root_ * normal<6>() + out.motion_sensitivity * e;
    out.angle.pan += x[0];
    out.angle.tilt += x[1];
    out.rate.pan += x[2];
    out.rate.tilt += x[3];
    out.acceleration.pan += x[4];
    out.acceleration.tilt += x[5];
    return out;
  }

  template <int n>
  Matrix<double, n, 1> normal() {
    Matrix<double, n, 1> out;
    for (int i = 0; i < n; ++i) out[i] = distribution_(generator_);
    return out;
  }

 private:
  static constexpr int kDraws = 4000;
  std::mt19937_64 generator_{17};
  std::normal_distribution<double> distribution_;
  ParameterCovariance<double> calibration_root_ =
      Eigen::LLT<ParameterCovariance<double>>(calibration().covariance).matrixL();
  // At row 0 it is what it was at the middle row, moved: rounding may leave a pivot negative, so by LDLT.
  MotionCovariance motion_root_ = [] {
    const Eigen::LDLT<MotionCovariance> factor(frame().motion_covariance);
    MotionCovariance root = factor.matrixL();
    root = root * factor.vectorD().cwiseMax(0).cwiseSqrt().asDiagonal();
    return MotionCovariance(factor.transpositionsP().transpose() * root);
  }();
};

TEST(PixelQuery, ADirectionIsAsUncertainAsItsCovarianceSays) {
  for (const Vector2<double>& u : {Vector2<double>(30, 20), Vector2<double>(1250, 700)}) {
    for (const double sigma_px : {0.0, 0.2}) {
      const json one = directions_of(
          json{{"pixels", {{u.x(), u.y()}}}, {"pixel_sigma_px", sigma_px}}.dump())["directions"][0];
      const Vector3<double> d = vector_of<3>(one["direction"]);
      const Matrix2<double> said = matrix_of(one["covariance"]);
      Matrix<double, 3, 2> basis;
      basis << vector_of<3>(one["basis"][0]), vector_of<3>(one["basis"][1]);
      Draws draws;
      Draws::expect_agreement(draws.covariance([&](Draws& draw) {
        const FrameOrientation other = draw.changed();
        Vector3<double> moved = Vector3<double>::Zero();
        EXPECT_EQ(other.direction(u + sigma_px * draw.normal<2>(), &moved), ProjectionStatus::kOk);
        return Vector2<double>(basis.transpose() * (moved - d));
      }),
                              said);
      const double larger =
          said.trace() / 2 +
          std::sqrt(std::pow((said(0, 0) - said(1, 1)) / 2, 2) + std::pow(said(0, 1), 2));
      EXPECT_NEAR(one["sigma_rad"].get<double>(), std::sqrt(larger), 1e-9 * std::sqrt(larger));
    }
  }
}

TEST(PixelQuery, APixelIsAsUncertainAsItsCovarianceSays) {
  Vector3<double> d;
  ASSERT_EQ(frame().direction({1250, 700}, &d), ProjectionStatus::kOk);
  const json one = pixels_of(json{{"directions", {{d.x(), d.y(), d.z()}}}}.dump())["pixels"][0];
  const Vector2<double> u = vector_of<2>(one["pixel"]);
  Draws draws;
  Draws::expect_agreement(draws.covariance([&](Draws& draw) {
    const FrameOrientation other = draw.changed();
    Vector2<double> moved = Vector2<double>::Zero();
    EXPECT_EQ(other.pixel(d, &moved), ProjectionStatus::kOk);
    return Vector2<double>(moved - u);
  }),
                          matrix_of(one["covariance_px2"]));
}

TEST(PixelQuery, SaysWhichPixelOrDirectionHasNoAnswer) {
  const json directions =
      directions_of(R"({"pixels":[[-0.001,1],[1,720.001],[1,1],[1e300,1]]})")["directions"];
  EXPECT_EQ(directions[0]["error"], "outside the image");
  EXPECT_EQ(directions[1]["error"], "outside the image");
  EXPECT_FALSE(directions[2].contains("error"));
  EXPECT_EQ(directions[3]["error"], "outside the image");
  EXPECT_FALSE(directions[3].contains("direction"));
  const json pixels = pixels_of(R"({"directions":[[-1,0,0],[0,0,1e-300],[0.7,0.7,0]]})")["pixels"];
  EXPECT_EQ(pixels[0]["error"], "behind the camera");
  EXPECT_TRUE(pixels[1].contains("error"));
  EXPECT_TRUE(pixels[2].contains("pixel"));
}

TEST(PixelQuery, ADirectionMayHaveAnyLength) {
  const json answer = pixels_of(
      R"({"directions":[[0.75,0.65,0.2],[7.5e300,6.5e300,2e300],[7.5e-300,6.5e-300,2e-300]]})");
  for (const json& one : answer["pixels"]) {
    ASSERT_TRUE(one.contains("pixel")) << one;
    EXPECT_LT((vector_of<2>(one["pixel"]) - vector_of<2>(answer["pixels"][0]["pixel"])).norm(),
              1e-9);
    EXPECT_NEAR(vector_of<3>(one["direction"]).norm(), 1, 1e-15);
  }
}

TEST(PixelQuery, ReadsWhichFrameIsMeant) {
  EXPECT_FALSE(direction_query(R"({"pixels":[[1,2]]})").which.frame);
  EXPECT_FALSE(direction_query(R"({"pixels":[[1,2]]})").which.time_s);
  EXPECT_EQ(direction_query(R"({"frame":0,"pixels":[[1,2]]})").which.frame, 0);
  EXPECT_EQ(direction_query(R"({"frame":0,"pixels":[[1,2]]})").which.frame, 0);
  EXPECT_EQ(direction_query(R"({"time_s":12,"pixels":[[1,2]]})").which.time_s, 12.0);
}

struct Refused {
  const char* name;
  std::string body;
  const char* error;
};

class RefusedQuery : public ::testing::TestWithParam<Refused> {};

TEST_P(RefusedQuery, IsToldWhy) {
  DirectionQuery directions;
  PixelQuery pixels;
  std::string error;
  EXPECT_FALSE(parse_direction_query(GetParam().body, &directions, &error));
  EXPECT_THAT(error, HasSubstr(GetParam().error));
  EXPECT_EQ(error.find('\n'), std::string::npos);
  EXPECT_FALSE(parse_pixel_query(GetParam().body, &pixels, &error));
}

std::string many(std::size_t count) {
  std::string body = "{\"pixels\":[[1,2]";
  for (std::size_t i = 1; i < count; ++i) body += ",[1,2]";
  return body + "]}";
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedQuery,
    ::testing::Values(
        Refused{"Empty", "", "must be a JSON object"}, Refused{"Text", "pixels", "JSON object"},
        Refused{"Array", "[[1,2]]", "JSON object"}, Refused{"Null", "null", "JSON object"},
        Refused{"Unfinished", R"({"pixels":[[1,2])", "JSON object"},
        Refused{"TwoObjects", R"({"pixels":[[1,2]]}{})", "JSON object"},
        Refused{"NotUtf8", "{\"\xff\":1}", "JSON object"},
        Refused{"Nan", R"({"pixels":[[NaN,2]]})", "JSON object"},
        Refused{"Infinite", R"({"pixels":[[1e999,2]]})", "JSON object"},
        Refused{"Deep", std::string(60000, '['), "nested too deeply"},
        Refused{"DeepObjects", R"({"a":{"a":{"a":{"a":1}}}})", "nested too deeply"},
        Refused{"UnknownKey", R"({"pixel":[[1,2]]})", "unknown key; known here: "},
        Refused{"NoPixels", R"({"frame":1})", "pixels must be an array of 1 to 1000"},
        Refused{"NoneAtAll", R"({"pixels":[]})", "array of 1 to 1000"},
        Refused{"TooMany", many(1001), "array of 1 to 1000"},
        Refused{"OneNumber", R"({"pixels":[[1,2],[1]]})", "item 1 is not"},
        Refused{"ThreeNumbers", R"({"pixels":[[1,2,3]]})", "item 0 is not"},
        Refused{"TextForANumber", R"({"pixels":[["1","2"]]})", "item 0 is not"},
        Refused{"TruthForANumber", R"({"pixels":[[true,false]]})", "item 0 is not"},
        Refused{"FlatPixels", R"({"pixels":[1,2]})", "item 0 is not"},
        Refused{"FrameAndTime", R"({"frame":1,"time_s":2,"pixels":[[1,2]]})", "exclude each other"},
        Refused{"FractionalFrame", R"({"frame":1.5,"pixels":[[1,2]]})", "frame must be an integer"},
        Refused{"HugeFrame", R"({"frame":9223372036854775808,"pixels":[[1,2]]})",
                "0 or more, below 2^63"},
        Refused{"NegativeFrame", R"({"frame":-5,"pixels":[[1,2]]})",
                "frame must be an integer, 0 or more"},
        Refused{"TextFrame", R"({"frame":"1","pixels":[[1,2]]})", "frame must be an integer"},
        Refused{"TextTime", R"({"time_s":"1","pixels":[[1,2]]})", "time_s must be a number"},
        Refused{"NegativeSigma", R"({"pixels":[[1,2]],"pixel_sigma_px":-1})", "from 0 to 1000"},
        Refused{"NearDistance", R"({"pixels":[[1,2]],"distance_m":0.5})", "from 1 to"},
        Refused{"TextDistance", R"({"pixels":[[1,2]],"distance_m":"far"})", "from 1 to"},
        Refused{"HugeSigma", R"({"pixels":[[1,2]],"pixel_sigma_px":1001})", "from 0 to 1000"}),
    [](const ::testing::TestParamInfo<Refused>& one) { return one.param.name; });

TEST(PixelQuery, AThousandPixelsAreAnswered) {
  EXPECT_EQ(directions_of(many(1000))["directions"].size(), 1000u);
}

TEST(PixelQuery, RefusesADirectionOfNoLength) {
  PixelQuery query;
  std::string error;
  EXPECT_FALSE(parse_pixel_query(R"({"directions":[[1,0,0],[0,0,0]]})", &query, &error));
  EXPECT_EQ(error, "directions: a direction must not be zero");
}

}  // namespace
}  // namespace alidade
