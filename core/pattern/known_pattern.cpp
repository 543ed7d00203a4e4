#include "core/pattern/known_pattern.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <locale>
#include <sstream>

#include "core/pattern/aruco_markers.h"

namespace alidade {
namespace {

constexpr const char* kExamples =
    "chessboard:9x6:25mm, circles:4x11:20mm, symmetric-circles:7x6:20mm, aprilgrid:6x6:30mm:0.3 or "
    "charuco:9x6:30mm:22mm:4x4_50";

struct NamedKind {
  const char* name;
  PatternKind kind;
};
constexpr std::array<NamedKind, 5> kKinds = {{{"chessboard", PatternKind::kChessboard},
                                              {"circles", PatternKind::kAsymmetricCircles},
                                              {"symmetric-circles", PatternKind::kSymmetricCircles},
                                              {"aprilgrid", PatternKind::kAprilGrid},
                                              {"charuco", PatternKind::kCharuco}}};

struct Unit {
  const char* name;
  double metres;
};
constexpr std::array<Unit, 4> kUnits = {{{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}, {"in", 0.0254}}};

// A number and the text after it, in the classic locale.
std::optional<double> leading_number(const std::string& text, std::string* rest) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  double value = 0;
  if (!(in >> value) || !std::isfinite(value)) return std::nullopt;
  rest->clear();
  std::getline(in, *rest, '\0');
  return value;
}

std::optional<double> length_of(const std::string& text) {
  std::string unit;
  const std::optional<double> value = leading_number(text, &unit);
  if (!value) return std::nullopt;
  for (const Unit& known : kUnits) {
    if (unit == known.name) return *value * known.metres;
  }
  return std::nullopt;
}

bool counts_of(const std::string& text, int* columns, int* rows) {
  const std::size_t by = text.find('x');
  if (by == std::string::npos || by == 0 || by + 1 == text.size()) return false;
  if (text.find_first_not_of("0123456789x") != std::string::npos ||
      text.find('x', by + 1) != std::string::npos)
    return false;
  if (text.size() > 9) return false;
  *columns = std::atoi(text.substr(0, by).c_str());
  *rows = std::atoi(text.substr(by + 1).c_str());
  return true;
}

// Accepts OpenCV's spelling as well: DICT_4X4_50.
std::optional<int> dictionary_of(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (text.rfind("dict_", 0) == 0) text.erase(0, 5);
  for (std::size_t i = 0; i < kMarkerDictionaries.size(); ++i) {
    if (text == kMarkerDictionaries[i].name) return static_cast<int>(i);
  }
  return std::nullopt;
}

// Reads what follows a square's side: the marker's side and the dictionary. Returns what is wrong,
// or an empty text.
std::string read_markers(const std::vector<std::string>& parts, KnownPattern* pattern) {
  const std::optional<double> marker = length_of(parts[3]);
  if (!marker) return "'" + parts[3] + "' is not a marker's length with its unit, mm, cm, m or in";
  if (!(*marker > 0 && *marker < pattern->size_m)) {
    return "a marker of " + parts[3] + " does not fit into a square of " + parts[2] +
           "; give the square first, then the marker, about 0.75 of it";
  }
  pattern->marker_m = *marker;
  if (parts.size() > 4) {
    const std::optional<int> dictionary = dictionary_of(parts[4]);
    if (!dictionary) {
      return "'" + parts[4] +
             "' is not a known dictionary; known are 4x4_50, _100, _250, _1000, the same with 5x5, "
             "6x6 and "
             "7x7, aruco_original, apriltag_16h5, _25h9, _36h10 and _36h11";
    }
    pattern->dictionary = *dictionary;
  }
  const MarkerDictionary& dictionary =
      kMarkerDictionaries[static_cast<std::size_t>(pattern->dictionary)];
  if (pattern->markers() > dictionary.markers) {
    return "the board has " + std::to_string(pattern->markers()) + " markers, but dictionary " +
           dictionary.name + " has only " + std::to_string(dictionary.markers) +
           "; name the dictionary that it was printed with";
  }
  return "";
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ':');) parts.push_back(part);
  return parts;
}

}  // namespace

