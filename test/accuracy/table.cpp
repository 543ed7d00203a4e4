#include "test/accuracy/table.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

namespace alidade::test {

void Table::print(std::ostream& out) const {
  std::vector<std::size_t> width(header.size(), 0);
  const auto widen = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) width[i] = std::max(width[i], cells[i].size());
  };
  widen(header);
  for (const auto& row : rows) widen(row);
  const auto print_row = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const auto columns = static_cast<int>(width[i]);
      if (i == 0) {
        out << "  " << std::left << std::setw(columns) << cells[i] << std::right;
      } else {
        out << "  " << std::setw(columns) << cells[i];
      }
    }
    out << "\n";
  };
  out << "\n" << title << "\n";
  print_row(header);
  for (const auto& row : rows) print_row(row);
  for (const auto& note : notes) out << "  " << note << "\n";
  out.flush();
}

nlohmann::json Table::to_json() const {
  return {{"title", title}, {"header", header}, {"rows", rows}, {"notes", notes}};
}

std::string number(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  std::ostringstream text;
  const double size = std::abs(value);
  if (size > 0 && (size < 1e-3 || size >= 1e5)) {
    text << std::scientific << std::setprecision(digits - 1) << value;
  } else {
    const int before_point = size > 0 ? static_cast<int>(std::floor(std::log10(size))) + 1 : 1;
    text << std::fixed << std::setprecision(std::max(0, digits - before_point)) << value;
  }
  return text.str();
}

}  // namespace alidade::test
