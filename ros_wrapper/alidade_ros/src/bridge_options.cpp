#include <cmath>
#include <stdexcept>

#include "alidade_ros/edge_bridge.h"

namespace alidade_ros {
namespace {

template <typename T>
void read(const ros::NodeHandle& handle, const char* name, T* value) {
  XmlRpc::XmlRpcValue raw;
  if (handle.getParam(name, raw) && !handle.getParam(name, *value)) {
    throw std::invalid_argument(std::string("~") + name + ": has another type than its default");
  }
}

}  // namespace

BridgeOptions read_options(const ros::NodeHandle& handle) {
  BridgeOptions options;
  read(handle, "url", &options.edge.url);
  read(handle, "token_env", &options.edge.token_env);
  read(handle, "token_file", &options.edge.token_file);
  read(handle, "silence_timeout", &options.edge.silence_timeout_s);
  std::string camera = "camera";
  read(handle, "camera", &camera);
  options.names.base = camera + "_base";
  options.names.optical = camera + "_optical_frame";
  options.names.plane = camera + "_plane";
  options.names.pan_joint = camera + "_pan_joint";
  options.names.tilt_joint = camera + "_tilt_joint";
  read(handle, "base_frame", &options.names.base);
  read(handle, "optical_frame", &options.names.optical);
  read(handle, "plane_frame", &options.names.plane);
  read(handle, "pan_joint", &options.names.pan_joint);
  read(handle, "tilt_joint", &options.names.tilt_joint);
  read(handle, "publish_tf", &options.publish_tf);
  read(handle, "tf_rows", &options.tf_rows);
  read(handle, "time_offset", &options.time_offset_s);
  read(handle, "marker_distance", &options.marker_distance_m);
  const std::string wrong = wrong_with(options.edge);
  if (!wrong.empty()) throw std::invalid_argument("~" + wrong);
  if (options.tf_rows < 1 || options.tf_rows > 100) {
    throw std::invalid_argument("~tf_rows: must be from 1 to 100");
  }
  if (!(options.edge.silence_timeout_s >= 1)) {
    throw std::invalid_argument("~silence_timeout: must be at least 1 (s)");
  }
  if (!std::isfinite(options.time_offset_s)) {
    throw std::invalid_argument("~time_offset: must be a finite number (s)");
  }
  if (!(options.marker_distance_m > 0) || !std::isfinite(options.marker_distance_m)) {
    throw std::invalid_argument("~marker_distance: must be a positive number (m)");
  }
  return options;
}

}  // namespace alidade_ros
