#include "edge_app/output/calibration_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

#include "core/model/angle.h"
#include "edge_app/output/calibration_summary.h"
#include "edge_app/output/svg_plot.h"

namespace alidade {
namespace {

constexpr int kWide = 1040;  // px
constexpr int kHalf = 510;
constexpr double kDegrees = 180 / kPi;
constexpr double kMilli = 1e3;  // s -> ms, rad -> mrad

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --paper: #ffffff; --ink: #1c2430; --soft: #5b6673; --rule: #dfe4ea;
  --panel: #f5f7f9; --a: #1f6fb2; --b: #c05a10; --bad: #c62828; --good: #2e7d32; }
@media (prefers-color-scheme: dark) { :root { --paper: #13171c; --ink: #e3e8ee; --soft: #98a4b1;
  --rule: #2c343d; --panel: #1b2128; --a: #5aa9e6; --b: #f0954a; --bad: #ff6b6b; --good: #66bb6a; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1088px; margin: 0 auto; padding: 28px 24px 48px; }
h1 { font-size: 25px; line-height: 1.25; margin: 0 0 16px; overflow-wrap: anywhere; }
h2 { font-size: 18px; margin: 36px 0 10px; }
p { margin: 6px 0; } .soft { color: var(--soft); }
.verdict { border-left: 5px solid var(--good); background: var(--panel); padding: 12px 16px;
  border-radius: 0 6px 6px 0; } .verdict.weak { border-color: var(--bad); }
.verdict strong { font-size: 17px; }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(230px, 1fr)); gap: 10px;
  margin: 16px 0; padding: 0; list-style: none; }
.facts li { background: var(--panel); border-radius: 6px; padding: 8px 12px; color: var(--soft);
  font-size: 13px; } .facts b { display: block; color: var(--ink); font-size: 19px; font-weight: 600; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 14px; }
th { text-align: left; color: var(--soft); font-weight: 600; }
th, td { padding: 5px 18px 5px 0; border-bottom: 1px solid var(--rule); white-space: nowrap; }
.matrix { font-size: 12.5px; } .matrix th, .matrix td { border: 1px solid var(--paper); padding: 4px 7px; }
.matrix td { text-align: center; min-width: 62px; }
.matrix thead th { text-align: center; white-space: normal; vertical-align: bottom; }
figure { margin: 14px 0; } figcaption { color: var(--soft); font-size: 13.5px; margin: 0 0 4px; }
figcaption b { color: var(--ink); }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 0 20px; }
svg { display: block; width: 100%; height: auto; font-size: 12px; font-variant-numeric: tabular-nums; }
svg text { fill: var(--soft); } svg .name { fill: var(--ink); font-size: 12.5px; }
svg .grid { stroke: var(--rule); } svg .frame { stroke: var(--soft); fill: none; }
svg .dots { fill: none; stroke-linecap: round; stroke-opacity: .75; }
svg .line { fill: none; stroke-width: 1.4; stroke-linejoin: round; }
svg .band { fill: var(--soft); fill-opacity: .14; } svg .level { stroke: var(--soft); }
svg .a { stroke: var(--a); } svg .b { stroke: var(--b); } svg .bad { stroke: var(--bad); }
svg .ink { stroke: var(--ink); } svg .faint { stroke: var(--soft); stroke-opacity: .7; }
svg .area { stroke: none; } svg .area.a { fill: var(--a); } svg .area.b { fill: var(--b); }
.key { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin: 0 4px 0 8px; }
.key.a { background: var(--a); } .key.b { background: var(--b); } .key.bad { background: var(--bad); }
)";

class Page {
 public:
  explicit Page(const CalibrationReportInput& report)
      : report_(report), result_(report.result), start_s_(result_.frames.front().time_s) {}

