#pragma once
// The configuration of `alidade`: one YAML file, strictly checked (yaml_section.h).
//
// Each value has the same unit here as in the file. A key that the file leaves out takes the
// default below. A key without a default (types, addresses) is required. Passwords come from the
// environment (`password_env` names the variable) or from a file of their own (`password_file`),
// never from this file. Relative paths start at the file's folder. Reading touches this file, the
// environment, and the files of secrets and certificates that the file names. It tries no
// connection.

#include <optional>
#include <string>
#include <vector>

#include "core/model/pupil.h"
#include "core/realtime/telemetry/telemetry_buffer.h"  // TelemetryLimits
#include "edge_app/config/detectors_config.h"
#include "edge_app/config/mqtt_config.h"
#include "edge_app/config/pan_tilt_config.h"
#include "edge_app/config/tracking_config.h"
#include "edge_app/config/video_config.h"
#include "edge_app/output/http/http_options.h"
#include "edge_app/record/record_format.h"  // OutputFormat

namespace alidade {

// The focal lengths of a zoom lens at both ends of its range.
struct FocalLengthRange {
  double wide_px = 0;
  double tele_px = 0;  // greater than wide_px
};

// The camera as the data sheet has it. It is used as long as there is no calibration.
struct CameraConfig {
  // For a zoom lens: the geometric mean of wide_px and tele_px.
  std::optional<double> focal_length_px;
  std::optional<FocalLengthRange> focal_length_range;
  double aspect = 1;
  double radial_distortion = 0;
  // px, sigma of the optical centre about the picture's middle, in each calibration. 0: the centre
  // is the middle. Empty: 1 % of the width.
  std::optional<double> centre_sigma_px;
  double line_delay_s = 0;  // s/row, of the sensor read from top to bottom
  // The camera hangs upside down and turns its image by 180 degrees; negates line_delay_s.
  bool upside_down = false;
  Pupil pupil;  // as stated, or the usual one
};

struct CalibrationConfig {
  std::string file;   // empty: none
  std::string prior;  // a lens.yaml; empty: none
  // For live video only: calibrate while the camera moves, and store the result in `file`.
  bool automatic = true;
  // Device units; two zoom readings that differ by no more are one zoom. Empty: found from their
  // jitter (steady_zoom.h).
  std::optional<double> zoom_tolerance;
  // s, one standard deviation: how much the links' delay may differ from that of the connection for
  // which the calibration was stored. Used until movement has shown the delay. Empty:
  // LinkDelay::kOpenSigma_s. If a value is set and the mode is PT, no picture is decoded.
  std::optional<double> clock_offset_sigma_s;
};

struct SceneMapConfig {
  std::string file;                // a scene.map; empty: none
  double interval_s = 10;          // s, from the end of a search to the next picture: scene_tap.h
  double zero_sigma_rad = 1e-3;    // rad, of telemetry's zero from one start to the next
  bool correct_moved_base = true;  // false: a movement is only reported
  bool update = false;             // pictures that are found in the map keep the file up to date
};

struct RealtimeConfig {
  bool landmarks = true;  // true: mode OE; false: mode PT, nothing is calibrated
  int priority = 0;       // SCHED_FIFO priority, see priority_of(); 0: normal scheduling
  int cpu = -1;           // -1: any
  bool lock_memory = false;
  // s beyond the newest trusted angle.
  double max_extrapolation_s = TelemetryLimits().max_extrapolation_s;
};

struct OutputConfig {
  std::optional<OutputFormat> stdout_format = OutputFormat::kJson;  // empty: nothing on stdout
  std::optional<HttpServerOptions> http;                            // empty: no server
  std::string targets;  // file to which targets are appended as JSON Lines; empty: none
  std::string
      recordings;  // directory for recordings that the page or API begins; empty: none can be
};

struct Config {
  VideoConfig video;
  PanTiltConfig pan_tilt;
  CameraConfig camera;
  std::optional<SceneDistance> scene;  // of what the camera sees; empty: nothing is known
  CalibrationConfig calibration;
  SceneMapConfig scene_map;
  RealtimeConfig realtime;
  TrackingConfig tracking;
  BuiltInDetectorOptions detectors;
  OutputConfig output;
  std::optional<MqttOptions> mqtt;    // empty: no broker
  std::vector<std::string> warnings;  // lines for the log: FILE:LINE: ...
};

// Which of the sections `video` and `pan_tilt` are required. Every section that the file has is
// checked in any case.
enum class ConfigScope {
  kAll,      // both
  kVideo,    // `video`: a camera without a head, as on a bench. Use only config.video
  kTracking  // neither. Use only config.tracking
};

// `path` names the file in errors; relative paths start at its folder. On failure returns false
// with one line in *error: "FILE[:LINE]: KEY: what is wrong; what would be right".
[[nodiscard]] bool parse_config(const std::string& text, const std::string& path, Config* config,
                                std::string* error, ConfigScope scope = ConfigScope::kAll);
[[nodiscard]] bool load_config(const std::string& path, Config* config, std::string* error,
                               ConfigScope scope = ConfigScope::kAll);

}  // namespace alidade
