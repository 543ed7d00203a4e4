#pragma once
// FrameClock: the capture time of each frame of a live stream, and whether this time is known. A
// frame may have waited for an unknown time before it arrived and was stamped: behind a relay or a
// network that stood still, in a cache, or in the socket of this process. The frame's time comes
// from the sender's clock, else from sequence numbers, else from arrivals alone (receipt_clock.h,
// uneven_arrivals.h). If the sequence numbers contradict a frame's driver stamp (stamped_at), the
// stamp counts. Time stamps that run at a wrong rate, or count pictures, are left out. If
// wait_for_pace is false (no arrivals, or a recording read as a source): CaptureClock alone.
// Seconds. Fixed memory, no allocation, one thread. Derivation: docs/derivations.md.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/model/arrival_pace.h"
#include "core/model/delay_wander.h"
#include "core/model/stamp_count.h"
#include "core/model/stamp_jumps.h"
#include "core/model/stamp_rate.h"
#include "edge_app/clocks/capture_clock.h"
#include "edge_app/clocks/receipt_clock.h"
#include "edge_app/clocks/uneven_arrivals.h"
#include "edge_app/clocks/utc_line.h"
#include "platform/streams/frame.h"
#include "platform/video/stamp_guard.h"

namespace alidade {

struct FrameTime {
  ClockEstimate clock;
  bool known = true;   // false: clock.time_s may be late by any amount
  bool of_use = true;  // false: of no use for calibration, and later frames do not improve it
  // s, sum of the steps of the least delay. The receive time contains this sum, the line does not.
  double delay_shift_s = 0;
  // s, how far frames lie off the clock's line. Included in clock.sigma_s. Neighbouring frames
  // share this error.
  double off_line_s = 0;
  double wander_s = 0;  // s, the same if frames leave the line again and again, else 0
  // Why clock.restarted, for people; of static storage. Empty: it is not restarted.
  const char* restarted_by = "";
  // s, at a restart or step of the clock: how much the new line may differ from the old one. The
  // cause may be the delay or the stamps.
  double moved_s = 0;
  bool stamps_left_out = false;                 // the sender's stamps are not used: wrong rate
  std::optional<double> stamp_rate_error = {};  // rate minus 1; in the first such frame only
  bool stamps_count = false;                    // likewise: the stamps count pictures
};

class FrameClock {
 public:
  // stamp_sigma_s: one standard deviation of a receive time that is used as the capture time.
  FrameClock(const ClockFilterOptions& options, double stamp_sigma_s, bool wait_for_pace)
      : stamp_sigma_s_(stamp_sigma_s),
        settle_s_(options.settle_s),
        least_step_s_(options.min_delay_step_s),
        wait_for_pace_(wait_for_pace),
        clock_(options),
        receipts_(stamp_sigma_s),
        uneven_(stamp_sigma_s) {}

  // The connection that begins with the next frame has no backlog. If later frames show that the
  // first ones had waited, the clock begins anew all the same.
  void expect_fresh() { fresh_ = true; }

  FrameTime update(const FrameStamp& stamp) {
    FrameTime time = judge(stamp);
    if (!waiting_ && kind_ != Kind::kNothing) time.delay_shift_s = clock_.filter().delay_shift_s();
    if (kind_ != Kind::kNothing) time.off_line_s = wander_.off_s();
    if (wander_.wanders()) time.wander_s = time.off_line_s;
    time.stamps_left_out = stamps_left_out_;
    return time;
  }

 private:
  enum class Kind : std::uint8_t { kNew, kSenderTime, kSequence, kNothing };

  static constexpr int kStrangeInARow = 3;
  static constexpr int kFreshInARow = 3;     // a backlog comes down faster than it was sent
  static constexpr double kEarly_s = 0.02;   // least delays of two connections differ by less
  static constexpr double kAstray_s = 0.01;  // more than the jitter of a driver's stamps
  static constexpr int kManyStrays = 25;
  static constexpr double kStoodStill_s = 0.5;  // half of the window in which the pace is shown
  static constexpr double kGate = 6;  // sigmas of the line: items below it have come down to it
  // sigmas of the line: a smaller deviation may be the line's own error
  static constexpr double kOpen = 3;