std::vector<Vector3<double>> KnownPattern::points_m() const {
  std::vector<Vector3<double>> points;
  const int less = kind == PatternKind::kCharuco ? 1 : 0;  // its corners lie between squares
  for (int row = 0; row < rows - less; ++row) {
    for (int column = 0; column < columns - less; ++column) {
      if (kind == PatternKind::kAsymmetricCircles) {
        points.emplace_back((2 * column + row % 2) * size_m, row * size_m, 0);
      } else if (kind == PatternKind::kAprilGrid) {
        const double x = column * size_m * (1 + gap);
        const double y = (rows - 1 - row) * size_m * (1 + gap);
        points.emplace_back(x, y + size_m, 0);
        points.emplace_back(x + size_m, y + size_m, 0);
        points.emplace_back(x + size_m, y, 0);
        points.emplace_back(x, y, 0);
      } else {
        points.emplace_back(column * size_m, row * size_m, 0);
      }
    }
  }
  return points;
}

bool KnownPattern::is_symmetric() const {
  switch (kind) {
    case PatternKind::kChessboard:
    case PatternKind::kSymmetricCircles:
      // A chessboard's colours show the half turn for half of all boards, but not to OpenCV.
      return true;
    case PatternKind::kAsymmetricCircles:
      return rows % 2 == 1;
    case PatternKind::kAprilGrid:
    case PatternKind::kCharuco:
      return false;
  }
  return false;
}

std::optional<KnownPattern> parse_pattern(const std::string& text, std::string* error) {
  const std::vector<std::string> parts = split(text);
  const auto wrong = [&](const std::string& what) {
    *error = "'" + text + "': " + what + "; expected " + kExamples;
    return std::nullopt;
  };
  if (parts.empty()) return wrong("no pattern is given");
  KnownPattern pattern;
  bool known = false;
  for (const NamedKind& named : kKinds) {
    if (parts[0] != named.name) continue;
    pattern.kind = named.kind;
    known = true;
  }
  if (!known) return wrong("'" + parts[0] + "' is not a kind of pattern");
  const bool grid = pattern.kind == PatternKind::kAprilGrid;
  const bool charuco = pattern.kind == PatternKind::kCharuco;
  if (charuco && !internal::has_aruco()) {
    *error = "'" + text +
             "': this build of alidade cannot find ChArUco boards; build it with Debian's package "
             "libopencv-contrib-dev installed";
    return std::nullopt;
  }
  if (charuco && parts.size() != 4 && parts.size() != 5)
    return wrong("it needs kind, counts, square, marker and optionally a dictionary");
  if (!charuco && parts.size() != (grid ? 4U : 3U))
    return wrong(grid ? "it needs kind, counts, length and gap"
                      : "it needs kind, counts and length");
  if (!counts_of(parts[1], &pattern.columns, &pattern.rows))
    return wrong("'" + parts[1] + "' is not COLUMNSxROWS");
  const int least = grid ? 1 : 3;
  if (pattern.columns < least || pattern.rows < least || pattern.columns > 100 ||
      pattern.rows > 100) {
    return wrong("'" + parts[1] + "' is out of range, " + std::to_string(least) + " to 100");
  }
  if (grid && pattern.columns * pattern.rows > 587) return wrong("its family has only 587 tags");
  const std::optional<double> size = length_of(parts[2]);
  if (!size) return wrong("'" + parts[2] + "' is not a length with its unit, mm, cm, m or in");
  if (!(*size >= 1e-4 && *size <= 10))
    return wrong("'" + parts[2] + "' is out of range, 0.1 mm to 10 m");
  pattern.size_m = *size;
  if (charuco) {
    const std::string fault = read_markers(parts, &pattern);
    if (!fault.empty()) return wrong(fault);
  }
  if (grid) {
    std::string rest;
    const std::optional<double> gap = leading_number(parts[3], &rest);
    if (!gap || !rest.empty() || !(*gap > 0 && *gap <= 2))
      return wrong("'" + parts[3] +
                   "' is not a gap in parts of a tag's side, above 0 and at most 2");
    pattern.gap = *gap;
  }
  return pattern;
}

std::string to_string(const KnownPattern& pattern) {
  const auto* const kind = std::find_if(
      kKinds.begin(), kKinds.end(), [&](const NamedKind& one) { return one.kind == pattern.kind; });
  char text[120];
  std::snprintf(text, sizeof text, "%s:%dx%d:%gmm", kind->name, pattern.columns, pattern.rows,
                1000 * pattern.size_m);
  std::string name = text;
  if (pattern.kind == PatternKind::kAprilGrid) {
    std::snprintf(text, sizeof text, ":%g", pattern.gap);
    name += text;
  } else if (pattern.kind == PatternKind::kCharuco) {
    std::snprintf(text, sizeof text, ":%gmm:%s", 1000 * pattern.marker_m,
                  kMarkerDictionaries[static_cast<std::size_t>(pattern.dictionary)].name);
    name += text;
  }
  return name;
}

}  // namespace alidade
