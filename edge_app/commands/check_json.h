#pragma once
// What `alidade check` found, for programs: the numbers of its report and every finding as one line of JSON. Names bear
// their units; what is not known is null. README.md lists the keys. Pure; allocates.

#include <optional>
#include <string>

#include "edge_app/check/motion_check.h"
#include "edge_app/check/repeat_check.h"
#include "edge_app/check/telemetry_check.h"
#include "edge_app/check/video_check.h"
#include "edge_app/commands/check_measurement.h"
#include "edge_app/commands/check_scene.h"
#include "edge_app/commands/command.h"

namespace alidade {

struct CheckReport {
  std::string configuration;  // the file
  const NamedCalibration& calibration;
  const Measured& measured;
  const VideoReport& video;
  const TelemetryReport& telemetry;
  RepeatReport repeats;
  std::optional<MotionReport> motion;  // where there are pictures and samples
  bool has_telemetry = true;           // by configuration
  SceneCheck scene;
  std::string broker;        // of MQTT; empty: none is configured
  std::string broker_error;  // empty: it takes a connection
  Findings findings;         // of all of them
};

// No finding is a problem.
[[nodiscard]] bool is_ok(const Findings& findings);

// With its line feed.
[[nodiscard]] std::string check_json(const CheckReport& report);

}  // namespace alidade
