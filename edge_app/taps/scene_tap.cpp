#include "edge_app/taps/scene_tap.h"

#include <algorithm>
#include <cmath>

#include "platform/system/clock.h"

namespace alidade {

SceneTap::SceneTap(SceneLocator& locator, const SceneTapOptions& options)
    : options_(options), locator_(locator) {
  // Touches the queue's memory: the real-time thread must not be the first to do so.
  while (frames_.push(LocalizableFrame())) {
  }
  frames_.reset();
}

bool SceneTap::wants(double now_s, RecordMode mode, bool began_anew) {
  has_begun_anew_ = has_begun_anew_ || began_anew;
  if (busy_.load(std::memory_order_acquire)) return false;
  const bool has_reason =
      has_begun_anew_ || mode == RecordMode::kNone || asked_in_oe_ != (mode == RecordMode::kOe);
  return now_s >= (has_reason ? earliest_s_ : due_s_).load(std::memory_order_relaxed);
}

bool SceneTap::push(const LocalizableFrame& frame) {
  if (!frames_.push(frame)) return false;
  asked_in_oe_ = frame.record.mode == RecordMode::kOe;
  has_begun_anew_ = false;
  busy_.store(true, std::memory_order_relaxed);
  pushed_.post();
  return true;
}

void SceneTap::end() {
  ended_.store(true, std::memory_order_release);
  pushed_.post();
}

void SceneTap::run(const std::function<void()>& wake) {
  locator_.prepare();
  busy_.store(false, std::memory_order_release);
  while (true) {
    pushed_.wait();
    const bool is_last = ended_.load(std::memory_order_acquire);
    for (LocalizableFrame frame; frames_.pop(frame);) {
      // After the end nobody waits for a result.
      if (!is_last) look(frame, wake);
      returned_.push(frame.slot);
      busy_.store(false, std::memory_order_release);
    }
    if (is_last) return;
  }
}

void SceneTap::look(const LocalizableFrame& frame, const std::function<void()>& wake) {
  ToldBase told;
  told.frame = *frame.record.frame;
  told.time_s = *frame.record.time_s;
  const SceneLocator::Outcome outcome = locator_.look(frame, &told);
  if (outcome == SceneLocator::Outcome::kTold && told_.push(told)) wake();
  const bool is_in_vain =
      outcome == SceneLocator::Outcome::kNotFound && frame.record.orientation.has_value();
  in_vain_ = is_in_vain ? in_vain_ + 1 : 0;
  constexpr int kMostDoublings = 5;
  const double pause_s = std::min(
      options_.interval_s, options_.least_pause_s * std::exp2(std::min(in_vain_, kMostDoublings)));
  const bool is_settled = in_vain_ == 0 && outcome != SceneLocator::Outcome::kOnceMore;
  const double now_s = monotonic_now_s();
  earliest_s_.store(now_s + pause_s, std::memory_order_relaxed);
  due_s_.store(now_s + (is_settled ? options_.interval_s : pause_s), std::memory_order_relaxed);
}

}  // namespace alidade
