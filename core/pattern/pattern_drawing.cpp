#include "core/pattern/pattern_drawing.h"

#include <apriltag.h>
#include <tag36h11.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "core/pattern/aruco_markers.h"

namespace alidade {
namespace {

struct Paper {
  const char* name;
  double width_mm, height_mm;
};
constexpr std::array<Paper, 6> kPapers = {{{"a4", 210, 297},
                                           {"a3", 297, 420},
                                           {"a2", 420, 594},
                                           {"a1", 594, 841},
                                           {"a0", 841, 1189},
                                           {"letter", 215.9, 279.4}}};
constexpr double kMargin_mm = 5;   // left white by printers
constexpr double kNoSeam = 1.002;  // slightly wider, so that no seam shows between cells
constexpr double kCircle = 0.5;    // radius, as a share of half the least distance of two centres

struct Shapes {
  std::string svg;
  double width_mm = 0, height_mm = 0;

  void rectangle(double x, double y, double w, double h) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "<rect x=\"%.4f\" y=\"%.4f\" width=\"%.4f\" height=\"%.4f\"/>\n", x, y, w, h);
    svg += text;
  }
  void circle(double x, double y, double r) {
    char text[160];
    std::snprintf(text, sizeof text, "<circle cx=\"%.4f\" cy=\"%.4f\" r=\"%.4f\"/>\n", x, y, r);
    svg += text;
  }
};

Shapes chessboard(const KnownPattern& pattern, double size_mm) {
  Shapes shapes;
  // With room for a white square around.
  shapes.width_mm = (pattern.columns + 1) * size_mm;
  shapes.height_mm = (pattern.rows + 1) * size_mm;
  for (int row = 0; row <= pattern.rows; ++row) {
    for (int column = row % 2; column <= pattern.columns; column += 2) {
      shapes.rectangle(column * size_mm, row * size_mm, size_mm, size_mm);
    }
  }
  return shapes;
}

Shapes circles(const KnownPattern& pattern) {
  Shapes shapes;
  const bool symmetric = pattern.kind == PatternKind::kSymmetricCircles;
  const double size_mm = 1000 * pattern.size_m;
  // The nearest neighbour in an asymmetric grid is diagonal.
  const double radius = kCircle * size_mm * (symmetric ? 0.5 : std::sqrt(0.5));
  for (const Vector3<double>& p : pattern.points_m()) {
    const double x = 1000 * p.x() + 2 * radius;
    const double y = 1000 * p.y() + 2 * radius;
    shapes.circle(x, y, radius);
    shapes.width_mm = std::max(shapes.width_mm, x + 2 * radius);
    shapes.height_mm = std::max(shapes.height_mm, y + 2 * radius);
  }
  return shapes;
}

// As kalibr draws it: black borders of two cells, black squares beside each corner. around: also
// outside the grid, where detectors can do without them.
Shapes april_grid(const KnownPattern& pattern, bool around) {
  constexpr int kCode = 6;  // cells a side
  constexpr int kBorder = 2;
  constexpr int kSide = kCode + 2 * kBorder;
  Shapes shapes;
  const double size_mm = 1000 * pattern.size_m;
  const double gap_mm = size_mm * pattern.gap;
  const double pitch = size_mm + gap_mm;
  const double cell = size_mm / kSide;
  const double start = around ? gap_mm : 0;  // of the first tag
  const auto run = [&](double left, double top, int column, int row, int width, int height) {
    shapes.rectangle(left + column * cell, top + row * cell, (width - 1 + kNoSeam) * cell,
                     (height - 1 + kNoSeam) * cell);
  };
  apriltag_family_t* family = tag36h11_create();
  for (int tag = 0; tag < pattern.columns * pattern.rows; ++tag) {
    const int row_below = tag / pattern.columns;
    const double left = start + tag % pattern.columns * pitch;
    const double top = start + (pattern.rows - 1 - row_below) * pitch;
    shapes.rectangle(left, top, size_mm, kBorder * cell);
    shapes.rectangle(left, top + (kSide - kBorder) * cell, size_mm, kBorder * cell);
    run(left, top, 0, kBorder, kBorder, kCode);
    shapes.rectangle(left + (kSide - kBorder) * cell, top + kBorder * cell, kBorder * cell,
                     kCode * cell);
    image_u8_t* image = apriltag_to_image(family, tag);
    const int before = (image->width - kCode) / 2;
    for (int y = 0; y < kCode; ++y) {
      const auto* row = image->buf + (y + before) * image->stride + before;
      for (int x = 0; x < kCode; ++x) {
        int width = 0;
        while (x + width < kCode && row[x + width] == 0) ++width;
        if (width > 0) run(left, top, x + kBorder, y + kBorder, width, 1);
        x += width;
      }
    }
    // As image_u8_destroy() does, which the shared library does not export.
    std::free(image->buf);
    std::free(image);
  }
  tag36h11_destroy(family);
  for (int row = around ? 0 : 1; row < pattern.rows + (around ? 1 : 0); ++row) {
    for (int column = around ? 0 : 1; column < pattern.columns + (around ? 1 : 0); ++column)
      shapes.rectangle(start + column * pitch - gap_mm, start + row * pitch - gap_mm, gap_mm,
                       gap_mm);
  }
  shapes.width_mm = pattern.columns * pitch - gap_mm + 2 * start;
  shapes.height_mm = pattern.rows * pitch - gap_mm + 2 * start;
  return shapes;
}

