// The names, order and digits of the records are what other programs rely on.

#include "edge_app/record/record_format.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "edge_app/output/openapi.h"

namespace alidade {
namespace {

OrientationRecord full_record() {
  OrientationRecord record;
  record.frame = 7;
  record.time_s = 12345.678901234;
  record.time_sigma_s = 0.000244140625;
  record.receive_time_s = 12345.75;
  record.mode = RecordMode::kOe;
  record.calibrated = true;
  record.orientation =
      OrientationRecord::Orientation{0.5,
                                     -0.25,
                                     0.125,
                                     -0.0625,
                                     0.03125,
                                     -0.015625,
                                     {0.5, -0.5, 0.5, 0.5},
                                     {1e-5, 2e-5, 3e-5},
                                     {1e-10, 2e-12, 0, 2e-12, 4e-10, 0, 0, 0, 9e-10},
                                     {}};
  record.landmarks = 187;
  record.residual_px = 0.0625;
  record.camera.line_delay = -1.42e-5;
  record.calibration = {CalibrationActivity::kWatching, CalibrationNeed::kNothing};
  record.camera.focal_length = 32008;
  record.camera.radial_distortion = 55.4;
  record.camera.covariance[0] = 24 * 24;
  record.camera.centre_u = 3.5;
  record.camera.centre_v = -2;
  record.latency_s = 2.5e-5;
  record.telemetry_age_s = -0.03125;
  record.zoom = 3000;
  record.orientation->geometry.zoom_rate = -0.375;
  record.orientation->geometry.zoom_rate_sigma = 0.00390625;
  record.localized = {4.5, 1e-5, {5e-3, 0}};
  return record;
}

OrientationRecord record_without_frame() {
  OrientationRecord record;
  record.receive_time_s = 3.5;
  record.status = RecordStatus::kVideoLost;
  record.calibration = {CalibrationActivity::kCollecting, CalibrationNeed::kTilt};
  record.camera.focal_length = 1000;
  return record;
}

TEST(RecordFormat, WritesAllFieldsAsOneJsonLine) {
  EXPECT_EQ(
      json_line(full_record()),
      R"({"frame":7,"time_s":12345.678901234,"receive_time_s":12345.75,"mode":"OE","status":"ok",)"
      R"("calibrated":true,"calibration":"watching","needs":null,"pan_rad":0.5,"tilt_rad":-0.25,"pan_rate_rad_s":0.125,"tilt_rate_rad_s":-0.0625,)"
      R"("pan_acceleration_rad_s2":0.03125,"tilt_acceleration_rad_s2":-0.015625,)"
      R"("q_base_from_camera":[0.5,-0.5,0.5,0.5],"orientation_sigma_rad":[1e-05,2e-05,3e-05],)"
      R"("orientation_covariance_rad2":[1e-10,2e-12,0.0,2e-12,4e-10,0.0,0.0,0.0,9e-10],)"
      R"("reference_row":0.0,"landmarks":187,"residual_px":0.0625,)"
      R"("line_delay_s":-1.42e-05,"focal_length_px":32008.0,"focal_length_sigma_px":24.0,"aspect":1.0,"radial_distortion":55.4,"centre_offset_px":[3.5,-2.0],)"
      R"("latency_s":2.5e-05,"telemetry_age_s":-0.03125,"zoom":3000.0,"zoom_rate_per_s":-0.375,"zoom_rate_sigma_per_s":0.00390625,"localized":{"age_s":4.5,"sigma_rad":1e-05},"time_sigma_s":0.000244140625})"
      "\n");
}

TEST(RecordFormat, WritesNullForWhatARecordLacks) {
  EXPECT_EQ(
      json_line(record_without_frame()),
      R"({"frame":null,"time_s":null,"receive_time_s":3.5,"mode":"none","status":"video lost",)"
      R"("calibrated":false,"calibration":"collecting","needs":"tilt more","pan_rad":null,"tilt_rad":null,"pan_rate_rad_s":null,"tilt_rate_rad_s":null,)"
      R"("pan_acceleration_rad_s2":null,"tilt_acceleration_rad_s2":null,)"
      R"("q_base_from_camera":null,"orientation_sigma_rad":null,)"
      R"("orientation_covariance_rad2":null,"reference_row":0.0,"landmarks":0,"residual_px":null,)"
      R"("line_delay_s":0.0,"focal_length_px":1000.0,"focal_length_sigma_px":0.0,"aspect":1.0,"radial_distortion":0.0,"centre_offset_px":[0.0,0.0],)"
      R"("latency_s":null,"telemetry_age_s":null,"zoom":null,"zoom_rate_per_s":null,"zoom_rate_sigma_per_s":null,"localized":null,"time_sigma_s":null})"
      "\n");
}

TEST(RecordFormat, WritesCsvColumnsInTheOrderOfTheHeader) {
  EXPECT_EQ(csv_header(),
            "frame,time_s,receive_time_s,mode,status,calibrated,calibration,needs,"
            "pan_rad,tilt_rad,pan_rate_rad_s,"
            "tilt_rate_rad_s,pan_acceleration_rad_s2,tilt_acceleration_rad_s2,"
            "q_x,q_y,q_z,q_w,orientation_sigma_rad_0,orientation_sigma_rad_1,orientation_sigma_rad_"
            "2,orientation_covariance_rad2_0,orientation_covariance_rad2_1,"
            "orientation_covariance_rad2_2,orientation_covariance_rad2_3,"
            "orientation_covariance_rad2_4,orientation_covariance_rad2_5,"
            "orientation_covariance_rad2_6,orientation_covariance_rad2_7,"
            "orientation_covariance_rad2_8,reference_row,landmarks,residual_px,"
            "line_delay_s,focal_length_px,focal_length_sigma_px,aspect,radial_distortion,"
            "centre_offset_u_px,centre_offset_v_px,latency_s,telemetry_age_s,zoom,zoom_rate_per_s,"
            "zoom_rate_sigma_per_s,localized_age_s,localized_sigma_rad,time_sigma_s\n");
  EXPECT_EQ(
      csv_line(full_record()),
      "7,12345.678901234,12345.75,OE,ok,true,watching,,0.5,-0.25,0.125,-0.0625,0.03125,-0.015625,"
      "0.5,-0.5,0.5,0.5,1e-05,2e-05,3e-05,"
      "1e-10,2e-12,0.0,2e-12,4e-10,0.0,0.0,0.0,9e-10,0.0,187,0.0625,"
      "-1.42e-05,32008.0,24.0,1.0,55.4,3.5,-2.0,2.5e-05,-0.03125,3000.0,-0.375,0.00390625,4.5,1e-"
      "05,0.000244140625\n");
}

TEST(RecordFormat, LeavesCsvCellsEmptyForWhatARecordLacks) {
  const std::string line = csv_line(record_without_frame());
  EXPECT_EQ(
      line,
      ",,3.5,none,video lost,false,collecting,tilt more,,,,,,,,,,,,,,,,,,,,,,,0.0,0,,0.0,1000.0,"
      "0.0,1.0,0.0,0.0,0.0,,,,,,,,\n");
  const std::string header = csv_header();
  EXPECT_EQ(std::count(line.begin(), line.end(), ','),
            std::count(header.begin(), header.end(), ','));
}

TEST(RecordFormat, NumbersReadBackToTheSameBits) {
  OrientationRecord record = full_record();
  for (const double value :
       {0.1, 1.0 / 3, 86400.123456789012, 5e-324, std::numeric_limits<double>::max()}) {
    record.time_s = value;
    EXPECT_EQ(nlohmann::json::parse(json_line(record))["time_s"].get<double>(), value);
  }
}

TEST(RecordFormat, WhatIsNotFiniteHasNoValue) {
  OrientationRecord record = record_without_frame();
  record.receive_time_s = std::numeric_limits<double>::quiet_NaN();
  record.latency_s = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(nlohmann::json::parse(json_line(record))["receive_time_s"].is_null());
  EXPECT_EQ(csv_line(record),
            ",,,none,video lost,false,collecting,tilt more,,,,,,,,,,,,,,,,,,,,,,,0.0,0,,0.0,1000.0,"
            "0.0,1.0,0.0,0.0,0.0,,,,,,,,\n");
}

TEST(RecordFormat, EveryFieldIsInTheDescriptionOfTheApi) {
  const std::string& description = openapi_text();
  const auto record = nlohmann::json::parse(json_line(full_record()));
  for (const auto& [name, value] : record.items())
    EXPECT_NE(description.find("\n        " + name + ": {"), std::string::npos) << name;
}

TEST(RecordFormat, NamesTheModes) {
  EXPECT_STREQ(to_string(RecordMode::kNone), "none");
  EXPECT_STREQ(to_string(RecordMode::kPt), "PT");
  EXPECT_STREQ(to_string(RecordMode::kOe), "OE");
}

TEST(RecordFormat, EveryStatusHasWordsWithoutACommaOrQuote) {
  for (const RecordStatus status : kRecordStatuses) {
    const std::string words = to_string(status);
    EXPECT_EQ(words.find_first_of(",\"\n"), std::string::npos) << words;
    EXPECT_NE(words, "unknown status");
  }
}

TEST(Statuses, AreInTheManual) {
  std::ifstream file(std::string(ALIDADE_MANUAL) + "/reference/statuses.md");
  const std::string page(std::istreambuf_iterator<char>(file), {});
  for (const RecordStatus status : kRecordStatuses) {
    EXPECT_NE(page.find("\n| `" + std::string(to_string(status)) + "` | "), std::string::npos)
        << to_string(status);
  }
}

}  // namespace
}  // namespace alidade
