#include "edge_app/output/pattern_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/calibration/number_text.h"
#include "core/pattern/image_cells.h"
#include "core/pattern/pattern_view.h"
#include "edge_app/output/html_page.h"
#include "edge_app/output/lens_table.h"
#include "edge_app/output/report_page.h"
#include "edge_app/output/svg_plot.h"

namespace alidade {
namespace {

using report::kDegrees;
using report::kHalf_px;
using report::kWide_px;

// A residual with its time and place, for all sections.
struct ShownResidual {
  double time_s;  // since the first frame
  Vector2<double> u;
  Vector2<double> error;  // px, measured minus predicted
};

class PatternPage {
 public:
  explicit PatternPage(const PatternReportInput& report)
      : report_(report), start_s_(report.data.frames.front().time_s) {
    with_ = shown(report.data, report.calibration.lens);
    // For comparison: a global shutter that exposes all rows when the middle row was exposed.
    const double line_delay = report.calibration.lens[index(LensParameter::kLineDelay)];
    PatternData at_once = report.data;
    for (PatternFrame& frame : at_once.frames)
      frame.time_s += 0.5 * line_delay * report.data.height;
    LensVector global = report.calibration.lens;
    global[index(LensParameter::kLineDelay)] = 0;
    without_ = shown(at_once, global);
  }

  std::string text() {
    beginning();
    parameters();
    residuals();
    motion();
    coverage();
    return html_page("Line delay and lens of " + escape_html(report_.name), body_);
  }

 private:
  template <class... Values>
  void add(fmt::format_string<Values...> format, Values&&... values) {
    body_ += fmt::format(format, std::forward<Values>(values)...);
  }
  void figure(const std::string& caption, const SvgPlot& plot, const std::string& label) {
    body_ += html_figure(caption, plot.svg(label));
  }

  [[nodiscard]] std::vector<ShownResidual> shown(const PatternData& data,
                                                 const LensVector& lens) const {
    std::vector<ShownResidual> residuals;
    for (const PatternResidual& residual :
         pattern_residuals(data, lens, report_.calibration.curve)) {
      const auto frame = static_cast<std::size_t>(residual.frame);
      const auto observation = static_cast<std::size_t>(residual.observation);
      if (report_.calibration.used[frame][observation] == 0) continue;
      residuals.push_back({report_.data.frames[frame].time_s - start_s_,
                           report_.data.frames[frame].observations[observation].u,
                           -residual.error});
    }
    return residuals;
  }

  static double rms(const std::vector<ShownResidual>& residuals) {
    double sum = 0;
    for (const ShownResidual& residual : residuals) sum += residual.error.squaredNorm();
    return std::sqrt(sum / (2.0 * static_cast<double>(std::max<std::size_t>(1, residuals.size()))));
  }

  [[nodiscard]] PlotAxis time_axis() const {
    const PoseCurve& curve = report_.calibration.curve;
    return {curve.begin_s() - start_s_, curve.end_s() - start_s_, "time since the first frame, s"};
  }

  void beginning() {
    const PatternCalibration& c = report_.calibration;
    add("<p class=\"soft\">alidade {}, {}; {}; images of {}\u00d7{} px, {:.1f} s</p>\n",
        escape_html(report_.version), escape_html(report_.date), escape_html(report_.pattern),
        report_.data.width, report_.data.height, report_.data.frames.back().time_s - start_s_);
    const double line_delay = c.lens[index(LensParameter::kLineDelay)];
    const double sigma = c.sigma(LensParameter::kLineDelay);
    add("<div class=\"verdict\"><strong>Line delay {} \u00b1 {} us/row</strong><p>{}</p></div>\n",
        value_text(1e6 * line_delay, 1e6 * sigma), sigma_text(1e6 * sigma),
        c.has_global_shutter()
            ? "0 within 3 sigmas: a global shutter, or rows too fast to tell"
            : fmt::format("{:.2f} ms from the first row to the last, read {}",
                          1e3 * std::abs(line_delay) * report_.data.height,
                          line_delay > 0 ? "from top to bottom" : "from bottom to top"));
    add("<ul class=\"facts\">\n");
    const auto fact = [this](const std::string& number, const std::string& what) {
      add("<li><b>{}</b>{}</li>\n", number, what);
    };
    fact(fmt::format("{}", report_.found),
         fmt::format("images with the pattern, of {}", report_.images));
    fact(fmt::format("{}", c.frames), "frames used");
    fact(fmt::format("{}", c.observations), "points used");
    fact(fmt::format("{}", c.left_out), "left out: wrong detections, or none that fits");
    fact(fmt::format("{:.3f} px", c.sigma_px), "sigma of a detection's coordinate");
    fact(fmt::format("{:.3f} px", rms(with_)), "RMS residual of a coordinate");
    fact(fmt::format("{:.3f} px", rms(without_)), "the same with all rows exposed at once");
    fact(fmt::format("{}", c.curve.segments() + 1), "knots of the curve");
    add("</ul>\n");
    body_ += html_list("About the video", report_.remarks);
  }

