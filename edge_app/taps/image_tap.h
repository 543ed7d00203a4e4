#pragma once
// ImageTap: now and then an image of the live video, small, with what the real-time thread saw in that frame,
// for somebody who asks.
//
//   asking thread ---a wish---> real-time thread ---TappedFrame---> tap thread ---LiveImage---> asking thread
//                                                                       | ImageSlot
//                                                                       +--> capture thread
//
// Made only for those who ask, and five times a second at most, however many they are: who asks within
// an interval of the newest image gets that one. To the real-time thread the wish is one atomic flag, and the hand-over
// a push of a fixed-size message and a post; the image is lent with its slot, not copied.

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>

#include "core/realtime/image/image_view.h"
#include "edge_app/step/frame_landmarks.h"
#include "edge_app/taps/image_slot.h"
#include "platform/system/semaphore.h"

namespace alidade {

// One frame on its way to the tap thread; its image is lent with its slot.
struct TappedFrame {
  std::int64_t frame = 0;
  ImageView image;
  ImageSlot slot = kNoImageSlot;
  FrameLandmarks landmarks;
};
static_assert(std::is_trivially_copyable_v<TappedFrame>);

struct LiveImage {
  std::int64_t frame = 0;
  int width = 0;  // px, of the frame
  int height = 0;
  std::string jpeg;  // at most ImageTap::kMaxWidth wide; empty: could not be made
  FrameLandmarks landmarks;
};

class ImageTap {
 public:
  static constexpr int kMaxWidth = 480;  // px
  static constexpr std::chrono::milliseconds kInterval{200};
  static constexpr std::size_t kKept = 16;

  explicit ImageTap(std::chrono::milliseconds interval = kInterval);

  // Any thread but the real-time one. The newest image, if it is not older than the interval; else the next one, which
  // is waited for. Null: none came within the time given, or close() was called.
  [[nodiscard]] std::shared_ptr<const LiveImage> ask(std::chrono::milliseconds patience);
  // Any thread but the real-time one. One of the last kKept images; null: it is not among them.
  [[nodiscard]] std::shared_ptr<const LiveImage> of_frame(std::int64_t frame) const;

  // Any thread but the real-time one: nobody waits, from this moment on.
  void close();

  // Real-time thread. True: the next frame with an image is wanted, and whoever was told so has to push one.
  bool take_wish() { return wanted_.exchange(false, std::memory_order_relaxed); }
  // Real-time thread. False: not taken, the wish stands again.
  bool push(const TappedFrame& frame);
  // Real-time thread: nothing will follow.
  void end();

  // Tap thread: makes images until end(), and closes.
  void run();

  // Capture thread: a slot that nobody looks at, one after the other.
  bool pop_returned(ImageSlot& slot) { return returned_.pop(slot); }

 private:
  using Clock = std::chrono::steady_clock;
  void make(const TappedFrame& frame);

  const std::chrono::milliseconds interval_;
  std::atomic<bool> wanted_{false};
  std::atomic<bool> ended_{false};
  // One wish, one frame: there is never more than one.
  boost::lockfree::spsc_queue<TappedFrame, boost::lockfree::capacity<2>> frames_;
  boost::lockfree::spsc_queue<ImageSlot, boost::lockfree::capacity<2 * kImageSlots>> returned_;
  Semaphore pushed_;

  mutable std::mutex mutex_;  // of what follows; never on the real-time thread
  std::condition_variable made_;
  bool wish_under_way_ = false;
  bool closed_ = false;
  Clock::time_point newest_at_;
  std::deque<std::shared_ptr<const LiveImage>> images_;  // the newest last
};

}  // namespace alidade
