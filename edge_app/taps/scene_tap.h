#pragma once
// SceneTap: now and then lends a live picture to the localizer, which finds the camera's
// orientation by the scene map. A picture is wanted:
// 1. at the start, and after a reconnection of the video;
// 2. when OE mode has lost its landmarks, or found some, since the last picture;
// 3. without telemetry, while frames have no orientation;
// 4. when the last picture was not found, or a second one has to confirm it;
// 5. else interval_s after the end of the last search.
// In cases 1 to 4 least_pause_s lie between the end of a search and the next picture. After each
// picture that is not found the pause doubles, five times at most; the pause is never longer than
// interval_s. While frames have no orientation the pause stays least_pause_s.
//
//   real-time thread --LocalizableFrame--> localization thread --ToldBase--> real-time thread
//                                                | ImageSlot
//                                                +--> capture thread
//
// One picture at a time, the newest when the thread is ready: none waits. For the real-time thread
// this is a few atomics and one push of a fixed-size message. The image is lent with its slot.

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

// A frame on its way to the localization thread.
struct LocalizableFrame {
  OrientationRecord record;  // with time; without orientation only if there is no telemetry
  // Camera frame; set if the record has no orientation.
  std::array<double, 3> angular_velocity_rad_s{};
  ImageView image;  // lent with its slot
  ImageSlot slot = kNoImageSlot;
};
static_assert(std::is_trivially_copyable_v<LocalizableFrame>);

// The localizer. Called by the localization thread alone.
class SceneLocator {
 public:
  enum class Outcome {
    kTold,      // *told is valid, for the real-time thread
    kNotTold,   // found, but there is nothing to report
    kOnceMore,  // a second picture has to confirm it
    kNotFound
  };

  virtual ~SceneLocator() = default;

  virtual void prepare() = 0;
  [[nodiscard]] virtual Outcome look(const LocalizableFrame& frame, ToldBase* told) = 0;
};

struct SceneTapOptions {
  double interval_s = 10;    // s, > 0: of case 5
  double least_pause_s = 1;  // s, > 0: of cases 1 to 4
};

class SceneTap {
 public:
  // Borrows the locator: it must outlive this object.
  SceneTap(SceneLocator& locator, const SceneTapOptions& options);

  // Real-time thread, for each frame: whether its image is wanted. began_anew: the first frame of a
  // connection.
  [[nodiscard]] bool wants(double now_s, RecordMode mode, bool began_anew);
  // Real-time thread, after wants(). False: not taken; the slot stays the caller's.
  bool push(const LocalizableFrame& frame);
  bool pop(ToldBase& told) { return told_.pop(told); }
  // Real-time thread: no frame will follow.
  void end();

  // Localization thread: runs until end(). Calls wake() once pop() has something to deliver.
  void run(const std::function<void()>& wake);

  // Capture thread: pops one slot whose image is no longer in use.
  bool pop_returned(ImageSlot& slot) { return returned_.pop(slot); }

 private:
  void look(const LocalizableFrame& frame, const std::function<void()>& wake);

  const SceneTapOptions options_;
  SceneLocator& locator_;
  int in_vain_ = 0;  // localization thread: unsuccessful pictures in a row

  bool asked_in_oe_ = false;     // real-time thread: mode of the frame pushed last
  bool has_begun_anew_ = false;  // real-time thread: a connection began since then

  std::atomic<bool> busy_{true};  // or not ready yet
  std::atomic<bool> ended_{false};
  std::atomic<double> earliest_s_{0};  // s, of the next picture, if there is a reason
  std::atomic<double> due_s_{0};       // s, of the next picture, if there is none
  boost::lockfree::spsc_queue<LocalizableFrame, boost::lockfree::capacity<2>> frames_;
  boost::lockfree::spsc_queue<ToldBase, boost::lockfree::capacity<4>> told_;
  boost::lockfree::spsc_queue<ImageSlot, boost::lockfree::capacity<2 * kImageSlots>> returned_;
  Semaphore pushed_;
};

}  // namespace alidade
