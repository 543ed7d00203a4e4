// Readings of one axis at a time, of any times and angles: what is paired lies within what was read. An
// input is a list of readings: which axis, the time since the one before, how long it took, the angle.

#include "platform/pan_tilt/axis_pairing.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  constexpr double kPi = 3.14159265358979323846;
  // What the sources hand over: times of a clock that runs, angles within some turns.
  const auto bounded = [](double value, double most) {
    return std::isfinite(value) ? std::clamp(value, -most, most) : 0;
  };
  FuzzInput input(data, size);
  AxisPairing pairing;
  double now_s = std::abs(bounded(input.number(), 1e9));
  bool tilt_since_pan = false;
  double last_tilt = 0;
  while (!input.empty()) {
    const unsigned bits = input.byte();
    if ((bits & 2U) != 0) {
      pairing.reset();
      tilt_since_pan = false;
    }
    AxisReading reading;
    reading.earliest_s = now_s + std::abs(bounded(input.number(), 1e3));
    reading.latest_s = reading.earliest_s + std::abs(bounded(input.number(), 1e3));
    reading.angle_rad = bounded(input.number(), 4 * kPi);
    now_s = reading.latest_s;
    if ((bits & 1U) != 0) {
      pairing.add_tilt(reading);
      tilt_since_pan = true;
      last_tilt = reading.angle_rad;
      continue;
    }
    const auto paired = pairing.add_pan(reading);
    FUZZ_REQUIRE(tilt_since_pan || !paired);
    tilt_since_pan = false;
    if (!paired) continue;
    FUZZ_REQUIRE(paired->pan_rad >= -kPi && paired->pan_rad < kPi);
    FUZZ_REQUIRE(paired->tilt_rad == last_tilt);
    FUZZ_REQUIRE(std::isfinite(paired->earliest_s) && paired->earliest_s <= paired->latest_s);
    FUZZ_REQUIRE(paired->latest_s <= now_s + 1e3);
  }
  return 0;
}