  std::string html() {
    verdict();
    parameters();
    correlations();
    residuals();
    trajectory();
    timing();
    landmarks();
    const std::string title = "Calibration of " + escape_html(report_.name);
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<title>{0}</title>\n<style>{1}</style>\n</head>\n<body>\n<main>\n<h1>{0}</h1>\n{2}"
        "</main>\n</body>\n</html>\n",
        title, kStyle, body_);
  }

 private:
  template <class... Values>
  void add(fmt::format_string<Values...> format, Values&&... values) {
    body_ += fmt::format(format, std::forward<Values>(values)...);
  }
  // caption is HTML.
  void figure(const std::string& caption, const SvgPlot& plot, const std::string& label) {
    add("<figure><figcaption>{}</figcaption>\n{}</figure>\n", caption, plot.svg(label));
  }
  void list(const char* title, const std::vector<std::string>& lines) {
    if (lines.empty()) return;
    add("<h2>{}</h2>\n<ul>\n", title);
    for (const std::string& line : lines) add("<li>{}</li>\n", escape_html(line));
    add("</ul>\n");
  }
  [[nodiscard]] PlotAxis time_axis() const {
    const TrajectorySpline& spline = result_.trajectory;
    return {spline.begin_s() - start_s_, spline.end_s() - start_s_,
            "time since the first frame, s"};
  }
  [[nodiscard]] double pixel_sigma(const ObservationResidual& residual) const {
    return report_.input.observations[residual.observation].sigma_px *
           result_.quality.pixel_sigma_ratio;
  }

  void verdict();
  void parameters();
  void correlations();
  void residuals();
  void residuals_over_time();
  void residuals_over_image();
  void histograms();
  void trajectory();
  void timing();
  void landmarks();

  const CalibrationReportInput& report_;
  const CalibrationResult& result_;
  double start_s_;
  std::string body_;
};

// A symmetric range that shows `quantile` of the magnitudes, with some air.
double symmetric_range(std::vector<double> magnitudes, double quantile) {
  if (magnitudes.empty()) return 1;
  const auto at = magnitudes.begin() + static_cast<std::ptrdiff_t>(
                                           quantile * static_cast<double>(magnitudes.size() - 1));
  std::nth_element(magnitudes.begin(), at, magnitudes.end());
  return std::max(1.15 * *at, 1e-9);
}

// low and high with a little air; never empty.
void widen(double* low, double* high) {
  const double air = std::max(0.05 * (*high - *low), 1e-6);
  *low -= air;
  *high += air;
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, values.size())));
}

void Page::verdict() {
  const CalibrationQuality& q = result_.quality;
  add("<div class=\"verdict{}\"><strong>{}</strong><p>{}</p></div>\n", result_.ok() ? "" : " weak",
      result_.ok() ? "Calibrated" : "Too uncertain: no calibration was written",
      escape_html(result_.message));
  add("<ul class=\"facts\">\n");
  const auto fact = [this](const std::string& number, const char* what) {
    add("<li><b>{}</b>{}</li>\n", number, what);
  };
  fact(fmt::format("{}", q.frames), "frames");
  fact(fmt::format("{}", q.observations), "observations");
  fact(fmt::format("{}", q.landmarks), "landmarks");
  fact(fmt::format("{}", q.telemetry), "telemetry samples");
  fact(fmt::format("{:.3f} px", q.mean_reprojection_error_px), "mean image residual");
  fact(fmt::format("{:.3f}", q.pixel_sigma_ratio), "image residuals / stated noise");
  fact(fmt::format("{:.3f}", q.telemetry_sigma_ratio), "telemetry residuals / assumed noise");
  fact(fmt::format("{}", result_.trajectory.segments() + 1), "spline knots");
  add("</ul>\n");
  list("What would help", q.advice);
  list("Left out", result_.exclusions.describe());
  list("About the recording", report_.remarks);
}

