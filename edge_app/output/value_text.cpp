#include "edge_app/output/value_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

int decimals_for(double sigma) {
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 12);
}

}  // namespace

std::string value_text(double value, double sigma) {
  return sigma > 0 ? fmt::format("{:.{}f}", value, decimals_for(sigma)) : fmt::format("{}", value);
}

std::string sigma_text(double sigma) {
  if (!(sigma > 0)) return "exact";
  return sigma < 1e-4 ? fmt::format("{:.1e}", sigma)
                      : fmt::format("{:.{}f}", sigma, decimals_for(sigma));
}

}  // namespace alidade
