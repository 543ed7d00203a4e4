// Telemetry of any times and angles, and questions for any time: an answer is finite, its angles are
// wrapped, and its variances are none below 0. An input is a list of samples, each followed by a question.

#include "core/realtime/telemetry/telemetry_buffer.h"
#include "test/fuzz/stamps.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  constexpr double kHalfTurn = 3.14159265358979323846;
  FuzzInput input(data, size);
  TelemetryNoise noise;
  TelemetryLimits limits;
  const unsigned bits = input.byte();
  limits.max_repeat_s = (bits & 1U) != 0 ? 0 : 0.1;
  limits.max_gap_s = (bits & 2U) != 0 ? 1e6 : 0.5;
  limits.max_extrapolation_s = (bits & 4U) != 0 ? 100 : 0.25;
  TelemetryBuffer<16> buffer(noise, limits);
  TelemetrySample sample;
  sample.time_s = 1000;
  sample.time_sigma_s = (bits & 8U) != 0 ? 1e-2 : 0;
  while (!input.empty()) {
    const TelemetrySample before = sample;
    sample.time_s = next_stamp(sample.time_s, &input);
    sample.pan = next_stamp(sample.pan, &input);
    sample.tilt = next_stamp(sample.tilt, &input);
    if (buffer.push(sample) == PushStatus::kNotFinite) {
      sample = before;
      continue;
    }
    const double time_s = next_stamp(sample.time_s, &input);
    InterpolatedPanTilt answer;
    if (!has_result(buffer.query(time_s, sample.time_sigma_s, &answer))) continue;
    FUZZ_REQUIRE(answer.angle.pan >= -kHalfTurn && answer.angle.pan < kHalfTurn);
    FUZZ_REQUIRE(answer.angle.tilt >= -kHalfTurn && answer.angle.tilt < kHalfTurn);
    FUZZ_REQUIRE(std::isfinite(answer.rate.pan) && std::isfinite(answer.rate.tilt));
    FUZZ_REQUIRE(answer.covariance.allFinite());
    FUZZ_REQUIRE((answer.covariance.diagonal().array() >= 0).all());
    FUZZ_REQUIRE(answer.acceleration_square.allFinite());
  }
  return 0;
}
