#pragma once
// The host clock of every receive time: CLOCK_MONOTONIC in seconds. It never jumps, is the same in
// all processes of one machine, and begins anew at each boot.

namespace alidade {

[[nodiscard]] double monotonic_now_s();

}  // namespace alidade
