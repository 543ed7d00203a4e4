// Publishes targets and their plane; forwards detections.

#include <utility>
#include <vector>

#include "alidade_ros/edge_bridge_ports.h"
#include "alidade_ros/targets.h"

namespace alidade_ros {

void EdgeBridge::clear_markers() {
  const std::lock_guard<std::mutex> lock(ports_mutex_);
  if (!markers_) return;
  ports_->target_markers.publish(target_markers_.clear());
  markers_.reset();
}

bool EdgeBridge::on_targets(const std::string& json, std::string* error) {
  alidade_msgs::Targets targets;
  MarkerView view;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!parse_targets(json, clock_, options_.names, &targets, error)) return false;
    if (newest_) {
      view.focal_length = newest_->focal_length_px;
      view.aspect = newest_->aspect;
    }
    if (plane_) {
      view.has_camera_position = true;
      view.camera_position[0] = plane_->x;
      view.camera_position[1] = plane_->y;
      view.camera_position[2] = plane_->height;
    }
  }
  const std::lock_guard<std::mutex> lock(ports_mutex_);
  targets_ = targets;
  markers_ = target_markers_.take(targets, view);
  ports_->targets.publish(*targets_);
  ports_->target_markers.publish(*markers_);
  return true;
}

void EdgeBridge::forward_detections(const alidade_msgs::Detections& detections) {
  std::string question;
  std::string error;
  bool asked = detections_question(detections, clock(), &question, &error);
  if (asked) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!connected_) error = error_;
    asked = connected_;
  }
  std::size_t left_out = 0;
  if (asked) {
    const HttpClient::Answer answer = client_.post("/api/v1/detections", question);
    error = answer.error;
    std::string why;
    left_out = detections_left_out(answer.body, &why);
    if (left_out > 0)
      ROS_WARN_THROTTLE(10, "of one frame, boxes left out: %zu (%s)", left_out, why.c_str());
  }
  if (!error.empty()) ROS_WARN_THROTTLE(10, "detections refused: %s", error.c_str());
  const std::lock_guard<std::mutex> lock(mutex_);
  boxes_left_out_ += left_out;
  if (error.empty()) {
    ++detections_taken_;
  } else {
    ++detections_refused_;
    detections_error_ = error;
  }
}

// Nodes that run keep a static transform until they end, as tf2 cannot withdraw it. For nodes that
// start later, the latched message is replaced by an empty one.
void EdgeBridge::forget_plane_transform() {
  if (!plane_transform_) return;
  plane_transform_.reset();
  if (!options_.publish_tf) return;
  ROS_WARN(
      "the edge has lost its ground plane; nodes that run keep its transform until they are "
      "restarted");
  ports_->static_tf = tf2_ros::StaticTransformBroadcaster();
  ports_->static_tf.sendTransform(std::vector<geometry_msgs::TransformStamped>());
}

void EdgeBridge::poll_plane() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!plane_is_old_) return;
  }
  const HttpClient::Answer answer = client_.get("/api/v1/plane");
  PlaneValues plane;
  std::string error;
  const bool there_is_none = answer.status == 404;
  if (!there_is_none && (!answer.ok() || !parse_plane(answer.body, &plane, &error))) {
    ROS_WARN_THROTTLE(30, "%s", (answer.ok() ? error : answer.error).c_str());
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    plane_is_old_ = false;
    plane_.reset();
    if (!there_is_none) plane_ = plane;
  }
  const std::lock_guard<std::mutex> lock(ports_mutex_);
  if (there_is_none) {
    forget_plane_transform();
    return;
  }
  plane_transform_ = plane_transform(plane, options_.names);
  if (options_.publish_tf) ports_->static_tf.sendTransform(*plane_transform_);
}

}  // namespace alidade_ros
