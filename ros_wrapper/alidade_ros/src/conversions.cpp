#include "alidade_ros/conversions.h"

#include <ros/duration.h>
#include <ros/time.h>
#include <sensor_msgs/distortion_models.h>
#include <tf2/LinearMath/Quaternion.h>

#include <cmath>
#include <limits>

#include "alidade_ros/record_conversion.h"

namespace alidade_ros {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std_msgs::Header header_of(const ros::Time& stamp, const std::string& frame) {
  std_msgs::Header header;
  header.stamp = stamp;
  header.frame_id = frame;
  return header;
}

tf2::Quaternion rotation(const std::array<double, 3>& axis, double angle) {
  return tf2::Quaternion(tf2::Vector3(axis[0], axis[1], axis[2]), angle);
}

}  // namespace

ros::Time ros_time(double seconds) {
  const double whole = std::floor(seconds);
  ros::Time time(static_cast<std::uint32_t>(whole), 0);
  // Below one second: exact to the nanosecond.
  time += ros::Duration(0, static_cast<std::int32_t>(std::lround((seconds - whole) * 1e9)));
  return time;
}

geometry_msgs::Vector3 ros_from_base(const std::array<double, 3>& d_base) {
  geometry_msgs::Vector3 d;
  d.x = d_base[0];
  d.y = turned(d_base[1]);
  d.z = turned(d_base[2]);
  return d;
}

std::array<double, 3> base_from_ros(const geometry_msgs::Vector3& d_ros) {
  return {d_ros.x, turned(d_ros.y), turned(d_ros.z)};
}

geometry_msgs::Quaternion ros_orientation(const std::array<double, 4>& q_base_from_camera) {
  // (1, 0, 0, 0), half a turn about x, times q is (w, -z, y, -x); of both signs take w >= 0.
  const auto& [x, y, z, w] = q_base_from_camera;
  const bool other = x > 0;
  geometry_msgs::Quaternion q;
  q.x = other ? turned(w) : w;
  q.y = other ? z : turned(z);
  q.z = other ? turned(y) : y;
  q.w = other ? x : turned(x);
  return q;
}

alidade_msgs::Pixel ros_from_pixel(double u, double v) {
  alidade_msgs::Pixel pixel;
  pixel.u = u - 0.5;
  pixel.v = v - 0.5;
  return pixel;
}

std::array<double, 2> pixel_from_ros(const alidade_msgs::Pixel& pixel) {
  return {pixel.u + 0.5, pixel.v + 0.5};
}

std::uint8_t mode_number(const std::string& mode) {
  using Message = alidade_msgs::FrameOrientation;
  if (mode == "OE") return Message::MODE_OE;
  return mode == "PT" ? Message::MODE_PT : Message::MODE_NONE;
}

alidade_msgs::FrameOrientation frame_orientation(const Record& record, std::uint64_t number,
                                                 const ros::Time& stamp, const FrameNames& names) {
  alidade_msgs::FrameOrientation message;
  message.header = header_of(stamp, names.base);
  message.child_frame_id = names.optical;
  message.record = number;
  fill_fields(record, &message);
  return message;
}

sensor_msgs::JointState joint_state(const Record::Orientation& orientation, const ros::Time& stamp,
                                    const FrameNames& names) {
  sensor_msgs::JointState message;
  message.header = header_of(stamp, "");
  message.name = {names.pan_joint, names.tilt_joint};
  message.position = {turned(orientation.pan_rad), turned(orientation.tilt_rad)};
  message.velocity = {turned(orientation.pan_rate_rad_s), turned(orientation.tilt_rate_rad_s)};
  return message;
}

geometry_msgs::QuaternionStamped quaternion(const Record::Orientation& orientation,
                                            const ros::Time& stamp, const FrameNames& names) {
  geometry_msgs::QuaternionStamped message;
  message.header = header_of(stamp, names.base);
  message.quaternion = ros_orientation(orientation.q_base_from_camera);
  return message;
}

sensor_msgs::CameraInfo camera_info(const Record& record, int width, int height,
                                    const ros::Time& stamp, const FrameNames& names) {
  sensor_msgs::CameraInfo message;
  message.header = header_of(stamp, names.optical);
  message.width = static_cast<std::uint32_t>(width);
  message.height = static_cast<std::uint32_t>(height);
  message.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  message.D = {record.radial_distortion, 0, 0, 0, 0};
  const double f_u = record.focal_length_px;
  const double f_v = record.focal_length_px * record.aspect;
  const alidade_msgs::Pixel centre = ros_from_pixel(width / 2.0 + record.centre_offset_px[0],
                                                    height / 2.0 + record.centre_offset_px[1]);
  message.K = {f_u, 0, centre.u, 0, f_v, centre.v, 0, 0, 1};
  message.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  message.P = {f_u, 0, centre.u, 0, 0, f_v, centre.v, 0, 0, 0, 1, 0};
  return message;
}

