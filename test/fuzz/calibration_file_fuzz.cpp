// calibration.yaml: what is read is written as a text that is read as the same bits.

#include "core/calibration/calibration_text.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

void require_same(const Calibration& a, const Calibration& b) {
  FUZZ_REQUIRE(a.camera.width == b.camera.width && a.camera.height == b.camera.height);
  FUZZ_REQUIRE(a.camera.focal_length == b.camera.focal_length);
  FUZZ_REQUIRE(a.camera.aspect == b.camera.aspect);
  FUZZ_REQUIRE(a.camera.distortion.radial == b.camera.distortion.radial);
  FUZZ_REQUIRE(a.line_delay == b.line_delay && a.clock_offset == b.clock_offset);
  FUZZ_REQUIRE(a.mechanics.pan_axis == b.mechanics.pan_axis);
  FUZZ_REQUIRE(a.mechanics.tilt_axis == b.mechanics.tilt_axis);
  FUZZ_REQUIRE(a.mechanics.pan_scale == b.mechanics.pan_scale);
  FUZZ_REQUIRE(a.mechanics.tilt_scale == b.mechanics.tilt_scale);
  FUZZ_REQUIRE(a.zoom == b.zoom);
  FUZZ_REQUIRE(a.covariance == b.covariance);
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  Calibration calibration;
  CalibrationNotes notes;
  std::string error;
  if (!parse_calibration(std::string(text_of(data, size)), "calibration.yaml", &calibration, &error,
                         nullptr, &notes.telemetry_error)) {
    FUZZ_REQUIRE(is_one_line(error));
    FUZZ_REQUIRE(error.rfind("calibration.yaml:", 0) == 0);
    return 0;
  }
  FUZZ_REQUIRE(std::isfinite(calibration.camera.focal_length));
  FUZZ_REQUIRE(calibration.covariance.allFinite());
  FUZZ_REQUIRE(notes.telemetry_error.pan.validate() && notes.telemetry_error.tilt.validate());
  Calibration again;
  CalibrationNotes notes_again;
  const std::string text = format_calibration(calibration, notes);
  FUZZ_REQUIRE(
      parse_calibration(text, "again", &again, &error, nullptr, &notes_again.telemetry_error));
  require_same(calibration, again);
  FUZZ_REQUIRE(format_calibration(again, notes_again) == text);
  return 0;
}
