#include "edge_app/verify/verification_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"
#include "edge_app/output/html_page.h"
#include "edge_app/output/svg_plot.h"
#include "edge_app/verify/verification_words.h"

namespace alidade {
namespace {

constexpr int kHalf_px = 510;
constexpr int kWide_px = 1040;
constexpr int kHeight_px = 260;
constexpr double kMilli = 1e3;
constexpr double kDegreesARadian = 180 / kPi;

const char* colour_of(Verdict verdict) {
  return verdict == Verdict::kContradicted ? "bad" : verdict == Verdict::kHolds ? "a" : "faint";
}

// The ratio of each comparison with its interval, and the line at 1.
std::string ratio_plot(const Verification& v) {
  std::vector<const ClaimComparison*> shown;
  double high = 1.5;
  for (const ClaimComparison& claim : v.claims) {
    if (claim.result.pairs == 0) continue;
    shown.push_back(&claim);
    high = std::max(high, std::min(claim.result.high, 20.0) * 1.1);
  }
  if (shown.empty()) return "";
  SvgPlot plot(kWide_px, kHeight_px,
               {0, static_cast<double>(shown.size()) + 1, "comparison, in the table's order"},
               {0, high, "difference / claimed sigma"});
  plot.level(1);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const double x = static_cast<double>(i) + 1;
    const ClaimResult& r = shown[i]->result;
    const char* colour = colour_of(shown[i]->verdict);
    plot.line({{x, r.low}, {x, r.high}}, colour);
    plot.dots({{x, r.ratio}}, colour, 7);
  }
  return html_figure(
      "<b>What sigma claims.</b> Differences of directions of the same place, divided by their "
      "sigmas, with the interval of 95 %; at 1 or below the sigmas hold",
      plot.svg("ratios of differences and sigmas"));
}

std::string claims_table(const Verification& v) {
  std::string out =
      "<h2>Places seen again</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th>returns</th>"
      "<th>mode</th><th>pairs</th><th>independent numbers</th><th>RMS, px</th><th>RMS, deg</th>"
      "<th>claimed, px</th><th>ratio</th><th>95 %</th><th>verdict</th></tr></thead>\n<tbody>\n";
  for (const ClaimComparison& claim : v.claims) {
    const ClaimResult& r = claim.result;
    if (r.pairs == 0) continue;
    out += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.0f}</td><td>{:.3f}</td><td>{:.5f}</td>"
        "<td>{:.3f}</td><td>{:.2f}</td><td>{:.2f} to {:.2f}</td><td>{}</td></tr>\n",
        name_of(claim.kind), mode_of(claim.from), r.pairs, r.freedom, r.rms_px, r.rms_deg,
        r.claimed_px, r.ratio, r.low, r.high, to_string(claim.verdict));
  }
  return out + "</tbody>\n</table></div>\n";
}

std::string model_table(const Verification& v) {
  std::string out =
      "<h2>Telemetry and pictures against the calibration</h2>\n<div class=\"scroll\"><table>\n"
      "<thead><tr><th>departure</th><th>by this recording alone</th><th>chi-square</th>"
      "<th>of</th><th>chance</th><th>verdict</th></tr></thead>\n<tbody>\n";
  for (const ModelComparison& comparison : v.model) {
    const DepartureTest& test = comparison.test;
    if (test.freedom == 0) continue;
    out += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{:.1f}</td><td>{}</td><td>{:.2g}</td><td>{}</td></tr>\n",
        name_of(test.departure), size_of(test), test.chi_square, test.freedom,
        std::exp(test.log_chance), to_string(comparison.verdict));
  }
  return out +
         fmt::format(
             "</tbody>\n</table></div>\n<p class=\"soft\">A departure is contradicted below a "
             "chance of {:.1g}, so that one in a hundred calibrations with true sigmas is "
             "contradicted at most. Sizes are what this recording alone shows, whatever the "
             "calibration claims.</p>\n",
             v.chance_limit);
}

