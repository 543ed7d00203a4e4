#include "edge_app/commands/pattern_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/calibration/clock_line.h"
#include "core/model/stamp_rate.h"
#include "core/pattern/pattern_doubts.h"
#include "edge_app/commands/command.h"
#include "edge_app/step/repeated_images.h"

namespace alidade {
namespace {

constexpr std::size_t kLeastForLine = 3;
constexpr double kMuchJitter = 0.1;  // share of a period
// The sender's clock and the arrivals drift apart by more than this over the whole connection. That
// is more than the random delay of frames.
constexpr double kRunApart_s = 0.05;

bool increases(const std::vector<double>& times) {
  return std::adjacent_find(times.begin(), times.end(),
                            [](double a, double b) { return !(b > a); }) == times.end();
}

}  // namespace

PatternSearch::PatternSearch(std::string name, const KnownPattern& pattern)
    : name_(std::move(name)), pattern_(pattern), detector_(pattern) {
  video_.name = name_;
  video_.data.points_m = pattern.points_m();
}

bool PatternSearch::note(const Frame& frame) {
  if (width_ == 0) {
    width_ = frame.width;
    height_ = frame.height;
    if (std::min(width_, height_) < PatternDetector::kLeastImage_px) {
      throw CommandError(
          kExitFailed,
          fmt::format(
              "{}: its images are {}x{} px, too small for a pattern; expected {} px or more a "
              "side, better several hundred",
              name_, width_, height_, PatternDetector::kLeastImage_px));
    }
  }
  if (frame.width != width_ || frame.height != height_) {
    throw CommandError(
        kExitFailed,
        fmt::format("{}: image {} is {}x{}, those before are {}x{}; expected one size", name_,
                    frame.stamp.frame, frame.width, frame.height, width_, height_));
  }
  interlaced_ = interlaced_ || frame.interlaced;
  if (frame.luma != nullptr) {
    const std::uint64_t digest =
        image_digest({frame.luma, frame.width, frame.height, frame.stride});
    if (std::exchange(before_, digest) == digest) {
      ++repeated_;
      return false;
    }
  }
  stamps_.push_back(frame.stamp);
  to_look_at_ += frame.luma == nullptr ? 0 : 1;
  return frame.luma != nullptr;
}

bool PatternSearch::look(const Frame& frame) {
  video_.data.width = frame.width;
  video_.data.height = frame.height;
  PatternFrame found;
  found.time_s = frame.stamp.receive_time_s;
  found.observations = detector_.find(frame.luma, frame.width, frame.height, frame.stride);
  const bool is_found = !found.observations.empty();
  video_.found += is_found ? 1 : 0;
  looked_.push_back(frame.stamp.frame);
  video_.data.frames.push_back(std::move(found));
  return is_found;
}

void PatternSearch::undo_half_turns() {
  constexpr double kFollowed = 10;  // mean periods between two searched images
  const std::vector<PatternFrame>& frames = video_.data.frames;
  const double all_s = frames.back().time_s - frames.front().time_s;
  follow_half_turns(pattern_, kFollowed * all_s / static_cast<double>(frames.size() - 1),
                    &video_.data);
}

const PatternData& PatternSearch::found_so_far() {
  if (video_.data.frames.size() > 1) undo_half_turns();
  return video_.data;
}

std::vector<PatternSearch::Span> PatternSearch::connections() const {
  std::vector<Span> spans;
  for (std::size_t i = 0; i < stamps_.size(); ++i) {
    if (i == 0 || stamps_[i].restarted) spans.push_back({i, i});
    spans.back().end = i + 1;
  }
  return spans;
}

std::vector<double> PatternSearch::times_of(Span span) {
  internal::ClockInput arrivals;
  internal::ClockInput sender;
  arrivals.one_sided = true;
  for (std::size_t i = span.begin; i < span.end; ++i) {
    arrivals.stamp_s.push_back(stamps_[i].receive_time_s);
    arrivals.sequence.push_back(stamps_[i].sequence);
    if (stamps_[i].sender_time_s) sender.stamp_s.push_back(*stamps_[i].sender_time_s);
  }
  sender.sequence = arrivals.sequence;
  const std::size_t count = arrivals.stamp_s.size();
  bool by_sender = sender.stamp_s.size() == count && increases(sender.stamp_s);
  const std::vector<double>& chosen = by_sender ? sender.stamp_s : arrivals.stamp_s;
  if (!increases(chosen)) {
    std::size_t i = 1;
    while (chosen[i] > chosen[i - 1]) ++i;
    throw CommandError(
        kExitFailed,
        fmt::format("{}: time stamps do not increase: image {} is of {} s, the one before of {} s; "
                    "expected the video as the camera gave it, not cut or joined",
                    name_, stamps_[span.begin + i].frame, chosen[i], chosen[i - 1]));
  }
  if (count < kLeastForLine) return chosen;
  internal::ClockLine line = internal::fit_clock_line(by_sender ? sender : arrivals);
  if (by_sender && increases(arrivals.stamp_s)) {
    const internal::ClockLine of_arrivals = internal::fit_clock_line(arrivals);
    const double apart =
        line.steady && of_arrivals.steady ? std::abs(line.period_s / of_arrivals.period_s - 1) : 0;
    const double span_s = arrivals.stamp_s.back() - arrivals.stamp_s.front();
    if (apart > StampRate::kQuartz && apart * span_s > kRunApart_s) {
      stamps_left_out_ = true;
      line = of_arrivals;
    }
  }
  unsteady_ = unsteady_ || !line.steady;
  if (line.steady && line.stamp_sigma_s > worst_scatter_ * line.period_s) {
    worst_scatter_ = line.stamp_sigma_s / line.period_s;
    scatter_s_ = line.stamp_sigma_s;
    period_s_ = line.period_s;
  }
  video_.lost += line.lost;
  return line.time_s;
}

// Each connection has a clock of its own. Several connections are aligned by the host's clock: each
// is shifted so that its least delayed frame has no delay.
std::vector<double> PatternSearch::all_times() {
  const std::vector<Span> spans = connections();
  std::vector<double> times;
  for (const Span span : spans) {
    const std::vector<double> own = times_of(span);
    double shift_s = 0;
    if (spans.size() > 1) {
      shift_s = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < own.size(); ++i)
        shift_s = std::min(shift_s, stamps_[span.begin + i].receive_time_s - own[i]);
    }
    if (!times.empty()) {
      // Frames that a relay had stored before must not overlap those of the last connection.
      const double least_s = times.back() + (own.size() > 1 ? own[1] - own[0] : 1e-3) - own[0];
      shift_s = std::max(shift_s, least_s);
      video_.remarks.push_back(
          fmt::format("no images from {:.1f} to {:.1f} s, the connection was lost",
                      times.back() - times.front(), own.front() + shift_s - times.front()));
    }
    for (const double time_s : own) times.push_back(time_s + shift_s);
  }
  return times;
}

