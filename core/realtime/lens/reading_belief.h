#pragma once
// ReadingJudge: whether a zoom reading is believed, by the lens that landmarks showed. This is
// decided nowhere else. There are two judges: that of ReadLens judges the reading, that of
// LensFollower judges the lens that OE mode was given.
// Fixed memory; no allocation. One thread.

#include <algorithm>
#include <cmath>

namespace alidade {

enum class ReadingBelief {
  kBelieved,  // no landmarks lately, or none that contradict the reading
  kExcluded,  // the latest landmarks that held show another focal length
  kJumped     // farther from the lens that landmarks last showed than any lens can have moved since
};

struct ReadingBeliefOptions {
  // Standard deviations of reading and landmarks together, > 0; beyond it the reading is wrong.
  double excluded_sigmas = 5;
  double longest_s = 0.5;  // s, > 0; how long the lens that landmarks showed counts
  double fastest = 3;      // 1/s, > 0, of log f: 20 times in a second; no lens is faster
  // Largest sigma of a reading's log f that counts for kJumped, > 0. The sigma itself grows without
  // bound between readings far apart.
  double largest_sigma = 0.1;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const {
    const char* problem = nullptr;
    if (!(largest_sigma > 0)) problem = "largest_sigma must be positive";
    if (!(fastest > 0)) problem = "fastest must be positive";
    if (!(longest_s > 0)) problem = "longest_s must be positive";
    if (!(excluded_sigmas > 0)) problem = "excluded_sigmas must be positive";
    if (error != nullptr && problem != nullptr) *error = problem;
    return problem == nullptr;
  }
};

class ReadingJudge {
 public:
  // options: valid.
  explicit ReadingJudge(const ReadingBeliefOptions& options) : options_(options) {}

  // No landmarks have been compared with a reading.
  void forget() { excluded_ = false; }
  // Landmarks held. difference: of log f, theirs minus the reading's. sigma: of the difference.
  // Both may be in any common unit.
  void judge(double difference, double sigma) { excluded_ = std::abs(difference) > reach(sigma); }

  // age_s: since landmarks last showed the lens. True if that lens still counts.
  [[nodiscard]] bool remembers(double age_s) const { return age_s < options_.longest_s; }
  // Belief in a frame's reading, age_s after landmarks last showed the lens.
  [[nodiscard]] ReadingBelief belief(double age_s) const {
    return excluded_ && remembers(age_s) ? ReadingBelief::kExcluded : ReadingBelief::kBelieved;
  }
  // The same if the change of the reading's log f since then is known too, with its sigma.
  [[nodiscard]] ReadingBelief belief(double age_s, double change, double sigma) const {
    if (!remembers(age_s)) return ReadingBelief::kBelieved;
    if (excluded_) return ReadingBelief::kExcluded;
    const double most =
        options_.fastest * std::abs(age_s) + reach(std::min(sigma, options_.largest_sigma));
    return std::abs(change) > most ? ReadingBelief::kJumped : ReadingBelief::kBelieved;
  }
  // Largest difference of log f at which a reading is believed. sigma: of the difference.
  [[nodiscard]] double reach(double sigma) const { return options_.excluded_sigmas * sigma; }

 private:
  ReadingBeliefOptions options_;
  bool excluded_ = false;
};

}  // namespace alidade
