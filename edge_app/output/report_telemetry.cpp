// The report's section on what telemetry's angles are off by: over the angle, and by play.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/model/telemetry_error.h"
#include "edge_app/output/calibration_summary.h"
#include "edge_app/output/report_page.h"

namespace alidade::report {
namespace {

const char* axis_name(int axis) { return axis == 0 ? "Pan" : "Tilt"; }
const char* axis_colour(int axis) { return axis == 0 ? "a" : "b"; }

// Reading less scaled camera angle over the true angle, with what the samples show of it.
void error_over_angle(ReportPage& page, int axis, const AngleErrorCurve& curve) {
  if (curve.count < 1) return;
  constexpr int kSteps = 400;
  constexpr double kBeyond = 0.05;  // of the knots' extent, where the curve fades out
  const double beyond = curve.fills_turn() ? 0 : kBeyond * curve.extent_rad() + curve.spacing_rad;
  const double begin = curve.first_rad - beyond;
  const double end = curve.first_rad + curve.extent_rad() + beyond;
  std::vector<PlotPoint> middle;
  std::vector<PlotPoint> low;
  std::vector<PlotPoint> high;
  double highest = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = begin + (end - begin) * i / kSteps;
    const double error = kMilli * curve.at(angle);
    const double sigma = kMilli * curve.sigma(angle);
    middle.push_back({angle * kDegrees, error});
    low.push_back({angle * kDegrees, error - 2 * sigma});
    high.push_back({angle * kDegrees, error + 2 * sigma});
    highest = std::max({highest, std::abs(low.back().y), std::abs(high.back().y)});
  }
  std::vector<PlotPoint> samples;
  for (const TelemetryResidual& residual : page.result().telemetry_residuals) {
    const double left = residual.error_rad[axis];
    if (residual.outlier || !std::isfinite(left)) continue;
    const double angle = page.result().trajectory.position(residual.time_s).vector()[axis];
    const double shown = curve.first_rad + wrap_angle(angle - curve.first_rad);
    samples.push_back({shown * kDegrees, kMilli * (curve.at(angle) + left)});
  }
  highest = std::max(highest, 1e-6);
  SvgPlot plot(
      kWide_px, 220,
      {begin * kDegrees, end * kDegrees, fmt::format("true {}, deg", axis == 0 ? "pan" : "tilt")},
      {-1.1 * highest, 1.1 * highest, "telemetry's error, mrad"});
  plot.area(low, high, axis_colour(axis));
  plot.level(0);
  plot.dots(samples, "faint");
  plot.line(middle, axis_colour(axis));
  page.figure(fmt::format("<b>Telemetry's error over the angle, {}</b> \u2013 line: as it was "
                          "learnt, \u00b12 sigma; grey: samples, play taken out",
                          axis == 0 ? "pan" : "tilt"),
              plot, fmt::format("{} error of telemetry over the angle", axis_name(axis)));
}

// Reading less camera, to and fro once.
void loop_of_play(ReportPage& page, int axis, const Play& play) {
  constexpr int kSteps = 200;   // each way
  constexpr double kReach = 2;  // widths, either way
  const double width = play.width_rad;
  const bool on_motor = play.kind == PlayKind::kMotor;
  DraggedAngle dragged(play);
  std::vector<PlotPoint> loop;
  for (int i = 0; i <= 3 * kSteps; ++i) {
    const double share = i <= kSteps       ? -1 + 2.0 * i / kSteps
                         : i <= 2 * kSteps ? 3 - 2.0 * i / kSteps
                                           : -5 + 2.0 * i / kSteps;
    const double driver = kReach * width * share;
    const double behind = driver - dragged.next(driver).angle;
    if (i < kSteps) continue;  // its state is known from here on
    loop.push_back({kMilli * driver, kMilli * (on_motor ? behind : -behind)});
  }
  const double reach = kMilli * kReach * width;
  const double half = kMilli * width / 2;
  const double sigma = kMilli * play.sigma_rad;
  const double highest = 1.3 * (half + sigma);
  SvgPlot plot(kHalf_px, 240,
               {-reach, reach, on_motor ? "way of the reading, mrad" : "way of the camera, mrad"},
               {-highest, highest, "reading - camera, mrad"});
  // Two sigmas of the width are one of each branch twice.
  plot.band(half - sigma, half + sigma);
  plot.band(-half - sigma, -half + sigma);
  plot.level(0);
  plot.line(loop, axis_colour(axis));
  page.figure(
      fmt::format("<b>Play of {}</b> \u2013 {:.3f} \u00b1 {:.3f} mrad, {}; to and fro once; "
                  "grey: \u00b12 sigma",
                  axis == 0 ? "pan" : "tilt", kMilli * width, sigma,
                  on_motor ? "encoder on the motor: the camera stands still while the reading "
                             "crosses it"
                           : "encoder behind the gear: the reading stands still while the camera "
                             "crosses it"),
      plot, fmt::format("loop of play of {}", axis == 0 ? "pan" : "tilt"));
}

}  // namespace

void telemetry_error(ReportPage& page) {
  const TelemetryError& error = page.result().telemetry_error;
  if (!error.exists()) return;
  page.add("<h2>Telemetry's own error</h2>\n");
  page.add("{}", html_list("Learnt from this recording, stored, and taken out of the telemetry",
                           telemetry_error_lines(error)));
  error_over_angle(page, 0, error.pan);
  error_over_angle(page, 1, error.tilt);
  if (!error.pan_play.exists() && !error.tilt_play.exists()) return;
  page.add("<div class=\"pair\">\n");
  if (error.pan_play.exists()) loop_of_play(page, 0, error.pan_play);
  if (error.tilt_play.exists()) loop_of_play(page, 1, error.tilt_play);
  page.add("</div>\n");
}

}  // namespace alidade::report