  FrameTime judge(const FrameStamp& stamp) {
    if (!wait_for_pace_) return {ask_clock(stamp, stamp.restarted)};
    const Kind kind = stamp.sender_time_s && !stamps_left_out_ ? Kind::kSenderTime
                      : stamp.sequence                         ? Kind::kSequence
                                                               : Kind::kNothing;
    const bool finite = std::isfinite(stamp.receive_time_s) &&
                        (!stamp.sender_time_s || std::isfinite(*stamp.sender_time_s));
    begins_ = begins_ || stamp.restarted;
    // A few frames without stamps in a stream that has them are not a new stream.
    if (!finite || (!begins_ && kind != kind_ && ++strange_ < kStrangeInARow)) {
      return unusable(stamp);
    }
    if (begins_ || kind != kind_) guard_.restart();
    const StampGuard::Verdict verdict =
        kind == Kind::kSenderTime ? guard_.judge(stamp.receive_time_s, *stamp.sender_time_s)
                                  : StampGuard::Verdict::kGood;
    if (verdict == StampGuard::Verdict::kBad) return unusable(stamp);
    const bool begins = begins_ || kind != kind_ || verdict == StampGuard::Verdict::kJumped;
    const bool anew = begins && kind_ != Kind::kNew;
    const char* const why = begins_         ? "a connection began"
                            : kind != kind_ ? "its pictures carry other stamps than before"
                                            : "its time stamps jumped";
    strange_ = 0;
    begins_ = false;
    if (begins) begin(kind);
    if (begins) rate_.restart();
    if (begins) count_.restart();
    if (begins) jumps_.restart();
    if (kind == Kind::kSenderTime)
      jumps_.add(stamp.receive_time_s, *stamp.sender_time_s, behind_backlog_);
    if (kind == Kind::kSenderTime && runs_off(stamp)) return leave_stamps_out(stamp);
    if (kind == Kind::kSenderTime) utc_.watch(stamp);
    FrameTime time = by_what_is_told(stamp);
    if (anew && kind != Kind::kNothing) restart(why, &time);
    return time;
  }

  static void restart(const char* why, FrameTime* time) {
    time->clock.restarted = true;
    time->restarted_by = why;
  }

  FrameTime by_what_is_told(const FrameStamp& stamp) {
    return kind_ == Kind::kNothing ? by_receipt(stamp) : waiting_ ? wait(stamp) : by_line(stamp);
  }

  bool runs_off(const FrameStamp& stamp) {
    rate_.add(stamp.receive_time_s, *stamp.sender_time_s);
    count_.add(stamp.receive_time_s, *stamp.sender_time_s);
    return rate_.off() || count_.rate_error();
  }

  FrameTime leave_stamps_out(const FrameStamp& stamp) {
    stamps_left_out_ = true;
    stamps_count_ = count_.rate_error().has_value();
    utc_.forget();
    begin(stamp.sequence ? Kind::kSequence : Kind::kNothing);
    if (stamps_count_) uneven_.restart(count_.step_s());
    FrameStamp without = stamp;
    without.sender_time_s.reset();
    FrameTime time = by_what_is_told(without);
    restart("its time stamps are left out", &time);
    time.stamp_rate_error = stamps_count_ ? count_.rate_error() : rate_.off();
    time.stamps_count = stamps_count_;
    return time;
  }

