#pragma once
// An estimate and its standard deviation as a person reads them: two digits of sigma, the value to the same decimals.

#include <string>

namespace alidade {

// sigma 0: the value is exact.
[[nodiscard]] std::string value_text(double value, double sigma);
[[nodiscard]] std::string sigma_text(double sigma);

}  // namespace alidade
