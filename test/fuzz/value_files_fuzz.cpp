// The small files of a recording; the first line tells which: # recording, # noise, # limit, else guess.yaml. What
// is read is within its limits; what is refused has one line that names the file.

#include "edge_app/config/noise_file.h"
#include "edge_app/config/value_file.h"
#include "platform/storage/recording.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

void require_outcome(bool ok, const std::string& error) {
  FUZZ_REQUIRE(ok == error.empty());
  FUZZ_REQUIRE(ok || (is_one_line(error) && error.rfind("file.yaml:", 0) == 0));
}

void require_unit(const std::optional<Vector3<double>>& axis) {
  FUZZ_REQUIRE(!axis || std::abs(axis->norm() - 1) < 1e-12);
}

void require_stated(const std::optional<StatedValue>& stated) {
  FUZZ_REQUIRE(!stated || std::abs(stated->value) <= 1e12);
  FUZZ_REQUIRE(!stated || stated->sigma.value_or(0) >= 0);
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string text(text_of(data, size));
  const std::string first_line = text.substr(0, text.find('\n'));
  const std::string name = "file.yaml";
  std::string error;
  if (first_line == "# recording") {
    RecordingInfo info;
    require_outcome(parse_recording_info(text, name, &info, &error), error);
    FUZZ_REQUIRE(!error.empty() || (info.width > 0 && info.height > 0));
  } else if (first_line == "# noise") {
    RecordingNoise noise;
    require_outcome(parse_noise(text, name, &noise, &error), error);
    FUZZ_REQUIRE(!error.empty() || noise.image_period_s.value_or(1) > 0);
  } else if (first_line == "# limit") {
    CalibrationLimits limits;
    require_outcome(parse_limits(text, name, &limits, &error), error);
    FUZZ_REQUIRE(!error.empty() || limits.clock_offset_s.value_or(1) > 0);
  } else {
    CalibrationValues values;
    require_outcome(parse_values(text, name, &values, &error), error);
    if (!error.empty()) return 0;
    for (const auto& stated :
         {values.focal_length, values.aspect, values.radial_distortion, values.line_delay,
          values.clock_offset, values.pan_scale, values.tilt_scale}) {
      require_stated(stated);
    }
    require_unit(values.pan_axis);
    require_unit(values.tilt_axis);
  }
  return 0;
}
