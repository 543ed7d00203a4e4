#pragma once
// SteadyZoom: removes jitter from a lens's zoom readings. The only place that decides whether two
// readings are the same zoom.
//   no jitter   readings that stand still, or move without reversing all the time, pass unchanged
//   jitter      is detected by changes that reverse as often as chance makes them, about a constant
//               level; sigma comes from the changes and the spread. From then on readings at rest
//               are replaced by the level, until the median of the latest five leaves it; readings
//               of a movement pass unchanged
// With a given tolerance jitter is not searched for: readings pass unchanged. Fixed memory.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

namespace alidade {

class SteadyZoom {
 public:
  static constexpr double kFar = 6;  // sigmas; readings farther off are movements or glitches

  SteadyZoom() = default;
  // tolerance: device units; two readings no further apart are the same zoom. Empty: found from the
  // jitter.
  explicit SteadyZoom(std::optional<double> tolerance) : given_(tolerance) {}

  // time_s: in order. zoom: finite, device units. Returns the steady reading.
  double add(double time_s, double zoom) {
    found_now_ = false;
    if (given_) return zoom;
    time_s_ = time_s;
    largest_ = std::max(largest_, std::abs(zoom));
    latest_[readings_ % kLatest] = zoom;
    ++readings_;
    if (changes_ == 0 || zoom != change(0).zoom) {
      changed_[changes_ % kChanges] = {time_s, readings_, zoom};
      ++changes_;
      learn();
    }
    if (!has_jitter()) return zoom;
    return rests_ ? at_rest(zoom) : moving(zoom);
  }

  // sigma: of the jitter, as known from earlier readings; device units, > 0. The next reading
  // begins a rest.
  void know(double sigma) {
    sigma_ = own_sigma_ = creep_ = sigma;
    rests_ = true;
    of_level_ = 0;
  }

  [[nodiscard]] bool has_jitter() const { return sigma_ > 0; }
  // True if the last reading revealed the jitter.
  [[nodiscard]] bool found_now() const { return found_now_; }
  [[nodiscard]] double sigma() const { return sigma_; }  // device units; 0: no jitter known
  // Number of the present rest, counted up at the beginning of each. Empty if the last reading
  // passed unchanged.
  [[nodiscard]] std::optional<std::size_t> rest() const {
    return steadied_ ? std::optional<std::size_t>(rest_) : std::nullopt;
  }
  // Device units; two steady readings no further apart are the same zoom. 0 as long as no jitter is
  // known and no tolerance was given.
  [[nodiscard]] double tolerance() const { return given_.value_or(kOneZoom * sigma_); }

  // Rounded to the figures that the jitter leaves significant. Needs has_jitter().
  [[nodiscard]] double rounded(double zoom) const {
    const double figures = std::floor(std::log10(sigma_));
    const double unit = std::pow(10, std::abs(figures));
    return figures < 0 ? std::round(zoom * unit) / unit : std::round(zoom / unit) * unit;
  }

 private:
  static constexpr std::size_t kLatest = 8;    // readings that define a rest
  static constexpr std::size_t kChanges = 16;  // changes that define jitter, at most
  static constexpr double kOneZoom = 2;        // sigmas; a level errs by less than half a sigma
  static constexpr double kMoved = 2.5;        // sigmas; for the median of five: 4.5 of its own
  static constexpr double kSpread = 7;         // sigmas; widest spread of readings about one level

  struct Change {
    double time_s = 0;
    std::size_t reading = 0;  // its number
    double zoom = 0;
  };

  // back: 0 is the newest.
  [[nodiscard]] const Change& change(std::size_t back) const {
    return changed_[(changes_ - 1 - back) % kChanges];
  }

  void learn() {
    constexpr std::size_t kLeast = 9;
    constexpr double kLongest_s = 10;
    std::size_t n = std::min(changes_, kChanges);
    while (n > 0 && change(n - 1).time_s < change(0).time_s - kLongest_s) --n;
    if (n < kLeast || changes_ < next_learning_) return;
    const auto steps = static_cast<double>(n - 1);
    std::array<double, kChanges> size;
    double turns = 0;
    double low = change(0).zoom;
    double high = low;
    double square = 0;
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const double step = change(i).zoom - change(i + 1).zoom;
      size[i] = std::abs(step);
      square += step * step;
      low = std::min(low, change(i + 1).zoom);
      high = std::max(high, change(i + 1).zoom);
      if (i + 2 < n && step * (change(i + 1).zoom - change(i + 2).zoom) < 0) ++turns;
    }
    const auto middle = size.begin() + static_cast<std::ptrdiff_t>((n - 1) / 2);
    std::nth_element(size.begin(), middle, size.begin() + static_cast<std::ptrdiff_t>(n - 1));
    const double spread = high - low;
    if (turns < 0.45 * steps || spread > kSpread * *middle) return;
    // A large spread may be glitches, or a zoom moved to and fro. Only white noise changes and
    // reverses so often.
    constexpr double kSmall = 0.02;  // of the largest reading
    const bool is_large = spread > kSmall * largest_;
    const auto readings = static_cast<double>(change(0).reading - change(n - 1).reading);
    if (is_large && (n < kChanges || steps < 0.6 * readings || turns < 0.55 * steps ||
                     !has_value_within(n, low, high))) {
      return;
    }
    constexpr std::size_t kAveraged = 16;
    const double sigma = std::max(std::sqrt(square / steps / 2), spread / 4);
    next_learning_ = changes_ + kChanges;
    if (averaged_ < kAveraged) ++averaged_;
    found_now_ = !has_jitter();
    own_sigma_ = std::sqrt(own_sigma_ * own_sigma_ + (sigma * sigma - own_sigma_ * own_sigma_) /
                                                         static_cast<double>(averaged_));
    sigma_ = std::max(own_sigma_, creep_);
    if (found_now_) begin_rest();
  }