void PatternSearch::remark_clock() {
  if (unsteady_) {
    video_.remarks.emplace_back(
        "the frame rate is not steady, so time stamps are used as they are, and no sigma includes "
        "their errors; set a fixed frame rate and exposure");
  }
  if (stamps_left_out_) {
    video_.remarks.emplace_back(
        "the camera's time stamps run at another rate than its images come, so arrival times are "
        "used instead");
  }
  if (worst_scatter_ > kMuchJitter) {
    video_.remarks.push_back(
        fmt::format("time stamps scatter by {:.1f} ms about a steady rate of {:.2f} frames a "
                    "second; if the frame rate really varies, set a fixed frame rate and exposure",
                    1e3 * scatter_s_, 1 / period_s_));
  }
  if (video_.lost > 0)
    video_.remarks.push_back(
        fmt::format("{} images are missing, as their time stamps show", video_.lost));
}

PatternVideo PatternSearch::finish() {
  PatternData& data = video_.data;
  video_.repeated = repeated_;
  video_.images = static_cast<int>(data.frames.size()) + repeated_;
  video_.skipped = to_look_at_ - static_cast<int>(data.frames.size());
  if (data.frames.size() < kLeastForLine) {
    throw CommandError(kExitFailed, fmt::format("{}: {} images; a video of some 30 s is needed",
                                                name_, data.frames.size()));
  }
  const std::vector<double> times = all_times();
  remark_clock();
  std::size_t at = 0;
  for (std::size_t f = 0; f < looked_.size(); ++f) {
    while (stamps_[at].frame != looked_[f]) ++at;
    data.frames[f].time_s = times[at++];
  }
  undo_half_turns();
  if (interlaced_) video_.remarks.emplace_back(kInterlaced);
  for (const std::string& remark : doubts_of(data)) video_.remarks.push_back(remark);
  video_.doubt = detector_.doubt();
  if (video_.repeated > 0)
    video_.remarks.push_back(
        fmt::format("{} images repeat the one before and are left out", video_.repeated));
  return std::move(video_);
}

}  // namespace alidade
