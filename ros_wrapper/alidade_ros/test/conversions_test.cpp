#include "alidade_ros/conversions.h"

#include <gtest/gtest.h>
#include <ros/time.h>
#include <tf2/LinearMath/Matrix3x3.h>
#include <tf2/LinearMath/Quaternion.h>
#include <tf2/LinearMath/Vector3.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

namespace alidade_ros {
namespace {

using tf2::Matrix3x3;
using tf2::Vector3;

// By Rodrigues' formula, as MODEL has it and not by quaternions as the code does.
Matrix3x3 rotation(const Vector3& axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), x = axis.x(), y = axis.y(), z = axis.z();
  return Matrix3x3(c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s,  //
                   y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s,  //
                   z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c));
}

// forward-right-down from right-down-forward
const Matrix3x3 kFrdFromRdf(0, 0, 1, 1, 0, 0, 0, 1, 0);

Vector3 vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

Matrix3x3 base_from_camera(const Axes& axes, double pan, double tilt) {
  return rotation(vector(axes.pan), pan) * rotation(vector(axes.tilt), tilt) * kFrdFromRdf;
}

std::array<double, 4> quaternion_of(const Matrix3x3& R) {
  tf2::Quaternion q;
  R.getRotation(q);
  return {q.x(), q.y(), q.z(), q.w()};
}

Matrix3x3 matrix_of(const geometry_msgs::Quaternion& q) {
  return Matrix3x3(tf2::Quaternion(q.x, q.y, q.z, q.w));
}

void expect_near(const Matrix3x3& a, const Matrix3x3& b, double tolerance) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      EXPECT_NEAR(a[row][column], b[row][column], tolerance) << row << ',' << column;
    }
  }
}

Record moving_record(const Axes& axes) {
  Record record;
  record.mode = "OE";
  record.line_delay_s = -3e-5;
  record.focal_length_px = 2600;
  record.radial_distortion = 13.9;
  Record::Orientation& o = record.orientation.emplace();
  o.pan_rad = 0.4;
  o.tilt_rad = -0.1;
  o.pan_rate_rad_s = 1.5;
  o.tilt_rate_rad_s = -0.7;
  o.pan_acceleration_rad_s2 = 2;
  o.tilt_acceleration_rad_s2 = -3;
  o.q_base_from_camera = quaternion_of(base_from_camera(axes, o.pan_rad, o.tilt_rad));
  return record;
}

Axes tilted_axes() {
  return {{0.012, -0.02, std::sqrt(1 - 0.012 * 0.012 - 0.02 * 0.02)},
          {0.03, std::sqrt(1 - 0.03 * 0.03 - 0.014 * 0.014), 0.014}};
}

TEST(Conversions, LooksForwardAtRest) {
  const geometry_msgs::Quaternion q = ros_orientation(quaternion_of(base_from_camera({}, 0, 0)));
  // The rotation from a link to its optical frame that every ROS driver has.
  EXPECT_NEAR(q.x, -0.5, 1e-15);
  EXPECT_NEAR(q.y, 0.5, 1e-15);
  EXPECT_NEAR(q.z, -0.5, 1e-15);
  EXPECT_NEAR(q.w, 0.5, 1e-15);
}

TEST(Conversions, PanToTheRightIsTowardsMinusYAndTiltUpTowardsPlusZ) {
  const Matrix3x3 R = matrix_of(ros_orientation(quaternion_of(base_from_camera({}, 0.3, 0.2))));
  const Vector3 axis = R * Vector3(0, 0, 1);
  EXPECT_NEAR(std::atan2(axis.y(), axis.x()), -0.3, 1e-12);
  EXPECT_NEAR(std::asin(axis.z()), 0.2, 1e-12);
}

TEST(Conversions, JointPositionsTurnAboutZAndY) {
  const Record record = moving_record({});
  const sensor_msgs::JointState joints = joint_state(*record.orientation, ros::Time(5), {});
  ASSERT_EQ(joints.position.size(), 2U);
  EXPECT_EQ(joints.position[0], -0.4);
  EXPECT_EQ(joints.position[1], 0.1);
  EXPECT_EQ(joints.velocity[0], -1.5);
  EXPECT_EQ(joints.velocity[1], 0.7);
  // What robot_state_publisher makes of a URDF with these axes.
  const Matrix3x3 link = rotation({0, 0, 1}, joints.position[0]) *
                         rotation({0, 1, 0}, joints.position[1]) *
                         Matrix3x3(0, 0, 1, -1, 0, 0, 0, -1, 0);
  expect_near(matrix_of(ros_orientation(record.orientation->q_base_from_camera)), link, 1e-12);
}

