#pragma once
// Judges that tell when a published calibration no longer fits the camera. Each remembers only the
// latest verdicts.
// Seconds of the host's clock. Allocates little. One thread.

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <utility>

namespace alidade {

// Compares calibrations of later motion with the published one.
struct ContradictionOptions {
  // A larger chi-square of the difference (calibration_difference.h) contradicts. For 8 parameters
  // 99.9 % lie below 26; the limit is 1.5^2 times as large, as sigmas may be 1.5 times too small.
  double least_chi_square = 60;
  int believed_after = 2;  // contradictions in a row: a single one may be chance
};

class ContradictionJudge {
 public:
  enum class Verdict {
    kAgrees,
    kContradicts,  // not often enough in a row to be believed
    kBelieved      // the calibration is contradicted
  };

  explicit ContradictionJudge(const ContradictionOptions& options = {}) : options_(options) {}

  Verdict judge(double chi_square) {
    chi_square_ = chi_square;
    if (!(chi_square > options_.least_chi_square)) {
      in_a_row_ = 0;
      return Verdict::kAgrees;
    }
    return ++in_a_row_ >= options_.believed_after ? Verdict::kBelieved : Verdict::kContradicts;
  }
  // The latest chi-square, if it contradicted and was not believed yet.
  [[nodiscard]] std::optional<double> pending() const {
    return in_a_row_ > 0 && in_a_row_ < options_.believed_after ? std::optional(chi_square_)
                                                                : std::nullopt;
  }
  void restart() { in_a_row_ = 0; }

 private:
  ContradictionOptions options_;
  double chi_square_ = 0;
  int in_a_row_ = 0;
};

// Judges by the latest frames whether something holds in a large share of them. SelfCalibration
// withdraws a calibration if landmarks contradict telemetry in that share. StreamWatch has judges
// of its own for old telemetry and repeated pictures; these withdraw nothing.
struct DisagreementOptions {
  double span_s = 8;              // the frames of this latest time are judged
  double share = 0.5;             // of these frames, 0 to 1
  std::size_t least_frames = 40;  // fewer are not judged
};

class DisagreementJudge {
 public:
  explicit DisagreementJudge(const DisagreementOptions& options = {}) : options_(options) {}

  // True: in at least `share` of the frames. time_s: not decreasing from call to call.
  bool judge(double time_s, bool contradicted) {
    frames_.emplace_back(time_s, contradicted);
    while (frames_.front().first < time_s - options_.span_s) frames_.pop_front();
    const auto all = static_cast<double>(frames_.size());
    return frames_.size() >= options_.least_frames &&
           static_cast<double>(contradicted_frames()) >= options_.share * all;
  }
  [[nodiscard]] std::size_t frames() const { return frames_.size(); }
  [[nodiscard]] std::size_t contradicted_frames() const {
    return static_cast<std::size_t>(std::count_if(frames_.begin(), frames_.end(),
                                                  [](const auto& frame) { return frame.second; }));
  }
  void restart() { frames_.clear(); }

 private:
  DisagreementOptions options_;
  std::deque<std::pair<double, bool>> frames_;  // time, whether landmarks contradicted telemetry
};

}  // namespace alidade
