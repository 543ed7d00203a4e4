#include "edge_app/output/calibration_report.h"

#include <algorithm>
#include <cmath>

#include "edge_app/output/calibration_summary.h"
#include "edge_app/output/html_page.h"
#include "edge_app/output/report_page.h"

namespace alidade {
namespace report {
namespace {

void list(ReportPage& page, const char* title, const std::vector<std::string>& lines) {
  page.add("{}", html_list(title, lines));
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
  verdicts(page);
  list(page, "What contradicts the model", q.describe_departures());
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
  const std::string beyond = holds_beyond(page.result(), page.report().options);
  if (!beyond.empty()) {
    page.add(
        "<p class=\"soft\">Holds for {}. What is known of the distances and of the pupil: "
        "--scene-distance, --pupil; scene, camera.pupil_m.</p>\n",
        beyond);
  }
  const std::string far = far_focal_length_text(page.result());
  if (!far.empty()) {
    page.add("<p class=\"soft\">Focal length of far things, as scene and pupil tell: {}.</p>\n",
             far);
  }
  const std::string granted = taken_for_granted(page.result(), page.report().options);
  if (granted.empty()) return;
  page.add(
      "<p class=\"soft\">The focal length's sigma takes for granted {}; the maker's claim: "
      "--angle-accuracy, pan_tilt.angle_accuracy_deg.</p>\n",
      granted);
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
  report::telemetry_error(page);
  report::timing(page);
  report::landmarks(page);
  return html_page("Calibration of " + escape_html(report.name), page.body());
}

}  // namespace alidade