  // The estimate of CaptureClock alone.
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
    const bool has_line = kind_ == Kind::kSenderTime && !waiting_ && !line_begins_ && !late_;
    utc_.end_connection(has_line ? &clock_.filter() : nullptr, wander_.off_s());
    kind_ = kind;
    waiting_ = kind == Kind::kSenderTime && !fresh_;
    fresh_ = fresh_ && kind == Kind::kNothing;
    fresh_by_utc_ = 0;
    line_begins_ = true;
    late_ = false;
    behind_backlog_ = false;
    strays_ = 0;
    pace_.restart();
    wander_.restart();
    receipts_.restart();
    uneven_.restart();
  }

  FrameTime by_receipt(const FrameStamp& stamp) {
    const ReceiptClock::Answer answer = stamps_count_ ? uneven_.update(stamp.receive_time_s)
                                                      : receipts_.update(stamp.receive_time_s);
    FrameTime time;
    time.clock.time_s = answer.time_s;
    time.clock.sigma_s = answer.sigma_s;
    time.clock.state = ClockState::kLocked;  // it will not become better known
    fresh_ = fresh_ && !answer.known;
    if (fresh_) {
      time.clock.time_s = stamp.receive_time_s;
      time.clock.sigma_s = stamp_sigma_s_;
    }
    time.known = time.of_use = answer.known || fresh_;
    return time;
  }

  FrameTime wait(const FrameStamp& stamp) {
    pace_.add(stamp.receive_time_s, *stamp.sender_time_s);
    const double level_s = stamp.receive_time_s - *stamp.sender_time_s;
    const std::optional<UtcLine::Age> age = utc_.age(stamp);
    const bool agrees = age && age->agrees();
    if (age && age->late_s < -UtcLine::kAgrees_s) utc_.forget();  // nothing arrives before its time
    const auto shown = pace_.shown(ArrivalPace::kLeastHalf_s, agrees);
    if (!shown) {
      FrameTime time = unusable(stamp);
      time.clock.rejected = false;
      time.of_use = true;
      const bool waited = pace_.saw_backlog(level_s, UtcLine::kAgrees_s);
      if (fresh_by_utc_ < kFreshInARow) fresh_by_utc_ = agrees && !waited ? fresh_by_utc_ + 1 : 0;
      if (!agrees || fresh_by_utc_ < kFreshInARow) return time;
      time.clock.time_s = age->time_s;
      time.clock.sigma_s = age->sigma_s;
      time.known = true;
      return time;
    }
    // Fresh frames that the absolute clock calls old or early: that clock was set.
    if (age && std::abs(age->late_s - (level_s - shown->least_s)) > UtcLine::kAgrees_s)
      utc_.forget();
    const bool backlog = pace_.saw_backlog(shown->least_s);
    FrameTime time;
    for (std::size_t i = backlog ? shown->first : 0; i < pace_.size(); ++i) {
      time.clock =
          *clock_.update(pace_.receive_s(i), pace_.sender_s(i), std::nullopt, line_begins_);
      if (line_begins_) line_since_s_ = pace_.receive_s(i);
      line_begins_ = false;
    }
    time.clock.restarted = false;
    if (backlog) restart("pictures before had waited on their way", &time);
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
    if (young && before_s < -kEarly_s)
      return begin_again(stamp, "all pictures before had come late");
    const double shift_s = filter.delay_shift_s();
    time.clock = ask_clock(stamp, line_begins_);
    if (line_begins_) line_since_s_ = stamp.receive_time_s;
    line_begins_ = false;
    time.known = !time.clock.rejected;
    if (time.clock.rejected) return time;
    if (time.clock.restarted && !by_count)
      return begin_again(stamp, "its pictures stay off the line of its time stamps");
    if (time.clock.restarted) time.restarted_by = "its count of pictures does not go on";
    if (by_count && goes_astray(stamp, &time)) return time;
    if (time.clock.delay_stepped) time.moved_s = std::abs(filter.delay_shift_s() - shift_s);
    judge_lateness(stamp, &time);
    return time;
  }

