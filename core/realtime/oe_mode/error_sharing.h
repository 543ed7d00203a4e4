#pragma once
// ErrorSharing: how much of their errors landmarks have in common with their neighbours in the
// image, and frames with the next ones, as in haze or pictures of a low bit rate.
//   sharing    = mean square of averages over sixths of the image / that of single residuals
//   repetition = 1 + 2 sum of the correlations of these averages, 1 to kLags frames apart
//   factor     = 1 + (sharing - 1) repetition
// Squares are in units of what independent errors with the claimed covariances leave. An error that
// a sixth of the image shares is in the frame's angle, rate and acceleration, too, and in what the
// map takes over from several frames. Learnt over some seconds of frames; 1 if errors are
// independent. No allocation. One thread.

#include <array>
#include <cstddef>

#include "core/realtime/oe_mode/orientation_solve.h"

namespace alidade {

class ErrorSharing {
 public:
  void reset() { *this = {}; }
  // A frame that landmarks answered: SolvedMotion's squares and averages. Ignored without degrees
  // of freedom.
  void note(const ResidualSquares& single, const ResidualSquares& large,
            const LargeAverages& averages);
  [[nodiscard]] double factor() const;  // >= 1, for the covariance of a frame

 private:
  static constexpr double kMemory = 64;        // frames
  static constexpr double kFirstFreedom = 12;  // degrees, of independent errors before the first
  static constexpr std::size_t kLags = 8;      // frames

  [[nodiscard]] double repetition() const;  // >= 1

  ResidualSquares single_{kFirstFreedom, kFirstFreedom};
  ResidualSquares large_{kFirstFreedom, kFirstFreedom};
  std::array<LargeAverages, kLags> before_{};  // newest first
  // Mean products of the averages, 0 to kLags frames apart.
  std::array<double, kLags + 1> products_{kFirstFreedom};
};

}  // namespace alidade
