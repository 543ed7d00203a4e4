#pragma once
// Calibrations of many recordings against their truth (truth.yaml), another program's estimates (peer.yaml)
// and the best possible standard deviations (limit.yaml). What is not there is shown as '-'.
//   error / limit   root mean square; with the 95 % interval of sqrt(chi^2_n / n)
//   ANEES           mean of (error / sigma)^2, of axes e^T P^-1 e / 2; with the interval of chi^2_n / n
// Pure text out; allocates.

#include <array>
#include <string>
#include <vector>

#include "core/model/calibration.h"
#include "edge_app/config/value_file.h"

namespace alidade::test {

struct ComparedRun {
  std::string name;
  CalibrationValues truth;
  CalibrationValues peer;
  CalibrationLimits limits;
};

// What a recording's folder holds of them. False with one line in *error if a file is malformed.
[[nodiscard]] bool load_known_values(const std::string& directory, ComparedRun* run,
                                     std::string* error);

class CalibrationComparison {
 public:
  // The run as text.
  std::string add(const ComparedRun& known, const Calibration& estimate);
  void add_failure(const std::string& message) { failures_.push_back(message); }

  // The tables at the end.
  [[nodiscard]] std::string statistics() const;
  [[nodiscard]] std::size_t failures() const { return failures_.size(); }

  static constexpr std::size_t kQuantities = 9;

 private:
  struct Tally {
    std::vector<double> errors;  // magnitudes, in the unit shown
    std::vector<double> ratios;  // to the limit
    std::vector<double> nees;    // divided by the degrees of freedom
  };
  struct Pair {
    Tally ours;
    Tally peer;
  };
  std::array<Pair, kQuantities> tallies_;
  std::size_t runs_ = 0;
  std::vector<std::string> failures_;
};

}  // namespace alidade::test