// A departure over angle or time, each knot with its sigma.
std::string curve_plot(const DepartureTest& test, const DepartureTest* found, double unit_x,
                       double unit_y, const char* x_label, const char* y_label) {
  const DepartureTest& shown = found != nullptr ? *found : test;
  if (shown.at.size() < 2 || shown.freedom == 0) return "";
  // Of knots that the recording does not tell apart only the differences mean anything.
  double mean = 0;
  for (const double size : shown.size) mean += size / static_cast<double>(shown.size.size());
  double reach = 1e-9;
  for (std::size_t i = 0; i < shown.size.size(); ++i) {
    reach = std::max(reach, unit_y * (std::abs(shown.size[i] - mean) + 2 * shown.sigma[i]));
  }
  SvgPlot plot(kHalf_px, kHeight_px, {unit_x * shown.at.front(), unit_x * shown.at.back(), x_label},
               {-1.1 * reach, 1.1 * reach, y_label});
  plot.level(0);
  std::vector<PlotPoint> line;
  for (std::size_t i = 0; i < shown.size.size(); ++i) {
    const double x = unit_x * shown.at[i];
    const double y = unit_y * (shown.size[i] - mean);
    line.push_back({x, y});
    plot.line({{x, y - unit_y * shown.sigma[i]}, {x, y + unit_y * shown.sigma[i]}}, "faint");
  }
  plot.line(line, "a");
  plot.dots(line, "a", 4);
  return html_figure(fmt::format("<b>{}.</b> With one sigma", name_of(shown.departure)),
                     plot.svg(name_of(shown.departure)));
}

std::string curves(const Verification& v) {
  std::string out = "<div class=\"pair\">\n";
  const double begin_s = [&v] {
    for (const ModelComparison& comparison : v.model) {
      if (comparison.test.departure == Departure::kPanDrift && !comparison.test.at.empty())
        return comparison.test.at.front();
    }
    return 0.0;
  }();
  for (const ModelComparison& comparison : v.model) {
    DepartureTest test = comparison.test;
    const DepartureTest* found = nullptr;
    for (const DepartureTest& each : v.found) {
      if (each.departure == test.departure) found = &each;
    }
    switch (test.departure) {
      case Departure::kPanGear:
      case Departure::kTiltGear:
        out += curve_plot(test, found, kDegreesARadian, kMilli, "true angle, deg",
                          "telemetry minus truth, mrad");
        break;
      case Departure::kPanDrift:
      case Departure::kTiltDrift:
      case Departure::kFocalDrift: {
        DepartureTest shown = found != nullptr ? *found : test;
        for (double& at : shown.at) at -= begin_s;
        const bool is_lens = test.departure == Departure::kFocalDrift;
        out += curve_plot(shown, nullptr, 1, is_lens ? 1 : kMilli, "time, s",
                          is_lens ? "change of f, px" : "telemetry minus truth, mrad");
        break;
      }
      default:
        break;
    }
  }
  return out + "</div>\n";
}

// Residuals of places, without what their pair has in common, over the place in the picture.
std::string lens_plot(const Verification& v, int axis) {
  std::vector<PlotPoint> points;
  double reach = 0.05;
  double most = 1;
  std::vector<double> sizes;
  for (const PairRows& pair : v.by_landmarks) {
    Vector2<double> mean = Vector2<double>::Zero();
    for (const PlaceRow& place : pair.places)
      mean += place.residual / static_cast<double>(pair.places.size());
    for (const PlaceRow& place : pair.places) {
      const double off = (place.residual - mean)[axis];
      points.push_back({place.at[axis], off});
      most = std::max(most, place.at[axis]);
      sizes.push_back(std::abs(off));
    }
  }
  if (!sizes.empty()) {
    const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() * 99 / 100);
    std::nth_element(sizes.begin(), at, sizes.end());
    reach = std::max(reach, *at);
  }
  SvgPlot plot(kHalf_px, kHeight_px,
               {0, most, axis == 0 ? "u in the picture, px" : "v in the picture, px"},
               {-1.1 * reach, 1.1 * reach, axis == 0 ? "residual of u, px" : "residual of v, px"});
  plot.level(0);
  plot.dots(points, "a");
  return html_figure(
      "<b>Corner against centre.</b> Places of OE mode's pairs, without what a pair "
      "has in common: a slope or a bow is the lens",
      plot.svg("residuals over the picture"));
}