  void parameters() {
    add("<h2>Parameters</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th>parameter</th>"
        "<th>value</th><th>sigma</th><th>unit</th></tr></thead>\n<tbody>\n");
    for (const LensTableRow& row : lens_table(report_.calibration)) {
      add("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", row.name, row.value, row.sigma,
          *row.unit == '\0' ? "1" : row.unit);
    }
    add("</tbody>\n</table></div>\n<p class=\"soft\">sigma: one standard deviation. Pixels with "
        "the "
        "centre of the top-left one at (0.5, 0.5).</p>\n");
  }

  void residuals() {
    add("<h2>Residuals</h2>\n");
    for (int axis = 0; axis < 2; ++axis) {
      std::vector<PlotPoint> with;
      std::vector<PlotPoint> without;
      double largest = 1e-6;
      const auto points = [&](const std::vector<ShownResidual>& from, std::vector<PlotPoint>* to) {
        for (const ShownResidual& residual : from) {
          to->push_back({residual.time_s, residual.error[axis]});
          largest = std::max(largest, std::abs(residual.error[axis]));
        }
      };
      points(with_, &with);
      points(without_, &without);
      const char* name = axis == 0 ? "u" : "v";
      SvgPlot plot(kWide_px, 220, time_axis(),
                   {-1.05 * largest, 1.05 * largest, fmt::format("error in {}, px", name)});
      plot.level(0);
      plot.dots(without, "b", 1.8);
      plot.dots(with, "a", 1.8);
      figure(
          fmt::format("<b>Residuals over time, {}</b> \u2013 measured minus predicted; "
                      "<span class=\"key a\"></span>with the line delay; "
                      "<span class=\"key b\"></span>without: same lens and curve, all rows exposed "
                      "with the middle one",
                      name),
          plot, std::string("residuals in ") + name + " over time");
    }
    add("<div class=\"pair\">\n");
    residuals_over_image();
    residuals_over_rows();
    add("</div>\n");
  }

  [[nodiscard]] SvgPlot image_plot() const {
    const int width = report_.data.width;
    const int height = report_.data.height;
    const int plane =
        std::clamp((kHalf_px - SvgPlot::kLeft - SvgPlot::kRight) * height / width, 120, 640);
    return {kHalf_px,
            plane + SvgPlot::kTop + SvgPlot::kBottom,
            {0, static_cast<double>(width), "u, px"},
            {0, static_cast<double>(height), "v, px"},
            true};
  }

  struct Cell {
    PlotPoint low, high;
    Vector2<double> sum = Vector2<double>::Zero();
    int count = 0;
  };
  // All cells of the image with their residuals.
  [[nodiscard]] std::vector<Cell> cells() const {
    const ImageCells image(report_.data.width, report_.data.height);
    std::vector<Cell> cells;
    for (int i = 0; i < image.count(); ++i) {
      const Vector2<double> low = image.low(i);
      const Vector2<double> high = image.high(i);
      cells.push_back({{low.x(), low.y()}, {high.x(), high.y()}});
    }
    for (const ShownResidual& residual : with_) {
      Cell& cell = cells[static_cast<std::size_t>(image.cell_of(residual.u))];
      cell.sum += residual.error;
      ++cell.count;
    }
    return cells;
  }