  [[nodiscard]] bool has_value_within(std::size_t n, double low, double high) const {
    for (std::size_t i = 0; i < n; ++i) {
      if (change(i).zoom > low && change(i).zoom < high) return true;
    }
    return false;
  }

  void begin_rest() {
    const std::size_t n = std::min(readings_, kLatest);
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += latest_[i];
    level_ = sum / static_cast<double>(n);
    of_level_ = n;
    begun_ = readings_ - n;
    rests_ = true;
    ++rest_;
  }

  [[nodiscard]] double median_of_five() const {
    std::array<double, 5> five{};
    for (std::size_t i = 0; i < five.size(); ++i) five[i] = latest_[(readings_ - 1 - i) % kLatest];
    std::nth_element(five.begin(), five.begin() + 2, five.end());
    return five[2];
  }

  double at_rest(double zoom) {
    constexpr std::size_t kMost = 32;  // readings in a level, at most: a creeping level is followed
    steadied_ = false;
    if (of_level_ == 0) {
      level_ = zoom;
      begun_ = readings_ - 1;
      ++rest_;
    }
    if (readings_ >= begun_ + 5 && std::abs(median_of_five() - level_) > kMoved * sigma_) {
      rests_ = false;
      since_moved_ = 0;
      return zoom;
    }
    if (std::abs(zoom - level_) > kFar * sigma_) return zoom;
    of_level_ = std::min(of_level_ + 1, kMost);
    level_ += (zoom - level_) / static_cast<double>(of_level_);
    steadied_ = true;
    return rounded(level_);
  }

  double moving(double zoom) {
    steadied_ = false;
    if (++since_moved_ < kLatest) return zoom;
    double trend = 0;
    for (std::size_t i = 0; i < kLatest; ++i) {
      const double at = latest_[(readings_ - 1 - i) % kLatest];
      trend += (i < kLatest / 2 ? at : -at) / (static_cast<double>(kLatest) / 2);
    }
    const auto [low, high] = std::minmax_element(latest_.begin(), latest_.end());
    // sigmas; three of the trend's own
    constexpr double kTrend = 2.1;
    if (std::abs(trend) > kTrend * sigma_ || *high - *low > kSpread * sigma_) return zoom;
    const double before = level_;
    begin_rest();
    note_creep(level_ - before);
    steadied_ = true;
    return rounded(level_);
  }

  // A level that leaves and returns by little, as with a motor that hunts: the jitter is larger
  // than white noise shows.
  void note_creep(double step) {
    constexpr double kLongest_s = 20;
    constexpr double kLargest = 4;  // sigmas
    const bool small = std::abs(step) <= kLargest * sigma_;
    if (small && step * step_ < 0 && time_s_ - step_s_ < kLongest_s) {
      creep_ = std::max(creep_, std::abs(step) / kMoved);
      sigma_ = std::max(sigma_, creep_);
    }
    step_ = small ? step : 0;
    step_s_ = time_s_;
  }

  std::optional<double> given_;
  double largest_ = 0;                    // magnitude, of all readings
  std::array<double, kLatest> latest_{};  // readings
  std::size_t readings_ = 0;              // all
  std::array<Change, kChanges> changed_;  // readings that differ from the one before
  std::size_t changes_ = 0;               // all
  std::size_t next_learning_ = 0;         // changes
  double sigma_ = 0;                      // the larger of the next two; 0: no jitter known
  double own_sigma_ = 0;                  // from changes between readings
  double creep_ = 0;                      // from changes between levels
  std::size_t averaged_ = 0;              // estimates averaged in own_sigma_
  bool found_now_ = false;
  bool rests_ = true;
  bool steadied_ = false;
  double level_ = 0;
  std::size_t of_level_ = 0;  // readings
  std::size_t begun_ = 0;     // number of readings before the rest
  std::size_t since_moved_ = 0;
  std::size_t rest_ = 0;
  double time_s_ = 0;
  double step_ = 0;  // from the previous level to this one; 0 unless small
  double step_s_ = 0;
};

}  // namespace alidade
