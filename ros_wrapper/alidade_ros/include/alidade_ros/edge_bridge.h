#pragma once
// EdgeBridge: the node and the nodelet. A client of one edge executable's HTTP API that publishes
// its data in ROS conventions, stamped with capture times. Topics, services, parameters: README.md.
// Threads: the event stream's thread publishes records. A second thread polls once a second: the
// status, the calibration if it changed, diagnostics, and whether the master still knows this node.
// roscpp registers with a master once, so after a restart of the master all topics and services are
// advertised anew. Services and detections run on the spinner's threads and give up if the edge
// sends nothing for 10 s. Lock order: ports_mutex_, then mutex_. Service callbacks never take
// ports_mutex_, as taking a service down waits for them.

#include <alidade_msgs/Calibrate.h>
#include <alidade_msgs/Detections.h>
#include <alidade_msgs/DirectionToPixel.h>
#include <alidade_msgs/PixelToDirection.h>
#include <alidade_msgs/Status.h>
#include <alidade_msgs/Targets.h>
#include <ros/ros.h>
#include <visualization_msgs/MarkerArray.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "alidade_ros/clock_map.h"
#include "alidade_ros/conversions.h"
#include "alidade_ros/event_stream.h"
#include "alidade_ros/http_client.h"
#include "alidade_ros/record.h"
#include "alidade_ros/target_markers.h"

namespace diagnostic_updater {
class DiagnosticStatusWrapper;
}

namespace alidade_ros {

struct BridgeOptions {
  EdgeAddress edge;
  FrameNames names;
  bool publish_tf = true;
  int tf_rows = 3;                // transforms per frame
  double time_offset_s = 0;       // added to every stamp
  double marker_distance_m = 10;  // distance at which targets that are directions are drawn
};

// Reads a node's private parameters. Throws std::invalid_argument with one line that names the
// parameter.
[[nodiscard]] BridgeOptions read_options(const ros::NodeHandle& private_handle);

class EdgeBridge {
 public:
  EdgeBridge(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
             const BridgeOptions& options);
  ~EdgeBridge();
  EdgeBridge(const EdgeBridge&) = delete;
  EdgeBridge& operator=(const EdgeBridge&) = delete;

 private:
  struct Ports;

  void advertise();
  [[nodiscard]] bool master_forgot_us() const;

  void on_hello(const Hello& hello);
  void on_clock(const ClockPair& pair);
  void on_record(const Record& record, std::uint64_t number);
  bool on_targets(const std::string& json, std::string* error);
  void on_disconnected(const std::string& error);
  void publish_camera_info();
  void publish_status();
  void clear_markers();
  void forward_detections(const alidade_msgs::Detections& detections);

  void poll();
  void poll_status();
  void poll_calibration();
  void poll_plane();
  void forget_plane_transform();  // call with ports_mutex_ held
  void wake_poll();

  void diagnose_connection(diagnostic_updater::DiagnosticStatusWrapper& status);
  void diagnose_orientation(diagnostic_updater::DiagnosticStatusWrapper& status);

  bool pixel_to_direction(alidade_msgs::PixelToDirection::Request& request,
                          alidade_msgs::PixelToDirection::Response& response);
  bool direction_to_pixel(alidade_msgs::DirectionToPixel::Request& request,
                          alidade_msgs::DirectionToPixel::Response& response);
  bool calibrate(alidade_msgs::Calibrate::Request& request,
                 alidade_msgs::Calibrate::Response& response);

  [[nodiscard]] ClockMap clock() const;

  ros::NodeHandle handle_;
  ros::NodeHandle private_handle_;
  const BridgeOptions options_;
  HttpClient client_;
  EventStream stream_;

  std::mutex ports_mutex_;
  std::unique_ptr<Ports> ports_;  // guarded by ports_mutex_, as are the next seven
  std::optional<sensor_msgs::CameraInfo> camera_info_;
  std::optional<alidade_msgs::Calibration> calibration_;
  std::optional<alidade_msgs::Status> status_;
  std::optional<alidade_msgs::Targets> targets_;
  std::optional<visualization_msgs::MarkerArray> markers_;
  std::optional<geometry_msgs::TransformStamped> plane_transform_;
  TargetMarkers target_markers_;

  mutable std::mutex mutex_;  // guards the members up to ending_
  ClockMap clock_;
  Hello hello_;
  bool connected_ = false;
  std::string error_ = "not connected yet";
  std::optional<Record> newest_;
  ros::Time newest_stamp_;
  Axes axes_;
  std::optional<ImageSize> size_;
  std::string status_json_;
  std::optional<PlaneValues> plane_;
  bool plane_is_old_ = true;
  std::uint64_t detections_taken_ = 0;
  std::uint64_t detections_refused_ = 0;
  std::uint64_t boxes_left_out_ = 0;  // in accepted detections
  std::string detections_error_;      // of the last refused detections
  bool calibration_is_old_ = true;
  bool wake_ = false;
  bool ending_ = false;
  std::condition_variable changed_;

  std::uint64_t diagnosed_records_ = 0;  // used by the poll thread only, as is the next
  ros::WallTime diagnosed_at_;
  std::thread poll_thread_;
};

}  // namespace alidade_ros
