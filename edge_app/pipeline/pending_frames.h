#pragma once
// PendingFrames: the frames that extrapolated telemetry answered, until telemetry encloses their time.
//
// Times: frame_time_s on the image clock, telemetry_time_s where the frame is looked up, on the telemetry
// clock. Of more frames than there is room for the oldest are forgotten: what they could tell the next
// ones tell too. Fixed memory; one thread.

#include <array>
#include <cstddef>
#include <optional>

namespace alidade {

struct PendingFrame {
  double frame_time_s = 0;
  double telemetry_time_s = 0;
  double time_sigma_s = 0;
};

class PendingFrames {
 public:
  static constexpr std::size_t kCapacity = 32;

  void add(const PendingFrame& frame) {
    frames_[(first_ + size_) % kCapacity] = frame;
    if (size_ < kCapacity) {
      ++size_;
    } else {
      first_ = (first_ + 1) % kCapacity;
    }
  }

  // Removes and gives the oldest frame, if its time lies before the newest sample's.
  [[nodiscard]] std::optional<PendingFrame> take(double newest_sample_s) {
    if (size_ == 0 || frames_[first_].telemetry_time_s > newest_sample_s) return std::nullopt;
    const PendingFrame frame = frames_[first_];
    first_ = (first_ + 1) % kCapacity;
    --size_;
    return frame;
  }

  void clear() { size_ = 0; }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  std::array<PendingFrame, kCapacity> frames_{};
  std::size_t first_ = 0;
  std::size_t size_ = 0;
};

}  // namespace alidade
