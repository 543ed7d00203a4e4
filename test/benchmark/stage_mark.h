#pragma once
// The system call that no kernel has, by which stage_cost tells stage_count_plugin that a piece of work begins
// (its argument is 1) or has ended (0).

namespace alidade::benchmarks {

inline constexpr long kStageMark = 0x414C49;

}  // namespace alidade::benchmarks