TEST(Conversions, CalibratedAxesTurnJointPositions) {
  const Axes axes = tilted_axes();
  CalibrationValues values;
  values.pan_axis = axes.pan;
  values.tilt_axis = axes.tilt;
  const alidade_msgs::Calibration message = calibration(values, "", ros::Time(), {});
  const auto in_ros = [](const geometry_msgs::Vector3& v) { return Vector3(v.x, v.y, v.z); };
  const Matrix3x3 expected =
      matrix_of(ros_orientation(quaternion_of(base_from_camera(axes, 0.4, -0.1))));
  expect_near(rotation(in_ros(message.pan_axis), -0.4) * rotation(in_ros(message.tilt_axis), 0.1) *
                  Matrix3x3(0, 0, 1, -1, 0, 0, 0, -1, 0),
              expected, 1e-12);
}

TEST(Conversions, DirectionsAndPixelsComeBack) {
  const std::array<double, 3> d = {0.6, -0.64, 0.48};
  const geometry_msgs::Vector3 d_ros = ros_from_base(d);
  EXPECT_EQ(d_ros.x, 0.6);
  EXPECT_EQ(d_ros.y, 0.64);
  EXPECT_EQ(d_ros.z, -0.48);
  EXPECT_EQ(base_from_ros(d_ros), d);
  const alidade_msgs::Pixel first = ros_from_pixel(0.5, 0.5);
  EXPECT_EQ(first.u, 0);
  EXPECT_EQ(first.v, 0);
  EXPECT_EQ(pixel_from_ros(ros_from_pixel(12.25, 7.75)), (std::array<double, 2>{12.25, 7.75}));
}

TEST(Conversions, CameraInfoProjectsLikeTheModel) {
  for (const double k : {13.9, -4.0, 0.0}) {
    Record record = moving_record({});
    record.radial_distortion = k;
    record.aspect = 1.02;
    const sensor_msgs::CameraInfo info = camera_info(record, 160, 96, ros::Time(), {});
    const cv::Matx33d K(info.K.data());
    const cv::Mat D(info.D);
    for (const cv::Point3d& d :
         {cv::Point3d(0, 0, 1), cv::Point3d(0.02, -0.015, 1), cv::Point3d(-0.05, 0.03, 1.5)}) {
      std::vector<cv::Point2d> seen;
      cv::projectPoints(std::vector<cv::Point3d>{d}, cv::Vec3d(), cv::Vec3d(), K, D, seen);
      const double x = d.x / d.z, y = d.y / d.z, s = 1 + k * (x * x + y * y);
      const alidade_msgs::Pixel expected =
          ros_from_pixel(2600 * x * s + 80, 2600 * 1.02 * y * s + 48);
      EXPECT_NEAR(seen[0].x, expected.u, 1e-10);
      EXPECT_NEAR(seen[0].y, expected.v, 1e-10);
    }
  }
}

TEST(Conversions, TheLensOfTheFrameIsToldWithItsRate) {
  Record record = moving_record({});
  record.centre_offset_px = {3.5, -2};
  record.focal_length_sigma_px = 0.25;
  record.zoom = 3000;
  record.zoom_rate_per_s = -0.5;
  record.zoom_rate_sigma_per_s = 0.01;
  const auto message = frame_orientation(record, 1, ros_time(5), {});
  EXPECT_EQ(message.focal_length_sigma, 0.25);
  EXPECT_EQ(message.zoom, 3000);
  EXPECT_EQ(message.zoom_rate, -0.5);
  EXPECT_EQ(message.zoom_rate_sigma, 0.01);
  EXPECT_EQ(message.centre_offset_u, 3.5);
  EXPECT_EQ(message.centre_offset_v, -2);
  const sensor_msgs::CameraInfo info = camera_info(record, 160, 96, ros_time(5), {});
  EXPECT_EQ(info.K[0], record.focal_length_px);
  EXPECT_EQ(info.K[2], 83);
  EXPECT_EQ(info.K[5], 45.5);
}

