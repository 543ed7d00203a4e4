#pragma once
// SvgPlot: one diagram as an <svg> element for a page that defines the colours (class names a, b, bad,
// soft as `--a` etc.). Axes with round ticks, names with units; series are drawn in the order in which
// they are added. Points beyond the vertical range stand on its edge; points that cover each other are
// drawn once, and of very many each n-th. A plot to which no dot, line or rectangle was added says "no data". The element's
// class is `wide` or `half`, for narrow screens. Pure; allocates.

#include <string>
#include <vector>

namespace alidade {

// &, <, > and quotes as entities: for whatever comes from a file or a command line.
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
  // Size in px. Axes must be finite with low < high. y_down: images, whose rows run downwards.
  SvgPlot(int width, int height, PlotAxis x, PlotAxis y, bool y_down = false);

  void dots(const std::vector<PlotPoint>& points, const char* colour, double diameter = 2.2);
  void line(const std::vector<PlotPoint>& points, const char* colour);
  void arrow(const PlotPoint& from, const PlotPoint& to);
  // From `low` to `high` over the whole width.
  void band(double low, double high);
  // From `from` to `to` over the whole height: where there is nothing to show.
  void shade(double from, double to);
  void level(double y);
  void rectangle(const PlotPoint& from, const PlotPoint& to, const char* colour, double opacity);
  // Short strokes on the x axis.
  void ticks(const std::vector<double>& x, const char* colour);

  // The whole element. label: for readers who cannot see it.
  [[nodiscard]] std::string svg(const std::string& label) const;

  // Size of one unit of the axes in px.
  [[nodiscard]] double x_scale() const;
  [[nodiscard]] double y_scale() const;

  // Room for the axes; the rest of the size is the plane.
  static constexpr int kLeft = 66;
  static constexpr int kRight = 14;
  static constexpr int kTop = 10;
  static constexpr int kBottom = 44;
  static constexpr int kWide = 600;  // from here on a plot is `wide`

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