// Each known direction: how far off, with its sigma.
std::string known_plot(const KnownComparison& known, int axis) {
  std::vector<PlotPoint> points;
  double reach = 1e-6;
  const std::vector<KnownOffset>& offsets = known.result.offsets;
  for (const KnownOffset& each : offsets)
    reach = std::max(reach, kDegreesARadian * (std::abs(each.off[axis]) + each.sigma[axis]));
  const char* name = axis == 0 ? "Known minus seen, to the right" : "Known minus seen, up";
  SvgPlot plot(kHalf_px, kHeight_px,
               {0, static_cast<double>(offsets.size()) + 1, "direction, in the table's order"},
               {-1.1 * reach, 1.1 * reach, "deg"});
  plot.level(0);
  const char* colour = colour_of(known.verdict);
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    if (axis == 0 && !offsets[i].known.azimuth) continue;
    const double x = static_cast<double>(i) + 1;
    const double y = kDegreesARadian * offsets[i].off[axis];
    const double sigma = kDegreesARadian * offsets[i].sigma[axis];
    plot.line({{x, y - sigma}, {x, y + sigma}}, "faint");
    points.push_back({x, y});
  }
  plot.dots(points, colour, 5);
  return html_figure(fmt::format("<b>Known directions, {} mode.</b> {}; with one sigma",
                                 mode_of(known.from), name),
                     plot.svg("known directions"));
}

std::string known_table(const KnownComparison& known) {
  std::string out =
      "<div class=\"scroll\"><table>\n<thead><tr><th>frame</th><th>u, px</th><th>v, px</th>"
      "<th>off, px</th><th>claimed, px</th><th>right, deg</th><th>up, deg</th><th>sigmas</th></tr>"
      "</thead>\n<tbody>\n";
  const auto angle = [](const KnownOffset& offset, int axis) {
    return fmt::format("{:.5f} +- {:.5f}", kDegreesARadian * offset.off[axis],
                       kDegreesARadian * offset.sigma[axis]);
  };
  for (const KnownOffset& each : known.result.offsets) {
    out += fmt::format(
        "<tr><td>{}</td><td>{:.2f}</td><td>{:.2f}</td><td>({:.2f}, {:.2f})</td><td>{:.2f}</td>"
        "<td>{}</td><td>{}</td><td>{:.2f}</td></tr>\n",
        each.known.frame, each.known.pixel.x(), each.known.pixel.y(), each.off_px.x(),
        each.off_px.y(), each.claimed_px, each.known.azimuth ? angle(each, 0) : "horizon",
        angle(each, 1), each.sigmas);
  }
  return out + "</tbody>\n</table></div>\n";
}

std::string known_part(const Verification& v) {
  if (v.known.empty()) return "";
  std::string out = "<h2>Known directions</h2>\n";
  for (const KnownComparison& known : v.known) {
    out += "<p>" + escape_html(known.sentence) + "</p>\n";
    if (known.result.offsets.empty()) continue;
    out += "<div class=\"pair\">\n" + known_plot(known, 0) + known_plot(known, 1) + "</div>\n" +
           known_table(known);
  }
  return out;
}

}  // namespace

std::string verification_report(const Verification& v, const VerificationOrigin& origin) {
  std::string body = fmt::format(
      "<p class=\"soft\">alidade {}, {}</p>\n<div class=\"verdict{}\"><strong>{}"
      "</strong><p>{}</p></div>\n",
      escape_html(origin.version), escape_html(origin.date),
      v.verdict == Verdict::kHolds ? "" : " weak",
      v.verdict == Verdict::kHolds          ? "The sigmas hold"
      : v.verdict == Verdict::kContradicted ? "The sigmas are contradicted"
                                            : "Not judged",
      escape_html(v.sentence));
  body += fmt::format(
      "<ul class=\"facts\">\n<li><b>{}</b>pairs of pictures</li>\n<li><b>{}</b>places found again"
      "</li>\n<li><b>{:.2f}</b>picture noise / stated noise</li>\n</ul>\n",
      v.pairs, v.places, v.noise_ratio);
  if (v.zooms) body += "<p>" + escape_html(sentence_of(*v.zooms)) + "</p>\n";
  if (v.link) body += "<p>" + escape_html(sentence_of(*v.link)) + "</p>\n";
  body += html_list("What would help", v.advice) + known_part(v);
  if (v.pairs > 0) {
    body += claims_table(v) + ratio_plot(v) + model_table(v) + curves(v);
    if (!v.by_landmarks.empty())
      body += "<div class=\"pair\">\n" + lens_plot(v, 0) + lens_plot(v, 1) + "</div>\n";
  }
  return html_page("Verification of " + escape_html(origin.recording), body);
}

}  // namespace alidade
