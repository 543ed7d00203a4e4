#include "core/detection/earlier_frames.h"

#include <algorithm>
#include <cstring>

namespace alidade {

void EarlierFrames::Row::push(int slot) {
  std::copy_backward(slots.begin(), slots.begin() + count, slots.begin() + count + 1);
  slots[0] = slot;
  ++count;
}

int EarlierFrames::Row::pop() { return slots[static_cast<std::size_t>(--count)]; }

EarlierFrames::EarlierFrames(int width, int height, double spacing_s)
    : width_(width), height_(height), spacing_s_(spacing_s) {
  for (Frame& frame : frames_) {
    frame.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }
  clear();
}

void EarlierFrames::clear() {
  recent_.count = ladder_.count = free_.count = 0;
  for (int i = 0; i < kMost; ++i) free_.push(i);
}

void EarlierFrames::add(const ImageView& image, const FrameOrientation& orientation) {
  if (recent_.count == kRecent) {
    const int leaving = recent_.pop();
    if (ladder_.count == 0 || time_of(leaving) - time_of(ladder_.slots[0]) >= spacing_s_) {
      if (ladder_.count == kLadder) free_.push(ladder_.pop());
      ladder_.push(leaving);
    } else {
      free_.push(leaving);
    }
  }
  const int slot = free_.pop();
  recent_.push(slot);
  Frame& frame = frames_[static_cast<std::size_t>(slot)];
  frame.orientation = orientation;
  for (int v = 0; v < height_; ++v) {
    std::memcpy(frame.pixels.data() + static_cast<std::ptrdiff_t>(v) * width_, image.row(v),
                static_cast<std::size_t>(width_));
  }
}

void EarlierFrames::order_for(double time_s) {
  const int young = ladder_.count > 0 && time_s - time_of(ladder_.slots[0]) < spacing_s_ ? 1 : 0;
  int* next = std::copy(ladder_.slots.begin() + young, ladder_.slots.begin() + ladder_.count,
                        order_.begin());
  if (young == 1) *next++ = ladder_.slots[0];
  std::reverse_copy(recent_.slots.begin(), recent_.slots.begin() + recent_.count, next);
}

std::size_t EarlierFrames::memory_bytes() const {
  return kMost * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
}

}  // namespace alidade
