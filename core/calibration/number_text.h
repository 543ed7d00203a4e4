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

}  // namespace alidade
