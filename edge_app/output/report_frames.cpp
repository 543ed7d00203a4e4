// The report's page itself, and which frames of the recording were used: the gaps between them and
// the reasons for unused frames.

#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_set>

#include "edge_app/output/report_page.h"
#include "platform/system/text.h"

namespace alidade::report {
namespace {

// The times between two used frames that are clearly farther apart than usual.
std::vector<TimeGap> gaps_between(const std::vector<FrameResult>& frames, double start_s) {
  constexpr double kUsual = 3.5;  // median intervals; a few lost frames are no gap
  std::vector<double> intervals;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    intervals.push_back(frames[i].time_s - frames[i - 1].time_s);
  }
  if (intervals.empty()) return {};
  std::vector<double> sorted = intervals;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::vector<TimeGap> gaps;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    if (intervals[i] <= kUsual * *middle) continue;
    gaps.push_back({frames[i].time_s - start_s, frames[i + 1].time_s - start_s});
  }
  return gaps;
}

}  // namespace

ReportPage::ReportPage(const CalibrationReportInput& report)
    : report_(report),
      start_s_(report.result.frames.front().time_s),
      gaps_(gaps_between(report.result.frames, start_s_)) {}

void ReportPage::shade_gaps(SvgPlot* plot) const {
  for (const TimeGap& gap : gaps_) plot->shade(gap.begin_s, gap.end_s);
}

void ReportPage::line_between_gaps(const std::vector<TimedPoint>& points, const char* colour,
                                   SvgPlot* plot) const {
  std::vector<PlotPoint> piece;
  const auto end_piece = [&] {
    // A line of one point would be invisible.
    if (piece.size() == 1) plot->dots(piece, colour);
    if (piece.size() > 1) plot->line(piece, colour);
    piece.clear();
  };
  std::size_t next = 0;  // first gap that ends after the point
  for (const TimedPoint& at : points) {
    for (; next < gaps_.size() && gaps_[next].end_s <= at.time_s; ++next) end_piece();
    if (next < gaps_.size() && at.time_s > gaps_[next].begin_s) continue;
    piece.push_back(at.point);
  }
  end_piece();
}

namespace {

// In the order of Untracked. The last line is for a given tracks.csv.
constexpr std::array<const char*, 6> kUntrackedLines = {
    "whose picture is missing or could not be decoded",
    "outside the telemetry's time span, or of no use to the first look at the video",
    "in which no point was followed: too plain or too blurred",
    "whose points were followed through fewer than 5 frames: too plain, too blurred, or too fast",
    "whose points were left out, as more than 30000 observations take too long",
    "of which tracks.csv has no point"};
static_assert(kMinSightings == 5 && kMaxObservations == 30000);

}  // namespace

std::vector<std::string> unused_frames(const ReportPage& page) {
  std::unordered_set<std::int64_t> known;
  for (const FrameResult& frame : page.result().frames) known.insert(frame.frame);
  std::unordered_set<std::int64_t> observed;
  for (const CalibrationObservation& seen : page.report().input.observations) {
    observed.insert(seen.frame);
  }
  // Counts by Untracked. The last: no reason is known.
  std::array<int, kUntrackedLines.size()> without_points{};
  int left_out = 0;
  const auto& untracked = page.report().untracked;
  const auto line_of = [&untracked](std::int64_t frame) {
    if (!untracked) return kUntrackedLines.size() - 1;
    const auto why = untracked->find(frame);
    return why == untracked->end() ? kUntrackedLines.size() - 1
                                   : static_cast<std::size_t>(why->second);
  };
  for (const CalibrationFrame& frame : page.report().input.frames) {
    // Skip used frames. The exclusions report frames without a time stamp and repeated frames.
    if (!std::isfinite(frame.stamp_s) || !known.insert(frame.frame).second) continue;
    ++(observed.count(frame.frame) != 0 ? left_out : without_points[line_of(frame.frame)]);
  }
  std::vector<std::string> lines;
  for (std::size_t why = 0; why < without_points.size(); ++why) {
    if (without_points[why] > 0)
      lines.push_back(
          fmt::format("{} {}", counted(without_points[why], "frame"), kUntrackedLines[why]));
  }
  if (left_out > 0) {
    lines.push_back(fmt::format(
        "{} of whose points none was used: outliers, seen in no other frame, or outside the "
        "telemetry's time span",
        counted(left_out, "frame")));
  }
  for (const TimeGap& gap : page.gaps()) {
    constexpr std::size_t kMost = 8;  // lines
    if (lines.size() == kMost) {
      lines.emplace_back("and in further gaps, grey in the plots over time");
      break;
    }
    lines.push_back(fmt::format("no frame from {:.2f} to {:.2f} s: grey in the plots over time",
                                gap.begin_s, gap.end_s));
  }
  return lines;
}

}  // namespace alidade::report
