#include "edge_app/output/live_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "edge_app/record/record_format.h"
#include "platform/system/clock.h"
#include "platform/system/random.h"

namespace alidade {
namespace {

bool same(const PlainCalibration& a, const PlainCalibration& b) {
  static_assert(kDistortionCount == 1, "each term is compared");
  return a.focal_length == b.focal_length && a.aspect == b.aspect &&
         a.radial_distortion == b.radial_distortion && a.centre_u == b.centre_u &&
         a.centre_v == b.centre_v && a.line_delay == b.line_delay && a.pan_axis == b.pan_axis &&
         a.tilt_axis == b.tilt_axis && a.pan_scale == b.pan_scale && a.tilt_scale == b.tilt_scale &&
         a.clock_offset == b.clock_offset && a.zoom == b.zoom && a.covariance == b.covariance &&
         a.centre_error == b.centre_error;
}

}  // namespace

LiveState::LiveState(const LiveStateOptions& options)
    : options_(options),
      start_id_(random_hex(16)),
      started_s_(monotonic_now_s()),
      minute_(options.minute_s, options.minute_step_s),
      hour_(options.hour_s, options.hour_step_s) {}

bool LiveState::write(const OrientationRecord& record) {
  std::shared_ptr<const std::string> line;
  bool followed = false;
  {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    followed = !readers_.empty();
  }
  if (followed) {
    std::string text = json_line(record);
    text.pop_back();  // the line feed
    line = std::make_shared<const std::string>(std::move(text));
  }
  {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    if (!newest_ || !same(newest_->camera, record.camera)) calibration_since_s_ = monotonic_now_s();
    newest_ = record;
    if (record.orientation) newest_oriented_ = record;
    if (record.frame && record.time_s) keep(record);
    minute_.add(record);
    hour_.add(record);
    ++last_id_;
    if (line == nullptr) {
      // There is no reader, or the first one came after the check above. It begins with the next
      // record.
      lines_.clear();
      for (Reader* reader : readers_) reader->next_ = last_id_ + 1;
    } else {
      lines_.push_back(std::move(line));
      if (lines_.size() > options_.max_lines) lines_.pop_front();
    }
  }
  if (followed) {
    for (const std::function<void()>& on_news : on_news_) on_news();
  }
  return true;
}

void LiveState::keep(const OrientationRecord& record) {
  // Time jumped back: another recording, or a clock that restarted. Older frames would be found at
  // wrong times.
  if (!kept_.empty() && *record.time_s < *kept_.back().time_s) {
    kept_.clear();
    held_.clear();
  }
  kept_.push_back(record);
  while (kept_.size() > options_.max_kept ||
         *kept_.front().time_s < *record.time_s - options_.kept_s)
    kept_.pop_front();
}

std::optional<OrientationRecord> LiveState::newest() const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  return newest_;
}

std::optional<OrientationRecord> LiveState::newest_oriented() const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  return newest_oriented_;
}

FrameSearch LiveState::find(std::int64_t frame, OrientationRecord* record) const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  if (kept_.empty()) return FrameSearch::kNoneYet;
  for (const std::deque<OrientationRecord>* records : {&kept_, &held_}) {
    const auto found = std::find_if(records->rbegin(), records->rend(),
                                    [frame](const auto& one) { return *one.frame == frame; });
    if (found == records->rend()) continue;
    *record = *found;
    return FrameSearch::kFound;
  }
  return FrameSearch::kNotKept;
}

void LiveState::hold(const OrientationRecord& record) {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  const auto is_it = [&record](const auto& one) { return *one.frame == *record.frame; };
  held_.erase(std::remove_if(held_.begin(), held_.end(), is_it), held_.end());
  held_.push_back(record);
  if (held_.size() > kMaxHeld) held_.pop_front();
}

FrameSearch LiveState::find_at(double time_s, OrientationRecord* record) const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  if (kept_.empty()) return FrameSearch::kNoneYet;
  const auto time_of = [this](std::size_t i) { return *kept_[i].time_s; };
  const auto after = std::partition_point(
      kept_.begin(), kept_.end(), [time_s](const auto& one) { return *one.time_s < time_s; });
  auto nearest = static_cast<std::size_t>(after - kept_.begin());
  if (nearest == kept_.size() ||
      (nearest > 0 && time_s - time_of(nearest - 1) < time_of(nearest) - time_s))
    --nearest;
  double period_s = std::numeric_limits<double>::infinity();
  if (nearest > 0) period_s = time_of(nearest) - time_of(nearest - 1);
  if (nearest + 1 < kept_.size())
    period_s = std::min(period_s, time_of(nearest + 1) - time_of(nearest));
  if (kept_.size() == 1) period_s = 0;
  // The caller may have the time from another clock, and the times of the first frames can lie
  // close together.
  constexpr double kLeastReach_s = 1e-3;
  const double reach_s = std::max(period_s / 2, kLeastReach_s);
  if (!(std::abs(time_s - time_of(nearest)) <= reach_s)) return FrameSearch::kNotKept;
  *record = kept_[nearest];
  return FrameSearch::kFound;
}

std::vector<HistorySample> LiveState::history() const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  return minute_.samples();
}

std::vector<HistorySample> LiveState::hour() const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  return hour_.samples();
}

std::optional<double> LiveState::calibration_since_s() const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  if (!newest_) return std::nullopt;
  return calibration_since_s_;
}

std::int64_t LiveState::oldest_line() const {
  return last_id_ - static_cast<std::int64_t>(lines_.size()) + 1;
}

ReaderCounters LiveState::counters_of(const Reader& reader) const {
  ReaderCounters counters = reader.counters_;
  counters.lost += std::max<std::int64_t>(0, oldest_line() - reader.next_);
  return counters;
}

std::vector<ReaderCounters> LiveState::readers() const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  std::vector<ReaderCounters> out;
  for (const Reader* reader : readers_) out.push_back(counters_of(*reader));
  return out;
}

std::int64_t LiveState::lost_by_readers() const {
  const std::lock_guard<PriorityMutex> lock(mutex_);
  std::int64_t lost = lost_by_past_readers_;
  for (const Reader* reader : readers_) lost += counters_of(*reader).lost;
  return lost;
}

LiveState::Reader::Reader(LiveState* state) : state_(state) {
  const std::lock_guard<PriorityMutex> lock(state_->mutex_);
  next_ = state_->last_id_ + 1;
  state_->readers_.push_back(this);
}

LiveState::Reader::~Reader() {
  const std::lock_guard<PriorityMutex> lock(state_->mutex_);
  state_->readers_.remove(this);
  state_->lost_by_past_readers_ += state_->counters_of(*this).lost;
}

LiveState::News LiveState::Reader::take() {
  News news;
  LiveState& state = *state_;
  const std::lock_guard<PriorityMutex> lock(state.mutex_);
  const std::int64_t oldest = state.oldest_line();
  if (next_ < oldest) {
    news.lost = oldest - next_;
    counters_.lost += news.lost;
    next_ = oldest;
  }
  while (next_ <= state.last_id_ && news.lines.size() < kBatch) {
    news.lines.push_back({next_, state.lines_[static_cast<std::size_t>(next_ - oldest)]});
    ++next_;
  }
  counters_.records += static_cast<std::int64_t>(news.lines.size());
  return news;
}

}  // namespace alidade
