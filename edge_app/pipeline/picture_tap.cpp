#include "edge_app/pipeline/picture_tap.h"

#include <algorithm>

#include "edge_app/pipeline/small_picture.h"

namespace alidade {

PictureTap::PictureTap(std::chrono::milliseconds interval) : interval_(interval) {
  // The real-time thread must not be the first to touch what it fills.
  while (frames_.push(TappedFrame())) {
  }
  frames_.reset();
}

std::shared_ptr<const LivePicture> PictureTap::ask(std::chrono::milliseconds patience) {
  std::unique_lock<std::mutex> lock(mutex_);
  const Clock::time_point asked_at = Clock::now();
  const auto fresh = [&] { return !pictures_.empty() && newest_at_ + interval_ > asked_at; };
  if (!closed_ && !fresh() && !wish_under_way_) {
    wish_under_way_ = true;
    wanted_.store(true, std::memory_order_relaxed);
  }
  made_.wait_for(lock, patience, [&] { return closed_ || fresh(); });
  return !closed_ && fresh() ? pictures_.back() : nullptr;
}

std::shared_ptr<const LivePicture> PictureTap::of_frame(std::int64_t frame) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = std::find_if(pictures_.rbegin(), pictures_.rend(),
                                  [frame](const auto& picture) { return picture->frame == frame; });
  return found == pictures_.rend() ? nullptr : *found;
}

bool PictureTap::push(const TappedFrame& frame) {
  const bool pushed = frames_.push(frame);
  if (!pushed) wanted_.store(true, std::memory_order_relaxed);
  pushed_.post();
  return pushed;
}

void PictureTap::end() {
  ended_.store(true, std::memory_order_release);
  pushed_.post();
}

void PictureTap::run() {
  bool last = false;
  while (!last) {
    pushed_.wait();
    last = ended_.load(std::memory_order_acquire);
    for (TappedFrame frame; frames_.pop(frame);) {
      make(frame);
      returned_.push(frame.slot);
    }
  }
  close();
}

void PictureTap::close() {
  const std::lock_guard<std::mutex> lock(mutex_);
  closed_ = true;
  made_.notify_all();
}

void PictureTap::make(const TappedFrame& frame) {
  auto picture = std::make_shared<LivePicture>();
  picture->frame = frame.frame;
  picture->width = frame.picture.width;
  picture->height = frame.picture.height;
  picture->jpeg = small_jpeg(frame.picture, kMaxWidth);
  picture->landmarks = frame.landmarks;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (pictures_.size() == kKept) pictures_.pop_front();
  pictures_.push_back(std::move(picture));
  newest_at_ = Clock::now();
  wish_under_way_ = false;
  made_.notify_all();
}

}  // namespace alidade
