#pragma once
// FrameClock: the capture time of each frame of a live stream, and whether it is known.
//
// A frame is stamped when it arrives, and may have waited before that for nobody knows how long: behind a relay or
// a network that stood still, in a cache that a new reader is served from, in the socket of this process while it was
// stopped. What is known of its age depends on what the stream tells:
//   sender's clock  At a (re)connection nothing until the arrivals have shown the sender's pace (arrival_pace.h); the
//                   CaptureClock then learns from the items that showed it, and if none before them waited, from all. From
//                   then on the line holds also for what waits, if the sender's clock runs on while its items wait. It is
//                   believed to once it was seen to: late frames came down to the line again. Until then a frame
//                   later than ArrivalPace::kBacklog_s is of unknown age: the sender may have stood still, and its clock
//                   with it. Where such frames come at the pace, it did, and the clock begins anew.
//                   A frame that comes before a young line by more than kEarly_s shows that all before it had
//                   waited: as at a reconnection.
//   count alone     (V4L2: stamps of the driver.) The same but for the start: a driver holds back a few buffers only.
//   nothing         receipt_clock.h.
// wait_for_pace false (a recording, whose stamps have been there all the time): CaptureClock alone.
// Fixed memory, no allocation, one thread. Seconds.

#include <cmath>
#include <cstdint>
#include <optional>

#include "core/model/arrival_pace.h"
#include "edge_app/pipeline/capture_clock.h"
#include "edge_app/pipeline/receipt_clock.h"
#include "platform/streams/frame.h"

namespace alidade {

struct FrameTime {
  ClockEstimate clock;
  bool known = true;   // false: clock.time_s may be late by any time
  bool of_use = true;  // false: nor will it be known later, when the pace or the line is
  // Steps of the least delay, which the receive time contains and the line does not.
  double delay_shift_s = 0;
};

class FrameClock {
 public:
  // stamp_sigma_s: one standard deviation of a receive time that has to do for the time itself.
  FrameClock(const ClockFilterOptions& options, double stamp_sigma_s, bool wait_for_pace)
      : stamp_sigma_s_(stamp_sigma_s),
        settle_s_(options.settle_s),
        wait_for_pace_(wait_for_pace),
        clock_(options),
        receipts_(stamp_sigma_s) {}

  FrameTime update(const FrameStamp& stamp) {
    FrameTime time = judge(stamp);
    if (!waiting_ && kind_ != Kind::kNothing) time.delay_shift_s = clock_.filter().delay_shift_s();
    return time;
  }

 private:
  enum class Kind : std::uint8_t { kNew, kSenderTime, kSequence, kNothing };

  static constexpr int kStrangeInARow = 3;
  static constexpr double kEarly_s = 0.02;      // the least delay of a connection differs by less
  static constexpr double kStoodStill_s = 0.5;  // half of the window at the pace that tells

  FrameTime judge(const FrameStamp& stamp) {
    if (!wait_for_pace_) return {ask_clock(stamp, stamp.restarted)};
    const Kind kind = stamp.sender_time_s ? Kind::kSenderTime
                      : stamp.sequence    ? Kind::kSequence
                                          : Kind::kNothing;
    const bool finite = std::isfinite(stamp.receive_time_s) &&
                        (!stamp.sender_time_s || std::isfinite(*stamp.sender_time_s));
    begins_ = begins_ || stamp.restarted;
    // A part of a stream with stamps that has none is no other stream yet.
    if (!finite || (!begins_ && kind != kind_ && ++strange_ < kStrangeInARow)) {
      return unusable(stamp);
    }
    const bool begins = begins_ || kind != kind_;
    const bool anew = begins && kind_ != Kind::kNew;
    strange_ = 0;
    begins_ = false;
    if (begins) begin(kind);
    FrameTime time = kind == Kind::kNothing ? by_receipt(stamp)
                     : waiting_             ? wait(stamp)
                                            : by_line(stamp);
    time.clock.restarted = time.clock.restarted || (anew && kind != Kind::kNothing);
    return time;
  }

  // The estimate without any of the above.
  ClockEstimate ask_clock(const FrameStamp& stamp, bool anew) {
    ClockEstimate clock;
    clock.time_s = stamp.receive_time_s;
    clock.sigma_s = stamp_sigma_s_;
    clock.state = ClockState::kLocked;
    return clock_.update(stamp.receive_time_s, stamp.sender_time_s, stamp.sequence, anew)
        .value_or(clock);
  }

