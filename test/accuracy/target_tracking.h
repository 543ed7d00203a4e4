#pragma once
// How well targets are tracked on simulated detections: the tables of Lisanti et al. (2, 3, 4) with people on a plane before a camera that
// turns and zooms; associations compared where people cross; normalised errors; the time of a step.

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace alidade::test {

struct TargetTrackingOptions {
  int runs = 30;  // of 60 s, each table row
  std::uint64_t first_seed = 1;
  double recall = 0.9;
  double false_alarms = 0.1;
  double noise_px = 2;
  std::string only;  // part of a table's title
};

// Prints tables; returns what misses its mark.
[[nodiscard]] std::vector<std::string> run_target_tracking(const TargetTrackingOptions& options,
                                                           std::ostream& out);

}  // namespace alidade::test
