#pragma once
// `alidade verify`. The command line (command_line.cpp) names the options as here and checks them.

#include <optional>
#include <string>

namespace alidade {

struct VerifyOptions {
  std::string recording;
  std::string calibration;  // empty: <recording>/alidade/calibration.yaml
  std::string known;        // DIRECTIONS.csv, as known_directions.h has it; empty: none
  // Degrees or "free": of the platform's turn against the known directions. Empty: 0.
  std::string heading_sigma, level_sigma;
  std::string directory;  // for verification.html; empty: <recording>/alidade
  // Device units; readings that differ by no more are one zoom. Empty: found from their jitter.
  std::optional<double> zoom_tolerance;
  bool json = false;
};

// How good a calibration is on a recording. Returns the exit code: kExitOk if the sigmas hold,
// kExitFailed if they are contradicted, kExitUsage if the recording does not suffice to judge.
// Throws CommandError, always with kExitUsage, if nothing was judged: an option, the recording or
// the calibration cannot be used, a result cannot be written, or a signal came.
[[nodiscard]] int verify_calibration(const VerifyOptions& options);

}  // namespace alidade
