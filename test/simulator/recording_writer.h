#pragma once
// Writes what the virtual camera saw and said as a recording with truth.
//
// Clocks: the image clock is the true time of the simulation, so frames.csv holds capture times plus
// jitter, and truth.csv the capture times; telemetry.csv holds true times + clock_offset plus jitter.
// Telemetry starts a second before the first frame and ends a second after the last.
// sender_time_s is the capture time on the sender's own clock (image_clock_ppm).

#include <filesystem>

#include "test/simulator/config.h"

namespace alidade::simulator {

// The directory is made; it must not exist or be empty. Throws ConfigError if the configuration does
// not describe a recording, std::runtime_error if it cannot be written.
void write_recording(const Config& config, const std::filesystem::path& directory);

}  // namespace alidade::simulator
