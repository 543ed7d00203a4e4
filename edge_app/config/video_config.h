#pragma once
// Section `video`: where frames come from. Each type of source is one row of kVideoTypes; the
// switches over VideoConfig::Type have no default, so that the compiler names what a new type
// lacks. To add one: platform/video/README.md.

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "edge_app/config/yaml_section.h"
#include "platform/system/link_rules.h"
#include "platform/video/v4l2_mode.h"  // V4l2Format

namespace alidade {

struct VideoConfig {
  enum class Type { kRtsp, kRtp, kMjpeg, kV4l2, kRecording, kCount };
  enum class Transport { kTcp, kUdp };
  Type type = Type::kRtsp;
  // rtsp: rtsp://... or rtsps://...; mjpeg: http(s)://...; rtp: an .sdp file or rtp://address:port.
  std::string url;
  std::string format = "MJPG";             // of rtp://address:port: MJPG, H264 or H265
  std::string directory;                   // recording
  std::string device;                      // v4l2: /dev/video0
  std::optional<V4l2Format> pixel_format;  // v4l2; empty: the first that fits
  double rate_hz = 0;                      // v4l2; 0: the device's own
  int width = 0;     // px; 0: any. Live video needs it until there is a calibration
  int height = 0;    // px, likewise
  std::string user;  // rtsp, mjpeg
  std::string password;
  LinkRules rules;                        // rtsp, mjpeg
  Transport transport = Transport::kTcp;  // rtsp
  std::string certificate_file;           // rtsps://; empty: the system's
  double timeout_s = 3;                   // s without a picture; then the camera counts as lost
  double max_backoff_s = 5;               // s, longest pause between two attempts to connect
};

inline constexpr auto kVideoTypeCount = static_cast<std::size_t>(VideoConfig::Type::kCount);

// The value of `type` of each source, in the order of VideoConfig::Type.
[[nodiscard]] const std::array<const char*, kVideoTypeCount>& video_type_names();

// Throws ConfigError. Relative paths start at the folder of config_path.
[[nodiscard]] VideoConfig read_video(YamlSection section, const std::string& config_path);

}  // namespace alidade
