#pragma once
// StampRate: detects stamps that run at another rate than the items arrive.
//   receive_i - sender_i = constant + b receive_i + delay_i,    stamps' rate = 1 - b
// A quartz clock keeps |b| below 2e-4. Stamps that count items at a nominal rate which the camera
// does not keep, or on a clock of another frequency than stated, drift from the arrivals evenly and
// for ever. A backlog that shrinks (b < 0) or grows (b > 0) makes a drift, too; but this drift
// ends, and it is uneven as pictures differ in size (docs/clocks.md).
// Fixed memory, trivially copyable, no allocation, no exceptions; one thread. All times are
// seconds.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <type_traits>

namespace alidade {

class StampRate {
 public:
  static constexpr double kQuartz = 1e-3;  // smaller |b| may be a clock's and are not reported
  static constexpr double kNear = 0.05;
  static constexpr double kApart_s = 0.5;
  static constexpr double kFarApart_s = 10;
  static constexpr std::size_t kParts = 30;

  void restart() { *this = StampRate(); }

  // Values must be finite. Repeated and overtaken items are ignored. After kLongestGap_s without an
  // item, or if a stamp goes back by kOvertaken_s, the judgement begins anew.
  void add(double receive_s, double sender_s) {
    if (items_ > 0 && receive_s - last_receive_s_ > kLongestGap_s) restart();
    if (any_ && !(sender_s > last_sender_s_)) {
      if (sender_s > last_sender_s_ - kOvertaken_s) return;
      restart();
    }
    any_ = true;
    last_receive_s_ = receive_s;
    last_sender_s_ = sender_s;
    if (items_ >= kLeastItems && receive_s - since_s_ >= kPart_s) end_part();
    if (items_ == 0) since_s_ = receive_s;
    const double level_s = receive_s - sender_s;
    const double above_s = level_s - slope_ * (receive_s - since_s_);
    items_ += 1;
    sum_s_ += above_s;
    if (above_s >= least_s_) return;
    least_s_ = above_s;
    part_ = {receive_s, level_s, 0};
  }

  // The stamps' rate minus 1, if it is shown to be another. b is shown if both hold:
  //   evenly       the last kParts seconds' minima of receive - sender (chosen with b removed, as
  //                known by then) lie on one line, to kEven_s or 3 standard deviations of a minimum
  //                of exponential delays;
  //   long enough  to exclude a backlog: the drift has reached kApart_s, or kFarApart_s if |b|
  //                exceeds kNear, an error that no clock has.
  [[nodiscard]] std::optional<double> off() const {
    if (!even_since_s_ || std::abs(slope_) < kQuartz) return std::nullopt;
    const double apart_s = std::abs(slope_) * (last_receive_s_ - *even_since_s_);
    if (apart_s < (std::abs(slope_) <= kNear ? kApart_s : kFarApart_s)) return std::nullopt;
    return -slope_;
  }

 private:
  static constexpr double kPart_s = 1;
  static constexpr double kLeastItems = 3;
  static constexpr double kEven_s = 2e-3;
  static constexpr std::size_t kFewParts = 3;
  static constexpr double kLongestGap_s = 3;
  static constexpr double kOvertaken_s = 1;
  static constexpr double kNone_s = std::numeric_limits<double>::infinity();

  struct Part {
    double receive_s = 0;  // of the item with the lowest level
    double level_s = 0;
    double spread_s = 0;  // standard deviation of the minimum if the delays are exponential
  };

  void end_part() {
    part_.spread_s = (sum_s_ / items_ - least_s_) / items_;
    parts_[next_] = part_;
    next_ = (next_ + 1) % kParts;
    size_ = std::min(size_ + 1, kParts);
    items_ = sum_s_ = 0;
    least_s_ = kNone_s;
    if (size_ >= kFewParts) fit();
  }

  // Least squares, about the middle.
  void fit() {
    double receive_s = 0;
    double level_s = 0;
    const Part* const end = parts_.data() + size_;
    for (const Part* part = parts_.data(); part != end; ++part) {
      receive_s += part->receive_s / static_cast<double>(size_);
      level_s += part->level_s / static_cast<double>(size_);
    }
    double product = 0;
    double square = 0;
    for (const Part* part = parts_.data(); part != end; ++part) {
      product += (part->receive_s - receive_s) * (part->level_s - level_s);
      square += (part->receive_s - receive_s) * (part->receive_s - receive_s);
    }
    slope_ = product / square;
    if (size_ < kParts) return;
    const bool even = std::all_of(parts_.begin(), parts_.end(), [&](const Part& part) {
      const double residual_s = part.level_s - level_s - slope_ * (part.receive_s - receive_s);
      return std::abs(residual_s) <= std::max(kEven_s, 3 * part.spread_s);
    });
    if (!even) {
      even_since_s_.reset();
    } else if (!even_since_s_) {
      even_since_s_ = parts_[next_].receive_s;
    }
  }

  std::array<Part, kParts> parts_{};  // the oldest at next_, once full
  std::size_t next_ = 0;
  std::size_t size_ = 0;
  Part part_;  // the current second; and its:
  double since_s_ = 0;
  double items_ = 0;
  double sum_s_ = 0;  // of the levels minus slope_ times the time since since_s_
  double least_s_ = kNone_s;
  bool any_ = false;
  double last_receive_s_ = 0;
  double last_sender_s_ = 0;
  double slope_ = 0;  // b
  std::optional<double> even_since_s_;
};

static_assert(std::is_trivially_copyable_v<StampRate>);

}  // namespace alidade
