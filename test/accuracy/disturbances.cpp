#include "test/accuracy/disturbances.h"

#include <cmath>
#include <functional>

#include "test/accuracy/backend.h"

namespace alidade::test {
namespace {

constexpr Parameter kShown[] = {Parameter::kFocalLength, Parameter::kRadialDistortion,
                                Parameter::kClockOffset, Parameter::kLineDelay};

struct Disturbance {
  std::string name;
  std::function<void(Simulation*, CalibrationOptions*)> apply;
  std::string authors;
  bool another_camera = false;  // not to be compared with the undisturbed run
  Scales scales = Scales::kBase;
};

using Disturbances = std::vector<Disturbance>;

void set_field(double degrees, Simulation* s) {
  s->focal_length = s->width / 2.0 / std::tan(degrees * kPi / 360);
}

void add_authors_rows(Disturbances* rows) {
  for (const double factor : {0.3, 0.5, 0.55, 0.6, 2.0, 10.0}) {
    std::string authors = "-";
    if (factor == 0.5) authors = "29 of 30 fail";
    if (factor == 0.55) authors = "25 of 30 fail";
    if (factor == 0.6) authors = "11 of 30 fail";
    if (factor == 10) authors = "6 of 30 fail";
    rows->push_back({"prior of f: " + number(factor) + " x truth, sigma as large",
                     [factor](Simulation* s, CalibrationOptions* options) {
                       const double value = factor * s->focal_length;
                       options->focal_length = CalibrationPrior{value, value};
                     },
                     authors});
  }
  for (const double offset : {-1.0, -0.5, 0.5, 1.0}) {
    std::string authors = "5 of 30 fail";
    if (offset == 1) authors = "28 of 30 fail";
    if (offset == -1) authors = "-";
    rows->push_back({"d = " + number(offset) + " s",
                     [offset](Simulation* s, CalibrationOptions*) { s->clock_offset = offset; },
                     authors});
  }
  for (const double share : {0.02, 0.1}) {
    rows->push_back({number(100 * share, 2) + " % of the frames lost",
                     [share](Simulation* s, CalibrationOptions*) { s->lost_frames = share; },
                     share < 0.05 ? "line delay 5 -> 26 ns" : "line delay 5 -> 148 ns"});
  }
  rows->push_back({"10 % of the frames lost, none numbered",
                   [](Simulation* s, CalibrationOptions*) {
                     s->lost_frames = 0.1;
                     s->with_sequence = false;
                   },
                   "-"});
  for (const double quantum : {0.01, 0.1}) {
    rows->push_back({"telemetry in steps of " + number(quantum, 1) + " degrees",
                     [quantum](Simulation* s, CalibrationOptions*) {
                       s->angle_quantum_rad = quantum * kPi / 180;
                     },
                     quantum < 0.05 ? "1 of 30 NaN" : "29 of 30 NaN"});
  }
  for (const double share : {0.01, 0.05, 0.2}) {
    std::string authors = "18 of 30 fail";
    if (share == 0.01) authors = "1 of 30 fail";
    if (share == 0.05) authors = "f error 3x";
    rows->push_back({number(100 * share, 2) + " % image outliers",
                     [share](Simulation* s, CalibrationOptions*) { s->image_outliers = share; },
                     authors});
  }
  rows->push_back({"10 % telemetry outliers of 0.02 rad",
                   [](Simulation* s, CalibrationOptions*) { s->telemetry_outliers = 0.1; },
                   "d 0.14 -> 0.80 ms"});
  for (const double aspect : {1.002, 1.01}) {
    rows->push_back({"aspect " + number(aspect, 4) + ", estimated",
                     [aspect](Simulation* s, CalibrationOptions* options) {
                       s->aspect = aspect;
                       options->aspect = std::nullopt;
                     },
                     aspect < 1.005 ? "f off 2e-4, ANEES 18" : "f off 1e-3, ANEES 297"});
  }
  for (const double offset : {5.0, 20.0}) {
    rows->push_back({"optical centre off by " + number(offset, 1) + " px, unknown",
                     [offset](Simulation* s, CalibrationOptions*) {
                       s->optical_centre_offset_px = offset * Eigen::Vector2d(0.6, 0.8);
                     },
                     offset < 10 ? "harmless" : "k ANEES 7.8"});
  }
  for (const double field : {2.0, 1.0}) {
    rows->push_back({number(field, 1) + " degree field, sigma pan/tilt 1e-3 rad",
                     [field](Simulation* s, CalibrationOptions*) {
                       set_field(field, s);
                       s->pan_tilt_sigma = 1e-3;
                     },
                     field > 1.5 ? "d ANEES 25" : "d ANEES 315", true});
  }
  for (const double field : {4.0, 1.0}) {
    rows->push_back({"valley: soft scales, " + number(field, 1) + " degree field",
                     [field](Simulation* s, CalibrationOptions*) { set_field(field, s); },
                     "f off 3-6 % (4 of 300)", true, Scales::kSoft});
  }
}

void add_further_rows(Disturbances* rows) {
  for (const double delay : {-2e-6, 0.0, 20e-6}) {
    rows->push_back({"line delay " + number(delay * 1e6, 2) + " us",
                     [delay](Simulation* s, CalibrationOptions*) { s->line_delay = delay; }, "-"});
  }
  rows->push_back({"telemetry at 10 Hz",
                   [](Simulation* s, CalibrationOptions*) { s->telemetry_rate_hz = 10; }, "-"});
  rows->push_back({"stamps late, never early (exponential)",
                   [](Simulation* s, CalibrationOptions* options) {
                     s->one_sided_stamps = true;
                     options->image_stamps = options->telemetry_stamps = StampNoise::kOneSided;
                   },
                   "-"});
  rows->push_back({"image clock 50 ppm fast",
                   [](Simulation* s, CalibrationOptions*) { s->sender_skew = 50e-6; }, "-"});
  rows->push_back(
      {"noise not stated", [](Simulation* s, CalibrationOptions*) { s->with_noise = false; }, "-"});
}

// Errors in units of the undisturbed runs' bounds, root mean square.
double against(const std::vector<Run>& runs, const std::vector<Run>& undisturbed, Parameter p) {
  std::vector<double> values;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double bound = undisturbed[i].bound[index(p)];
    if (runs[i].estimated && bound > 0) values.push_back(runs[i].error[index(p)] / bound);
  }
  return root_mean_square(values);
}

}  // namespace

