#include "core/realtime/oe_mode/error_sharing.h"

#include <algorithm>
#include <numeric>

namespace alidade {

void ErrorSharing::note(const ResidualSquares& single, const ResidualSquares& large,
                        const LargeAverages& averages) {
  if (!(single.freedom > 0) || !(large.freedom > 0)) return;
  constexpr double kKept = 1 - 1 / kMemory;
  const auto add = [](const ResidualSquares& of_frame, ResidualSquares* to) {
    *to = {kKept * to->sum + of_frame.sum, kKept * to->freedom + of_frame.freedom};
  };
  add(single, &single_);
  add(large, &large_);
  for (std::size_t lag = 0; lag <= kLags; ++lag) {
    const LargeAverages& other = lag == 0 ? averages : before_[lag - 1];
    products_[lag] = kKept * products_[lag] +
                     std::inner_product(averages.begin(), averages.end(), other.begin(), 0.0);
  }
  std::copy_backward(before_.begin(), before_.end() - 1, before_.end());
  before_[0] = averages;
}

double ErrorSharing::repetition() const {
  constexpr double kNoCorrelation = 0.1;  // and none beyond
  double sum = 1;
  for (std::size_t lag = 1; lag <= kLags; ++lag) {
    const double correlation = products_[lag] / products_[0];
    if (!(correlation > kNoCorrelation)) break;
    sum += 2 * correlation;
  }
  return sum;
}

double ErrorSharing::factor() const {
  // Residuals below their covariances do not shrink these.
  const double single = std::max(1.0, single_.sum / single_.freedom);
  const double sharing = std::max(1.0, large_.sum / large_.freedom / single);
  return 1 + (sharing - 1) * repetition();
}

}  // namespace alidade
