#include "edge_app/output/zoom_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "core/calibration/number_text.h"
#include "core/model/lens/zoom_law.h"
#include "edge_app/output/html_page.h"
#include "edge_app/output/svg_plot.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

constexpr int kZoomPlot_px = 1040;
constexpr int kZoomPlotHeight_px = 220;
constexpr double kPercent = 100;

// One value of the curve, or of a calibration, and its standard deviation.
struct LensValue {
  double value = 0;
  double sigma = 0;
};

// A quantity of the lens as the plots show it.
struct LensQuantity {
  const char* name;
  const char* axis;
  std::function<LensValue(const Calibration&)> of;
};

LensValue by_parameter(double value, const Calibration& c, Parameter parameter) {
  return {value, parameter_sigma(c, parameter)};
}

// k (R / f)^2 in per cent: k itself grows with the square of the focal length.
LensValue corner_distortion_of(const Calibration& c) {
  static_assert(kDistortionCount == 1, "a plot for each term");
  const ZoomQuantityMatrix<double> J = zoom_quantities_by_camera(c.camera);
  ZoomQuantityMatrix<double> of_lens;
  for (int i = 0; i < kZoomQuantityCount; ++i) {
    for (int j = 0; j < kZoomQuantityCount; ++j) {
      of_lens(i, j) = c.covariance(index(kParameterOfQuantity[static_cast<std::size_t>(i)]),
                                   index(kParameterOfQuantity[static_cast<std::size_t>(j)]));
    }
  }
  const int row = index(ZoomQuantity::kCornerDistortion);
  const double variance = (J * of_lens * J.transpose())(row, row);
  return {kPercent * corner_distortion(c.camera)[0], kPercent * std::sqrt(std::max(0.0, variance))};
}

const std::vector<LensQuantity>& lens_quantities() {
  static const std::vector<LensQuantity> quantities = {
      {"Focal length f", "f, px",
       [](const Calibration& c) {
         return by_parameter(c.camera.focal_length, c, Parameter::kFocalLength);
       }},
      {"Distortion k in the corner", "of the radius, %", corner_distortion_of},
      {"Optical centre, to the right of the middle", "u, px",
       [](const Calibration& c) {
         return by_parameter(c.camera.centre_u, c, Parameter::kCentreU);
       }},
      {"Optical centre, below the middle", "v, px", [](const Calibration& c) {
         return by_parameter(c.camera.centre_v, c, Parameter::kCentreV);
       }}};
  return quantities;
}

// The curve at many readings, from the first node to the last.
std::vector<Calibration> along(const ZoomCurve& curve) {
  constexpr int kSteps = 240;
  std::vector<Calibration> out;
  for (int i = 0; i <= kSteps; ++i) {
    Calibration c;
    const double reading =
        curve.first_reading() + (curve.last_reading() - curve.first_reading()) * i / kSteps;
    if (curve.at(reading, &c)) out.push_back(c);
  }
  return out;
}

PlotAxis reading_axis(const ZoomCurve& curve) {
  const double air = 0.02 * (curve.last_reading() - curve.first_reading());
  return {curve.first_reading() - air, curve.last_reading() + air, "zoom reading, device units"};
}

