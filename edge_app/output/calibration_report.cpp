#include "edge_app/output/calibration_report.h"

#include <algorithm>
#include <cmath>

#include "edge_app/output/calibration_summary.h"
#include "edge_app/output/report_page.h"

namespace alidade {
namespace report {
namespace {

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
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(420px, 100%), 1fr)); gap: 0 20px; }
svg { display: block; width: 100%; height: auto; font-size: 12px; font-variant-numeric: tabular-nums; }
svg text { fill: var(--soft); } svg .name { fill: var(--ink); font-size: 12.5px; }
svg .grid { stroke: var(--rule); } svg .frame { stroke: var(--soft); fill: none; }
svg .dots { fill: none; stroke-linecap: round; stroke-opacity: .75; }
svg .line { fill: none; stroke-width: 1.4; stroke-linejoin: round; }
svg .band { fill: var(--soft); fill-opacity: .14; } svg .gap { fill: var(--soft); fill-opacity: .22; }
svg .level { stroke: var(--soft); }
svg .a { stroke: var(--a); } svg .b { stroke: var(--b); } svg .bad { stroke: var(--bad); }
svg .ink { stroke: var(--ink); } svg .faint { stroke: var(--soft); stroke-opacity: .7; }
svg .area { stroke: none; } svg .area.a { fill: var(--a); } svg .area.b { fill: var(--b); }
.key { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin: 0 4px 0 8px; }
.key.a { background: var(--a); } .key.b { background: var(--b); } .key.bad { background: var(--bad); }
.plot { overflow-x: auto; }
/* A wide plot is moved sideways in its frame rather than squeezed until nobody can read it. */
@media (max-width: 700px) { main { padding: 18px 12px 36px; } svg.wide { width: 820px; font-size: 14px; }
  svg.wide .name { font-size: 14.5px; } svg.half, svg.half .name { font-size: 16px; }
  th, td { padding-right: 10px; } .facts { grid-template-columns: 1fr 1fr; } }
)";

void list(ReportPage& page, const char* title, const std::vector<std::string>& lines) {
  if (lines.empty()) return;
  page.add("<h2>{}</h2>\n<ul>\n", title);
  for (const std::string& line : lines) page.add("<li>{}</li>\n", escape_html(line));
  page.add("</ul>\n");
}

void origin(ReportPage& page) {
  const CalibrationReportInput& report = page.report();
  const std::vector<FrameResult>& frames = report.result.frames;
  page.add("<p class=\"soft\">alidade {}, {}; pictures of {}\u00d7{} px, {:.1f} s</p>\n",
           escape_html(report.version), escape_html(report.date), report.input.width,
           report.input.height, frames.back().time_s - frames.front().time_s);
}

void verdict(ReportPage& page) {
  const CalibrationQuality& q = page.result().quality;
  page.add("<div class=\"verdict{}\"><strong>{}</strong><p>{}</p></div>\n",
           page.result().ok() ? "" : " weak",
           page.result().ok() ? "Calibrated" : "Too uncertain: no calibration was written",
           escape_html(page.result().message));
  page.add("<ul class=\"facts\">\n");
  const auto fact = [&page](const std::string& number, const std::string& what) {
    page.add("<li><b>{}</b>{}</li>\n", number, what);
  };
  const std::size_t used = page.result().frames.size();
  const std::size_t frames = page.report().input.frames.size();
  fact(fmt::format("{}", used),
       used == frames ? "frames, all there are" : fmt::format("frames used, of {}", frames));
  fact(fmt::format("{}", q.observations), "observations");
  fact(fmt::format("{}", q.landmarks), "landmarks");
  fact(fmt::format("{}", q.telemetry), "telemetry samples");
  fact(fmt::format("{:.3f} px", q.mean_reprojection_error_px), "mean image residual");
  fact(fmt::format("{:.3f}", q.pixel_sigma_ratio), "image residuals / stated noise");
  fact(fmt::format("{:.3f}", q.telemetry_sigma_ratio), "telemetry residuals / assumed noise");
  fact(fmt::format("{}", page.result().trajectory.segments() + 1), "spline knots");
  page.add("</ul>\n");
  list(page, "What would help", q.advice);
  std::vector<std::string> left_out = unused_frames(page);
  for (const std::string& line : page.result().exclusions.describe()) left_out.push_back(line);
  list(page, "Left out", left_out);
  list(page, "About the recording", page.report().remarks);
}

void parameters(ReportPage& page) {
  page.add(
      "<h2>Parameters</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th>parameter</th>"
      "<th>value</th><th>sigma</th><th>unit</th><th>prior</th></tr></thead>\n<tbody>\n");
  for (const SummaryRow& row : summary_rows(page.result(), page.report().options)) {
    page.add("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"soft\">{}</td></tr>\n",
             row.parameter, row.value, row.sigma, row.unit, row.prior);
  }
  page.add(
      "</tbody>\n</table></div>\n<p class=\"soft\">sigma: one standard deviation, noise of image, "
      "telemetry and stamps included. Axes: in the base (forward, right, down), sigma of the two "
      "components in the tangent plane.</p>\n");
}

void correlations(ReportPage& page) {
  const auto& cov = page.result().calibration.covariance;
  std::vector<int> free;
  for (int i = 0; i < kParameterCount; ++i) {
    if (cov(i, i) > 0) free.push_back(i);
  }
  if (free.size() < 2) return;
  page.add(
      "<h2>Correlations</h2>\n<p class=\"soft\">Weakest direction: {} (condition {:.3g}).</p>\n"
      "<div class=\"scroll\"><table class=\"matrix\">\n<thead><tr><th></th>",
      escape_html(page.result().quality.weakest_direction), page.result().quality.condition);
  const auto name = [](int i) {
    std::string text = to_string(static_cast<Parameter>(i));
    std::replace(text.begin(), text.end(), '_', ' ');
    return text;
  };
  for (const int i : free) page.add("<th>{}</th>", name(i));
  page.add("</tr></thead>\n<tbody>\n");
  for (const int i : free) {
    page.add("<tr><th>{}</th>", name(i));
    for (const int j : free) {
      const double r = cov(i, j) / std::sqrt(cov(i, i) * cov(j, j));
      if (i == j) {
        page.add("<td class=\"soft\">1</td>");
        continue;
      }
      page.add(
          "<td style=\"background:color-mix(in srgb, var(--{}) {:.0f}%, "
          "transparent)\">{}{:.2f}</td>",
          r < 0 ? "b" : "a", 80 * std::min(1.0, std::abs(r)), r < -0.005 ? "\u2212" : "",
          std::abs(r));
    }
    page.add("</tr>\n");
  }
  page.add("</tbody>\n</table></div>\n");
}

}  // namespace
}  // namespace report

std::string calibration_report(const CalibrationReportInput& report) {
  report::ReportPage page(report);
  report::origin(page);
  report::verdict(page);
  report::parameters(page);
  report::correlations(page);
  report::residuals(page);
  report::trajectory(page);
  report::timing(page);
  report::landmarks(page);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}</style>\n</head>\n<body>\n<main>\n<h1>{0}</h1>\n{2}"
      "</main>\n</body>\n</html>\n",
      "Calibration of " + escape_html(report.name), report::kStyle, page.body());
}

}  // namespace alidade