void Page::parameters() {
  add("<h2>Parameters</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th>parameter</th>"
      "<th>value</th><th>sigma</th><th>unit</th><th>prior</th></tr></thead>\n<tbody>\n");
  for (const SummaryRow& row : summary_rows(result_, report_.options)) {
    add("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"soft\">{}</td></tr>\n",
        row.parameter, row.value, row.sigma, row.unit, row.prior);
  }
  add("</tbody>\n</table></div>\n<p class=\"soft\">sigma: one standard deviation, noise of image, "
      "telemetry and stamps included. Axes: in the base (forward, right, down), sigma of the two "
      "components in the tangent plane.</p>\n");
}

void Page::correlations() {
  const auto& cov = result_.calibration.covariance;
  std::vector<int> free;
  for (int i = 0; i < kParameterCount; ++i) {
    if (cov(i, i) > 0) free.push_back(i);
  }
  if (free.size() < 2) return;
  add("<h2>Correlations</h2>\n<p class=\"soft\">Weakest direction: {} (condition {:.3g}).</p>\n"
      "<div class=\"scroll\"><table class=\"matrix\">\n<thead><tr><th></th>",
      escape_html(result_.quality.weakest_direction), result_.quality.condition);
  const auto name = [](int i) {
    std::string text = to_string(static_cast<Parameter>(i));
    std::replace(text.begin(), text.end(), '_', ' ');
    return text;
  };
  for (const int i : free) add("<th>{}</th>", name(i));
  add("</tr></thead>\n<tbody>\n");
  for (const int i : free) {
    add("<tr><th>{}</th>", name(i));
    for (const int j : free) {
      const double r = cov(i, j) / std::sqrt(cov(i, i) * cov(j, j));
      if (i == j) {
        add("<td class=\"soft\">1</td>");
        continue;
      }
      add("<td style=\"background:color-mix(in srgb, var(--{}) {:.0f}%, "
          "transparent)\">{}{:.2f}</td>",
          r < 0 ? "b" : "a", 80 * std::min(1.0, std::abs(r)), r < -0.005 ? "\u2212" : "",
          std::abs(r));
    }
    add("</tr>\n");
  }
  add("</tbody>\n</table></div>\n");
}

void Page::residuals() {
  add("<h2>Residuals</h2>\n");
  residuals_over_time();
  add("<div class=\"pair\">\n");
  residuals_over_image();
  histograms();
  add("</div>\n");
}

void Page::residuals_over_time() {
  std::unordered_map<std::int64_t, double> time_of;
  for (const FrameResult& frame : result_.frames) time_of[frame.frame] = frame.time_s - start_s_;
  std::vector<PlotPoint> good[2];
  std::vector<PlotPoint> bad[2];
  std::vector<double> magnitudes;
  std::vector<double> sigmas;
  for (const ObservationResidual& residual : result_.observation_residuals) {
    const CalibrationObservation& seen = report_.input.observations[residual.observation];
    const auto frame = time_of.find(seen.frame);
    if (frame == time_of.end()) continue;
    // At the time of its row.
    const double time = frame->second + seen.v_px * result_.calibration.line_delay;
    for (int i = 0; i < 2; ++i) {
      (residual.outlier ? bad : good)[i].push_back({time, residual.error_px[i]});
      if (!residual.outlier) magnitudes.push_back(std::abs(residual.error_px[i]));
    }
    if (!residual.outlier) sigmas.push_back(pixel_sigma(residual));
  }
  const double range = std::max(symmetric_range(magnitudes, 1), 1e-6);
  const double sigma = root_mean_square(sigmas);
  for (int i = 0; i < 2; ++i) {
    SvgPlot plot(kWide, 196, time_axis(),
                 {-range, range, i == 0 ? "error in u, px" : "error in v, px"});
    plot.band(-2 * sigma, 2 * sigma);
    plot.level(0);
    plot.dots(good[i], "a", 1.8);
    plot.dots(bad[i], "bad", 4);
    figure(fmt::format("<b>Image residuals over time, {}</b> \u2013 measured minus predicted; "
                       "grey: \u00b12 sigma{}",
                       i == 0 ? "u" : "v",
                       bad[i].empty() ? ""
                                      : "; <span class=\"key bad\"></span>outliers, left out (at "
                                        "the edge if beyond)"),
           plot, i == 0 ? "residuals in u over time" : "residuals in v over time");
  }
}

