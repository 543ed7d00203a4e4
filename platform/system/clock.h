#pragma once
// The host's clocks, in seconds. monotonic_now_s(): CLOCK_MONOTONIC, the clock of all receive
// times. It never jumps, is the same in all processes of a machine, and starts anew at each boot.
// utc_now_s(): UTC since 1970 as the host has it; may jump.

namespace alidade {

[[nodiscard]] double monotonic_now_s();
[[nodiscard]] double utc_now_s();

// Converts a wait to a timeout for poll() and curl_multi_poll(): whole milliseconds, rounded up,
// clamped to 0 to 10 s.
[[nodiscard]] int poll_milliseconds(double seconds);

}  // namespace alidade
