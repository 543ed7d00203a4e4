#include "edge_app/output/lens_table.h"

#include <cstddef>

#include "core/calibration/number_text.h"

namespace alidade {

std::vector<LensTableRow> lens_table(const PatternCalibration& calibration) {
  std::vector<LensTableRow> rows;
  for (int i = 0; i < kLensParameterCount; ++i) {
    const auto parameter = static_cast<LensParameter>(i);
    const bool is_delay = parameter == LensParameter::kLineDelay;
    const double unit = is_delay ? 1e-6 : 1;
    const double sigma = calibration.sigma(parameter) / unit;
    rows.push_back({kLensParameterNames[static_cast<std::size_t>(i)],
                    value_text(calibration.lens[i] / unit, sigma), sigma_text(sigma),
                    is_delay                        ? "us/row"
                    : i < index(LensParameter::kK1) ? "px"
                                                    : ""});
  }
  return rows;
}

}  // namespace alidade