void Page::residuals_over_image() {
  const int width = report_.input.width;
  const int height = report_.input.height;
  constexpr int kColumns = 16;
  const int rows = std::clamp(
      static_cast<int>(std::lround(kColumns * static_cast<double>(height) / width)), 1, 48);
  struct Cell {
    Vector2<double> sum = Vector2<double>::Zero();
    double squares = 0;  // in sigmas
    int count = 0;
  };
  std::vector<Cell> cells(static_cast<std::size_t>(kColumns * rows));
  for (const ObservationResidual& residual : result_.observation_residuals) {
    if (residual.outlier) continue;
    const CalibrationObservation& seen = report_.input.observations[residual.observation];
    const int column = std::clamp(static_cast<int>(seen.u_px * kColumns / width), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(seen.v_px * rows / height), 0, rows - 1);
    Cell& cell = cells[static_cast<std::size_t>(row * kColumns + column)];
    cell.sum += residual.error_px;
    cell.squares += residual.error_px.squaredNorm() / std::pow(pixel_sigma(residual), 2);
    ++cell.count;
  }
  constexpr int kFewest = 5;  // that make a mean
  double longest = 0;
  for (const Cell& cell : cells) {
    if (cell.count >= kFewest) longest = std::max(longest, cell.sum.norm() / cell.count);
  }
  const int plane = kHalf - SvgPlot::kLeft - SvgPlot::kRight;
  const int plane_height = std::clamp(plane * height / width, 120, 640);
  SvgPlot plot(kHalf, plane_height + SvgPlot::kTop + SvgPlot::kBottom,
               {0, static_cast<double>(width), "u, px"}, {0, static_cast<double>(height), "v, px"},
               true);
  const double cell_width = static_cast<double>(width) / kColumns;
  const double cell_height = static_cast<double>(height) / rows;
  const double stretch = longest > 0 ? 0.6 * cell_width / longest : 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Cell& cell = cells[static_cast<std::size_t>(row * kColumns + column)];
      if (cell.count < kFewest) continue;
      const double rms = std::sqrt(cell.squares / (2 * cell.count));
      const PlotPoint corner{column * cell_width, row * cell_height};
      const double strength = std::min(1.0, std::abs(std::log2(std::max(rms, 1e-3))));
      plot.rectangle(corner, {corner.x + cell_width, corner.y + cell_height}, rms > 1 ? "b" : "a",
                     0.06 + 0.7 * strength);
      const PlotPoint middle{corner.x + cell_width / 2, corner.y + cell_height / 2};
      const Vector2<double> mean = cell.sum / cell.count * stretch;
      plot.arrow(middle, {middle.x + mean[0], middle.y + mean[1]});
    }
  }
  figure(fmt::format("<b>Image residuals over the image</b> \u2013 strokes: mean of a cell, the "
                     "longest is {:.3f} px; colour: its RMS, "
                     "<span class=\"key a\"></span>below and <span class=\"key b\"></span>above "
                     "the noise",
                     longest),
         plot, "residuals over the image");
}

