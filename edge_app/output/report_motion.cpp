// The report's sections on the motion of the camera: trajectory, clocks, landmarks.

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <unordered_map>

#include "edge_app/output/report_page.h"

namespace alidade::report {

void trajectory(ReportPage& page) {
  page.add("<h2>Trajectory</h2>\n");
  const TrajectorySpline& spline = page.result().trajectory;
  const Mechanics<double>& mechanics = page.result().calibration.mechanics;
  std::vector<double> knots;
  for (int i = 0; i <= spline.segments(); ++i) knots.push_back(spline.knot(i) - page.start_s());
  for (int axis = 0; axis < 2; ++axis) {
    const char* name = axis == 0 ? "pan" : "tilt";
    const char* colour = axis == 0 ? "a" : "b";
    const double scale = axis == 0 ? mechanics.pan_scale : mechanics.tilt_scale;
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    std::vector<TimedPoint> curve;
    constexpr int kSteps = 1200;
    for (int i = 0; i <= kSteps; ++i) {
      const double time = spline.begin_s() + (spline.end_s() - spline.begin_s()) * i / kSteps;
      const double angle = spline.position(time).vector()[axis] * kDegrees;
      curve.push_back({time - page.start_s(), {time - page.start_s(), angle}});
      low = std::min(low, angle);
      high = std::max(high, angle);
    }
    std::vector<PlotPoint> samples;
    std::vector<PlotPoint> good;
    std::vector<PlotPoint> bad;
    std::vector<double> magnitudes;
    for (const TelemetryResidual& residual : page.result().telemetry_residuals) {
      // The error is that of the measured angle, which is scale times the true one; wrapping does
      // not matter.
      const double error = residual.error_rad[axis];
      if (!std::isfinite(error)) continue;
      const double time = residual.time_s - page.start_s();
      const double angle =
          (spline.position(residual.time_s).vector()[axis] + error / scale) * kDegrees;
      samples.push_back({time, angle});
      (residual.outlier ? bad : good).push_back({time, kMilli * error});
      if (!residual.outlier) magnitudes.push_back(std::abs(kMilli * error));
    }
    widen(&low, &high);
    SvgPlot plot(kWide_px, 196, page.time_axis(), {low, high, fmt::format("{}, deg", name)});
    page.shade_gaps(&plot);
    plot.ticks(knots, "ink");
    plot.dots(samples, "faint", 4);
    page.line_between_gaps(curve, colour, &plot);
    page.figure(
        fmt::format("<b>{}</b> \u2013 line: the adjusted spline; grey: telemetry; strokes on "
                    "the time axis: {} knots{}",
                    axis == 0 ? "Pan" : "Tilt", knots.size(), page.gap_note()),
        plot, std::string(name) + " over time");
    const double range = symmetric_range(magnitudes, 1);
    SvgPlot difference(kWide_px, 160, page.time_axis(),
                       {-range, range, fmt::format("{} error, mrad", name)});
    page.shade_gaps(&difference);
    difference.level(0);
    difference.dots(good, colour);
    difference.dots(bad, "bad", 4);
    page.figure(
        fmt::format("<b>Telemetry minus spline, {}</b> \u2013 RMS {:.3f} mrad{}", name,
                    root_mean_square(magnitudes),
                    bad.empty()
                        ? ""
                        : "; <span class=\"key bad\"></span>outliers, left out (at the edge "
                          "if beyond)"),
        difference, std::string(name) + " telemetry minus spline");
  }
}

namespace {

// By how much a polled sample's angle is late or early, by the motion: e r / r^2 with the error e
// and the rate r of both axes. Only where that is known to `most_s` or better.
struct PolledDelay {
  double time_s = 0;  // since the first frame
  double late_s = 0;
};

std::vector<PolledDelay> polled_delays(const ReportPage& page, double most_s) {
  std::vector<PolledDelay> delays;
  for (const TelemetryResidual& residual : page.result().telemetry_residuals) {
    if (residual.outlier || !residual.error_rad.allFinite() || !residual.sigma_rad.allFinite())
      continue;
    const Vector2<double> rate = page.result().trajectory.rate(residual.time_s).vector();
    const double square = rate.squaredNorm();
    const double sigma_rad = residual.sigma_rad.maxCoeff();
    if (!(square > 0) || sigma_rad / std::sqrt(square) > most_s) continue;
    delays.push_back({residual.time_s - page.start_s(), residual.error_rad.dot(rate) / square});
  }
  return delays;
}

// Of a telemetry whose samples have times of their own. There is no line to hold them against, but
// the motion shows when each angle was true.
void polled_stamps(ReportPage& page) {
  constexpr double kSharpest_s = 1e-3;
  const double sigma_s = page.report().input.noise.telemetry_stamp_sigma_s.value_or(kSharpest_s);
  const std::vector<PolledDelay> delays = polled_delays(page, std::max(kSharpest_s, sigma_s));
  double range = 3 * kMilli * sigma_s;
  std::vector<PlotPoint> points;
  for (const PolledDelay& one : delays) {
    points.push_back({one.time_s, kMilli * one.late_s});
    range = std::max(range, 1.05 * std::abs(points.back().y));
  }
  SvgPlot plot(kHalf_px, 240, page.time_axis(), {-range, range, "angle - stamp, ms"});
  plot.band(-2 * kMilli * sigma_s, 2 * kMilli * sigma_s);
  plot.level(0);
  plot.dots(points, "b", 3);
  page.figure(fmt::format("<b>Stamps of the telemetry</b> \u2013 it is polled; how much later than "
                          "its stamp each angle was true, as the motion tells; {} of {} samples "
                          "are quick enough for that; grey: \u00b12 sigma of a poll",
                          delays.size(), page.result().telemetry_residuals.size()),
              plot, "timing residuals of the polled telemetry");
}

const char* taken_as(const StreamTiming& timing, StampNoise noise) {
  if (noise == StampNoise::kOwnTimes) return "their own times: polled";
  if (!timing.steady) return "they are: no steady clock";
  return noise == StampNoise::kSymmetric ? "scattering to both sides" : "late only";
}

}  // namespace

void timing(ReportPage& page) {
  page.add(
      "<h2>Clocks</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th>stream</th><th>period, ms"
      "</th><th>its sigma, ms</th><th>sigma of a stamp, ms</th><th>sigma of the line, ms</th>"
      "<th>lost</th><th>stamps are taken as</th></tr></thead>\n<tbody>\n");
  const auto row = [&page](const char* name, const StreamTiming& timing, StampNoise noise) {
    page.add(
        "<tr><td>{}</td><td>{:.6f}</td><td>{:.2g}</td><td>{:.3g}</td><td>{:.2g}</td><td>{}</td>"
        "<td>{}</td></tr>\n",
        name, kMilli * timing.period_s, kMilli * timing.period_sigma_s,
        kMilli * timing.stamp_sigma_s, kMilli * timing.offset_sigma_s, timing.lost,
        taken_as(timing, noise));
  };
  row("image", page.result().image_timing, page.report().options.image_stamps);
  row("telemetry", page.result().telemetry_timing, page.report().options.telemetry_stamps);
  page.add("</tbody>\n</table></div>\n<div class=\"pair\">\n");

  std::unordered_map<std::int64_t, double> stamp_of;
  for (const CalibrationFrame& frame : page.report().input.frames) {
    stamp_of.emplace(frame.frame, frame.stamp_s);
  }
  std::vector<PlotPoint> image;
  for (const FrameResult& frame : page.result().frames) {
    image.push_back(
        {frame.time_s - page.start_s(), kMilli * (stamp_of[frame.frame] - frame.time_s)});
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
    SvgPlot plot(kHalf_px, 240, page.time_axis(), {low, high, "stamp - line, ms"});
    plot.band(std::max(low, -2 * kMilli * timing.stamp_sigma_s),
              std::min(high, 2 * kMilli * timing.stamp_sigma_s));
    plot.level(0);
    plot.dots(points, colour, 3);
    page.figure(fmt::format("<b>Stamps of {}</b> \u2013 minus the times of its steady clock; grey: "
                            "\u00b12 sigma",
                            name),
                plot, std::string("timing residuals of ") + name);
  };
  plot_stream("the image", "a", image, page.result().image_timing);
  if (page.report().options.telemetry_stamps == StampNoise::kOwnTimes) {
    polled_stamps(page);
    page.add("</div>\n");
    return;
  }
  std::vector<PlotPoint> telemetry;
  std::optional<std::size_t> shown;
  for (const TelemetryResidual& residual : page.result().telemetry_residuals) {
    // A second residual of the same sample is a change of a coarse reading, not a time stamp.
    if (shown == residual.sample) continue;
    shown = residual.sample;
    const double line = residual.time_s + page.result().calibration.clock_offset;
    telemetry.push_back({residual.time_s - page.start_s(),
                         kMilli * (page.report().input.telemetry[residual.sample].stamp_s - line)});
  }
  plot_stream("the telemetry", "b", telemetry, page.result().telemetry_timing);
  page.add("</div>\n");
}

void landmarks(ReportPage& page) {
  const Mechanics<double>& mechanics = page.result().calibration.mechanics;
  std::vector<TimedPoint> path;
  double reference = 0;
  const auto place = [&reference](const Vector3<double>& d) {
    const double azimuth = reference + wrap_angle(std::atan2(d.y(), d.x()) - reference);
    return PlotPoint{azimuth * kDegrees, -std::asin(std::clamp(d.z(), -1.0, 1.0)) * kDegrees};
  };
  for (const FrameResult& frame : page.result().frames) {
    const Vector3<double> axis = R_base_from_camera(mechanics, frame.angle).col(2);
    path.push_back({frame.time_s - page.start_s(), place(axis)});
    // Keeps the azimuth continuous beyond +-180 degrees.
    reference = path.back().point.x / kDegrees;
  }
  double low_x = path.front().point.x;
  double high_x = low_x;
  double low_y = path.front().point.y;
  double high_y = low_y;
  const auto include = [&](const PlotPoint& point) {
    low_x = std::min(low_x, point.x);
    high_x = std::max(high_x, point.x);
    low_y = std::min(low_y, point.y);
    high_y = std::max(high_y, point.y);
  };
  for (const TimedPoint& at : path) include(at.point);
  reference = 0.5 * (low_x + high_x) / kDegrees;
  std::vector<PlotPoint> often;
  std::vector<PlotPoint> seldom;
  constexpr int kOften = 10;
  for (const CalibrationLandmark& landmark : page.result().landmarks) {
    const PlotPoint point = place(landmark.d_b);
    include(point);
    (landmark.observations >= kOften ? often : seldom).push_back(point);
  }
  widen(&low_x, &high_x);
  widen(&low_y, &high_y);
  // Use the same scale for both axes, with a limited height of the plot.
  const double plane = kWide_px - SvgPlot::kLeft - SvgPlot::kRight;
  const double plane_height = std::clamp(plane * (high_y - low_y) / (high_x - low_x), 180.0, 560.0);
  const double scale = std::min(plane / (high_x - low_x), plane_height / (high_y - low_y));
  const double x_air = 0.5 * (plane / scale - (high_x - low_x));
  const double y_air = 0.5 * (plane_height / scale - (high_y - low_y));
  SvgPlot plot(kWide_px, static_cast<int>(plane_height) + SvgPlot::kTop + SvgPlot::kBottom,
               {low_x - x_air, high_x + x_air, "azimuth (right), deg"},
               {low_y - y_air, high_y + y_air, "elevation (up), deg"});
  plot.dots(seldom, "b", 3.4);
  plot.dots(often, "a", 3.4);
  page.line_between_gaps(path, "ink", &plot);
  page.add("<h2>Landmarks</h2>\n");
  page.figure(
      fmt::format("<b>Map in the base</b> \u2013 <span class=\"key a\"></span>seen {} times or "
                  "more, <span class=\"key b\"></span>less often; line: the optical axis, where "
                  "frames were used",
                  kOften),
      plot, "map of the landmarks");
}

}  // namespace alidade::report
