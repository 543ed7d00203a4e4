#pragma once
// DetectorTap: the newest picture of the live video with its frame's record, for detectors on a thread of their own.
//
//   real-time thread ---DetectableFrame, newest wins---> detector thread (FrameDetector)
//                                                            | ImageSlot
//                                                            +--> capture thread
//
// Only frames in OE mode: what moves is told from what stands by comparing pictures to a fraction of a pixel, and telemetry alone is off by
// pixels at the long end of a zoom. A mailbox of one place: who looks takes the picture out, and one that comes before is replaced, and
// counted. Three frames in fixed memory, whose owners change by one atomic exchange (a triple buffer), so that the real-time thread
// neither waits nor allocates; the picture is lent with its slot, not copied.

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <type_traits>

#include "core/realtime/image/image_view.h"
#include "edge_app/record/orientation_record.h"
#include "edge_app/taps/image_slot.h"
#include "platform/system/semaphore.h"

namespace alidade {

struct DetectableFrame {
  OrientationRecord record;  // in mode OE, with number, time and orientation
  ImageView image;           // lent with its slot
  ImageSlot slot = kNoImageSlot;
};
static_assert(std::is_trivially_copyable_v<DetectableFrame>);

// Who looks. Called by the detector thread alone.
class FrameDetector {
 public:
  virtual ~FrameDetector() = default;
  virtual void look(const DetectableFrame& frame) = 0;
};

class DetectorTap {
 public:
  // Borrows the detector.
  explicit DetectorTap(FrameDetector& detector) : detector_(detector) {}

  // Real-time thread: whether a frame of this record can be looked at.
  [[nodiscard]] static bool takes(const OrientationRecord& record) {
    return record.mode == RecordMode::kOe && record.frame && record.time_s && record.orientation;
  }
  // Real-time thread. The slot of the picture that nobody looks at any more, as this one replaces it; kNoImageSlot: of none.
  [[nodiscard]] ImageSlot put(const OrientationRecord& record, const ImageView& image,
                              ImageSlot slot);
  // Real-time thread: nothing will follow.
  void end();

  // Detector thread: until end(). What waits then is given back, and not looked at.
  void run();

  // Capture thread: a slot that was looked at, one after the other.
  bool pop_returned(ImageSlot& slot) { return returned_.pop(slot); }

  // Any thread: pictures that were replaced.
  [[nodiscard]] std::int64_t replaced() const { return replaced_.load(std::memory_order_relaxed); }

 private:
  static constexpr unsigned kFresh = 4;  // beside the number of a frame

  // Detector thread. Null: nothing new.
  [[nodiscard]] const DetectableFrame* take();

  FrameDetector& detector_;
  std::array<DetectableFrame, 3> frames_;
  unsigned written_ = 0;              // real-time thread's
  std::atomic<unsigned> waiting_{1};  // nobody's; with kFresh: not taken yet
  unsigned read_ = 2;                 // detector thread's
  std::atomic<bool> ended_{false};
  std::atomic<std::int64_t> replaced_{0};
  boost::lockfree::spsc_queue<ImageSlot, boost::lockfree::capacity<2 * kImageSlots>> returned_;
  Semaphore put_;
};

}  // namespace alidade