void Page::histograms() {
  std::vector<double> image;
  for (const ObservationResidual& residual : result_.observation_residuals) {
    if (residual.outlier) continue;
    for (int i = 0; i < 2; ++i) image.push_back(residual.error_px[i] / pixel_sigma(residual));
  }
  std::vector<double> telemetry;
  for (const TelemetryResidual& residual : result_.telemetry_residuals) {
    if (residual.outlier) continue;
    for (int i = 0; i < 2; ++i) {
      const double sigma = residual.sigma_rad[i];
      if (std::isfinite(sigma)) telemetry.push_back(residual.error_rad[i] / sigma);
    }
  }
  constexpr double kReach = 5;
  constexpr double kBin = 0.25;
  constexpr int kBins = static_cast<int>(2 * kReach / kBin);
  const auto outline = [&](const std::vector<double>& values) {
    std::vector<int> counts(kBins, 0);
    for (const double value : values) {
      const int bin =
          static_cast<int>(std::floor((std::clamp(value, -kReach, kReach) + kReach) / kBin));
      ++counts[static_cast<std::size_t>(std::clamp(bin, 0, kBins - 1))];
    }
    std::vector<PlotPoint> points;
    const double unit = kBin * static_cast<double>(std::max<std::size_t>(1, values.size()));
    for (int i = 0; i < kBins; ++i) {
      const double density = counts[static_cast<std::size_t>(i)] / unit;
      points.push_back({-kReach + i * kBin, density});
      points.push_back({-kReach + (i + 1) * kBin, density});
    }
    return points;
  };
  const std::vector<PlotPoint> image_outline = outline(image);
  const std::vector<PlotPoint> telemetry_outline = outline(telemetry);
  std::vector<PlotPoint> gaussian;
  double highest = 0;
  for (double x = -kReach; x <= kReach; x += 0.05) {
    gaussian.push_back({x, std::exp(-0.5 * x * x) / std::sqrt(2 * kPi)});
    highest = std::max(highest, gaussian.back().y);
  }
  for (const auto* points : {&image_outline, &telemetry_outline}) {
    for (const PlotPoint& point : *points) highest = std::max(highest, point.y);
  }
  const int plane_height = std::clamp(
      (kHalf - SvgPlot::kLeft - SvgPlot::kRight) * report_.input.height / report_.input.width, 200,
      320);
  SvgPlot plot(kHalf, plane_height + SvgPlot::kTop + SvgPlot::kBottom,
               {-kReach, kReach, "residual / its sigma"}, {0, 1.08 * highest, "density"});
  plot.line(gaussian, "faint");
  plot.line(telemetry_outline, "b");
  plot.line(image_outline, "a");
  figure(
      "<b>Distribution</b> \u2013 <span class=\"key a\"></span>image (u and v), "
      "<span class=\"key b\"></span>telemetry (pan and tilt), grey: the unit Gaussian",
      plot, "histogram of normalised residuals");
}

