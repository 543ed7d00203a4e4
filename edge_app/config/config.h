#pragma once
// The configuration of `alidade`: one YAML file, strictly checked (yaml_section.h).
//
// Every value carries its unit here as in the file. What the file leaves out has the default below;
// what has no default (types, addresses) is required. Passwords stand in the environment, never in
// the file: `password_env` names the variable. Relative paths are relative to the file's folder.
// Reading touches nothing but the file and the environment: no connection is tried.

#include <optional>
#include <string>
#include <vector>

#include "edge_app/config/detectors_config.h"
#include "edge_app/config/mqtt_config.h"
#include "edge_app/config/pan_tilt_config.h"
#include "edge_app/config/tracking_config.h"
#include "edge_app/output/http/http_options.h"
#include "edge_app/record/record_format.h"  // OutputFormat
#include "platform/system/link_rules.h"
#include "platform/video/v4l2_mode.h"  // V4l2Format

namespace alidade {

struct VideoConfig {
  enum class Type { kRtsp, kRtp, kMjpeg, kV4l2, kRecording };
  enum class Transport { kTcp, kUdp };
  Type type = Type::kRtsp;
  std::string
      url;  // rtsp: rtsp://... or rtsps://...; mjpeg: http://...; rtp: an .sdp file or rtp://address:port
  std::string format = "MJPG";             // rtp://address:port: MJPG, H264 or H265
  std::string directory;                   // recording
  std::string device;                      // v4l2: /dev/video0
  std::optional<V4l2Format> pixel_format;  // v4l2; empty: the first that fits
  double rate_hz = 0;                      // v4l2; 0: the device's own
  int width = 0;                           // px, what live video must have; 0: whatever comes
  int height = 0;                          // px
  std::string user;                        // rtsp, mjpeg
  std::string password;
  LinkRules rules;                        // rtsp, mjpeg
  Transport transport = Transport::kTcp;  // rtsp
  std::string certificate_file;           // rtsps://; empty: the system's
  double timeout_s = 3;                   // silence that counts as a loss
  double max_backoff_s = 5;               // longest pause between two attempts
};

// Of a lens that zooms: at both ends of its range.
struct FocalLengthRange {
  double wide_px = 0;
  double tele_px = 0;  // more than that
};

// The data sheet's camera: used as long as there is no calibration.
struct CameraConfig {
  // Where it zooms the one in the middle, in octaves.
  std::optional<double> focal_length_px;
  std::optional<FocalLengthRange> focal_length_range;
  double aspect = 1;
  double radial_distortion = 0;
  double line_delay_s = 0;  // of the sensor read top to bottom
  bool upside_down =
      false;  // mounted upside down, image turned by 180 degrees: negates line_delay_s
};

struct CalibrationConfig {
  std::string file;   // empty: none
  std::string prior;  // a lens.yaml; empty: none
  // Live only: calibrate while the camera moves, and store the result in file.
  bool automatic = true;
  // Device units within which two zoom readings are one; none: as their jitter shows (steady_zoom.h).
  std::optional<double> zoom_tolerance;
};

struct SceneMapConfig {
  std::string file;                // a scene.map; empty: none
  double interval_s = 10;          // from one localization to the next, while nothing calls for one
  double zero_sigma_rad = 1e-3;    // of telemetry's zero from one start to the next
  bool correct_moved_base = true;  // false: a movement is reported only
  bool update = false;             // the file is kept up by the pictures that are found in it
};

struct RealtimeConfig {
  bool landmarks = true;  // mode OE; false: PT, and nothing is calibrated
  int priority = 0;       // SCHED_FIFO priority, see priority_of(); 0 leaves the scheduler alone
  int cpu = -1;           // -1: any
  bool lock_memory = false;
  double max_extrapolation_s = 0.25;  // how far beyond the newest trusted angle one is stated
};

struct OutputConfig {
  std::optional<OutputFormat> stdout_format = OutputFormat::kJson;  // empty: nothing on stdout
  std::optional<HttpServerOptions> http;                            // empty: no server
  std::string targets;  // JSON Lines of targets are appended to this file; empty: to none
};

struct Config {
  VideoConfig video;
  PanTiltConfig pan_tilt;
  CameraConfig camera;
  CalibrationConfig calibration;
  SceneMapConfig scene_map;
  RealtimeConfig realtime;
  TrackingConfig tracking;
  BuiltInDetectorOptions detectors;
  OutputConfig output;
  std::optional<MqttOptions> mqtt;    // empty: no broker is told
  std::vector<std::string> warnings;  // FILE:LINE: ... lines for the log
};

// What must be there. What is there is checked either way.
enum class ConfigScope {
  kAll,
  kVideo,    // a camera without a head, as on a bench; of the result, the video
  kTracking  // neither need be there; of the result, the tracking
};

// path stands for the file in errors, and is where relative paths start.
// False with a line "FILE[:LINE]: KEY: what is wrong; what would be right" in *error.
[[nodiscard]] bool parse_config(const std::string& text, const std::string& path, Config* config,
                                std::string* error, ConfigScope scope = ConfigScope::kAll);
[[nodiscard]] bool load_config(const std::string& path, Config* config, std::string* error,
                               ConfigScope scope = ConfigScope::kAll);

}  // namespace alidade
