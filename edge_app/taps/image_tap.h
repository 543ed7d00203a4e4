#pragma once
// ImageTap: on request, a small version of a live image with what the real-time thread saw in that
// frame.
//
//   asking thread --request--> real-time thread --TappedFrame--> tap thread --LiveImage--> asking
//                                                                    | ImageSlot           thread
//                                                                    +--> capture thread
//
// Images are made on request only, and at most five times a second for all askers together: a
// request within an interval of the newest image is answered with that image. For the real-time
// thread a request is one atomic flag, and the hand-over is one push of a fixed-size message and
// one post. The image is lent with its slot, not copied.

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
#include "edge_app/taps/small_image.h"
#include "platform/system/semaphore.h"

namespace alidade {

// One frame on its way to the tap thread; its image is lent with its slot.
struct TappedFrame {
  std::int64_t frame = 0;
  ImageView image;
  ImageSlot slot = kNoImageSlot;
  ImageColour colour;  // lent likewise
  FrameLandmarks landmarks;
};
static_assert(std::is_trivially_copyable_v<TappedFrame>);

struct LiveImage {
  std::int64_t frame = 0;
  int width = 0;  // px, of the full image
  int height = 0;
  std::string jpeg;  // at most ImageTap::kMaxWidth px wide; empty: encoding failed
  FrameLandmarks landmarks;
};

class ImageTap {
 public:
  static constexpr int kMaxWidth = 480;  // px
  static constexpr std::chrono::milliseconds kInterval{200};
  static constexpr std::size_t kKept = 16;

  explicit ImageTap(std::chrono::milliseconds interval = kInterval);

  // Any thread but the real-time one. Returns the newest image if it is no older than the interval,
  // else waits for the next one. Null if none came within `patience`, or close() was called.
  [[nodiscard]] std::shared_ptr<const LiveImage> ask(std::chrono::milliseconds patience);
  // Any thread but the real-time one. The image of this frame, if it is one of the last kKept; else
  // null.
  [[nodiscard]] std::shared_ptr<const LiveImage> of_frame(std::int64_t frame) const;

  // Any thread: whether somebody asked within the last seconds.
  [[nodiscard]] bool is_watched() const;

  // Any thread but the real-time one. From now on no request waits: each is answered with null.
  void close();

  // Real-time thread. True: the next frame with an image is wanted, and the caller has to push one.
  bool take_wish() { return wanted_.exchange(false, std::memory_order_relaxed); }
  // Real-time thread. False: the queue is full; the request stands again.
  bool push(const TappedFrame& frame);
  // Real-time thread: no frame will follow.
  void end();

  // Tap thread: makes images until end(), then closes.
  void run();

  // Capture thread: pops one slot whose image is no longer in use.
  bool pop_returned(ImageSlot& slot) { return returned_.pop(slot); }

 private:
  using Clock = std::chrono::steady_clock;
  void make(const TappedFrame& frame);

  const std::chrono::milliseconds interval_;
  std::atomic<bool> wanted_{false};
  std::atomic<double> asked_s_{-1};  // s, CLOCK_MONOTONIC: the last request; < 0: none
  std::atomic<bool> ended_{false};
  // One request, one frame: there is never more than one in the queue.
  boost::lockfree::spsc_queue<TappedFrame, boost::lockfree::capacity<2>> frames_;
  boost::lockfree::spsc_queue<ImageSlot, boost::lockfree::capacity<2 * kImageSlots>> returned_;
  Semaphore pushed_;

  mutable std::mutex mutex_;  // guards the members below; never taken by the real-time thread
  std::condition_variable made_;
  bool wish_under_way_ = false;
  bool closed_ = false;
  Clock::time_point newest_at_;
  std::deque<std::shared_ptr<const LiveImage>> images_;  // newest last
};

}  // namespace alidade