  void residuals_over_image() {
    constexpr int kFewest = 5;  // residuals for a mean
    SvgPlot plot = image_plot();
    const std::vector<Cell> all = cells();
    double longest = 0;
    for (const Cell& cell : all) {
      if (cell.count >= kFewest) longest = std::max(longest, cell.sum.norm() / cell.count);
    }
    const double stretch =
        longest > 0 ? 0.6 * (all.front().high.x - all.front().low.x) / longest : 0;
    for (const Cell& cell : all) {
      if (cell.count < kFewest) continue;
      const PlotPoint middle{0.5 * (cell.low.x + cell.high.x), 0.5 * (cell.low.y + cell.high.y)};
      const Vector2<double> mean = cell.sum / cell.count * stretch;
      plot.rectangle(cell.low, cell.high, "a", 0.06);
      plot.arrow(middle, {middle.x + mean.x(), middle.y + mean.y()});
    }
    figure(
        fmt::format("<b>Residuals over the image</b> \u2013 strokes: mean of a cell, the longest "
                    "is {:.3f} px; a pattern in them is what the lens's model lacks",
                    longest),
        plot, "mean residuals over the image");
  }

  // With a wrong line delay or a too stiff curve these residuals depend on the row.
  void residuals_over_rows() {
    const double height = report_.data.height;
    std::vector<PlotPoint> with;
    double largest = 1e-6;
    for (const ShownResidual& residual : with_) {
      with.push_back({residual.u.y(), residual.error.y()});
      largest = std::max(largest, std::abs(residual.error.y()));
    }
    SvgPlot plot(kHalf_px, 280, {0, height, "row, px"},
                 {-1.05 * largest, 1.05 * largest, "error in v, px"});
    plot.level(0);
    plot.dots(with, "a", 1.8);
    figure("<b>Residuals by row</b> \u2013 in v, with the line delay", plot, "residuals by row");
  }

  void motion() {
    add("<h2>Motion of the camera</h2>\n");
    const PoseCurve& curve = report_.calibration.curve;
    std::vector<double> knots;
    std::vector<PlotPoint> spacing;
    double widest = 0;
    for (int i = 0; i <= curve.segments(); ++i) {
      knots.push_back(curve.knot(i) - start_s_);
      if (i == 0) continue;
      const double length = curve.knot(i) - curve.knot(i - 1);
      spacing.push_back({knots[knots.size() - 2], 1e3 * length});
      spacing.push_back({knots.back(), 1e3 * length});
      widest = std::max(widest, 1e3 * length);
    }
    SvgPlot plot(kWide_px, 160, time_axis(), {0, 1.1 * widest, "knots apart, ms"});
    plot.ticks(knots, "ink");
    plot.line(spacing, "a");
    plot.level(1e3 * report_.calibration.frame_interval_s);
    figure(
        fmt::format("<b>Knots</b> \u2013 strokes on the time axis: {} knots, put where the motion "
                    "needs them; line: how far apart; level: the time from one frame to the next",
                    knots.size()),
        plot, "knots over time");

    constexpr int kSteps = 1200;
    std::vector<PlotPoint> lines[6];
    for (int i = 0; i <= kSteps; ++i) {
      const double time = curve.begin_s() + (curve.end_s() - curve.begin_s()) * i / kSteps;
      const PoseVector x = curve.value(curve.basis(time));
      for (int k = 0; k < 6; ++k)
        lines[k].push_back({time - start_s_, k < 3 ? x[k] : kDegrees * x[k]});
    }
    for (const bool turned : {false, true}) {
      const auto* of = turned ? lines + 3 : lines;
      double low = std::numeric_limits<double>::infinity();
      double high = -low;
      for (int k = 0; k < 3; ++k) {
        for (const PlotPoint& point : of[k]) {
          low = std::min(low, point.y);
          high = std::max(high, point.y);
        }
      }
      const double air = std::max(0.05 * (high - low), 1e-6);
      SvgPlot way(kWide_px, 196, time_axis(),
                  {low - air, high + air, turned ? "turn, deg" : "position, m"});
      const char* colours[] = {"a", "b", "ink"};
      for (int k = 0; k < 3; ++k) way.line(of[k], colours[k]);
      figure(turned
                 ? "<b>Orientation</b> \u2013 turned from the middle of the motion about the "
                   "camera's <span class=\"key a\"></span>right, <span class=\"key "
                   "b\"></span>down and <span class=\"key ink\"></span>forward axis"
                 : "<b>Position</b> \u2013 in the pattern's frame: <span class=\"key "
                   "a\"></span>along its rows, <span class=\"key b\"></span>along its columns, and "
                   "<span class=\"key ink\"></span>before it (negative)",
             way, turned ? "orientation over time" : "position over time");
    }
  }