TEST(Conversions, ACalibrationHasItsZoomsNodesOrNone) {
  CalibrationValues values;
  EXPECT_TRUE(std::isnan(calibration(values, "", ros::Time(), {}).zoom_repeatability));
  values.zoom_repeatability = 0.002;
  values.zoom_nodes = {{100, 1300, 0.5, 3, 0.25, {1, 2}, {0.1, 0.2}}};
  const alidade_msgs::Calibration message = calibration(values, "", ros::Time(), {});
  EXPECT_EQ(message.zoom_repeatability, 0.002);
  ASSERT_EQ(message.zoom_nodes.size(), 1U);
  const alidade_msgs::ZoomNode& node = message.zoom_nodes[0];
  EXPECT_EQ(node.reading, 100);
  EXPECT_EQ(node.focal_length, 1300);
  EXPECT_EQ(node.focal_length_sigma, 0.5);
  EXPECT_EQ(node.radial_distortion, 3);
  EXPECT_EQ(node.radial_distortion_sigma, 0.25);
  EXPECT_EQ(node.centre_offset_u, 1);
  EXPECT_EQ(node.centre_offset_v, 2);
  EXPECT_EQ(node.centre_offset_u_sigma, 0.1);
  EXPECT_EQ(node.centre_offset_v_sigma, 0.2);
}

TEST(Conversions, RowsTurnAsTheMechanismDoes) {
  const Axes axes = tilted_axes();
  const Record record = moving_record(axes);
  for (const double row : {0.0, 100.0, 1080.0}) {
    const double t = row * record.line_delay_s;
    const Matrix3x3 expected =
        base_from_camera(axes, 0.4 + 1.5 * t + 2 * t * t / 2, -0.1 - 0.7 * t - 3 * t * t / 2);
    const auto [x, y, z, w] = orientation_of_row(record, axes, row);
    expect_near(Matrix3x3(tf2::Quaternion(x, y, z, w)), expected, 1e-12);
  }
}

TEST(Conversions, TransformsHoldWhenTheirRowsWereExposed) {
  const Axes axes = tilted_axes();
  const Record record = moving_record(axes);
  const FrameNames names;
  const auto all = transforms(record, axes, 1000, 3, ros_time(100), names);
  ASSERT_EQ(all.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(all[i].header.frame_id, "camera_base");
    EXPECT_EQ(all[i].child_frame_id, "camera_optical_frame");
    const double row = 500.0 * static_cast<double>(i);
    EXPECT_NEAR((all[i].header.stamp - ros_time(100)).toSec(), row * record.line_delay_s, 1e-9);
    expect_near(matrix_of(all[i].transform.rotation),
                matrix_of(ros_orientation(orientation_of_row(record, axes, row))), 1e-14);
  }
}

TEST(Conversions, RowsThatAreOneMomentAreOneTransform) {
  Record record = moving_record({});
  record.line_delay_s = 0;
  EXPECT_EQ(transforms(record, {}, 1000, 3, ros_time(100), {}).size(), 1U);
}

TEST(Conversions, WhatHasNoValueIsNan) {
  Record record;
  record.mode = "none";
  record.status = "video lost";
  record.receive_time_s = 3;
  const auto message = frame_orientation(record, 8, ros_time(1e9), {});
  EXPECT_EQ(message.mode, alidade_msgs::FrameOrientation::MODE_NONE);
  EXPECT_FALSE(message.has_frame);
  for (const double value : {message.time, message.latency, message.pan, message.tilt_rate,
                             message.orientation.w, message.orientation_covariance[4]}) {
    EXPECT_TRUE(std::isnan(value));
  }
}

TEST(Conversions, TimesKeepTheirNanoseconds) {
  EXPECT_EQ(ros_time(0.999999999), ros::Time(0, 999999999));
  EXPECT_EQ(ros_time(0.9999999999), ros::Time(1, 0));
  EXPECT_EQ(ros_time(4294967294.5), ros::Time(4294967294U, 500000000));
}

}  // namespace
}  // namespace alidade_ros
