#pragma once
// StampRate: do a sender's stamps run at another rate than its items come?
//
//   receive_i - sender_i = constant + b receive_i + delay_i,    stamps' rate = 1 - b
//
// A clock of quartz keeps |b| below 2e-4. Stamps counted at a nominal rate that the camera does not keep, or on a clock of
// another frequency than told, run off the arrivals evenly and for ever. So does, for a while, a backlog that is being
// worked off (b < 0), or one that grows (b > 0): those end, and come as evenly as pictures are large. Shown is b
//   evenly       the least receive - sender of each second, less b as known by then, lie for the last kParts on one line, to
//                kEven_s or 3 standard deviations of the least of a second's delays, were they exponential;
//   for so long  that no backlog is meant: until they ran apart by kApart_s, or, where |b| is more than kNear, which no
//                clock is off by, by kFarApart_s.
// Fixed memory, trivially copyable, no allocation, no exceptions; one thread. All times are seconds.

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
  static constexpr double kQuartz = 1e-3;  // |b| that a line may be held to
  static constexpr double kNear = 0.05;
  static constexpr double kApart_s = 0.5;
  static constexpr double kFarApart_s = 10;
  static constexpr std::size_t kParts = 30;

  void restart() { *this = StampRate(); }

  // Finite values. Items that were overtaken teach nothing.
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

  // The stamps' rate less one, if it is shown to be another.
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
    double receive_s = 0;  // of the item that comes down farthest
    double level_s = 0;
    double spread_s = 0;  // standard deviation of the least, were the delays exponential
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
  Part part_;  // of this second, and of it:
  double since_s_ = 0;
  double items_ = 0;
  double sum_s_ = 0;  // of the levels less slope_ times the time since the first of them
  double least_s_ = kNone_s;
  bool any_ = false;
  double last_receive_s_ = 0;
  double last_sender_s_ = 0;
  double slope_ = 0;  // b
  std::optional<double> even_since_s_;
};

static_assert(std::is_trivially_copyable_v<StampRate>);

}  // namespace alidade
