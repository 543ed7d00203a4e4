#pragma once
// EarlierFrames: images of the last seconds with their orientations, to compare an image with. The
// latest kRecent frames are all kept, as they show what has only just come into view. When frames
// become older than these, one in every spacing_s is kept further, in a ladder of kLadder frames
// that reaches back kLadder * spacing_s.
// Order of preference: the ladder, newest first; then the recent frames, oldest first, as slow
// targets have left their place of then. A ladder frame younger than spacing_s comes just before
// the recent ones. The constructor takes all memory. For one thread.

#include <array>
#include <cstdint>
#include <vector>

#include "core/realtime/frame_orientation.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

class EarlierFrames {
 public:
  static constexpr int kRecent = 3;
  static constexpr int kLadder = 5;
  static constexpr int kMost = kRecent + kLadder;

  struct Frame {
    std::vector<std::uint8_t> pixels;  // grey levels, row by row
    FrameOrientation orientation;
  };

  // width, height: px. spacing_s: s, >= 0.
  EarlierFrames(int width, int height, double spacing_s);

  void clear();
  // image: width x height, copied; its orientation's time is later than all before.
  void add(const ImageView& image, const FrameOrientation& orientation);

  [[nodiscard]] int size() const { return recent_.count + ladder_.count; }
  // Sets the order of preference for an image of this time. To be called before preferred() and
  // view().
  void order_for(double time_s);
  // i: 0 to size() - 1; 0 is preferred most.
  [[nodiscard]] const Frame& preferred(int i) const {
    return frames_[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])];
  }
  // Index of the oldest recent frame in that order.
  [[nodiscard]] int first_recent() const { return ladder_.count; }
  [[nodiscard]] ImageView view(int i) const {
    return {preferred(i).pixels.data(), width_, height_, width_};
  }
  // True if this time is later than those of all frames.
  [[nodiscard]] bool after_all(double time_s) const {
    return recent_.count == 0 || time_s > time_of(recent_.slots[0]);
  }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Indices of frames_, newest first.
  struct Row {
    std::array<int, kMost> slots{};
    int count = 0;

    void push(int slot);
    int pop();  // the oldest
  };

  [[nodiscard]] double time_of(int slot) const {
    return frames_[static_cast<std::size_t>(slot)].orientation.time_s;
  }

  int width_, height_;
  double spacing_s_;
  std::array<Frame, kMost> frames_;
  Row recent_, ladder_, free_;
  std::array<int, kMost> order_{};  // indices of frames_
};

}  // namespace alidade
