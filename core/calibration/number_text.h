#pragma once
// Numbers as text and back, in the classic locale, whatever the program's. Allocates.

#include <optional>
#include <string>

namespace alidade {

// A finite decimal number from the first to the last character, or nothing.
[[nodiscard]] std::optional<double> number_of(const std::string& text);

// The shortest text that reads back as the same bits: 55.4 rather than 55.399999999999999.
[[nodiscard]] std::string exact_text(double value);

// For messages: as many digits as a person would write.
[[nodiscard]] std::string short_text(double value);

// All below are for people, and never say -0.
// So many decimals.
[[nodiscard]] std::string rounded_text(double value, int decimals);

// An estimate and its standard deviation: two digits of sigma, the value to the same decimals. sigma 0: the value is exact, and has its own
// digits.
[[nodiscard]] std::string value_text(double value, double sigma);
[[nodiscard]] std::string sigma_text(double sigma);
// Both: "940.12 +- 0.34 px", or "940 px, exact". unit may be empty.
[[nodiscard]] std::string estimate_text(double value, double sigma, const std::string& unit);

}  // namespace alidade
