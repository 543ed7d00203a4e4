#include "core/calibration/number_text.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>

namespace alidade {

namespace {

std::string text_of(double value, int digits) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << std::setprecision(digits) << value;
  return stream.str();
}

// Decimals that show two digits of sigma.
int decimals_for(double sigma) {
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 12);
}

}  // namespace

std::optional<double> number_of(const std::string& text) {
  if (text.find_first_not_of("0123456789+-.eE") != std::string::npos) return std::nullopt;
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double value = 0;
  if (stream >> value && stream.peek() == std::istringstream::traits_type::eof() &&
      std::isfinite(value)) {
    return value;
  }
  return std::nullopt;
}

std::string exact_text(double value) {
  for (int digits = 15; digits < 17; ++digits) {
    std::string text = text_of(value, digits);
    if (number_of(text) == value) return text;
  }
  return text_of(value, 17);
}

std::string short_text(double value) { return text_of(value, 6); }

std::string rounded_text(double value, int decimals) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << std::fixed << std::setprecision(decimals) << value;
  std::string text = stream.str();
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text;
}

std::string value_text(double value, double sigma) {
  // The digits that a conversion between units leaves right. Adding 0 avoids -0.
  constexpr int kExactDigits = 10;
  return sigma > 0 ? rounded_text(value, decimals_for(sigma)) : text_of(value + 0, kExactDigits);
}

std::string sigma_text(double sigma) {
  if (!(sigma > 0)) return "exact";
  if (sigma >= 1e-4) return rounded_text(sigma, decimals_for(sigma));
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << std::scientific << std::setprecision(1) << sigma;
  return stream.str();
}

std::string estimate_text(double value, double sigma, const std::string& unit) {
  const std::string of = unit.empty() ? "" : " " + unit;
  if (!(sigma > 0)) return value_text(value, 0) + of + ", exact";
  return value_text(value, sigma) + " +- " + sigma_text(sigma) + of;
}

}  // namespace alidade
