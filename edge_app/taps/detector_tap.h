#pragma once
// DetectorTap: hands the newest live picture, with its frame's record, to detectors on a thread of
// their own.
//
//   real-time thread ---DetectableFrame, newest wins---> detector thread (FrameDetector)
//                                                            | ImageSlot
//                                                            +--> capture thread
//
// Only frames in OE mode are handed over: detectors find motion by comparing pictures to a fraction
// of a pixel, and telemetry alone errs by pixels at the long end of a zoom. The mailbox has one
// place. A picture that is not taken before the next one comes is replaced and counted. Three
// frames in fixed memory change owner by one atomic exchange (a triple buffer), so the real-time
// thread neither waits nor allocates. The picture is lent with its slot, not copied: its memory
// stays until the slot is returned.

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
  OrientationRecord record;  // in mode OE, with frame number, time and orientation
  ImageView image;           // lent with its slot
  ImageSlot slot = kNoImageSlot;
};
static_assert(std::is_trivially_copyable_v<DetectableFrame>);

// The detector. look() is called by the detector thread alone; the frame's image is valid during
// the call.
class FrameDetector {
 public:
  virtual ~FrameDetector() = default;
  virtual void look(const DetectableFrame& frame) = 0;
};

class DetectorTap {
 public:
  // Borrows the detector: it must outlive this object.
  explicit DetectorTap(FrameDetector& detector) : detector_(detector) {}

  // Real-time thread: whether the frame of this record can be handed over.
  [[nodiscard]] static bool takes(const OrientationRecord& record) {
    return record.mode == RecordMode::kOe && record.frame && record.time_s && record.orientation;
  }
  // Real-time thread. record: takes() must be true for it, which is not checked again. Returns the
  // slot of the picture that this picture replaces; kNoImageSlot if it replaces none.
  [[nodiscard]] ImageSlot put(const OrientationRecord& record, const ImageView& image,
                              ImageSlot slot);
  // Real-time thread: no frame will follow.
  void end();

  // Detector thread: runs until end(). A picture that still waits then is returned without being
  // looked at.
  void run();

  // Capture thread: pops one slot whose picture is no longer in use. False: there is none now. The
  // queue has room for every slot.
  bool pop_returned(ImageSlot& slot) { return returned_.pop(slot); }

  // Any thread: the number of pictures that were replaced.
  [[nodiscard]] std::int64_t replaced() const { return replaced_.load(std::memory_order_relaxed); }

 private:
  static constexpr unsigned kFresh = 4;  // flag, added to the index of a frame: not taken yet

  // Detector thread. Null if there is nothing new.
  [[nodiscard]] const DetectableFrame* take();

  FrameDetector& detector_;
  std::array<DetectableFrame, 3> frames_;
  unsigned written_ = 0;              // index; owned by the real-time thread
  std::atomic<unsigned> waiting_{1};  // index, with kFresh if not taken yet; owned by neither
  unsigned read_ = 2;                 // index; owned by the detector thread
  std::atomic<bool> ended_{false};
  std::atomic<std::int64_t> replaced_{0};
  boost::lockfree::spsc_queue<ImageSlot, boost::lockfree::capacity<2 * kImageSlots>> returned_;
  Semaphore put_;
};

}  // namespace alidade
