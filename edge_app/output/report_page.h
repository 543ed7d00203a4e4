#pragma once
// ReportPage: the page of report.html while it is written, and what its sections share: sizes, units, the time axis.
// Sections are free functions that add to it, in the order in which they are read.
// Internal to calibration_report.h. Allocates.

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/model/angle.h"
#include "edge_app/output/calibration_report.h"
#include "edge_app/output/html_page.h"
#include "edge_app/output/svg_plot.h"

namespace alidade::report {

inline constexpr int kWide_px = 1040;  // a plot across the page
inline constexpr int kHalf_px = 510;   // one of two side by side
inline constexpr double kDegrees = 180 / kPi;
inline constexpr double kMilli = 1e3;  // s -> ms, rad -> mrad

struct Span {
  double begin_s = 0;
  double end_s = 0;
};

struct TimedPoint {
  double time_s = 0;  // since the first frame
  PlotPoint point;
};

class ReportPage {
 public:
  explicit ReportPage(const CalibrationReportInput& report);

  template <class... Values>
  void add(fmt::format_string<Values...> format, Values&&... values) {
    body_ += fmt::format(format, std::forward<Values>(values)...);
  }
  // caption is HTML; label what the plot shows, for those who cannot see it.
  void figure(const std::string& caption, const SvgPlot& plot, const std::string& label) {
    body_ += html_figure(caption, plot.svg(label));
  }

  [[nodiscard]] const CalibrationReportInput& report() const { return report_; }
  [[nodiscard]] const CalibrationResult& result() const { return report_.result; }
  // Of the first frame, image clock: times are shown since then.
  [[nodiscard]] double start_s() const { return start_s_; }
  // Spans of time between two frames in which no frame was used, since start_s().
  [[nodiscard]] const std::vector<Span>& gaps() const { return gaps_; }
  // Shades the gaps of a plot over time; what its caption says of that.
  void shade_gaps(SvgPlot* plot) const;
  [[nodiscard]] std::string gap_note() const {
    return gaps_.empty() ? "" : "; grey columns: no frame was used";
  }
  // A line through points in order of time, cut where they lie in a gap or on both sides of one.
  void line_between_gaps(const std::vector<TimedPoint>& points, const char* colour,
                         SvgPlot* plot) const;
  [[nodiscard]] PlotAxis time_axis() const {
    const TrajectorySpline& spline = result().trajectory;
    return {spline.begin_s() - start_s_, spline.end_s() - start_s_,
            "time since the first frame, s"};
  }
  // px, as the residuals have it.
  [[nodiscard]] double pixel_sigma(const ObservationResidual& residual) const {
    return report_.input.observations[residual.observation].sigma_px *
           result().quality.pixel_sigma_ratio;
  }
  [[nodiscard]] const std::string& body() const { return body_; }

 private:
  const CalibrationReportInput& report_;
  double start_s_;
  std::vector<Span> gaps_;
  std::string body_;
};

// Which frames were not used and why, a line for each reason. report_frames.cpp
std::vector<std::string> unused_frames(const ReportPage& page);
// report_residuals.cpp
void residuals(ReportPage& page);
// report_motion.cpp
void trajectory(ReportPage& page);
void timing(ReportPage& page);
void landmarks(ReportPage& page);

// A symmetric range that shows `quantile` of the magnitudes, with some air.
inline double symmetric_range(std::vector<double> magnitudes, double quantile) {
  if (magnitudes.empty()) return 1;
  const auto at = magnitudes.begin() + static_cast<std::ptrdiff_t>(
                                           quantile * static_cast<double>(magnitudes.size() - 1));
  std::nth_element(magnitudes.begin(), at, magnitudes.end());
  return std::max(1.15 * *at, 1e-9);
}

// low and high with a little air; never empty.
inline void widen(double* low, double* high) {
  const double air = std::max(0.05 * (*high - *low), 1e-6);
  *low -= air;
  *high += air;
}

inline double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, values.size())));
}

}  // namespace alidade::report
