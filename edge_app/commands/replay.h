#pragma once
// `alidade replay`. The command line (command_line.cpp) names the options as here and checks them.

#include <optional>
#include <string>

namespace alidade {

struct ReplayOptions {
  std::string recording;
  std::string directory;    // empty: <recording>/alidade
  std::string calibration;  // empty: <recording>/alidade/calibration.yaml
  std::string mode;         // "OE", "PT"; empty: OE if there are images
  std::string detections;   // JSON Lines; "-": stdin; empty: none
  std::string tracking;     // a configuration with section `tracking`; empty: on the sphere
  // Device units; readings that differ by no more are one zoom. Empty: found from their jitter.
  std::optional<double> zoom_tolerance;
  bool realtime = false;
  bool json = false;
  bool csv = false;
};

// Runs the real-time step over a recording. Returns kExitOk. Throws CommandError if an option, the
// recording or the calibration cannot be used, a result cannot be written, or SIGINT or SIGTERM
// comes: then nothing is stored.
[[nodiscard]] int replay_recording(const ReplayOptions& options);

}  // namespace alidade
