// The report's section on residuals: over time, over the image, and their distribution.

#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "edge_app/output/report_page.h"

namespace alidade::report {
namespace {

void residuals_over_time(ReportPage& page) {
  std::unordered_map<std::int64_t, double> time_of;
  for (const FrameResult& frame : page.result().frames)
    time_of[frame.frame] = frame.time_s - page.start_s();
  std::vector<PlotPoint> good[2];
  std::vector<PlotPoint> bad[2];
  std::vector<double> magnitudes;
  std::vector<double> sigmas;
  for (const ObservationResidual& residual : page.result().observation_residuals) {
    const CalibrationObservation& seen = page.report().input.observations[residual.observation];
    const auto frame = time_of.find(seen.frame);
    if (frame == time_of.end()) continue;
    // The exposure time of its row.
    const double time = frame->second + seen.v_px * page.result().calibration.line_delay;
    for (int i = 0; i < 2; ++i) {
      (residual.outlier ? bad : good)[i].push_back({time, residual.error_px[i]});
      if (!residual.outlier) magnitudes.push_back(std::abs(residual.error_px[i]));
    }
    if (!residual.outlier) sigmas.push_back(page.pixel_sigma(residual));
  }
  const double range = std::max(symmetric_range(magnitudes, 1), 1e-6);
  const double sigma = root_mean_square(sigmas);
  for (int i = 0; i < 2; ++i) {
    SvgPlot plot(kWide_px, 196, page.time_axis(),
                 {-range, range, i == 0 ? "error in u, px" : "error in v, px"});
    page.shade_gaps(&plot);
    plot.band(-2 * sigma, 2 * sigma);
    plot.level(0);
    plot.dots(good[i], "a", 1.8);
    plot.dots(bad[i], "bad", 4);
    page.figure(
        fmt::format("<b>Image residuals over time, {}</b> \u2013 measured minus predicted; "
                    "grey: \u00b12 sigma{}{}",
                    i == 0 ? "u" : "v", page.gap_note(),
                    bad[i].empty() ? ""
                                   : "; <span class=\"key bad\"></span>outliers, left out (at "
                                     "the edge if beyond)"),
        plot, i == 0 ? "residuals in u over time" : "residuals in v over time");
  }
}

void residuals_over_image(ReportPage& page) {
  const int width = page.report().input.width;
  const int height = page.report().input.height;
  constexpr int kColumns = 16;
  const int rows = std::clamp(
      static_cast<int>(std::lround(kColumns * static_cast<double>(height) / width)), 1, 48);
  struct Cell {
    Vector2<double> sum = Vector2<double>::Zero();
    double squares = 0;  // in units of sigma^2
    int count = 0;
  };
  std::vector<Cell> cells(static_cast<std::size_t>(kColumns * rows));
  for (const ObservationResidual& residual : page.result().observation_residuals) {
    if (residual.outlier) continue;
    const CalibrationObservation& seen = page.report().input.observations[residual.observation];
    const int column = std::clamp(static_cast<int>(seen.u_px * kColumns / width), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(seen.v_px * rows / height), 0, rows - 1);
    Cell& cell = cells[static_cast<std::size_t>(row * kColumns + column)];
    cell.sum += residual.error_px;
    cell.squares += residual.error_px.squaredNorm() / std::pow(page.pixel_sigma(residual), 2);
    ++cell.count;
  }
  constexpr int kFewest = 5;  // residuals for a mean
  double longest = 0;
  for (const Cell& cell : cells) {
    if (cell.count >= kFewest) longest = std::max(longest, cell.sum.norm() / cell.count);
  }
  const int plane = kHalf_px - SvgPlot::kLeft - SvgPlot::kRight;
  const int plane_height = std::clamp(plane * height / width, 120, 640);
  SvgPlot plot(kHalf_px, plane_height + SvgPlot::kTop + SvgPlot::kBottom,
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
  page.figure(
      fmt::format("<b>Image residuals over the image</b> \u2013 strokes: mean of a cell, the "
                  "longest is {:.3f} px; colour: its RMS, "
                  "<span class=\"key a\"></span>below and <span class=\"key b\"></span>above "
                  "the noise; empty: fewer than {} observations",
                  longest, kFewest),
      plot, "residuals over the image");
}

void histograms(ReportPage& page) {
  std::vector<double> image;
  for (const ObservationResidual& residual : page.result().observation_residuals) {
    if (residual.outlier) continue;
    for (int i = 0; i < 2; ++i) image.push_back(residual.error_px[i] / page.pixel_sigma(residual));
  }
  std::vector<double> telemetry;
  for (const TelemetryResidual& residual : page.result().telemetry_residuals) {
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
  constexpr int kSteps = 200;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = kReach * (2.0 * i / kSteps - 1);
    gaussian.push_back({x, std::exp(-0.5 * x * x) / std::sqrt(2 * kPi)});
    highest = std::max(highest, gaussian.back().y);
  }
  for (const auto* points : {&image_outline, &telemetry_outline}) {
    for (const PlotPoint& point : *points) highest = std::max(highest, point.y);
  }
  const int plane_height = std::clamp((kHalf_px - SvgPlot::kLeft - SvgPlot::kRight) *
                                          page.report().input.height / page.report().input.width,
                                      200, 320);
  SvgPlot plot(kHalf_px, plane_height + SvgPlot::kTop + SvgPlot::kBottom,
               {-kReach, kReach, "residual / its sigma"}, {0, 1.08 * highest, "density"});
  if (!image.empty() || !telemetry.empty()) plot.line(gaussian, "faint");
  if (!telemetry.empty()) plot.line(telemetry_outline, "b");
  if (!image.empty()) plot.line(image_outline, "a");
  page.figure(
      fmt::format(
          "<b>Distribution</b> \u2013 <span class=\"key a\"></span>image (u and v){}, "
          "<span class=\"key b\"></span>telemetry (pan and tilt){}, grey: the unit Gaussian",
          image.empty() ? ": no data" : "", telemetry.empty() ? ": no data" : ""),
      plot, "histogram of normalised residuals");
}

}  // namespace

void residuals(ReportPage& page) {
  page.add("<h2>Residuals</h2>\n");
  residuals_over_time(page);
  page.add("<div class=\"pair\">\n");
  residuals_over_image(page);
  histograms(page);
  page.add("</div>\n");
}

}  // namespace alidade::report