  [[nodiscard]] FrameTime unusable(const FrameStamp& stamp) const {
    FrameTime time;
    time.clock.time_s = stamp.receive_time_s;
    time.clock.sigma_s = stamp_sigma_s_;
    time.clock.rejected = true;
    time.known = time.of_use = false;
    return time;
  }

  void begin(Kind kind) {
    kind_ = kind;
    waiting_ = kind == Kind::kSenderTime;
    line_begins_ = true;
    late_ = false;
    pace_.restart();
    receipts_.restart();
  }

  FrameTime by_receipt(const FrameStamp& stamp) {
    const ReceiptClock::Answer answer = receipts_.update(stamp.receive_time_s);
    FrameTime time;
    time.clock.time_s = answer.time_s;
    time.clock.sigma_s = answer.sigma_s;
    time.clock.state = ClockState::kLocked;  // it will not be known better
    time.known = time.of_use = answer.known;
    return time;
  }

  FrameTime wait(const FrameStamp& stamp) {
    pace_.add(stamp.receive_time_s, *stamp.sender_time_s);
    const auto shown = pace_.shown();
    if (!shown) {
      FrameTime time = unusable(stamp);
      time.clock.rejected = false;
      time.of_use = true;
      return time;
    }
    const bool backlog = pace_.saw_backlog(shown->least_s);
    FrameTime time;
    for (std::size_t i = backlog ? shown->first : 0; i < pace_.size(); ++i) {
      time.clock =
          *clock_.update(pace_.receive_s(i), pace_.sender_s(i), std::nullopt, line_begins_);
      if (line_begins_) line_since_s_ = pace_.receive_s(i);
      line_begins_ = false;
    }
    time.clock.restarted = backlog;  // those before it have other times
    time.known = !time.clock.rejected;
    waiting_ = false;
    return time;
  }

  FrameTime by_line(const FrameStamp& stamp) {
    FrameTime time;
    const ClockFilter<>& filter = clock_.filter();
    const bool by_count = kind_ == Kind::kSequence;
    const bool young = !line_begins_ && filter.state() == ClockState::kWarmingUp &&
                       stamp.receive_time_s < line_since_s_ + settle_s_;
    const double before_s = by_count ? 0
                                     : stamp.receive_time_s - filter.delay_shift_s() -
                                           filter.to_host(*stamp.sender_time_s);
    if (young && before_s < -kEarly_s) return begin_again(stamp);
    time.clock = ask_clock(stamp, line_begins_);
    if (line_begins_) line_since_s_ = stamp.receive_time_s;
    line_begins_ = false;
    time.known = !time.clock.rejected;
    if (time.clock.rejected) return time;
    if (time.clock.restarted && !by_count) return begin_again(stamp);
    judge_lateness(stamp, &time);
    return time;
  }

  // All that the stream has shown so far was of a backlog, or of another clock.
  FrameTime begin_again(const FrameStamp& stamp) {
    begin(kind_);
    FrameTime time = waiting_ ? wait(stamp) : FrameTime{ask_clock(stamp, true)};
    line_begins_ = waiting_;
    time.clock.restarted = true;
    return time;
  }

  void judge_lateness(const FrameStamp& stamp, FrameTime* time) {
    const double late_s =
        stamp.receive_time_s - clock_.filter().delay_shift_s() - time->clock.time_s;
    if (late_s <= ArrivalPace::kBacklog_s) {
      runs_on_ = runs_on_ || (late_ && late_s < ArrivalPace::kBacklog_s / 2);
      late_ = late_ && !runs_on_ && late_s >= ArrivalPace::kBacklog_s / 2;
      return;
    }
    if (!late_) pace_.restart();
    late_ = true;
    if (runs_on_) return;
    time->known = false;
    pace_.add(stamp.receive_time_s, time->clock.time_s);
    if (pace_.shown(kStoodStill_s)) *time = begin_again(stamp);
  }

  double stamp_sigma_s_;
  double settle_s_;
  bool wait_for_pace_;
  CaptureClock clock_;
  ReceiptClock receipts_;
  ArrivalPace pace_;  // of a stream that waits, or of late frames
  Kind kind_ = Kind::kNew;
  bool begins_ = true;    // with the next usable frame
  int strange_ = 0;       // stamps of another kind in a row
  bool waiting_ = false;  // for the pace
  bool line_begins_ = true;
  double line_since_s_ = 0;  // receive time
  bool late_ = false;        // the last frame, by more than jitter
  bool runs_on_ = false;     // the sender's clock, while its items wait; as seen on any connection
};

}  // namespace alidade
