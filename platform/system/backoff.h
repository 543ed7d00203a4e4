#pragma once
// Backoff: the pauses between attempts to connect. They double from 0.25 s up to a limit, and begin
// anew after reset(), which is to be called after a success.

#include <algorithm>

namespace alidade {

class Backoff {
 public:
  explicit Backoff(double max_s) : max_s_(max_s) { reset(); }

  void reset() { pause_s_ = kFirst_s; }

  [[nodiscard]] double next_s() {
    const double pause_s = std::min(pause_s_, max_s_);
    pause_s_ = std::min(2 * pause_s_, max_s_);
    return pause_s;
  }

 private:
  static constexpr double kFirst_s = 0.25;
  double max_s_;
  double pause_s_ = kFirst_s;
};

}  // namespace alidade