void run_disturbances(int runs, std::uint64_t first_seed, Report* report) {
  Disturbances rows = {{"undisturbed", [](Simulation*, CalibrationOptions*) {}, "-"}};
  add_authors_rows(&rows);
  add_further_rows(&rows);

  const std::string title = "disturbances, " + std::to_string(runs) + " runs a row from seed " +
                            std::to_string(first_seed);
  Table growth;
  growth.title = title + ": failures, and how much the errors grow";
  growth.header = {"disturbance", "refused",  "wrong", "growth of f",     "k", "d", "line delay",
                   "d, ms",       "line, ns", "CPU s", "authors' program"};
  Table honesty;
  honesty.title = title + ": against the disturbed data's own bound";
  honesty.header = {"disturbance", "error / bound of f", "k",        "d",
                    "line delay",  "ANEES of f",         "k",        "d",
                    "line delay",  "pan axis",           "tilt axis"};
  const double probability =
      1 - (1 - kVerdictProbability) / (4.0 * static_cast<double>(rows.size()));
  std::vector<Run> undisturbed;
  for (const Disturbance& row : rows) {
    std::vector<Run> done;
    for (int i = 0; i < runs; ++i) {
      Simulation s = draw_backend(row.scales, first_seed + static_cast<std::uint64_t>(i));
      CalibrationOptions options = backend_options(row.scales);
      row.apply(&s, &options);
      done.push_back(run_recording(s, simulate_with_truth(s), options, backend_spread(row.scales)));
    }
    if (undisturbed.empty()) undisturbed = done;
    report->list_failures(row.name, done);
    report->add_runs(row.name, done);

    int refused = 0;
    int wrong = 0;
    std::vector<double> times;
    for (const Run& run : done) {
      refused += run.published() ? 0 : 1;
      wrong += run.wrong() ? 1 : 0;
      times.push_back(run.cpu_s);
    }
    growth.rows.push_back({row.name, std::to_string(refused), std::to_string(wrong)});
    honesty.rows.push_back({row.name});
    for (const Parameter p : kShown) {
      const double ratio = against(done, undisturbed, p) / against(undisturbed, undisturbed, p);
      growth.rows.back().push_back(row.another_camera ? "-" : number(ratio));
      honesty.rows.back().push_back(number(root_mean_square(errors_over_bound(done, p))));
    }
    growth.rows.back().push_back(
        number(mean(absolute_errors(done, Parameter::kClockOffset)) * 1e3));
    growth.rows.back().push_back(number(mean(absolute_errors(done, Parameter::kLineDelay)) * 1e9));
    growth.rows.back().push_back(number(median(times)));
    growth.rows.back().push_back(row.authors);
    for (const Parameter p : kShown) {
      const std::vector<double> normalised = normalised_errors(done, p);
      std::vector<double> expected;
      for (const Run& run : done) expected.push_back(run.expected[index(p)]);
      const double anees = std::pow(root_mean_square(normalised), 2);
      const double ratio = anees / mean(expected);
      const int count = static_cast<int>(normalised.size());
      const bool in = mean_square_interval(count, kPrintedProbability).contains(ratio);
      const bool kept = mean_square_interval(count, probability).contains(ratio);
      if (!kept) {
        report->fail(row.name + ": ANEES of " + to_string(p) + " is " + number(anees) +
                     ", expected " + number(mean(expected)));
      }
      honesty.rows.back().push_back(number(anees) + (in ? "" : kept ? " *" : " !"));
    }
    for (const int i : {0, 1}) {
      std::vector<double> nees;
      for (const Run& run : done) {
        if (run.estimated) nees.push_back(run.axis_nees[i]);
      }
      const Interval interval =
          mean_square_interval(2 * static_cast<int>(nees.size()), kPrintedProbability);
      honesty.rows.back().push_back(number(mean(nees)) +
                                    (interval.contains(mean(nees)) ? "" : " *"));
    }
  }
  growth.notes = {
      "growth: root mean square over the runs of error / bound of the undisturbed run, over that "
      "of "
      "the undisturbed runs.",
      "wrong: published with an error of more than " + number(kWrongSigmas, 1) +
          " of its own sigmas. d and line delay: mean absolute errors.",
      "f needs no first guess, so a bad one can only come in as a prior."};
  const auto printed = [&](const Interval& interval) {
    return number(interval.low) + " to " + number(interval.high);
  };
  honesty.notes = {
      "bound: of what is left of the data; outliers and lost frames hold nothing, steps of the "
      "telemetry count as white noise.",
      "95 %: error / bound " + printed(root_mean_square_interval(runs, kPrintedProbability)) +
          ", ANEES " + printed(mean_square_interval(runs, kPrintedProbability)) +
          " (soft: times what is expected), axes " +
          printed(mean_square_interval(2 * runs, kPrintedProbability)) + ".",
      "* outside, as one in twenty by chance; ! outside of what all keep together with 99 %."};
  report->add(growth);
  report->add(honesty);
}

}  // namespace alidade::test
