#pragma once
// The host's clocks in seconds. That of every receive time: CLOCK_MONOTONIC, which never jumps, is the same in
// all processes of one machine, and begins anew at each boot; and UTC since 1970 as the host has it, which may jump.

namespace alidade {

[[nodiscard]] double monotonic_now_s();
[[nodiscard]] double utc_now_s();

// What a wait of this length is for poll() and curl_multi_poll(): whole milliseconds, rounded up; from 0 to 10 s.
[[nodiscard]] int poll_milliseconds(double seconds);

}  // namespace alidade
