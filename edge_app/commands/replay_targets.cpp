#include "edge_app/commands/replay_targets.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <limits>
#include <system_error>
#include <utility>

#include "edge_app/commands/command.h"
#include "edge_app/output/targets_json.h"

namespace alidade {
namespace {

std::string why() { return std::generic_category().message(errno); }

Config tracking_config(const std::string& path) {
  Config config;
  if (path.empty()) {
    config.tracking.targets = default_target_options(TargetSpace::kSphere);
    return config;
  }
  std::string error;
  if (!load_config(path, &config, &error, ConfigScope::kTracking))
    throw CommandError(kExitUsage, error);
  if (!config.tracking.targets)
    throw CommandError(kExitUsage,
                       path + ": has no section tracking; add one, or leave out --tracking");
  return config;
}

TargetStage make_stage(const std::string& path) {
  const Config config = tracking_config(path);
  const bool on_plane = config.tracking.targets->tracker.space == TargetSpace::kPlane;
  return {*config.tracking.targets, on_plane ? require_plane(config) : nullptr};
}

}  // namespace

ReplayTargets::ReplayTargets(const std::string& detections, const std::string& tracking,
                             std::string path, StopSignals* signals)
    : name_(detections == "-" ? "stdin" : detections),
      signals_(signals),
      stage_(make_stage(tracking)),
      in_(STDIN_FILENO),
      out_(std::move(path)),
      writer_(out_.descriptor(), out_.path(), "targets", LineWriter::Stalled::kWait) {
  if (detections != "-") {
    opened_.reset(::open(detections.c_str(), O_RDONLY | O_CLOEXEC));
    if (!opened_.is_open())
      throw CommandError(kExitUsage, name_ + ": cannot be read: " + why() +
                                         "; give --detections FILE, or - for stdin");
    in_ = opened_.get();
  }
}

bool ReplayTargets::read_line(std::string* line) {
  for (;;) {
    const std::size_t end = buffer_.find('\n', begin_);
    // The limit holds for any division of the line into pieces.
    if (std::min(end, buffer_.size()) - begin_ > kMaxDetectionBytes)
      throw CommandError(kExitFailed, fmt::format("{}:{}: is longer than {} bytes; expected one "
                                                  "frame a line",
                                                  name_, line_ + 1, kMaxDetectionBytes));
    if (end != std::string::npos || (ended_ && begin_ < buffer_.size())) {
      const std::size_t last = end == std::string::npos ? buffer_.size() : end;
      line->assign(buffer_, begin_, last - begin_);
      begin_ = end == std::string::npos ? buffer_.size() : end + 1;
      ++line_;
      return true;
    }
    if (ended_) return false;
    buffer_.erase(0, begin_);
    begin_ = 0;
    // A signal must end the wait for a slow writer.
    if (signals_->wait(in_, std::numeric_limits<double>::infinity()) == StopSignals::Event::kSignal)
      throw CommandError(kExitFailed, "replay interrupted; nothing stored");
    constexpr std::size_t kPiece = std::size_t{64} << 10;
    const std::size_t size = buffer_.size();
    buffer_.resize(size + kPiece);
    const ssize_t count = ::read(in_, buffer_.data() + size, kPiece);
    buffer_.resize(size + static_cast<std::size_t>(count > 0 ? count : 0));
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count < 0) throw CommandError(kExitFailed, name_ + ": cannot be read: " + why());
    ended_ = count == 0;
  }
}

// Reads the next frame of detections into waiting_. False: there is none.
bool ReplayTargets::next() {
  std::string text;
  do {
    if (!read_line(&text)) return false;
  } while (text.find_first_not_of(" \t\r") == std::string::npos);
  DetectionQuery query;
  std::string error;
  if (!parse_detections(text, &query, &error))
    throw CommandError(kExitFailed, fmt::format("{}:{}: {}", name_, line_, error));
  waiting_ = std::move(query);
  return true;
}

bool ReplayTargets::is_due() const {
  if (waiting_->which.frame) return newest_frame_ && *waiting_->which.frame <= *newest_frame_;
  return newest_s_ && *waiting_->which.time_s <= *newest_s_;
}

void ReplayTargets::take() {
  const FrameChoice which = waiting_->which;
  DetectedFrame frame;
  frame.boxes = std::move(waiting_->boxes);
  waiting_.reset();
  const FrameSearch found = which.frame ? records_.find(*which.frame, &frame.record)
                                        : records_.find_at(*which.time_s, &frame.record);
  if (found != FrameSearch::kFound) {
    const bool later = which.frame ? *which.frame > newest_frame_.value_or(-1)
                                   : *which.time_s > newest_s_.value_or(0);
    stage_.count(later ? DetectionStatus::kFrameNotYet : DetectionStatus::kUnknownFrame);
    return;
  }
  const DetectionAnswer answer = stage_.add(frame);
  if (is_taken(answer.status) && !writer_.write(targets_line(stage_.state())))
    throw CommandError(kExitFailed, writer_.error());
}

void ReplayTargets::add(const OrientationRecord& record) {
  static_cast<void>(records_.write(record));
  if (!record.frame) return;
  newest_frame_ = record.frame;
  if (record.time_s) newest_s_ = record.time_s;
  while (waiting_ || next()) {
    if (!is_due()) return;
    const bool at_hand = waiting_->which.frame == record.frame ||
                         (record.time_s && waiting_->which.time_s == record.time_s);
    take();
    if (at_hand) return;
  }
}

std::string ReplayTargets::complete() {
  while (waiting_ || next()) take();
  out_.complete();
  return out_.path() + ": " + detections_text(stage_.state().counters);
}

}  // namespace alidade