alidade_msgs::Calibration calibration(const CalibrationValues& values, const std::string& json,
                                      const ros::Time& stamp, const FrameNames& names) {
  const auto joint_axis = [](const std::array<double, 3>& axis) {
    // In the base of ROS (a_x, -a_y, -a_z); reversed, as joint positions count the other way.
    geometry_msgs::Vector3 a;
    a.x = turned(axis[0]);
    a.y = axis[1];
    a.z = axis[2];
    return a;
  };
  alidade_msgs::Calibration message;
  message.header = header_of(stamp, names.base);
  message.width = static_cast<std::uint32_t>(values.width);
  message.height = static_cast<std::uint32_t>(values.height);
  message.focal_length = values.focal_length;
  message.aspect = values.aspect;
  message.radial_distortion = values.radial_distortion;
  message.line_delay = values.line_delay;
  message.pan_axis = joint_axis(values.pan_axis);
  message.tilt_axis = joint_axis(values.tilt_axis);
  message.pan_scale = values.pan_scale;
  message.tilt_scale = values.tilt_scale;
  message.clock_offset = values.clock_offset;
  message.centre_offset_u = values.centre_offset[0];
  message.centre_offset_v = values.centre_offset[1];
  message.zoom = values.zoom.value_or(kNan);
  message.zoom_repeatability = values.zoom_repeatability.value_or(kNan);
  for (const ZoomNodeValues& node : values.zoom_nodes) {
    alidade_msgs::ZoomNode& out = message.zoom_nodes.emplace_back();
    out.reading = node.reading;
    out.focal_length = node.focal_length;
    out.focal_length_sigma = node.focal_length_sigma;
    out.radial_distortion = node.radial_distortion;
    out.radial_distortion_sigma = node.radial_distortion_sigma;
    out.centre_offset_u = node.centre_offset[0];
    out.centre_offset_v = node.centre_offset[1];
    out.centre_offset_u_sigma = node.centre_offset_sigma[0];
    out.centre_offset_v_sigma = node.centre_offset_sigma[1];
  }
  message.names = values.names;
  message.covariance = values.covariance;
  message.json = json;
  return message;
}

geometry_msgs::TransformStamped plane_transform(const PlaneValues& plane, const FrameNames& names) {
  constexpr double kPi = 3.14159265358979323846;
  tf2::Quaternion plane_from_base;
  plane_from_base.setRPY(plane.roll, -plane.pitch, kPi / 2 - plane.heading);
  const tf2::Quaternion q = plane_from_base.inverse();
  const tf2::Vector3 origin = tf2::quatRotate(q, -tf2::Vector3(plane.x, plane.y, plane.height));
  geometry_msgs::TransformStamped transform;
  transform.header = header_of(ros::Time(), names.base);
  transform.child_frame_id = names.plane;
  transform.transform.translation.x = origin.x();
  transform.transform.translation.y = origin.y();
  transform.transform.translation.z = origin.z();
  transform.transform.rotation.x = q.x();
  transform.transform.rotation.y = q.y();
  transform.transform.rotation.z = q.z();
  transform.transform.rotation.w = q.w();
  return transform;
}

std::array<double, 4> orientation_of_row(const Record& record, const Axes& axes, double row) {
  const Record::Orientation& o = *record.orientation;
  const double t = (row - record.reference_row) * record.line_delay_s;
  const double pan = (o.pan_rate_rad_s + o.pan_acceleration_rad_s2 * t / 2) * t;
  const double tilt = (o.tilt_rate_rad_s + o.tilt_acceleration_rad_s2 * t / 2) * t;
  // R_frd_from_rdf' a: forward-right-down (x, y, z) is right-down-forward (y, z, x).
  const std::array<double, 3> tilt_axis_camera = {axes.tilt[1], axes.tilt[2], axes.tilt[0]};
  const auto& [x, y, z, w] = o.q_base_from_camera;
  const tf2::Quaternion q =
      rotation(axes.pan, pan) * tf2::Quaternion(x, y, z, w) * rotation(tilt_axis_camera, tilt);
  return {q.x(), q.y(), q.z(), q.w()};
}

std::vector<geometry_msgs::TransformStamped> transforms(const Record& record, const Axes& axes,
                                                        int height, int rows,
                                                        const ros::Time& stamp,
                                                        const FrameNames& names) {
  std::vector<geometry_msgs::TransformStamped> result;
  for (int i = 0; i < rows; ++i) {
    const double row = rows == 1 ? record.reference_row : i * double(height) / (rows - 1);
    const double later = (row - record.reference_row) * record.line_delay_s;
    geometry_msgs::TransformStamped transform;
    transform.header = header_of(stamp + ros::Duration(later), names.base);
    // Without a line delay all rows have the same stamp; tf2 warns of a repeated stamp.
    if (!result.empty() && transform.header.stamp == result.back().header.stamp) continue;
    transform.child_frame_id = names.optical;
    transform.transform.rotation = ros_orientation(orientation_of_row(record, axes, row));
    result.push_back(transform);
  }
  return result;
}

}  // namespace alidade_ros
