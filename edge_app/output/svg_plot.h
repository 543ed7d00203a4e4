#pragma once
// SvgPlot: one diagram as an <svg> element. A `colour` is one of the classes a, b, bad, ink and
// faint, which html_page() defines. Axes have round ticks and labels with units. Series are drawn
// in the order in which they are added. What lies beyond the vertical range is drawn at its edge;
// dots beyond the horizontal range, or not finite, are left out. Dots that cover each other are
// drawn once; of more than 6000 only each n-th. A plot without dots, lines and rectangles says "no
// data". The element's class is `wide` or `half`, for narrow screens. Pure; allocates.

#include <string>
#include <vector>

namespace alidade {

// Writes &, <, > and quotes as entities, for text from files or the command line.
std::string escape_html(const std::string& text);

struct PlotPoint {
  double x = 0;
  double y = 0;
};

struct PlotAxis {
  double low = 0;
  double high = 1;
  std::string label;  // plain text with the unit
};

class SvgPlot {
 public:
  // Size in px. Axes must be finite with low < high. y_down: y grows downwards, as in images.
  SvgPlot(int width, int height, PlotAxis x, PlotAxis y, bool y_down = false);

  // diameter: px.
  void dots(const std::vector<PlotPoint>& points, const char* colour, double diameter = 2.2);
  // The coordinates of lines, areas and everything below must be finite.
  void line(const std::vector<PlotPoint>& points, const char* colour);
  // Fills the area between the lines `low` and `high`, without drawing these lines.
  void area(const std::vector<PlotPoint>& low, const std::vector<PlotPoint>& high,
            const char* colour);
  // A line from `from`, where it has a dot, to `to`.
  void arrow(const PlotPoint& from, const PlotPoint& to);
  // A grey band from `low` to `high` over the whole width.
  void band(double low, double high);
  // Shades the range of x from `from` to `to`, which has no data, over the whole height.
  void shade(double from, double to);
  // A horizontal line over the whole width.
  void level(double y);
  void rectangle(const PlotPoint& from, const PlotPoint& to, const char* colour, double opacity);
  // Short strokes on the x axis.
  void ticks(const std::vector<double>& x, const char* colour);

  // The whole element. label: text for readers who cannot see the plot.
  [[nodiscard]] std::string svg(const std::string& label) const;

  // px for one unit of the axis.
  [[nodiscard]] double x_scale() const;
  [[nodiscard]] double y_scale() const;

  // px, margins for the axes; the rest is the plot area.
  static constexpr int kLeft = 66;
  static constexpr int kRight = 14;
  static constexpr int kTop = 10;
  static constexpr int kBottom = 44;
  static constexpr int kWide = 600;  // px; from this width on the class is `wide`

 private:
  [[nodiscard]] double px(double x) const;
  [[nodiscard]] double py(double y) const;
  [[nodiscard]] std::string axes() const;

  int width_;
  int height_;
  PlotAxis x_;
  PlotAxis y_;
  bool y_down_;
  std::string body_;
  bool has_data_ = false;
};

}  // namespace alidade
