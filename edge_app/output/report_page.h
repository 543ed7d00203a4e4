#pragma once
// ReportPage: report.html while it is being written, and what its sections share: sizes, units, the
// time axis. Sections are free functions that append to it, in reading order. Internal to
// calibration_report.h. Allocates.

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

// A time without used frames, relative to ReportPage::start_s().
struct TimeGap {
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
  // caption: HTML; label: text for readers who cannot see the plot.
  void figure(const std::string& caption, const SvgPlot& plot, const std::string& label) {
    body_ += html_figure(caption, plot.svg(label));
  }

  [[nodiscard]] const CalibrationReportInput& report() const { return report_; }
  [[nodiscard]] const CalibrationResult& result() const { return report_.result; }
  // Time of the first frame, image clock. The page shows times relative to it.
  [[nodiscard]] double start_s() const { return start_s_; }
  // Times without used frames, relative to start_s().
  [[nodiscard]] const std::vector<TimeGap>& gaps() const { return gaps_; }
  // Shades the gaps in a plot over time. gap_note(): the text for its caption.
  void shade_gaps(SvgPlot* plot) const;
  [[nodiscard]] std::string gap_note() const {
    return gaps_.empty() ? "" : "; grey columns: no frame was used";
  }
  // Draws a line through points, which must be in order of time. The line is interrupted at gaps.
  void line_between_gaps(const std::vector<TimedPoint>& points, const char* colour,
                         SvgPlot* plot) const;
  [[nodiscard]] PlotAxis time_axis() const {
    const TrajectorySpline& spline = result().trajectory;
    return {spline.begin_s() - start_s_, spline.end_s() - start_s_,
            "time since the first frame, s"};
  }
  // px, sigma of the observation, scaled to the spread of the residuals.
  [[nodiscard]] double pixel_sigma(const ObservationResidual& residual) const {
    return report_.input.observations[residual.observation].sigma_px *
           result().quality.pixel_sigma_ratio;
  }
  [[nodiscard]] const std::string& body() const { return body_; }

 private:
  const CalibrationReportInput& report_;
  double start_s_;
  std::vector<TimeGap> gaps_;
  std::string body_;
};

// How many frames were not used, a line for each reason. In report_frames.cpp.
std::vector<std::string> unused_frames(const ReportPage& page);
// What the numbers say, in words, each with its limit. In report_verdicts.cpp.
void verdicts(ReportPage& page);
// In report_residuals.cpp.
void residuals(ReportPage& page);
// In report_motion.cpp.
void trajectory(ReportPage& page);
void timing(ReportPage& page);
void landmarks(ReportPage& page);
// In report_telemetry.cpp. Nothing if telemetry was found exact but for noise.
void telemetry_error(ReportPage& page);

// Half the width of a symmetric range that shows the share `quantile` (0 to 1) of the magnitudes,
// with a margin.
inline double symmetric_range(std::vector<double> magnitudes, double quantile) {
  if (magnitudes.empty()) return 1;
  const auto at = magnitudes.begin() + static_cast<std::ptrdiff_t>(
                                           quantile * static_cast<double>(magnitudes.size() - 1));
  std::nth_element(magnitudes.begin(), at, magnitudes.end());
  return std::max(1.15 * *at, 1e-9);
}

// Widens the range by a margin, so that it is never empty.
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
