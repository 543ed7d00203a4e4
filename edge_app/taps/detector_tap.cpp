#include "edge_app/taps/detector_tap.h"

namespace alidade {

ImageSlot DetectorTap::put(const OrientationRecord& record, const ImageView& image,
                           ImageSlot slot) {
  DetectableFrame& frame = frames_[written_];
  frame.record = record;
  frame.image = image;
  frame.slot = slot;
  // Release: the frame is complete for whoever takes it. Acquire: whoever had the other frame is
  // done with it.
  const unsigned before = waiting_.exchange(written_ | kFresh, std::memory_order_acq_rel);
  written_ = before & ~kFresh;
  put_.post();
  if ((before & kFresh) == 0) return kNoImageSlot;
  replaced_.fetch_add(1, std::memory_order_relaxed);
  return frames_[written_].slot;
}

void DetectorTap::end() {
  ended_.store(true, std::memory_order_release);
  put_.post();
}

const DetectableFrame* DetectorTap::take() {
  // Only this thread clears kFresh.
  if ((waiting_.load(std::memory_order_relaxed) & kFresh) == 0) return nullptr;
  read_ = waiting_.exchange(read_, std::memory_order_acq_rel) & ~kFresh;
  return &frames_[read_];
}

void DetectorTap::run() {
  for (bool is_last = false; !is_last;) {
    put_.wait();
    is_last = ended_.load(std::memory_order_acquire);
    const DetectableFrame* frame = take();
    if (frame == nullptr) continue;
    if (!is_last) detector_.look(*frame);
    returned_.push(frame->slot);
  }
}

}  // namespace alidade
