#include "alidade_ros/edge_bridge.h"

#include <alidade_msgs/Calibration.h>
#include <alidade_msgs/FrameOrientation.h>

#include <chrono>
#include <utility>

#include "alidade_ros/edge_bridge_ports.h"

namespace alidade_ros {
namespace {

constexpr std::uint32_t kQueue = 1000;  // records: 40 s at 25 Hz for a stalled subscriber
constexpr std::uint32_t kDetectionsQueue = 50;
constexpr auto kPollPeriod = std::chrono::seconds(1);
constexpr double kGreatestRosTimeS = 4294967295.0;
const char* const kMasterMarker = "known_to_master";

// The camera parameters in a record that change only with the calibration.
bool same_calibration(const Record& a, const Record& b) {
  return a.calibrated == b.calibrated && a.aspect == b.aspect && a.line_delay_s == b.line_delay_s;
}

// Also those that change from frame to frame if there is a zoom curve.
bool same_camera(const Record& a, const Record& b) {
  return same_calibration(a, b) && a.focal_length_px == b.focal_length_px &&
         a.radial_distortion == b.radial_distortion && a.centre_offset_px == b.centre_offset_px;
}

bool same_lens(const sensor_msgs::CameraInfo& a, const sensor_msgs::CameraInfo& b) {
  return a.width == b.width && a.height == b.height && a.K == b.K && a.D == b.D;
}

// Changes worth a message: counters and times alone are not.
bool same_state(const alidade_msgs::Status& a, const alidade_msgs::Status& b) {
  return a.connected == b.connected && a.error == b.error && a.start == b.start &&
         a.mode == b.mode && a.status == b.status && a.calibrated == b.calibrated &&
         a.calibration == b.calibration && a.needs == b.needs && a.json.empty() == b.json.empty();
}

}  // namespace

EdgeBridge::EdgeBridge(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
                       const BridgeOptions& options)
    : handle_(handle),
      private_handle_(private_handle),
      options_(options),
      client_(options.edge),
      stream_(
          &client_,
          {[this](const Hello& hello) { on_hello(hello); },
           [this](const ClockPair& pair) { on_clock(pair); },
           [this](const Record& record, std::uint64_t number) { on_record(record, number); },
           [this](const std::string& json, std::string* error) { return on_targets(json, error); },
           [this](const std::string& error) { on_disconnected(error); },
           [](const std::string& error) { ROS_WARN_THROTTLE(10, "%s", error.c_str()); }}),
      target_markers_(options.marker_distance_m),
      clock_(options.time_offset_s),
      diagnosed_at_(ros::WallTime::now()) {
  advertise();
  publish_status();
  stream_.start();
  poll_thread_ = std::thread([this] { poll(); });
}

EdgeBridge::~EdgeBridge() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  stream_.stop();
  poll_thread_.join();
  ports_.reset();  // waits for service callbacks, which use members that are destroyed earlier
}

void EdgeBridge::advertise() {
  const std::lock_guard<std::mutex> lock(ports_mutex_);
  ports_.reset();  // taken down first: roscpp would share the old registration
  ports_ = std::make_unique<Ports>(handle_, private_handle_);
  Ports& p = *ports_;
  p.frame_orientation =
      handle_.advertise<alidade_msgs::FrameOrientation>("frame_orientation", kQueue);
  p.orientation = handle_.advertise<geometry_msgs::QuaternionStamped>("orientation", kQueue);
  p.joint_states = handle_.advertise<sensor_msgs::JointState>("joint_states", kQueue);
  p.camera_info = handle_.advertise<sensor_msgs::CameraInfo>("camera_info", 1, true);
  p.calibration = handle_.advertise<alidade_msgs::Calibration>("calibration", 1, true);
  p.status = handle_.advertise<alidade_msgs::Status>("status", 1, true);
  p.targets = handle_.advertise<alidade_msgs::Targets>("targets", 1, true);
  p.target_markers = handle_.advertise<visualization_msgs::MarkerArray>("target_markers", 1, true);
  p.detections =
      handle_.subscribe("detections", kDetectionsQueue, &EdgeBridge::forward_detections, this);
  p.pixel_to_direction =
      handle_.advertiseService("pixel_to_direction", &EdgeBridge::pixel_to_direction, this);
  p.direction_to_pixel =
      handle_.advertiseService("direction_to_pixel", &EdgeBridge::direction_to_pixel, this);
  p.calibrate = handle_.advertiseService("calibrate", &EdgeBridge::calibrate, this);
  p.diagnostics.setHardwareID(client_.address().url);
  p.diagnostics.add("edge connection", this, &EdgeBridge::diagnose_connection);
  p.diagnostics.add("orientation", this, &EdgeBridge::diagnose_orientation);
  if (camera_info_) p.camera_info.publish(*camera_info_);
  if (calibration_) p.calibration.publish(*calibration_);
  if (status_) p.status.publish(*status_);
  if (targets_) p.targets.publish(*targets_);
  if (markers_) p.target_markers.publish(*markers_);
  if (plane_transform_ && options_.publish_tf) p.static_tf.sendTransform(*plane_transform_);
  private_handle_.setParam(kMasterMarker, true);
}

