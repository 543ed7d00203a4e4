// A program outside the repository: telemetry in, direction of a pixel out; OE mode and its map by themselves.
#include <core/calibration/calibration_text.h>
#include <core/realtime/oe_mode/oe_mode.h>
#include <core/realtime/pt_mode.h>

#include <cmath>
#include <cstdio>

int main() {
  alidade::Calibration calibration;
  calibration.camera = {1500.0, 1.0, {0.0}, 1280, 720};
  alidade::TelemetryBuffer<64> telemetry;
  for (int i = 0; i < 10; ++i) {
    const double time_s = 0.1 * i;
    if (telemetry.push({time_s, 0.0, 0.2 * time_s, 0.0}) != alidade::PushStatus::kStored) return 1;
  }
  alidade::FrameOrientation orientation;
  if (pt_orientation(calibration, telemetry, 0.45, 0.0, &orientation) !=
      alidade::QueryStatus::kOk) {
    return 2;
  }
  alidade::Vector3<double> direction;
  if (orientation.direction({640.0, 360.0}, &direction) != alidade::ProjectionStatus::kOk) return 3;
  const double pan = std::atan2(direction.y(), direction.x());
  std::printf("pan %.6f rad\n", pan);
  if (!(std::abs(pan - 0.09) < 1e-9)) return 4;

  alidade::OeOptions options;
  options.max_width = 1280;
  options.max_height = 720;
  alidade::OeMode oe_mode(options);
  oe_mode.reset(calibration);
  const alidade::MapState map = oe_mode.map_state();
  return map.landmarks.empty() ? 0 : 5;
}