  bool goes_astray(const FrameStamp& stamp, FrameTime* time) {
    const double off_s =
        stamp.receive_time_s - clock_.filter().delay_shift_s() - time->clock.time_s;
    if (stamp.stamped_at == StampedAt::kArrival || std::abs(off_s) <= kAstray_s) {
      strays_ = 0;
      return false;
    }
    if (++strays_ == kManyStrays) {
      *time = begin_again(stamp, "the driver's stamps contradict the count of pictures");
      return true;
    }
    time->clock.time_s = stamp.receive_time_s;
    time->clock.sigma_s = stamp_sigma_s_;
    time->of_use = false;  // calibrations use the count
    return true;
  }

  // All that the stream has shown so far belonged to a backlog, or to another clock.
  FrameTime begin_again(const FrameStamp& stamp, const char* why) {
    begin(kind_);
    utc_.forget();
    FrameTime time = waiting_ ? wait(stamp) : FrameTime{ask_clock(stamp, true)};
    line_begins_ = waiting_;
    restart(why, &time);
    time.moved_s = wander_.off_s();
    return time;
  }

  void judge_lateness(const FrameStamp& stamp, FrameTime* time) {
    const double late_s =
        stamp.receive_time_s - clock_.filter().delay_shift_s() - time->clock.time_s;
    watch_wander(stamp.receive_time_s, late_s, time->clock.sigma_s);
    time->clock.sigma_s =
        std::hypot(time->clock.sigma_s, std::max(wander_.off_s(), jumps_.off_s()));
    if (late_s <= ArrivalPace::kBacklog_s + wander_.off_s()) {
      runs_on_ = runs_on_ || (late_ && late_s < ArrivalPace::kBacklog_s / 2);
      late_ = late_ && !runs_on_ && late_s >= ArrivalPace::kBacklog_s / 2;
      return;
    }
    if (!late_) pace_.restart();
    late_ = true;
    if (runs_on_) return;
    time->known = false;
    pace_.add(stamp.receive_time_s, time->clock.time_s);
    if (pace_.shown(kStoodStill_s))
      *time = begin_again(stamp, "late pictures come at an even pace: the delay is another");
  }

  // A backlog arrives at once and is worked off. Until then it shows nothing about the delay. If
  // the delay was seen to wander before, lateness counts as wander instead.
  void watch_wander(double receive_s, double late_s, double sigma_s) {
    const double gate_s = std::max(least_step_s_, kGate * sigma_s);
    if (late_s > ArrivalPace::kBacklog_s && wander_.off_s() < ArrivalPace::kBacklog_s / 2) {
      behind_backlog_ = true;
    } else if (late_s <= gate_s) {
      behind_backlog_ = false;
    }
    if (!behind_backlog_) wander_.add(receive_s, late_s, kOpen * sigma_s);
  }

  double stamp_sigma_s_;
  double settle_s_;
  double least_step_s_;
  bool wait_for_pace_;
  CaptureClock clock_;
  ReceiptClock receipts_;
  UnevenArrivals uneven_;
  ArrivalPace pace_;  // while waiting for the pace, or of late frames
  DelayWander wander_;
  StampGuard guard_;
  StampRate rate_;
  StampCount count_;
  StampJumps jumps_;
  UtcLine utc_;
  Kind kind_ = Kind::kNew;
  bool begins_ = true;    // begins with the next usable frame
  bool fresh_ = false;    // until arrivals make a frame's time known
  int fresh_by_utc_ = 0;  // fresh first frames of the connection, in a row
  int strange_ = 0;       // frames with stamps of another kind, in a row
  bool waiting_ = false;  // for the sender's pace
  bool line_begins_ = true;
  double line_since_s_ = 0;  // receive time
  bool late_ = false;        // the last frame was late by more than jitter
  bool runs_on_ = false;     // the sender's clock, while its frames wait; as seen on any connection
  bool behind_backlog_ = false;
  int strays_ = 0;  // in a row
  bool stamps_left_out_ = false;
  bool stamps_count_ = false;
};

}  // namespace alidade
