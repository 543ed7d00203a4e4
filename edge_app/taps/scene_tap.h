#pragma once
// SceneTap: now and then a picture of the live video for somebody who knows by a scene map where it looks, and what comes of it: at the
// start, after a reconnection, where OE mode has lost its landmarks or found some, else each interval_s; without telemetry, as soon as may
// be wherever there is no orientation.
//
//   real-time thread --LocalizableFrame--> localization thread --ToldBase--> real-time thread
//                                                | ImageSlot
//                                                +--> capture thread
//
// One picture at a time, the newest when the thread is ready for one: none waits. To the real-time thread that is a few atomics and the
// push of a fixed-size message; the image is lent with its slot. Pauses grow while pictures are refused, but not where there is no
// orientation meanwhile.

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <functional>
#include <type_traits>

#include "core/realtime/image/image_view.h"
#include "edge_app/record/orientation_record.h"
#include "edge_app/step/told_base.h"
#include "edge_app/taps/image_slot.h"
#include "platform/system/semaphore.h"

namespace alidade {

// One frame on its way to the localization thread.
struct LocalizableFrame {
  OrientationRecord record;  // with time, and with an orientation unless there is no telemetry
  std::array<double, 3> angular_velocity_rad_s{};  // camera frame; where it has none
  ImageView image;                                 // lent with its slot
  ImageSlot slot = kNoImageSlot;
};
static_assert(std::is_trivially_copyable_v<LocalizableFrame>);

// Who looks. Called by the localization thread alone.
class SceneLocator {
 public:
  enum class Outcome {
    kTold,      // *told is to be told
    kNotTold,   // it was found, and there is nothing to be told
    kOnceMore,  // a second picture is to say the same
    kNotFound
  };

  virtual ~SceneLocator() = default;

  virtual void prepare() = 0;
  [[nodiscard]] virtual Outcome look(const LocalizableFrame& frame, ToldBase* told) = 0;
};

struct SceneTapOptions {
  double interval_s = 10;    // > 0
  double least_pause_s = 1;  // > 0: between two pictures
};

class SceneTap {
 public:
  // Borrows the locator.
  SceneTap(SceneLocator& locator, const SceneTapOptions& options);

  // Real-time thread, for each frame: whether its image is wanted. began_anew: the first of a connection.
  [[nodiscard]] bool wants(double now_s, RecordMode mode, bool began_anew);
  // Real-time thread; wants() has said so. False: not taken.
  bool push(const LocalizableFrame& frame);
  bool pop(ToldBase& told) { return told_.pop(told); }
  // Real-time thread: nothing will follow.
  void end();

  // Localization thread: until end(). wake: called behind what pop() gives.
  void run(const std::function<void()>& wake);

  // Capture thread: a slot that nobody looks at, one after the other.
  bool pop_returned(ImageSlot& slot) { return returned_.pop(slot); }

 private:
  void look(const LocalizableFrame& frame, const std::function<void()>& wake);

  const SceneTapOptions options_;
  SceneLocator& locator_;
  int in_vain_ = 0;  // localization thread: pictures in a row

  bool asked_in_oe_ = false;     // real-time thread: of the frame last pushed
  bool has_begun_anew_ = false;  // real-time thread: since then

  std::atomic<bool> busy_{true};  // or not ready yet
  std::atomic<bool> ended_{false};
  std::atomic<double> earliest_s_{0};  // of the next picture, where there is a reason
  std::atomic<double> due_s_{0};       // and without one
  boost::lockfree::spsc_queue<LocalizableFrame, boost::lockfree::capacity<2>> frames_;
  boost::lockfree::spsc_queue<ToldBase, boost::lockfree::capacity<4>> told_;
  boost::lockfree::spsc_queue<ImageSlot, boost::lockfree::capacity<2 * kImageSlots>> returned_;
  Semaphore pushed_;
};

}  // namespace alidade