void Page::trajectory() {
  add("<h2>Trajectory</h2>\n");
  const TrajectorySpline& spline = result_.trajectory;
  const Mechanics<double>& mechanics = result_.calibration.mechanics;
  std::vector<double> knots;
  for (int i = 0; i <= spline.segments(); ++i) knots.push_back(spline.knot(i) - start_s_);
  for (int axis = 0; axis < 2; ++axis) {
    const char* name = axis == 0 ? "pan" : "tilt";
    const char* colour = axis == 0 ? "a" : "b";
    const double scale = axis == 0 ? mechanics.pan_scale : mechanics.tilt_scale;
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    std::vector<PlotPoint> curve;
    constexpr int kSteps = 1200;
    for (int i = 0; i <= kSteps; ++i) {
      const double time = spline.begin_s() + (spline.end_s() - spline.begin_s()) * i / kSteps;
      const double angle = spline.position(time).vector()[axis] * kDegrees;
      curve.push_back({time - start_s_, angle});
      low = std::min(low, angle);
      high = std::max(high, angle);
    }
    std::vector<PlotPoint> samples;
    std::vector<PlotPoint> good;
    std::vector<PlotPoint> bad;
    std::vector<double> magnitudes;
    for (const TelemetryResidual& residual : result_.telemetry_residuals) {
      // The error is of the measured angle, scale times the true one, whatever the wrapping.
      const double error = residual.error_rad[axis];
      if (!std::isfinite(error)) continue;
      const double time = residual.time_s - start_s_;
      const double angle =
          (spline.position(residual.time_s).vector()[axis] + error / scale) * kDegrees;
      samples.push_back({time, angle});
      (residual.outlier ? bad : good).push_back({time, kMilli * error});
      if (!residual.outlier) magnitudes.push_back(std::abs(kMilli * error));
    }
    widen(&low, &high);
    SvgPlot plot(kWide, 196, time_axis(), {low, high, fmt::format("{}, deg", name)});
    plot.ticks(knots, "ink");
    plot.dots(samples, "faint", 4);
    plot.line(curve, colour);
    figure(fmt::format("<b>{}</b> \u2013 line: the adjusted spline; grey: telemetry; strokes on "
                       "the time axis: {} knots",
                       axis == 0 ? "Pan" : "Tilt", knots.size()),
           plot, std::string(name) + " over time");
    const double range = symmetric_range(magnitudes, 1);
    SvgPlot difference(kWide, 160, time_axis(),
                       {-range, range, fmt::format("{} error, mrad", name)});
    difference.level(0);
    difference.dots(good, colour);
    difference.dots(bad, "bad", 4);
    figure(fmt::format("<b>Telemetry minus spline, {}</b> \u2013 RMS {:.3f} mrad{}", name,
                       root_mean_square(magnitudes),
                       bad.empty()
                           ? ""
                           : "; <span class=\"key bad\"></span>outliers, left out (at the edge "
                             "if beyond)"),
           difference, std::string(name) + " telemetry minus spline");
  }
}

void Page::timing() {
  add("<h2>Clocks</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th>stream</th><th>period, ms"
      "</th><th>its sigma, ms</th><th>sigma of a stamp, ms</th><th>sigma of the line, ms</th>"
      "<th>lost</th><th>stamps are taken as</th></tr></thead>\n<tbody>\n");
  const auto row = [this](const char* name, const StreamTiming& timing, StampNoise noise) {
    add("<tr><td>{}</td><td>{:.6f}</td><td>{:.2g}</td><td>{:.3g}</td><td>{:.2g}</td><td>{}</td>"
        "<td>{}</td></tr>\n",
        name, kMilli * timing.period_s, kMilli * timing.period_sigma_s,
        kMilli * timing.stamp_sigma_s, kMilli * timing.offset_sigma_s, timing.lost,
        !timing.steady                    ? "they are: no steady clock"
        : noise == StampNoise::kSymmetric ? "scattering to both sides"
                                          : "late only");
  };
  row("image", result_.image_timing, report_.options.image_stamps);
  row("telemetry", result_.telemetry_timing, report_.options.telemetry_stamps);
  add("</tbody>\n</table></div>\n<div class=\"pair\">\n");

  std::unordered_map<std::int64_t, double> stamp_of;
  for (const CalibrationFrame& frame : report_.input.frames) {
    stamp_of.emplace(frame.frame, frame.stamp_s);
  }
  std::vector<PlotPoint> image;
  for (const FrameResult& frame : result_.frames) {
    image.push_back({frame.time_s - start_s_, kMilli * (stamp_of[frame.frame] - frame.time_s)});
  }
  std::vector<PlotPoint> telemetry;
  std::optional<std::size_t> shown;
  for (const TelemetryResidual& residual : result_.telemetry_residuals) {
    // A change of a coarse reading stands behind its sample, and is no stamp.
    if (shown == residual.sample) continue;
    shown = residual.sample;
    const double line = residual.time_s + result_.calibration.clock_offset;
    telemetry.push_back({residual.time_s - start_s_,
                         kMilli * (report_.input.telemetry[residual.sample].stamp_s - line)});
  }
  const auto plot_stream = [&](const char* name, const char* colour,
                               const std::vector<PlotPoint>& points, const StreamTiming& timing) {
    double low = 0;
    double high = 0;
    for (const PlotPoint& point : points) {
      low = std::min(low, point.y);
      high = std::max(high, point.y);
    }
    widen(&low, &high);
    SvgPlot plot(kHalf, 240, time_axis(), {low, high, "stamp - line, ms"});
    plot.band(std::max(low, -2 * kMilli * timing.stamp_sigma_s),
              std::min(high, 2 * kMilli * timing.stamp_sigma_s));
    plot.level(0);
    plot.dots(points, colour, 3);
    figure(fmt::format("<b>Stamps of {}</b> \u2013 minus the times of its steady clock; grey: "
                       "\u00b12 sigma",
                       name),
           plot, std::string("timing residuals of ") + name);
  };
  plot_stream("the image", "a", image, result_.image_timing);
  plot_stream("the telemetry", "b", telemetry, result_.telemetry_timing);
  add("</div>\n");
}