// As OpenCV draws it from 4.6 on: its upper left square is black.
Shapes charuco(const KnownPattern& pattern) {
  Shapes shapes;
  const double size_mm = 1000 * pattern.size_m;
  const double marker_mm = 1000 * pattern.marker_m;
  shapes.width_mm = pattern.columns * size_mm;
  shapes.height_mm = pattern.rows * size_mm;
  int id = 0;
  for (int row = 0; row < pattern.rows; ++row) {
    for (int column = 0; column < pattern.columns; ++column) {
      if ((column + row) % 2 == 0) {
        shapes.rectangle(column * size_mm, row * size_mm, size_mm, size_mm);
        continue;
      }
      const cv::Mat cells = internal::marker_cells(pattern.dictionary, id++);
      const double cell = marker_mm / cells.cols;
      const double left = column * size_mm + (size_mm - marker_mm) / 2;
      const double top = row * size_mm + (size_mm - marker_mm) / 2;
      for (int y = 0; y < cells.rows; ++y) {
        for (int x = 0; x < cells.cols; ++x) {
          if (cells.at<std::uint8_t>(y, x) != 0) continue;
          shapes.rectangle(left + x * cell, top + y * cell, cell * kNoSeam, cell * kNoSeam);
        }
      }
    }
  }
  return shapes;
}

Shapes shapes_of(const KnownPattern& pattern) {
  switch (pattern.kind) {
    case PatternKind::kChessboard:
      return chessboard(pattern, 1000 * pattern.size_m);
    case PatternKind::kAprilGrid:
      return april_grid(pattern, true);
    case PatternKind::kCharuco:
      return charuco(pattern);
    case PatternKind::kAsymmetricCircles:
    case PatternKind::kSymmetricCircles:
      break;
  }
  return circles(pattern);
}

// What a person measures to know that size, in words.
const char* size_name(PatternKind kind) {
  switch (kind) {
    case PatternKind::kAsymmetricCircles:
      return "half the distance of two circles in a row";
    case PatternKind::kSymmetricCircles:
      return "the distance of two neighbouring circles";
    case PatternKind::kAprilGrid:
      return "the side of a tag with its black border";
    case PatternKind::kChessboard:
    case PatternKind::kCharuco:
      break;
  }
  return "the side of a square";
}

constexpr double kRuler_mm = 100;
constexpr double kCaption_mm = 16;  // height of ruler and caption, with the white above them

