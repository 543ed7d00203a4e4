#pragma once
// The bridge's registrations at a master; all are renewed after the master's restart.

#include <diagnostic_updater/diagnostic_updater.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include "alidade_ros/edge_bridge.h"

namespace alidade_ros {

struct EdgeBridge::Ports {
  ros::Publisher frame_orientation, orientation, joint_states, camera_info, calibration, status;
  ros::Publisher targets, target_markers;
  ros::Subscriber detections;
  ros::ServiceServer pixel_to_direction, direction_to_pixel, calibrate;
  tf2_ros::TransformBroadcaster tf;
  tf2_ros::StaticTransformBroadcaster static_tf;
  diagnostic_updater::Updater diagnostics;

  Ports(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle)
      : diagnostics(handle, private_handle, private_handle.getNamespace()) {}
};

}  // namespace alidade_ros
