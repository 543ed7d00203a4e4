#include "edge_app/taps/image_tap.h"

#include <algorithm>

#include "platform/system/clock.h"

namespace alidade {

ImageTap::ImageTap(std::chrono::milliseconds interval) : interval_(interval) {
  // Touches the queue's memory: the real-time thread must not be the first to do so.
  while (frames_.push(TappedFrame())) {
  }
  frames_.reset();
}

std::shared_ptr<const LiveImage> ImageTap::ask(std::chrono::milliseconds patience) {
  asked_s_ = monotonic_now_s();
  std::unique_lock<std::mutex> lock(mutex_);
  const Clock::time_point asked_at = Clock::now();
  const auto fresh = [&] { return !images_.empty() && newest_at_ + interval_ > asked_at; };
  if (!closed_ && !fresh() && !wish_under_way_) {
    wish_under_way_ = true;
    wanted_.store(true, std::memory_order_relaxed);
  }
  made_.wait_for(lock, patience, [&] { return closed_ || fresh(); });
  return !closed_ && fresh() ? images_.back() : nullptr;
}

bool ImageTap::is_watched() const {
  constexpr double kWatches_s = 5;
  const double asked_s = asked_s_;
  return asked_s >= 0 && monotonic_now_s() - asked_s < kWatches_s;
}

std::shared_ptr<const LiveImage> ImageTap::of_frame(std::int64_t frame) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = std::find_if(images_.rbegin(), images_.rend(),
                                  [frame](const auto& image) { return image->frame == frame; });
  return found == images_.rend() ? nullptr : *found;
}

bool ImageTap::push(const TappedFrame& frame) {
  const bool pushed = frames_.push(frame);
  if (!pushed) wanted_.store(true, std::memory_order_relaxed);
  pushed_.post();
  return pushed;
}

void ImageTap::end() {
  ended_.store(true, std::memory_order_release);
  pushed_.post();
}

void ImageTap::run() {
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

void ImageTap::close() {
  const std::lock_guard<std::mutex> lock(mutex_);
  closed_ = true;
  made_.notify_all();
}

void ImageTap::make(const TappedFrame& frame) {
  auto image = std::make_shared<LiveImage>();
  image->frame = frame.frame;
  image->width = frame.image.width;
  image->height = frame.image.height;
  image->jpeg = small_jpeg(frame.image, kMaxWidth, frame.colour);
  image->landmarks = frame.landmarks;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (images_.size() == kKept) images_.pop_front();
  images_.push_back(std::move(image));
  newest_at_ = Clock::now();
  wish_under_way_ = false;
  made_.notify_all();
}

}  // namespace alidade