// A parameter of this node is lost with the master that held it. No answer does not mean that.
bool EdgeBridge::master_forgot_us() const {
  XmlRpc::XmlRpcValue request, response, known;
  request[0] = ros::this_node::getName();
  request[1] = private_handle_.resolveName(kMasterMarker);
  return ros::master::execute("hasParam", request, response, known, false) &&
         known.getType() == XmlRpc::XmlRpcValue::TypeBoolean && !static_cast<bool>(known);
}

void EdgeBridge::on_hello(const Hello& hello) {
  ROS_INFO("connected to %s, alidade %s", client_.address().url.c_str(), hello.version.c_str());
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    // A new start may follow a reboot, at which the monotonic clock starts anew.
    if (hello.start != hello_.start) clock_.reset();
    clock_.add(hello.clock);
    hello_ = hello;
    connected_ = true;
    error_.clear();
    calibration_is_old_ = true;
    plane_is_old_ = true;
  }
  wake_poll();
}

void EdgeBridge::on_clock(const ClockPair& pair) {
  const std::lock_guard<std::mutex> lock(mutex_);
  clock_.add(pair);
}

void EdgeBridge::on_disconnected(const std::string& error) {
  bool was_connected = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    was_connected = std::exchange(connected_, false);
    error_ = error;
  }
  if (was_connected) {
    ROS_WARN("%s; connecting again", error.c_str());
  } else {
    ROS_WARN_THROTTLE(30, "%s; connecting again", error.c_str());
  }
  publish_status();
  clear_markers();
}

void EdgeBridge::on_record(const Record& record, std::uint64_t number) {
  ros::Time stamp;
  Axes axes;
  int height = 0;
  bool changed = false;
  bool camera_changed = false;
  bool calibration_changed = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto wall = clock_.wall_from_monotonic(record.time_s.value_or(record.receive_time_s));
    const double seconds = wall.value_or(0);
    if (!wall || !(seconds > 0 && seconds < kGreatestRosTimeS)) {
      ROS_WARN_THROTTLE(10, "record %llu left out: its time is none of ROS",
                        static_cast<unsigned long long>(number));
      return;
    }
    stamp = ros_time(seconds);
    camera_changed = !newest_ || !same_camera(*newest_, record);
    // A change of the lens alone waits for the next poll, within a second.
    calibration_changed = !newest_ || !same_calibration(*newest_, record);
    changed = calibration_changed || newest_->mode != record.mode ||
              newest_->status != record.status || newest_->calibration != record.calibration ||
              newest_->needs != record.needs;
    calibration_is_old_ = calibration_is_old_ || camera_changed;
    newest_ = record;
    newest_stamp_ = stamp;
    if (record.calibrated) axes = axes_;
    if (size_) height = size_->height;
  }
  {
    const std::lock_guard<std::mutex> lock(ports_mutex_);
    ports_->frame_orientation.publish(frame_orientation(record, number, stamp, options_.names));
    if (record.orientation) {
      ports_->orientation.publish(quaternion(*record.orientation, stamp, options_.names));
      ports_->joint_states.publish(joint_state(*record.orientation, stamp, options_.names));
      if (options_.publish_tf) {
        const int rows = height > 0 ? options_.tf_rows : 1;
        ports_->tf.sendTransform(transforms(record, axes, height, rows, stamp, options_.names));
      }
    }
  }
  if (camera_changed) publish_camera_info();
  if (calibration_changed) wake_poll();
  if (changed) publish_status();
}

