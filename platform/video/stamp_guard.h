#pragma once
// StampGuard: decides which of a stream's time stamps can be true.
//
// Pictures are sent in order of capture and never arrive before their capture. So each stamp
// exceeds the stamp before, and receive - sender falls below its minimum so far by at most kEarly_s
// (10 s at the second stamp), more than a network's delay varies. Exception: a backlog, which
// arrives at once, with steps of at most four times the usual length. Any other stamp is bad, and
// its picture gets none. When kAgreeing bad stamps in a row follow each other by this rule, the
// sender's clock was changed, and the last of them is kJumped. But if they lie on the line from
// before the last good stamp, that good stamp was wrong, and the last of them is kGood. A late
// picture shows nothing: it may have waited. Fixed memory, no allocation, no exceptions.

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace alidade {

class StampGuard {
 public:
  enum class Verdict : std::uint8_t { kGood, kBad, kJumped };

  static constexpr double kEarly_s = 0.3;
  static constexpr int kAgreeing = 3;

  // Starts anew; the next stamp is good whatever it is.
  void restart() { line_ = other_ = Line{}; }

  [[nodiscard]] Verdict judge(double receive_s, double sender_s) {
    if (!std::isfinite(receive_s) || !std::isfinite(sender_s)) return Verdict::kBad;
    if (line_.items == 0 || line_.goes_on(receive_s, sender_s)) {
      line_.add(receive_s, sender_s);
      other_ = Line{};
      return Verdict::kGood;
    }
    if (!other_.goes_on(receive_s, sender_s)) other_ = Line{};
    other_.add(receive_s, sender_s);
    if (other_.items < kAgreeing) return Verdict::kBad;
    const bool came_back = std::abs(other_.least_s - line_.level_before_s) < kEarly_s;
    line_ = other_;
    other_ = Line{};
    return came_back ? Verdict::kGood : Verdict::kJumped;
  }

  // s, sender's clock: the stamp of a picture received at receive_s (s) that is as late as the
  // picture of the last good stamp; 0 before the first good stamp.
  [[nodiscard]] double expected_s(double receive_s) const {
    return line_.items == 0 ? 0 : line_.last_s + (receive_s - line_.received_s);
  }

 private:
  static constexpr double kEarlyAtFirst_s = 10;  // while no step is known
  static constexpr double kLongStep = 4;         // times the usual step

  struct Line {
    int items = 0;
    double received_s = 0;
    double last_s = 0;
    double least_s = 0;         // least receive - sender
    double level_before_s = 0;  // receive - sender of the last stamp but one
    double step_s = 0;          // usual step between stamps, without long ones; 0: not known

    [[nodiscard]] bool goes_on(double receive_s, double sender_s) const {
      const double step = sender_s - last_s;
      if (items == 0 || !(step > 0)) return false;
      const double early_s = step_s > 0 ? kEarly_s : kEarlyAtFirst_s;
      return receive_s - sender_s >= least_s - early_s || step <= kLongStep * step_s;
    }
    void add(double receive_s, double sender_s) {
      const double level_s = receive_s - sender_s;
      level_before_s = items == 0 ? level_s : received_s - last_s;
      least_s = items == 0 ? level_s : std::min(least_s, level_s);
      if (items > 0)
        step_s = step_s > 0 ? std::min(sender_s - last_s, 2 * step_s) : sender_s - last_s;
      received_s = receive_s;
      last_s = sender_s;
      items = std::min(items + 1, kAgreeing);
    }
  };

  Line line_;
  Line other_;  // line through the latest stamps, all bad so far
};

}  // namespace alidade
