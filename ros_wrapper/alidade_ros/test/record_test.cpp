#include "alidade_ros/record.h"

#include <gtest/gtest.h>

namespace alidade_ros {
namespace {

const char* const kRecord =
    R"({"frame":17,"time_s":9.5,"receive_time_s":9.75,"mode":"OE","status":"ok","calibrated":true,
        "calibration":"watching","needs":null,"pan_rad":0.1,"tilt_rad":0.2,"pan_rate_rad_s":0.3,
        "tilt_rate_rad_s":0.4,"pan_acceleration_rad_s2":0.5,"tilt_acceleration_rad_s2":0.6,
        "q_base_from_camera":[0.5,0.5,0.5,0.5],"orientation_covariance_rad2":[1,2,3,4,5,6,7,8,9],
        "reference_row":0,"landmarks":40,"residual_px":0.08,"line_delay_s":1e-5,"focal_length_px":2600,
        "aspect":1,"radial_distortion":13.9,"latency_s":0.002,"telemetry_age_s":-0.01,"zoom":3000,"zoom_rate_per_s":0.25,"zoom_rate_sigma_per_s":0.01,"focal_length_sigma_px":1.5,"time_sigma_s":0.02,"centre_offset_px":[3,-4],"localized":{"age_s":2.5,"sigma_rad":1e-5},"of_a_newer_edge":[]})";

TEST(Record, IsReadWhole) {
  Record record;
  std::string error;
  ASSERT_TRUE(parse_record(kRecord, &record, &error)) << error;
  EXPECT_EQ(record.frame, 17);
  EXPECT_EQ(record.time_s, 9.5);
  EXPECT_EQ(record.mode, "OE");
  EXPECT_EQ(record.needs, "");
  ASSERT_TRUE(record.orientation);
  EXPECT_EQ(record.orientation->tilt_acceleration_rad_s2, 0.6);
  EXPECT_EQ(record.orientation->orientation_covariance_rad2[5], 6);
  EXPECT_EQ(record.residual_px, 0.08);
  EXPECT_EQ(record.telemetry_age_s, -0.01);
  EXPECT_EQ(record.time_sigma_s, 0.02);
  EXPECT_EQ(record.zoom, 3000);
  EXPECT_EQ(record.zoom_rate_per_s, 0.25);
  EXPECT_EQ(record.zoom_rate_sigma_per_s, 0.01);
  EXPECT_EQ(record.focal_length_sigma_px, 1.5);
  EXPECT_EQ(record.radial_distortion, 13.9);
  EXPECT_EQ(record.centre_offset_px[1], -4);
  ASSERT_TRUE(record.localized);
  EXPECT_EQ(record.localized->age_s, 2.5);
  EXPECT_EQ(record.localized->sigma_rad, 1e-5);
}

TEST(Record, MayBeOfNoFrame) {
  Record record;
  std::string error;
  ASSERT_TRUE(parse_record(R"({"frame":null,"time_s":null,"receive_time_s":1,"mode":"none",
      "status":"video lost","calibrated":false,"calibration":"collecting","needs":"pan more",
      "pan_rad":null,"landmarks":0,"line_delay_s":0,"focal_length_px":2600,"aspect":1,
      "radial_distortion":0,"latency_s":null})",
                           &record, &error))
      << error;
  EXPECT_FALSE(record.frame);
  EXPECT_FALSE(record.orientation);
  EXPECT_FALSE(record.telemetry_age_s) << "as an older edge, which does not tell it";
  EXPECT_FALSE(record.time_sigma_s);
  EXPECT_FALSE(record.zoom);
  EXPECT_FALSE(record.zoom_rate_per_s);
  EXPECT_FALSE(record.localized);
  EXPECT_EQ(record.centre_offset_px[0], 0);
  EXPECT_EQ(record.needs, "pan more");
}

