#include "core/calibration/number_text.h"

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

}  // namespace alidade
