#pragma once
// Converts between the conventions of Alidade and of ROS (REP-103, REP-105): the only place where
// signs, frames and pixels change.
//
//             Alidade                                  ROS
//   base      forward-right-down                       forward-left-up: turned by pi about x
//   camera    right-down-forward                       the optical frame: the same
//   pan       positive right (about base z, down)      joint position about +z (up): -pan
//   tilt      positive up (about base y, right)        joint position about +y (left): -tilt
//   axes      a turned by +angle                       (-a_x, a_y, a_z) turned by -angle
//   pixel     centre of the top-left one (0.5, 0.5)    (0, 0)
//   lens      u = f x (1 + k |x|^2) + centre           plumb_bob with k1 = k: exact
// All conversions only change signs, exchange components or subtract 0.5, so nothing is rounded
// except the last bit of pixels. No side effects.

#include <alidade_msgs/Calibration.h>
#include <alidade_msgs/FrameOrientation.h>
#include <alidade_msgs/Pixel.h>
#include <geometry_msgs/Quaternion.h>
#include <geometry_msgs/QuaternionStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Vector3.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/JointState.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "alidade_ros/record.h"

namespace alidade_ros {

struct FrameNames {
  std::string base = "camera_base";
  std::string optical = "camera_optical_frame";
  std::string plane = "camera_plane";
  std::string pan_joint = "pan_joint";
  std::string tilt_joint = "tilt_joint";
};

// Axes of the mechanism, unit vectors in Alidade's base.
struct Axes {
  std::array<double, 3> pan{0, 0, 1};
  std::array<double, 3> tilt{0, 1, 0};
};

// To the nearest nanosecond. seconds since 1970, from 0 to 2106.
[[nodiscard]] ros::Time ros_time(double seconds);

[[nodiscard]] geometry_msgs::Vector3 ros_from_base(const std::array<double, 3>& d_base);
[[nodiscard]] std::array<double, 3> base_from_ros(const geometry_msgs::Vector3& d_ros);
[[nodiscard]] geometry_msgs::Quaternion ros_orientation(
    const std::array<double, 4>& q_base_from_camera);
[[nodiscard]] alidade_msgs::Pixel ros_from_pixel(double u, double v);
[[nodiscard]] std::array<double, 2> pixel_from_ros(const alidade_msgs::Pixel& pixel);

[[nodiscard]] std::uint8_t mode_number(const std::string& mode);

// stamp: the record's time_s, or its receive_time_s if there is none, in ROS time.
[[nodiscard]] alidade_msgs::FrameOrientation frame_orientation(const Record& record,
                                                               std::uint64_t number,
                                                               const ros::Time& stamp,
                                                               const FrameNames& names);
[[nodiscard]] sensor_msgs::JointState joint_state(const Record::Orientation& orientation,
                                                  const ros::Time& stamp, const FrameNames& names);
[[nodiscard]] geometry_msgs::QuaternionStamped quaternion(const Record::Orientation& orientation,
                                                          const ros::Time& stamp,
                                                          const FrameNames& names);
[[nodiscard]] sensor_msgs::CameraInfo camera_info(const Record& record, int width, int height,
                                                  const ros::Time& stamp, const FrameNames& names);
[[nodiscard]] alidade_msgs::Calibration calibration(const CalibrationValues& values,
                                                    const std::string& json, const ros::Time& stamp,
                                                    const FrameNames& names);

// The ground's frame (x east, y north, z up, or as the camera defines them) in the base. Its parent
// is <base>, so that a node that knows the pose of the base can add a parent above it.
//   R_plane_from_base = Rz(pi/2 - heading) Ry(-pitch) Rx(roll), both with z up.
[[nodiscard]] geometry_msgs::TransformStamped plane_transform(const PlaneValues& plane,
                                                              const FrameNames& names);

// The record must have an orientation. R_base_from_camera, as x, y, z, w, at the exposure of row v,
// t = (v - reference_row) line_delay later:
//   R' = Exp(dpan a_pan) R  R_frd_from_rdf' Exp(dtilt a_tilt) R_frd_from_rdf,
//   dpan = pan_rate t + pan_acceleration t^2 / 2, dtilt likewise (PTCEE 16, starting at R).
[[nodiscard]] std::array<double, 4> orientation_of_row(const Record& record, const Axes& axes,
                                                       double row);

// <base> -> <optical> at `rows` rows from the first (0) to the last (height), so that interpolation
// by tf2 at a row's time gives that row's orientation. One row: the reference row, at stamp. The
// record must have an orientation.
[[nodiscard]] std::vector<geometry_msgs::TransformStamped> transforms(const Record& record,
                                                                      const Axes& axes, int height,
                                                                      int rows,
                                                                      const ros::Time& stamp,
                                                                      const FrameNames& names);

}  // namespace alidade_ros