TEST(Record, ThatCannotBeUnderstoodIsOneLineOfError) {
  for (const char* text : {"", "{", "[]", "{\"mode\":\"OE\"}", "{\"receive_time_s\":\"soon\"}",
                           R"({"receive_time_s":1,"mode":7})"}) {
    Record record;
    std::string error;
    EXPECT_FALSE(parse_record(text, &record, &error)) << text;
    EXPECT_NE(error.find("record cannot be understood"), std::string::npos);
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

TEST(Record, TheGreetingTellsTheRunAndTheClock) {
  Hello hello;
  std::string error;
  ASSERT_TRUE(parse_hello(R"({"alidade":"0.1.0","start":"abc","monotonic_s":10,"wall_s":1.7e9,
                              "bracket_s":1e-6})",
                          &hello, &error))
      << error;
  EXPECT_EQ(hello.start, "abc");
  EXPECT_EQ(hello.clock.wall_s, 1.7e9);
}

TEST(Record, StatusTellsTheSizeOnceThereIsAFrame) {
  std::optional<ImageSize> size;
  std::string error;
  ASSERT_TRUE(parse_image_size(R"({"image":{"width":160,"height":96}})", &size, &error)) << error;
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width, 160);
  EXPECT_EQ(size->height, 96);
  ASSERT_TRUE(parse_image_size(R"({"image":{"width":null,"height":null}})", &size, &error));
  EXPECT_FALSE(size);
  EXPECT_FALSE(parse_image_size("{}", &size, &error));
}

TEST(Record, CalibrationHasValuesAndCovariance) {
  CalibrationValues values;
  std::string error;
  ASSERT_TRUE(parse_calibration(
      R"({"image":{"width":160,"height":96},"focal_length":{"value":2600,"sigma":1},
          "pan_axis":{"value":[0.01,0,0.99995],"sigma":[1e-5,1e-5]},"zoom":12,
          "covariance":{"names":["focal_length","line_delay"],"matrix":[[1,2],[3,4]]}})",
      &values, &error))
      << error;
  EXPECT_EQ(values.height, 96);
  EXPECT_EQ(values.pan_axis[0], 0.01);
  EXPECT_EQ(values.tilt_axis[1], 1);
  EXPECT_EQ(values.zoom, 12);
  EXPECT_EQ(values.names.size(), 2U);
  EXPECT_EQ(values.covariance, (std::vector<double>{1, 2, 3, 4}));
}

TEST(Record, CalibrationHasTheZoomsNodes) {
  CalibrationValues values;
  std::string error;
  ASSERT_TRUE(parse_calibration(
      R"({"image":{"width":160,"height":96},"focal_length":{"value":2600,"sigma":1},
          "centre_offset":{"value":[1,-2],"sigma":[0.1,0.2]},
          "zoom_curve":{"repeatability":0.002,"samples":{},"nodes":[
            {"reading":100,"focal_length":{"value":1300,"sigma":0.5},"radial_distortion":{"value":3,"sigma":0.25}},
            {"reading":900,"focal_length":{"value":2600,"sigma":1},"radial_distortion":{"value":13,"sigma":0.5},
             "centre_offset":{"value":[3,4],"sigma":[0.75,1.5]}}]}})",
      &values, &error))
      << error;
  EXPECT_EQ(values.centre_offset, (std::array<double, 2>{1, -2}));
  EXPECT_EQ(values.zoom_repeatability, 0.002);
  ASSERT_EQ(values.zoom_nodes.size(), 2U);
  EXPECT_EQ(values.zoom_nodes[0].reading, 100);
  EXPECT_EQ(values.zoom_nodes[0].focal_length, 1300);
  EXPECT_EQ(values.zoom_nodes[0].focal_length_sigma, 0.5);
  EXPECT_EQ(values.zoom_nodes[0].centre_offset_sigma[1], 0);
  EXPECT_EQ(values.zoom_nodes[1].radial_distortion, 13);
  EXPECT_EQ(values.zoom_nodes[1].radial_distortion_sigma, 0.5);
  EXPECT_EQ(values.zoom_nodes[1].centre_offset[1], 4);
  EXPECT_EQ(values.zoom_nodes[1].centre_offset_sigma[0], 0.75);
}

}  // namespace
}  // namespace alidade_ros
