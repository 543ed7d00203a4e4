#include "alidade_ros/services.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "alidade_ros/conversions.h"

namespace alidade_ros {
namespace {

using Json = nlohmann::json;

ClockMap clock_with_offset() {
  ClockMap clock;
  clock.add({0, 1000, 0});
  return clock;
}

TEST(Services, AskInTheEdgesOwnConventions) {
  alidade_msgs::PixelToDirection::Request request;
  request.at = request.STAMP;
  request.stamp = ros_time(1012.5);
  request.pixels.push_back(ros_from_pixel(10.5, 20.25));
  request.pixel_sigma = 0.25;
  std::string json, error;
  ASSERT_TRUE(direction_question(request, clock_with_offset(), &json, &error)) << error;
  EXPECT_EQ(Json::parse(json),
            Json::parse(R"({"time_s":12.5,"pixels":[[10.5,20.25]],"pixel_sigma_px":0.25})"));

  alidade_msgs::DirectionToPixel::Request inverse;
  inverse.at = inverse.FRAME;
  inverse.frame = 7;
  inverse.directions.push_back(ros_from_base({0.8, 0.6, 0}));
  ASSERT_TRUE(pixel_question(inverse, ClockMap(), &json, &error)) << error;
  EXPECT_EQ(Json::parse(json), Json::parse(R"({"frame":7,"directions":[[0.8,0.6,0.0]]})"));
}

TEST(Services, SayWhatIsWrongWithTheQuestion) {
  alidade_msgs::PixelToDirection::Request request;
  std::string json, error;
  request.at = 9;
  EXPECT_FALSE(direction_question(request, clock_with_offset(), &json, &error));
  EXPECT_NE(error.find("NEWEST"), std::string::npos);
  request.at = request.STAMP;
  EXPECT_FALSE(direction_question(request, ClockMap(), &json, &error));
  EXPECT_NE(error.find("clock"), std::string::npos);
}

TEST(Services, AnswerInTheConventionsOfRos) {
  alidade_msgs::PixelToDirection::Response response;
  std::string error;
  ASSERT_TRUE(direction_answer(
      R"({"frame":7,"time_s":12.5,"mode":"PT","calibrated":true,"directions":[
          {"pixel":[0.5,0.5],"time_s":12.75,"direction":[0.6,0.64,-0.48],"azimuth_rad":9,"elevation_rad":9,
           "covariance":[[1,2],[3,4]],"basis":[[0,1,0],[0,0,1]],"sigma_rad":0.5},
          {"pixel":[1,2],"error":"beyond the lens"}]})",
      clock_with_offset(), &response, &error))
      << error;
  EXPECT_EQ(response.frame, 7);
  EXPECT_TRUE(response.calibrated);
  EXPECT_EQ(response.stamp, ros_time(1012.5));
  ASSERT_EQ(response.directions.size(), 2U);
  const alidade_msgs::PixelDirection& d = response.directions[0];
  EXPECT_EQ(d.pixel.u, 0);
  EXPECT_EQ(d.stamp, ros_time(1012.75));
  EXPECT_EQ(d.direction.y, -0.64);
  EXPECT_LT(d.azimuth, 0);  // to the right
  EXPECT_NEAR(std::sin(d.elevation), 0.48, 1e-15);
  EXPECT_EQ(d.covariance[1], 2);
  EXPECT_EQ(d.basis[1].z, -1);
  EXPECT_EQ(response.directions[1].error, "beyond the lens");

  alidade_msgs::DirectionToPixel::Response inverse;
  ASSERT_TRUE(pixel_answer(
      R"({"frame":7,"time_s":12.5,"mode":"OE","calibrated":false,"pixels":[
          {"direction":[0.6,0.64,-0.48],"pixel":[100.5,50.5],"inside":true,"time_s":12.75,"covariance_px2":[[1,2],[3,4]]},
          {"direction":[-1,0,0],"error":"behind the camera"}]})",
      clock_with_offset(), &inverse, &error))
      << error;
  ASSERT_EQ(inverse.pixels.size(), 2U);
  EXPECT_EQ(inverse.pixels[0].pixel.u, 100);
  EXPECT_TRUE(inverse.pixels[0].inside);
  EXPECT_EQ(inverse.pixels[0].direction.z, 0.48);
  EXPECT_EQ(inverse.pixels[1].error, "behind the camera");
  EXPECT_EQ(inverse.mode, 2);
  EXPECT_FALSE(inverse.calibrated);
}

TEST(Services, RejectAnAnswerThatMakesNoSense) {
  alidade_msgs::PixelToDirection::Response response;
  std::string error;
  EXPECT_FALSE(direction_answer("{}", ClockMap(), &response, &error));
  EXPECT_NE(error.find("cannot be understood"), std::string::npos);
}

}  // namespace
}  // namespace alidade_ros
