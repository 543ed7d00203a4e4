#pragma once
// `alidade replay`. Its options bear the names of the command line (command_line.cpp), checked there.

#include <optional>
#include <string>

namespace alidade {

struct ReplayOptions {
  std::string recording;
  std::string directory;    // empty: <recording>/alidade
  std::string calibration;  // empty: <recording>/alidade/calibration.yaml
  std::string mode;         // "OE", "PT"; empty: OE if there are images
  std::string detections;   // JSON Lines; "-": stdin; empty: none
  std::string tracking;     // a configuration, of which section tracking counts; empty: the sphere
  // Device units within which two zoom readings are one; none: as their jitter shows.
  std::optional<double> zoom_tolerance;
  bool realtime = false;
  bool json = false;
  bool csv = false;
};

// The real-time modes over a recording. Returns the exit code; throws CommandError.
[[nodiscard]] int replay_recording(const ReplayOptions& options);

}  // namespace alidade