void Page::landmarks() {
  const Mechanics<double>& mechanics = result_.calibration.mechanics;
  std::vector<PlotPoint> path;
  double reference = 0;
  const auto place = [&reference](const Vector3<double>& d) {
    const double azimuth = reference + wrap_angle(std::atan2(d.y(), d.x()) - reference);
    return PlotPoint{azimuth * kDegrees, -std::asin(std::clamp(d.z(), -1.0, 1.0)) * kDegrees};
  };
  for (const FrameResult& frame : result_.frames) {
    const Vector3<double> axis = R_base_from_camera(mechanics, frame.angle).col(2);
    path.push_back(place(axis));
    reference = path.back().x / kDegrees;  // follows the camera around
  }
  double low_x = path.front().x;
  double high_x = low_x;
  double low_y = path.front().y;
  double high_y = low_y;
  const auto include = [&](const PlotPoint& point) {
    low_x = std::min(low_x, point.x);
    high_x = std::max(high_x, point.x);
    low_y = std::min(low_y, point.y);
    high_y = std::max(high_y, point.y);
  };
  for (const PlotPoint& point : path) include(point);
  reference = 0.5 * (low_x + high_x) / kDegrees;
  std::vector<PlotPoint> often;
  std::vector<PlotPoint> seldom;
  constexpr int kOften = 10;
  for (const CalibrationLandmark& landmark : result_.landmarks) {
    const PlotPoint point = place(landmark.d_b);
    include(point);
    (landmark.observations >= kOften ? often : seldom).push_back(point);
  }
  widen(&low_x, &high_x);
  widen(&low_y, &high_y);
  // The same scale both ways, in a plane of bearable height.
  const double plane = kWide - SvgPlot::kLeft - SvgPlot::kRight;
  const double plane_height = std::clamp(plane * (high_y - low_y) / (high_x - low_x), 180.0, 560.0);
  const double scale = std::min(plane / (high_x - low_x), plane_height / (high_y - low_y));
  const double x_air = 0.5 * (plane / scale - (high_x - low_x));
  const double y_air = 0.5 * (plane_height / scale - (high_y - low_y));
  SvgPlot plot(kWide, static_cast<int>(plane_height) + SvgPlot::kTop + SvgPlot::kBottom,
               {low_x - x_air, high_x + x_air, "azimuth (right), deg"},
               {low_y - y_air, high_y + y_air, "elevation (up), deg"});
  plot.dots(seldom, "b", 3.4);
  plot.dots(often, "a", 3.4);
  plot.line(path, "ink");
  add("<h2>Landmarks</h2>\n");
  figure(fmt::format("<b>Map in the base</b> \u2013 <span class=\"key a\"></span>seen {} times or "
                     "more, <span class=\"key b\"></span>less often; line: the optical axis",
                     kOften),
         plot, "map of the landmarks");
}

}  // namespace

std::string calibration_report(const CalibrationReportInput& report) { return Page(report).html(); }

}  // namespace alidade