// A ruler and two lines of text, from the upper left corner on; unit: mm. No rectangle and no
// circle, as these are the pattern's.
std::string caption_of(const KnownPattern& pattern, const Shapes& shapes,
                       const std::string& paper) {
  constexpr double kLine_mm = 7;  // of the ruler, from the top
  char text[400];
  std::string ticks;
  for (int mm = 0; mm <= kRuler_mm; ++mm) {
    std::snprintf(text, sizeof text, "M%d %gv%g", mm, kLine_mm,
                  mm % 50 == 0   ? -2.6
                  : mm % 10 == 0 ? -1.8
                                 : -0.9);
    ticks += text;
  }
  std::snprintf(text, sizeof text,
                "<path fill=\"none\" stroke=\"#555\" stroke-width=\"0.15\" d=\"");
  std::string out = text + ticks;
  std::snprintf(
      text, sizeof text,
      "M0 %gh%g\"/>\n<g font-family=\"sans-serif\" font-size=\"2.6\" fill=\"#333\">\n"
      "<text x=\"%g\" y=\"%g\">%g mm: measure this line. If it is not %g mm long, print at "
      "100 %%.</text>\n",
      kLine_mm, kRuler_mm, kRuler_mm + 2, kLine_mm, kRuler_mm, kRuler_mm);
  out += text;
  const std::string name = to_string(pattern);
  std::snprintf(text, sizeof text,
                "<text x=\"0\" y=\"11\">Alidade --pattern %s, %.0f x %.0f mm on %s</text>\n",
                name.c_str(), shapes.width_mm, shapes.height_mm, paper.c_str());
  out += text;
  std::snprintf(text, sizeof text,
                "<text x=\"0\" y=\"14.6\">%gmm is %s. If another length is measured on paper, give "
                "that one.</text>\n</g>\n",
                1000 * pattern.size_m, size_name(pattern.kind));
  return out + text;
}

// Width and height between the margins, mm. Landscape if the pattern is wider than high.
std::pair<double, double> room_on(const Paper& paper, const Shapes& shapes) {
  const double width = paper.width_mm - 2 * kMargin_mm;
  const double height = paper.height_mm - 2 * kMargin_mm;
  return shapes.width_mm > shapes.height_mm ? std::pair(height, width) : std::pair(width, height);
}

bool fits(const Shapes& shapes, const Paper& paper) {
  const auto [width, height] = room_on(paper, shapes);
  return shapes.width_mm <= width && shapes.height_mm <= height;
}

}  // namespace

std::optional<std::string> draw_pattern(const KnownPattern& pattern, const std::string& paper,
                                        std::string* error) {
  const auto* found =
      std::find_if(kPapers.begin(), kPapers.end(), [&](const Paper& p) { return paper == p.name; });
  if (found == kPapers.end()) {
    *error = "'" + paper + "' is not a known paper; expected a4, a3, a2, a1, a0 or letter";
    return std::nullopt;
  }
  const Paper& sheet = *found;
  Shapes shapes = shapes_of(pattern);
  if (pattern.kind == PatternKind::kAprilGrid && !fits(shapes, sheet))
    shapes = april_grid(pattern, false);
  char text[400];
  if (!fits(shapes, sheet)) {
    const auto [width, height] = room_on(sheet, shapes);
    std::snprintf(text, sizeof text,
                  "the pattern is %.0f x %.0f mm, and %s holds %.0f x %.0f mm; choose a larger "
                  "paper or a smaller pattern",
                  shapes.width_mm, shapes.height_mm, sheet.name, width, height);
    *error = text;
    return std::nullopt;
  }
  const auto [room_width, room_height] = room_on(sheet, shapes);
  const double width = room_width + 2 * kMargin_mm;
  const double height = room_height + 2 * kMargin_mm;
  const bool below = shapes.height_mm + kCaption_mm <= room_height;
  const bool beside = !below && shapes.width_mm + kCaption_mm <= room_width;
  const double left = (width - shapes.width_mm - (beside ? kCaption_mm : 0)) / 2;
  const double top = (height - shapes.height_mm - (below ? kCaption_mm : 0)) / 2;
  std::snprintf(text, sizeof text,
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.1fmm\" height=\"%.1fmm\" "
                "viewBox=\"0 0 %.1f %.1f\">\n"
                "<g transform=\"translate(%.3f %.3f)\" shape-rendering=\"geometricPrecision\">\n",
                width, height, width, height, left, top);
  std::string page = text + shapes.svg + "</g>\n";
  if (below || beside) {
    // At the edge of the paper, far from the pattern, which wants white around.
    if (below) {
      std::snprintf(text, sizeof text, "<g transform=\"translate(%.3f %.3f)\">\n", 2 * kMargin_mm,
                    height - kMargin_mm - kCaption_mm);
    } else {
      std::snprintf(text, sizeof text, "<g transform=\"translate(%.3f %.3f) rotate(-90)\">\n",
                    width - kMargin_mm - kCaption_mm, height - 2 * kMargin_mm);
    }
    page += text + caption_of(pattern, shapes, paper) + "</g>\n";
  }
  return page + "</svg>\n";
}

}  // namespace alidade
