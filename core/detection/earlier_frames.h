#pragma once
// Pictures of the last seconds with their orientations, in fixed memory: what a picture is compared with.
// The latest kRecent frames are all kept, since they show what has only just come into view; of those that leave, one in every spacing_s goes on
// to a ladder of kLadder, so that it reaches back to kLadder * spacing_s. Preferred are the ladder's, the newest first, and then the
// recent ones, the oldest first: what moves slowly has left its place in them. A ladder's frame that is not spacing_s old yet comes among these.
// All memory is taken by the constructor. For one thread.

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
    std::vector<std::uint8_t> pixels;  // row after row
    FrameOrientation orientation;
  };

  EarlierFrames(int width, int height, double spacing_s);

  void clear();
  // image: width x height; later than all before.
  void add(const ImageView& image, const FrameOrientation& orientation);

  [[nodiscard]] int size() const { return recent_.count + ladder_.count; }
  // In the order of preference to a picture of that time; call before preferred() and view().
  void order_for(double time_s);
  [[nodiscard]] const Frame& preferred(int i) const {
    return frames_[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])];
  }
  // In that order, the oldest of the recent ones.
  [[nodiscard]] int first_recent() const { return ladder_.count; }
  [[nodiscard]] ImageView view(int i) const {
    return {preferred(i).pixels.data(), width_, height_, width_};
  }
  [[nodiscard]] bool after_all(double time_s) const {
    return recent_.count == 0 || time_s > time_of(recent_.slots[0]);
  }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Of frames_, the newest first.
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
  std::array<int, kMost> order_{};  // of frames_
};

}  // namespace alidade
