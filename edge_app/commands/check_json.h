#pragma once
// The report of `alidade check` as one line of JSON: its numbers and all findings. The unit is part
// of each name; an unknown value is null. The keys: docs/manual/reference/json-of-commands.md.
// Pure; allocates.

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

// Its references are borrowed.
struct CheckReport {
  std::string configuration;  // path
  const PublishedCalibration& calibration;
  const Measured& measured;
  const VideoReport& video;
  const TelemetryReport& telemetry;
  RepeatReport repeats;
  std::optional<MotionReport> motion;  // empty without images or samples
  bool has_telemetry = true;           // according to the configuration
  SceneCheck scene;
  std::string broker;        // of MQTT; empty: none is configured
  std::string broker_error;  // empty: it accepts a connection
  Findings findings;         // of all checks
};

// True if no finding is a problem.
[[nodiscard]] bool is_ok(const Findings& findings);

// One line, with a line feed at its end.
[[nodiscard]] std::string check_json(const CheckReport& report);

}  // namespace alidade
