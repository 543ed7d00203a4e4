#pragma once
// TryPace: when the data of a session is worth another adjustment. Tries become rarer while they
// fail. Tests of a calibration against later motion become rarer while it agrees.
// Seconds of the frames' receive times. Does not allocate. One thread.

#include <algorithm>

#include "edge_app/self_calibration/calibration_schedule.h"
#include "edge_app/self_calibration/calibration_session.h"

namespace alidade {

class TryPace {
 public:
  explicit TryPace(const CalibrationSchedule& schedule)
      : schedule_(schedule), watch_interval_s_(schedule.first_watch_s) {}

  // The session is empty again.
  void begin_anew() { tries_ = 0; }
  // The session got its first frame, at this time.
  void begin(double time_s) { began_s_ = last_try_s_ = time_s; }

  // A try was made with the data that the session has now.
  void note_try(const CalibrationSession& session) { last_try_s_ = session.newest_s(); }
  // This try was for a first calibration.
  void note_first() { ++tries_; }
  [[nodiscard]] bool has_tried() const { return tries_ > 0; }
  [[nodiscard]] int tries() const { return tries_; }

  // The next test of the calibration comes after `pause_s`.
  void watch_after(double pause_s) { watch_interval_s_ = pause_s; }
  void watch_soon() { watch_after(schedule_.first_watch_s); }
  void watch_later() {
    watch_interval_s_ = std::min(2 * watch_interval_s_, schedule_.longest_watch_s);
  }

  // Whether a try for a first calibration is due.
  [[nodiscard]] bool first_is_due(const CalibrationSession& session) const {
    const double pause_s =
        tries_ < schedule_.many_tries ? schedule_.next_try_s : schedule_.slow_try_s;
    return session.span_s() >= schedule_.first_try_s &&
           (!has_tried() || session.newest_s() >= last_try_s_ + pause_s);
  }
  // Whether a try for the node of a dwell that has none is due.
  [[nodiscard]] bool node_is_due(const CalibrationSession& session) const {
    return session.span_s() >= schedule_.first_try_s &&
           session.newest_s() >= last_try_s_ + watch_interval_s_;
  }
  // Whether a test of a calibration against later motion is due. soon: it must not wait, as the
  // calibration's clock offset is of an earlier connection.
  [[nodiscard]] bool watch_is_due(const CalibrationSession& session, bool soon) const {
    const double newest_s = session.newest_s();
    return session.span_s() >= schedule_.watch_window_s &&
           newest_s >= began_s_ + schedule_.watch_window_s &&
           newest_s >= last_try_s_ + (soon ? schedule_.first_watch_s : watch_interval_s_);
  }

 private:
  CalibrationSchedule schedule_;
  double began_s_ = 0;  // the session's first frame
  double last_try_s_ = 0;
  int tries_ = 0;
  double watch_interval_s_;
};

}  // namespace alidade