  void coverage() {
    add("<h2>What was shown</h2>\n<div class=\"pair\">\n");
    SvgPlot plot = image_plot();
    const std::vector<Cell> all = cells();
    int most = 1;
    int empty = 0;
    for (const Cell& cell : all) {
      most = std::max(most, cell.count);
      empty += cell.count == 0 ? 1 : 0;
    }
    for (const Cell& cell : all) {
      if (cell.count > 0)
        plot.rectangle(cell.low, cell.high, "a", 0.1 + 0.8 * std::sqrt(1.0 * cell.count / most));
    }
    figure(
        fmt::format("<b>Image</b> \u2013 points in each cell, up to {}; {} of {} cells are empty",
                    most, empty, all.size()),
        plot, "coverage of the image");

    // Tilt and distance in each used frame.
    const Vector3<double> middle = middle_of(report_.data.points_m);
    std::vector<PlotPoint> tilts;
    std::vector<PlotPoint> distances;
    double largest_tilt = 1;
    double farthest_m = 0;
    const PoseCurve& curve = report_.calibration.curve;
    for (std::size_t f = 0; f < report_.data.frames.size(); ++f) {
      const auto& used = report_.calibration.used[f];
      if (std::count(used.begin(), used.end(), char{1}) == 0) continue;
      const double time_s = report_.data.frames[f].time_s;
      const PoseVector x = curve.value(curve.basis(time_s));
      const PatternView view = pattern_view(curve.R_pattern_from_camera(x), x.head<3>(), middle);
      const PlotPoint tilt{kDegrees * view.tilt.x(), kDegrees * view.tilt.y()};
      tilts.push_back(tilt);
      distances.push_back({time_s - start_s_, view.distance_m});
      largest_tilt = std::max({largest_tilt, std::abs(tilt.x), std::abs(tilt.y)});
      farthest_m = std::max(farthest_m, view.distance_m);
    }
    const double reach = std::min(90.0, 1.1 * largest_tilt);
    SvgPlot tilt_plot(kHalf_px, 400, {-reach, reach, "tilt to the side, deg"},
                      {-reach, reach, "tilt up and down, deg"});
    tilt_plot.level(0);
    tilt_plot.dots(tilts, "a", 4);
    figure(
        "<b>Tilt</b> \u2013 of the pattern to the line of sight, each frame; 30 to 45 degrees to "
        "all "
        "sides tell the focal length",
        tilt_plot, "tilt of the pattern");
    add("</div>\n");
    SvgPlot distance_plot(kWide_px, 160, time_axis(),
                          {0, std::max(1e-3, 1.1 * farthest_m), "distance, m"});
    distance_plot.dots(distances, "a", 3);
    figure("<b>Distance</b> \u2013 from the camera to the pattern's middle, each frame",
           distance_plot, "distance over time");
  }

  const PatternReportInput& report_;
  double start_s_;
  std::vector<ShownResidual> with_;
  std::vector<ShownResidual> without_;
  std::string body_;
};

}  // namespace

std::string pattern_report(const PatternReportInput& report) { return PatternPage(report).text(); }

}  // namespace alidade
