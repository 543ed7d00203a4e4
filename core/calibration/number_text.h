#pragma once
// Numbers as text and back, in the classic locale, whatever the program's. Allocates.

#include <optional>
#include <string>

namespace alidade {

// The text's value; empty unless all of it is one finite decimal number.
[[nodiscard]] std::optional<double> number_of(const std::string& text);

// The shortest text that reads back as the same bits: 55.4 rather than 55.399999999999999.
[[nodiscard]] std::string exact_text(double value);

// For messages: up to 6 significant digits.
[[nodiscard]] std::string short_text(double value);

// The texts below are for people and never show -0.
// With a fixed number of decimals.
[[nodiscard]] std::string rounded_text(double value, int decimals);

// The value alone, with the decimals (0 to 12) that show two digits of sigma. sigma 0: the value is
// exact and gets up to 10 digits.
[[nodiscard]] std::string value_text(double value, double sigma);
// sigma with as many decimals; below 1e-4 as "1.2e-05". "exact" if it is 0.
[[nodiscard]] std::string sigma_text(double sigma);
// Both: "940.12 +- 0.34 px", or "940 px, exact". unit may be empty.
[[nodiscard]] std::string estimate_text(double value, double sigma, const std::string& unit);

}  // namespace alidade