// The largest range of values that is to be seen, with a margin.
class SeenRange {
 public:
  void include(double value) {
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  [[nodiscard]] PlotAxis axis(const std::string& label) const {
    const double air = std::max(0.06 * (high_ - low_), 1e-6);
    return {low_ - air, high_ + air, label};
  }

 private:
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

// A value at a reading with two sigmas to either side.
struct SeenPoint {
  double reading = 0;
  LensValue seen;
};

void draw(const std::vector<SeenPoint>& points, const char* colour, SvgPlot* plot) {
  std::vector<PlotPoint> middles;
  for (const SeenPoint& point : points) {
    const double reach = 2 * point.seen.sigma;
    plot->line(
        {{point.reading, point.seen.value - reach}, {point.reading, point.seen.value + reach}},
        colour);
    middles.push_back({point.reading, point.seen.value});
  }
  plot->dots(middles, colour, 6);
}

void include(const std::vector<SeenPoint>& points, SeenRange* range) {
  for (const SeenPoint& point : points) {
    range->include(point.seen.value - 2 * point.seen.sigma);
    range->include(point.seen.value + 2 * point.seen.sigma);
  }
}

std::string curve_figure(const ZoomReportInput& report, const LensQuantity& quantity) {
  std::vector<PlotPoint> middle;
  std::vector<PlotPoint> low;
  std::vector<PlotPoint> high;
  SeenRange range;
  for (const Calibration& c : along(report.fit.curve)) {
    const LensValue at = quantity.of(c);
    middle.push_back({*c.zoom, at.value});
    low.push_back({*c.zoom, at.value - 2 * at.sigma});
    high.push_back({*c.zoom, at.value + 2 * at.sigma});
    range.include(low.back().y);
    range.include(high.back().y);
  }
  std::vector<SeenPoint> dwells;
  for (const ZoomReportDwell& dwell : report.dwells) {
    if (dwell.refusal.empty()) dwells.push_back({dwell.zoom, quantity.of(dwell.own)});
  }
  include(dwells, &range);
  SvgPlot plot(kZoomPlot_px, kZoomPlotHeight_px, reading_axis(report.fit.curve),
               range.axis(quantity.axis));
  plot.area(low, high, "a");
  plot.line(middle, "a");
  draw(dwells, "ink", &plot);
  return html_figure(
      fmt::format("<b>{}</b> \u2013 line: the curve, \u00b12 sigma; "
                  "<span class=\"key ink\"></span>each dwell by itself, \u00b12 sigma",
                  quantity.name),
      plot.svg(fmt::format("{} over the zoom reading", quantity.name)));
}

// Focal length of a dwell, or of a place in a movement, against the curve: per cent.
struct Departure {
  double reading = 0;
  LensValue of_f;
  [[nodiscard]] double sigmas() const { return of_f.sigma > 0 ? of_f.value / of_f.sigma : 0; }
};

// sigma: of log f itself. A dwell differs from the curve by how well the lens comes back, too.
Departure departure_of(const ZoomCurve& curve, double reading, double log_f, double sigma) {
  Departure out;
  Calibration there;
  out.reading = reading;
  if (!curve.at(reading, &there)) return out;
  out.of_f = {kPercent * (log_f - std::log(there.camera.focal_length)),
              kPercent * std::hypot(sigma, curve.content().repeatability)};
  return out;
}

Departure departure_of(const ZoomCurve& curve, const ZoomReportDwell& dwell) {
  return departure_of(curve, dwell.zoom, std::log(dwell.own.camera.focal_length),
                      relative_focal_length_sigma(dwell.own));
}

std::vector<Departure> departures_of(const ZoomCurve& curve, const MovementObservation& seen) {
  constexpr Eigen::Index kDwells = 2;  // rows before those of the readings
  std::vector<Departure> out;
  for (std::size_t i = 0; i < seen.reading.size(); ++i) {
    const Eigen::Index row = kDwells + static_cast<Eigen::Index>(i);
    out.push_back(departure_of(curve, seen.reading[i], seen.log_focal_length[row],
                               std::sqrt(std::max(0.0, seen.covariance(row, row)))));
  }
  return out;
}

std::string departures_figure(const ZoomReportInput& report) {
  const ZoomCurve& curve = report.fit.curve;
  std::vector<SeenPoint> dwells;
  std::vector<SeenPoint> movements;
  for (const ZoomReportDwell& dwell : report.dwells) {
    if (!dwell.refusal.empty()) continue;
    const Departure at = departure_of(curve, dwell);
    dwells.push_back({at.reading, at.of_f});
  }
  for (const ZoomReportMovement& movement : report.movements) {
    if (!movement.refusal.empty()) continue;
    for (const Departure& at : departures_of(curve, movement.seen))
      movements.push_back({at.reading, at.of_f});
  }
  SeenRange range;
  std::vector<PlotPoint> low;
  std::vector<PlotPoint> high;
  for (const Calibration& c : along(curve)) {
    const double reach = 2 * kPercent * relative_focal_length_sigma(c);
    low.push_back({*c.zoom, -reach});
    high.push_back({*c.zoom, reach});
    range.include(-reach);
    range.include(reach);
  }
  include(dwells, &range);
  include(movements, &range);
  SvgPlot plot(kZoomPlot_px, kZoomPlotHeight_px, reading_axis(curve),
               range.axis("f less the curve's, %"));
  plot.area(low, high, "a");
  plot.level(0);
  draw(movements, "b", &plot);
  draw(dwells, "ink", &plot);
  return html_figure(
      fmt::format(
          "<b>Residuals of the focal length</b> \u2013 <span class=\"key ink\"></span>dwells{}, "
          "\u00b12 sigma with the {:.2g} % to which the lens comes back; area: what the curve "
          "knows, \u00b12 sigma",
          movements.empty() ? "" : ", <span class=\"key b\"></span>places passed in a movement",
          kPercent * curve.content().repeatability),
      plot.svg("residuals of the focal length against the curve"));
}

// f of the visit that is this dwell, by all that was calibrated together.
std::string together_cells(const ZoomCurve& curve, const ZoomReportDwell& dwell) {
  std::optional<Calibration> visit;
  const double own = dwell.own.camera.focal_length;
  for (int i = 0; i < curve.content().nodes; ++i) {
    const Calibration node = curve.node(i);
    if (curve.content().is_between[static_cast<std::size_t>(i)] || *node.zoom != dwell.zoom)
      continue;
    if (!visit ||
        std::abs(node.camera.focal_length - own) < std::abs(visit->camera.focal_length - own))
      visit = node;
  }
  if (!visit) return "<td></td><td></td>";
  const double sigma = parameter_sigma(*visit, Parameter::kFocalLength);
  return fmt::format("<td>{}</td><td>{}</td>", value_text(visit->camera.focal_length, sigma),
                     sigma_text(sigma));
}

std::string dwell_rows(const ZoomReportInput& report) {
  std::string out;
  for (const ZoomReportDwell& dwell : report.dwells) {
    const std::string page =
        dwell.page.empty() ? "" : fmt::format("<a href=\"{0}\">{0}</a>", escape_html(dwell.page));
    if (!dwell.refusal.empty()) {
      out += fmt::format(
          "<tr><td>{:g}</td><td colspan=\"9\" class=\"words\">left out: {}</td><td>{}</td></tr>\n",
          dwell.zoom, escape_html(dwell.refusal), page);
      continue;
    }
    const Calibration& c = dwell.own;
    const double f = parameter_sigma(c, Parameter::kFocalLength);
    const double k = parameter_sigma(c, Parameter::kRadialDistortion);
    const double u = parameter_sigma(c, Parameter::kCentreU);
    const double v = parameter_sigma(c, Parameter::kCentreV);
    out += fmt::format(
        "<tr><td>{:g}</td>{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}, {}</td>"
        "<td>{}, {}</td><td>{}</td><td>{}</td></tr>\n",
        dwell.zoom, together_cells(report.fit.curve, dwell), value_text(c.camera.focal_length, f),
        sigma_text(f), value_text(c.camera.distortion.only_term(), k), sigma_text(k),
        value_text(c.camera.centre_u, u), value_text(c.camera.centre_v, v), sigma_text(u),
        sigma_text(v), rounded_text(departure_of(report.fit.curve, dwell).sigmas(), 1), page);
  }
  return out;
}

std::string movement_rows(const ZoomReportInput& report) {
  std::string out;
  for (const ZoomReportMovement& movement : report.movements) {
    if (!movement.refusal.empty()) {
      out += fmt::format(
          "<tr><td>{:g} to {:g}</td><td colspan=\"5\" class=\"words\">left out: {}</td></tr>\n",
          movement.from, movement.to, escape_html(movement.refusal));
      continue;
    }
    const MovementObservation& seen = movement.seen;
    double worst = 0;
    for (const Departure& at : departures_of(report.fit.curve, seen))
      worst = std::max(worst, std::abs(at.sigmas()));
    out += fmt::format(
        "<tr><td>{:g} to {:g}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2f}</td><td>{:.1f}</td>"
        "</tr>\n",
        movement.from, movement.to, seen.frames, seen.landmarks, seen.reading.size(),
        seen.pixel_sigma_ratio, worst);
  }
  return out;
}

struct Between {
  double usual = 0;  // relative sigmas of f at the curve's readings
  double worst = 0;
  double worst_reading = 0;
};

Between knowledge_between(const ZoomCurve& curve) {
  std::vector<double> sigmas;
  Between out;
  for (const Calibration& c : along(curve)) {
    sigmas.push_back(relative_focal_length_sigma(c));
    if (sigmas.back() <= out.worst) continue;
    out.worst = sigmas.back();
    out.worst_reading = *c.zoom;
  }
  std::sort(sigmas.begin(), sigmas.end());
  if (!sigmas.empty()) out.usual = sigmas[sigmas.size() / 2];
  return out;
}

std::string verdicts_of(const ZoomReportInput& report) {
  constexpr double kNear = 3;   // standard deviations of a chi-square that chance explains
  constexpr double kNode = 3;   // sigmas of a dwell that chance explains
  constexpr double kOe = 0.01;  // relative sigma of f with which OE mode begins at once
  const ZoomFit& fit = report.fit;
  const double two_cameras = ZoomFitOptions().two_cameras;
  const int freedom = std::max(1, fit.degrees_of_freedom);
  const double excess = (fit.chi_square - freedom) / std::sqrt(2.0 * freedom);
  std::string out = kHtmlVerdicts;
  out += html_verdict(
      excess > kNear ? "grown" : "good",
      fmt::format("chi-square {:.1f}, {} expected", fit.chi_square, fit.degrees_of_freedom),
      fmt::format("chance explains up to {:.0f}; above {:.0f} it would be two cameras",
                  freedom + kNear * std::sqrt(2.0 * freedom),
                  freedom + two_cameras * std::sqrt(2.0 * freedom)),
      excess > kNear ? "the dwells differ more than their sigmas say in what all zooms share"
                     : "the dwells agree in what all zooms share");
  double worst = 0;
  double worst_reading = 0;
  for (const ZoomReportDwell& dwell : report.dwells) {
    if (!dwell.refusal.empty()) continue;
    const double sigmas = std::abs(departure_of(fit.curve, dwell).sigmas());
    if (sigmas < worst) continue;
    worst = sigmas;
    worst_reading = dwell.zoom;
  }
  out += html_verdict(
      worst > kNode ? "grown" : "good",
      fmt::format("worst dwell {:.1f} sigmas off the curve, at reading {:.4g}", worst,
                  worst_reading),
      fmt::format("chance explains {:g}", kNode),
      worst > kNode ? "this dwell does not lie on the curve of the others: look at its own report"
                    : "all dwells lie on one curve");
  const Between known = knowledge_between(fit.curve);
  out +=
      html_verdict(known.worst > kOe ? "grown" : "good",
                   fmt::format("f known to {:.2g} % (median), {:.2g} % (worst, at reading {:.4g})",
                               kPercent * known.usual, kPercent * known.worst, known.worst_reading),
                   fmt::format("OE mode begins at once at {:g} % or better", kPercent * kOe),
                   known.worst > kOe ? "dwell there for some seconds, or record a zoom between"
                                     : "good enough at every reading");
  return out + "</ul>\n";
}

}  // namespace

std::string zoom_report(const ZoomReportInput& report) {
  const ZoomCurve& curve = report.fit.curve;
  const Calibration& shared = curve.content().shared;
  const auto left_out = std::count_if(report.dwells.begin(), report.dwells.end(),
                                      [](const auto& dwell) { return !dwell.refusal.empty(); });
  const auto used = static_cast<std::int64_t>(report.dwells.size()) - left_out;
  std::string body = fmt::format(
      "<p class=\"soft\">alidade {}, {}; pictures of {}\u00d7{} px, zoom readings {:g} to "
      "{:g}</p>\n",
      escape_html(report.version), escape_html(report.date), shared.camera.width,
      shared.camera.height, curve.first_reading(), curve.last_reading());
  Calibration first;
  Calibration last;
  std::string range;
  if (curve.at(curve.first_reading(), &first) && curve.at(curve.last_reading(), &last)) {
    range = fmt::format("focal length {:.0f} to {:.0f} px, ", first.camera.focal_length,
                        last.camera.focal_length);
  }
  body += fmt::format(
      "<div class=\"verdict{}\"><strong>One curve for all zooms</strong><p>{}from {} and {}{}</p>"
      "</div>\n",
      left_out > 0 ? " weak" : "", range, counted(used, "dwell"),
      counted(std::count_if(report.movements.begin(), report.movements.end(),
                            [](const auto& movement) { return movement.refusal.empty(); }),
              "movement"),
      left_out > 0 ? fmt::format("; {} left out, see below", counted(left_out, "dwell")) : "");
  body += verdicts_of(report);
  body += html_list("What would help", zoom_advice(curve));
  body += "<h2>Curves</h2>\n";
  for (const LensQuantity& quantity : lens_quantities()) body += curve_figure(report, quantity);
  body += departures_figure(report);
  body +=
      "<h2>Dwells</h2>\n<p class=\"soft\">Together: with all other dwells and movements, as in the "
      "table of <code>calibrate</code>. The other columns are of each dwell by itself.</p>\n"
      "<div class=\"scroll\"><table>\n<thead><tr><th>reading</th>"
      "<th>f together, px</th><th>sigma</th><th>f alone, "
      "px</th><th>sigma</th><th>k</th><th>sigma</th><th>centre, px</th><th>sigma</th>"
      "<th>off the curve, sigmas</th><th>report</th></tr></thead>\n<tbody>\n" +
      dwell_rows(report) + "</tbody>\n</table></div>\n";
  if (!report.movements.empty()) {
    body +=
        "<h2>Movements of the zoom</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th>readings"
        "</th><th>frames</th><th>landmarks</th><th>readings observed</th>"
        "<th>residuals / noise</th><th>worst, sigmas off the curve</th></tr></thead>\n<tbody>\n" +
        movement_rows(report) + "</tbody>\n</table></div>\n";
  }
  return html_page("Zoom calibration of " + escape_html(report.name), body);
}

}  // namespace alidade
