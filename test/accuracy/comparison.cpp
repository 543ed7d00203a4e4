#include "test/accuracy/comparison.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "test/accuracy/backend.h"
#include "test/accuracy/recordings.h"

namespace alidade::test {
namespace {

constexpr Parameter kFour[] = {Parameter::kFocalLength, Parameter::kRadialDistortion,
                               Parameter::kClockOffset, Parameter::kLineDelay};

struct Compared {
  GivenRecording given;
  Run run;
  FourParameters truth;
  FourParameters unit;  // what turns an error into that of limit.yaml
};

std::string interval_text(const Interval& interval) {
  return number(interval.low) + " to " + number(interval.high);
}

void add_each_run(const std::vector<Compared>& all, Report* report) {
  struct Shown {
    const char* title;
    double unit;
    bool relative;  // shown as deviation from the truth
  };
  const Shown shown[] = {{"focal length: errors in 1e-5 of it", 1e-5, true},
                         {"radial distortion", 1, false},
                         {"clock offset, ms", 1e-3, false},
                         {"line delay, ns", 1e-9, false}};
  for (int i = 0; i < 4; ++i) {
    Table table;
    table.title = std::string("given recordings, ") + shown[i].title;
    table.header = {"recording", "truth",     "our estimate", "peer's",
                    "our error", "our sigma", "peer error",   "peer sigma",
                    "limit",     "own bound", "bound / limit"};
    for (const Compared& c : all) {
      const double unit = shown[i].unit;
      const double scale = c.unit[i] / unit;
      const int p = index(kFour[i]);
      const double estimate_unit = shown[i].relative ? 1 : unit;
      const double limit = c.given.limit ? (*c.given.limit)[i] : std::nan("");
      table.rows.push_back(
          {c.given.name, number(c.truth[i] / estimate_unit, 5),
           c.run.estimated ? number((c.truth[i] + c.run.error[p]) / estimate_unit, 5) : "refused",
           number(c.given.peer[i] / estimate_unit, 5), number(c.run.error[p] * scale),
           number(c.run.sigma[p] * scale), number((c.given.peer[i] - c.truth[i]) * scale),
           number(c.given.peer_sigma[i] * scale), number(limit / unit),
           number(c.run.bound[p] * scale), number(c.run.bound[p] * c.unit[i] / limit, 4)});
    }
    report->add(table);
  }
}

void add_group(const std::string& name, const std::vector<const Compared*>& group, Report* report) {
  Table table;
  table.title = "given recordings, " + name + ": " + std::to_string(group.size()) + " runs";
  table.header = {
      "parameter", "ours: error / limit", "peer's", "95 %", "ours: ANEES", "expected", "peer's",
      "95 %",      "own bound / limit"};
  for (int i = 0; i < 4; ++i) {
    const int p = index(kFour[i]);
    std::vector<double> ours;
    std::vector<double> peers;
    std::vector<double> our_nees;
    std::vector<double> peer_nees;
    std::vector<double> expected;
    std::vector<double> bounds;
    for (const Compared* c : group) {
      const double peer_error = c->given.peer[i] - c->truth[i];
      if (c->given.limit) {
        peers.push_back(peer_error * c->unit[i] / (*c->given.limit)[i]);
        bounds.push_back(c->run.bound[p] * c->unit[i] / (*c->given.limit)[i]);
      }
      peer_nees.push_back(peer_error / c->given.peer_sigma[i]);
      if (!c->run.estimated) continue;
      if (c->given.limit) ours.push_back(c->run.error[p] * c->unit[i] / (*c->given.limit)[i]);
      our_nees.push_back(c->run.error[p] / c->run.sigma[p]);
      expected.push_back(c->run.expected[p]);
    }
    const int count = static_cast<int>(our_nees.size());
    table.rows.push_back({to_string(kFour[i]),
                          (ours.empty() ? "-" : number(root_mean_square(ours))),
                          (peers.empty() ? "-" : number(root_mean_square(peers))),
                          interval_text(root_mean_square_interval(count, kPrintedProbability)),
                          number(std::pow(root_mean_square(our_nees), 2)), number(mean(expected)),
                          number(std::pow(root_mean_square(peer_nees), 2)),
                          interval_text(mean_square_interval(count, kPrintedProbability)),
                          bounds.empty() ? "-" : number(median(bounds), 4)});
  }
  std::vector<double> nees[2];
  for (const Compared* c : group) {
    if (!c->run.estimated) continue;
    for (const int i : {0, 1}) nees[i].push_back(c->run.axis_nees[i]);
  }
  for (const int i : {0, 1}) {
    const int count = 2 * static_cast<int>(nees[i].size());
    table.rows.push_back({i == 0 ? "pan_axis" : "tilt_axis", "-", "-", "-", number(mean(nees[i])),
                          "1.00", "-",
                          interval_text(mean_square_interval(count, kPrintedProbability)), "-"});
  }
  std::string axes = "Axes, mean error in mrad, pan and tilt:";
  for (const int i : {0, 1}) {
    std::vector<double> our_angles;
    std::vector<double> peer_angles;
    for (const Compared* c : group) {
      const Simulation& s = c->given.simulation;
      if (c->run.estimated) our_angles.push_back(c->run.axis_angle[i] * 1e3);
      peer_angles.push_back(1e3 * (i == 0 ? (c->given.peer_pan_axis - s.pan_axis).norm()
                                          : (c->given.peer_tilt_axis - s.tilt_axis).norm()));
    }
    axes += " ours " + number(mean(our_angles)) + ", peer's " + number(mean(peer_angles)) +
            (i == 0 ? ";" : ".");
  }
  std::vector<double> ours;
  std::vector<double> peers;
  for (const Compared* c : group) {
    ours.push_back(c->run.cpu_s);
    peers.push_back(c->given.peer_cpu_s);
  }
  table.notes = {
      "error / limit: root mean square, limit.yaml; ANEES: mean of (error / reported sigma)^2; 95 "
      "% intervals of chi-square for what is 1 by itself.",
      "own bound / limit: median; see bound.h. CPU s, median and largest: ours " +
          number(median(ours)) + ", " + number(largest(ours)) + "; peer's " +
          number(median(peers)) + ", " + number(largest(peers)) + ".",
      axes};
  report->add(table);
}

}  // namespace

bool compare_recordings(const std::string& directory, Report* report, std::string* error) {
  std::vector<std::string> folders;
  std::error_code flaw;
  for (const auto& entry : std::filesystem::directory_iterator(directory, flaw)) {
    if (std::filesystem::exists(entry.path() / "tracks.csv")) {
      folders.push_back(entry.path().string());
    }
  }
  if (flaw || folders.empty()) {
    *error = directory + ": no folders with recordings that have tracks.csv";
    return false;
  }
  std::sort(folders.begin(), folders.end());
  std::vector<Compared> all;
  for (const std::string& folder : folders) {
    Compared c;
    if (!read_given_recording(folder, &c.given, error)) return false;
    const bool soft = c.given.options.pan_scale.sigma > 1e-6;
    const ParameterVector spread = backend_spread(soft ? Scales::kSoft : Scales::kBase);
    c.run = run_recording(c.given.simulation, c.given.recording, c.given.options, spread);
    c.run.name = c.given.name;
    const Simulation& s = c.given.simulation;
    c.truth = {s.focal_length, s.radial_distortion, s.clock_offset, s.line_delay};
    c.unit = {1 / s.focal_length, 1, 1, 1};
    all.push_back(c);
  }
  std::vector<Run> runs;
  std::map<std::string, std::vector<const Compared*>> groups;
  for (const Compared& c : all) {
    runs.push_back(c.run);
    groups[c.given.name.substr(0, c.given.name.rfind('-'))].push_back(&c);
  }
  report->list_failures("given recordings", runs);
  for (const auto& [name, group] : groups) add_group(name, group, report);
  add_each_run(all, report);
  report->add_runs("given recordings", runs);
  return true;
}

}  // namespace alidade::test
