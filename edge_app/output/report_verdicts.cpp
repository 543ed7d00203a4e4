// The report's numbers in words, each with the limit that it is held against.

#include <cmath>
#include <string>

#include "core/calibration/calibration_goals.h"
#include "core/calibration/number_text.h"
#include "core/model/recording_needs.h"
#include "edge_app/output/report_page.h"
#include "edge_app/self_calibration/checked_calibration.h"

namespace alidade::report {
namespace {

void add(ReportPage& page, const char* kind, const std::string& number, const std::string& limit,
         const std::string& words) {
  page.add("{}", html_verdict(kind, number, limit, words));
}

// ratio: residuals over their noise, 1 unless they differ beyond chance.
void add_noise(ReportPage& page, const char* of, const char* stated, double ratio, double most) {
  const char* kind = ratio > most ? "weak" : ratio > 1 ? "grown" : "good";
  const std::string words =
      ratio > most ? fmt::format(
                         "{} errors are so large that the model hardly describes them; "
                         "sigmas grown by {:.2g}",
                         of, ratio)
      : ratio > 1
          ? fmt::format("{} errors are larger than {}; sigmas grown by {:.2g}", of, stated, ratio)
      : ratio < 1 ? fmt::format("{} errors are smaller than {}; sigmas shrunk to {:.2g} of theirs",
                                of, stated, ratio)
                  : fmt::format("{} errors are as {}", of, stated);
  add(page, kind, fmt::format("{} residuals / noise {:.2f}", of, ratio),
      fmt::format("1 is as {}; live, more than {:g} is refused", stated, most), words);
}

void add_sigma(ReportPage& page, const ParameterGoal& goal) {
  constexpr double kFar = 50;
  if (!(*goal.sigma > 0)) return;  // exact
  const double sigma = goal.easy * *goal.sigma;
  const double limit = goal.easy * goal.wanted;
  const char* const of_what = goal.parameter == Parameter::kLineDelay ? " for the whole picture"
                              : is_distortion(goal.parameter) ? " of the radius in the corner"
                                                              : "";
  const bool holds = sigma <= limit;
  add(page, holds ? "good" : "weak",
      fmt::format("{} known to {} {}", goal.name, sigma_text(sigma), goal.easy_unit),
      fmt::format("limit {:g} {}{}", limit, goal.easy_unit, of_what),
      !holds                 ? "too uncertain"
      : limit > kFar * sigma ? fmt::format("more than {:g} times better than needed", kFar)
                             : fmt::format("{:.2g} times better than needed", limit / sigma));
}

}  // namespace

void verdicts(ReportPage& page) {
  constexpr double kRepeats = 1.1;
  const CalibrationQuality& q = page.result().quality;
  const CalibrationChecks checks;
  page.add("{}", kHtmlVerdicts);
  add_noise(page, "image", "the tracks state", q.pixel_sigma_ratio, checks.worst_pixel_ratio);
  const bool repeats = q.repetition > kRepeats;
  add(page, repeats ? "grown" : "good", fmt::format("repetition {:.1f}", q.repetition),
      "1: each picture errs on its own",
      repeats ? fmt::format("image errors repeat from picture to picture: {:.1f} observations of a "
                            "landmark count as one; sigmas grown by {:.2g}",
                            q.repetition, std::sqrt(q.repetition))
              : "image errors do not repeat");
  add_noise(page, "telemetry", "assumed", q.telemetry_sigma_ratio, checks.worst_telemetry_ratio);
  for (const ParameterGoal& goal : calibration_goals(page.result().calibration))
    add_sigma(page, goal);
  if (q.contradiction) {
    const bool refused = q.contradiction->scatter > kMaxScatter && q.causes.empty();
    add(page, refused ? "weak" : "grown",
        fmt::format("parts that differ {:.2g} times", q.contradiction->scatter),
        fmt::format("1 is noise; more than {:g} without a cause is refused", kMaxScatter),
        fmt::format("{} differs between {} by more than noise explains; its sigma has grown",
                    q.contradiction->parameter, q.contradiction->between));
  }
  page.add("</ul>\n");
}

}  // namespace alidade::report
