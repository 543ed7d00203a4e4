#pragma once
// EnduranceJudge: each record of a virtual day held against the truth, by what the record itself claims.
//
//   error   xi = log(R_estimate^T R_true), camera frame, at row 0; worst axis of |xi_i| / sigma_i
//   NEES    mean over the three axes of (xi_i / sigma_i)^2: 1 is honest
//   pixels  of the middle column in the first, middle and last row: the angle between where the record
//           (with its rates, accelerations, focal length) says it looks and where it did
// A record `says so` if it is not calibrated, has no orientation, has a status that is not ok, or its
// calibration is told to be doubtful. A record beyond kWorst sigmas that does not say so is silent; silent
// records in a row are an episode.

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "test/accuracy/endurance_consumer.h"
#include "test/accuracy/endurance_day.h"
#include "test/accuracy/report.h"

namespace alidade::test {

struct JudgedRecord {
  double time_s = 0;
  RecordMode mode = RecordMode::kNone;
  RecordStatus status = RecordStatus::kOk;
  bool calibrated = false;
  bool says_so = true;
  int landmarks = 0;
  double error_rad = 0;  // of the axis that is worst in its sigmas
  double sigma_rad = 0;  // ... its sigma
  double sigmas = 0;
  double nees = 0;
  std::array<double, 3> pixel_error_px{};  // first, middle, last row
  double pixel_sigmas = 0;                 // worst of the three rows, per component
};

// frame: of the day. answer.record must be that frame's.
[[nodiscard]] JudgedRecord judge(const VirtualDay& day, std::size_t frame, const Answer& answer);

class EnduranceJudge {
 public:
  static constexpr double kWorst = 5;        // sigmas
  static constexpr int kLongestEpisode = 5;  // frames

  struct Episode {
    double time_s = 0;  // of its first record
    int frames = 0;
    JudgedRecord worst;
  };

  explicit EnduranceJudge(std::vector<DayMark> marks) : marks_(std::move(marks)) {}

  void add(const JudgedRecord& record);

  [[nodiscard]] const std::vector<Episode>& episodes() const { return episodes_; }
  [[nodiscard]] int longest_episode() const;
  [[nodiscard]] const std::vector<JudgedRecord>& records() const { return records_; }
  // Seconds from a mark until the first record that is calibrated, in this mode, and ok; negative: never
  // before the next mark.
  [[nodiscard]] double time_until(std::size_t mark, RecordMode mode) const;
  // "base bumped + 3.2 s"
  [[nodiscard]] std::string since_mark(double time_s) const;

  void report(Report* report) const;
  // Records second by second: worst sigmas, median sigma.
  [[nodiscard]] nlohmann::json to_json() const;
  // A page with sigmas and sigma over time, and the marks.
  void write_plot(const std::string& file, const std::string& title) const;

 private:
  std::vector<DayMark> marks_;
  std::vector<JudgedRecord> records_;
  std::vector<Episode> episodes_;
  bool in_episode_ = false;
};

}  // namespace alidade::test