void EdgeBridge::publish_camera_info() {
  sensor_msgs::CameraInfo info;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!newest_ || !size_) return;
    info = camera_info(*newest_, size_->width, size_->height, newest_stamp_, options_.names);
  }
  const std::lock_guard<std::mutex> lock(ports_mutex_);
  if (camera_info_ && same_lens(*camera_info_, info)) return;
  camera_info_ = info;
  ports_->camera_info.publish(info);
}

void EdgeBridge::publish_status() {
  const std::lock_guard<std::mutex> ports_lock(ports_mutex_);
  alidade_msgs::Status status;
  const EventStream::Counters counters = stream_.counters();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status.header.stamp = newest_stamp_;
    status.header.frame_id = options_.names.base;
    status.connected = connected_;
    status.error = error_;
    status.url = client_.address().url;
    status.version = hello_.version;
    status.start = hello_.start;
    if (newest_) {
      status.mode = mode_number(newest_->mode);
      status.status = newest_->status;
      status.calibrated = newest_->calibrated;
      status.calibration = newest_->calibration;
      status.needs = newest_->needs;
    }
    status.published = counters.records;
    status.lost = counters.lost;
    status.connections = counters.connections;
    status.json = status_json_;
  }
  if (status_ && same_state(*status_, status)) return;
  status_ = status;
  ports_->status.publish(status);
}

void EdgeBridge::poll() {
  for (;;) {
    bool connected = false;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait_for(lock, kPollPeriod, [this] { return wake_ || ending_; });
      if (ending_) return;
      wake_ = false;
      connected = connected_;
    }
    if (connected) {
      poll_status();
      poll_calibration();
      poll_plane();
      publish_camera_info();
    }
    publish_status();
    if (master_forgot_us()) {
      ROS_WARN("the master was restarted; advertising anew");
      advertise();
    }
    const ros::WallTime now = ros::WallTime::now();
    if ((now - diagnosed_at_).toSec() >= 0.9) {
      const std::lock_guard<std::mutex> lock(ports_mutex_);
      ports_->diagnostics.force_update();
      diagnosed_at_ = now;
    }
  }
}

void EdgeBridge::poll_status() {
  const HttpClient::Answer answer = client_.get("/api/v1/status");
  if (!answer.ok()) {
    ROS_WARN_THROTTLE(30, "%s", answer.error.c_str());
    return;
  }
  std::optional<ImageSize> size;
  std::string error;
  if (!parse_image_size(answer.body, &size, &error)) {
    ROS_WARN_THROTTLE(30, "%s", error.c_str());
    return;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  status_json_ = answer.body;
  if (size) size_ = size;
}

void EdgeBridge::poll_calibration() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!calibration_is_old_ || !newest_) return;
  }
  const HttpClient::Answer answer = client_.get("/api/v1/calibration");
  CalibrationValues values;
  std::string error;
  const bool none_yet = answer.status == 404;
  if (!none_yet && (!answer.ok() || !parse_calibration(answer.body, &values, &error))) {
    ROS_WARN_THROTTLE(30, "%s", (answer.ok() ? error : answer.error).c_str());
    return;
  }
  ros::Time stamp;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    // The answer may be newer or older than the newest record; then it is requested again.
    calibration_is_old_ =
        none_yet ? newest_->calibrated
                 : newest_->calibrated && values.focal_length != newest_->focal_length_px;
    if (none_yet) return;
    axes_ = {values.pan_axis, values.tilt_axis};
    stamp = newest_stamp_;
  }
  const std::lock_guard<std::mutex> lock(ports_mutex_);
  if (calibration_ && calibration_->json == answer.body) return;
  calibration_ = calibration(values, answer.body, stamp, options_.names);
  ports_->calibration.publish(*calibration_);
}

void EdgeBridge::wake_poll() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_ = true;
  }
  changed_.notify_all();
}

ClockMap EdgeBridge::clock() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return clock_;
}

}  // namespace alidade_ros
