#pragma once
// The host's clocks in seconds. That of every receive time: CLOCK_MONOTONIC, which never jumps, is the same in
// all processes of one machine, and begins anew at each boot; and UTC since 1970 as the host has it, which may jump.

namespace alidade {

[[nodiscard]] double monotonic_now_s();
[[nodiscard]] double utc_now_s();

}  // namespace alidade
