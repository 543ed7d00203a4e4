#pragma once
// PlaceNoise: sigma of a feature's place by its size, as large features are less sharp. It starts
// with a guess and learns from an adjustment's residuals. For each bin of sizes sigma is the median
// of the errors' norms, divided by the median norm of two standard normal numbers.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/model/median.h"

namespace alidade {

class PlaceNoise {
 public:
  PlaceNoise() {
    for (std::size_t i = 0; i < sigma_.size(); ++i) {
      sigma_[i] = 0.08 * std::pow(2, 0.8 * static_cast<double>(i));
    }
  }

  // px; of each coordinate of a feature of this size (sigma of the blob, px).
  [[nodiscard]] double sigma_px(double scale_px) const { return sigma_[bin(scale_px)]; }

  // scale_and_error: size of the feature and norm of the error, px. A bin with fewer than 100
  // errors learns nothing, but is taken to be no sharper than the bin below it.
  void learn(const std::vector<std::pair<double, double>>& scale_and_error) {
    constexpr std::size_t kFewest = 100;
    const double median_of_norm = std::sqrt(2 * std::log(2.0));
    std::array<std::vector<double>, kBins> errors;
    for (const auto& [scale, error] : scale_and_error) errors[bin(scale)].push_back(error);
    for (std::size_t i = 0; i < kBins; ++i) {
      if (errors[i].size() >= kFewest) {
        sigma_[i] = std::max(0.01, median(errors[i]) / median_of_norm);
      } else if (i > 0) {
        sigma_[i] = std::max(sigma_[i], sigma_[i - 1]);
      }
    }
  }

 private:
  static constexpr std::size_t kBins = 8;
  [[nodiscard]] static std::size_t bin(double scale_px) {
    const double at = 2 * std::log2(std::max(scale_px, 1.0) / 1.4);
    return static_cast<std::size_t>(std::clamp(at, 0.0, kBins - 1.0));
  }
  std::array<double, kBins> sigma_{};
};

}  // namespace alidade
