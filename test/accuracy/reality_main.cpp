// alidade_reality: how honest and how accurate calibration and OE mode are if the camera departs
// from the model.
//   alidade_reality [--rows gear,play] [--seeds N] [--seed S] [--cache DIR] [--json FILE]
//                   [--results DIR [--calibrated]] [--measure]
// For each row (reality_film.h) and seed: makes a film with the virtual camera, runs `alidade
// calibrate` and `alidade replay --mode OE` on it, and compares both with the truth
// (reality_judge.h).
// Exit status: 0 all marks are met, 1 some are not (listed last; 0 with --measure), 2 something
// could not be run.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "test/accuracy/reality_film.h"
#include "test/accuracy/reality_judge.h"
#include "test/accuracy/table.h"
#include "test/support/process.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> rows;
  int seeds = 8;
  std::uint64_t first_seed = 1;
  fs::path cache = "reality_films";
  fs::path results;  // kept there if not empty
  std::string alidade = ALIDADE_PROGRAM;
  std::string json;
  bool measure = false;
  bool calibrated = false;  // the calibrations that `results` holds are judged, none is made
};

constexpr int kRefused = 1;  // exit status of `alidade calibrate`; a usage it does not know is 2

// Of what a program said before it failed.
std::string last_line(const std::string& errors) {
  std::istringstream lines(errors);
  std::string last;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) last = line;
  }
  return last;
}

// px: truth minus estimate of the middle's direction, along u and v.
void write_errors(const SeedResult& result, const fs::path& path) {
  std::ofstream file(path);
  file << "frame,mode,error_u_px,error_v_px,sigma_u_px,sigma_v_px,square\n";
  for (const FrameError& error : result.frame_errors) {
    file << fmt::format("{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.3f}\n", error.frame,
                        error.oe ? "OE" : "PT", error.px.x(), error.px.y(),
                        std::sqrt(error.covariance(0, 0)), std::sqrt(error.covariance(1, 1)),
                        error.normalised_square());
  }
  if (!file.flush()) throw std::runtime_error(path.string() + ": cannot be written");
}

SeedResult judge(const Options& options, const RealityRow& row, std::uint64_t seed,
                 const fs::path& results) {
  SeedResult result;
  result.seed = seed;
  const RealityFilm film = reality_film(row, seed, ALIDADE_TEST_DATA);
  const fs::path folder = kept_film(film, fmt::format("{}-{}", row.name, seed), options.cache);
  const std::string recording = (folder / "recording").string();

  const std::string file = (results / "calibration.yaml").string();
  if (!options.calibrated || !fs::exists(file)) {
    Process calibrate({options.alidade, "calibrate", "-o", results.string(), recording});
    static_cast<void>(calibrate.read_all());
    const int status = calibrate.wait();
    if (status == kRefused) {
      result.refusal = last_line(calibrate.errors());
      return result;
    }
    if (status != 0) throw std::runtime_error(recording + ": " + last_line(calibrate.errors()));
  }
  const FoundCalibration found = read_found_calibration(file);
  const RealityTruth truth(simulator::load_config(folder / "film.yaml"));
  result.error = truth.calibration_error(found);
  result.covariance = found.covariance;

  Process replay({options.alidade, "replay", "--mode", "OE", "--json", "--calibration", file, "-o",
                  results.string(), recording});
  for (std::string line = replay.read_line(); !line.empty(); line = replay.read_line()) {
    ++result.frames;
    if (const auto orientation = read_found_orientation(line)) {
      result.frame_errors.push_back(truth.frame_error(found, *orientation));
    }
  }
  if (replay.wait() != 0) throw std::runtime_error(recording + ": " + last_line(replay.errors()));
  write_errors(result, results / "errors.csv");
  return result;
}

nlohmann::json to_json(const SeedResult& seed) {
  nlohmann::json json = {{"seed", seed.seed}};
  if (!seed.refusal.empty()) json["refusal"] = seed.refusal;
  if (!seed.error) return json;
  for (int i = 0; i < kJudgedCount; ++i) {
    const double sigma = std::sqrt(seed.covariance(i, i));
    json["calibration"][kJudged[static_cast<std::size_t>(i)]] = {
        {"error", (*seed.error)[i]}, {"sigma", sigma}, {"sigmas", (*seed.error)[i] / sigma}};
  }
  const CalibrationStatistics calibration = calibration_statistics({seed});
  const ReplayStatistics replay = replay_statistics({seed});
  json["anees"] = calibration.anees;
  json["frames"] = replay.frames;
  json["oe"] = replay.oe;
  json["oe_nees"] = replay.nees;
  json["worst_frame"] = replay.worst;
  json["sigma_over_error"] = replay.sigma_over_error;
  json["rms_px"] = replay.rms_px;
  json["relative_px"] = replay.relative_px;
  return json;
}

std::string summary(const RealityRow& row, const SeedResult& seed) {
  if (!seed.error) return fmt::format("{} {}: refused: {}", row.name, seed.seed, seed.refusal);
  const CalibrationStatistics calibration = calibration_statistics({seed});
  const ReplayStatistics replay = replay_statistics({seed});
  return fmt::format(
      "{} {}: calibration {:.2f}, worst {:.1f} sigmas ({}); OE {} of {}: {:.2f}, worst "
      "{:.1f}, {:.3f} px, relative {:.3f} px",
      row.name, seed.seed, calibration.anees, calibration.worst_sigmas, calibration.worst,
      replay.oe, replay.frames, replay.nees, replay.worst, replay.rms_px, replay.relative_px);
}

int run(const Options& options) {
  if (const std::string fault = yardsticks_fault(); !fault.empty()) {
    std::cerr << "alidade_reality: " << fault << "\n";
    return 2;
  }
  std::vector<const RealityRow*> rows;
  for (const RealityRow& row : reality_rows()) {
    const auto& asked = options.rows;
    if (asked.empty() || std::find(asked.begin(), asked.end(), row.name) != asked.end()) {
      rows.push_back(&row);
    }
  }
  Table table;
  table.title = "Cameras that depart from the model: calibration, and OE mode with it";
  table.header = {"row",         "seeds",  "refused",    "e'C^-1e/n", "99.9 %",
                  ">4.5",        "worst",  "OE share",   "OE",        "worst frame",
                  "sigma/error", "RMS px", "relative px"};
  table.notes = {
      "e'C^-1e/n: calibrations' errors in units of their covariances, n = 8 a seed",
      "OE: mean of error^2 / sigma^2 of the middle's direction, frames in mode OE; worst "
      "frame: of all; lengths in px"};
  nlohmann::json all = nlohmann::json::array();
  std::vector<std::string> missed;
  std::vector<std::string> refusals;
  for (const RealityRow* row : rows) {
    std::vector<SeedResult> seeds;
    nlohmann::json each = nlohmann::json::array();
    for (int i = 0; i < options.seeds; ++i) {
      const TemporaryDirectory temporary;
      const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(i);
      const fs::path results = options.results.empty()
                                   ? fs::path(temporary.path())
                                   : options.results / fmt::format("{}-{}", row->name, seed);
      seeds.push_back(judge(options, *row, seed, results));
      each.push_back(to_json(seeds.back()));
      std::cout << summary(*row, seeds.back()) << std::endl;
      if (!seeds.back().refusal.empty()) {
        refusals.push_back(fmt::format("{} {}: {}", row->name, seed, seeds.back().refusal));
      }
    }
    const CalibrationStatistics c = calibration_statistics(seeds);
    const ReplayStatistics r = replay_statistics(seeds);
    const auto shown = [](bool measured, double value) { return measured ? number(value) : "-"; };
    const bool oe = r.oe > 0;
    table.rows.push_back(
        {row->name, std::to_string(options.seeds), std::to_string(options.seeds - c.seeds),
         shown(c.seeds > 0, c.anees), fmt::format("{:.2f}-{:.2f}", c.chance.low, c.chance.high),
         std::to_string(c.beyond), fmt::format("{} {:.1f}", c.worst, c.worst_sigmas),
         shown(r.frames > 0, r.frames > 0 ? r.oe / static_cast<double>(r.frames) : 0),
         shown(oe, r.nees), shown(r.answered > 0, r.worst), shown(oe, r.sigma_over_error),
         shown(oe, r.rms_px), shown(oe, r.relative_px)});
    const std::vector<std::string> marks = missed_marks(c, r, row->most_relative);
    for (const std::string& mark : marks) missed.push_back(row->name + ": " + mark);
    all.push_back({{"row", row->name},
                   {"departure", row->departure},
                   {"calibrated", c.seeds},
                   {"anees", c.anees},
                   {"chance", {c.chance.low, c.chance.high}},
                   {"beyond", c.beyond},
                   {"worst", c.worst},
                   {"worst_sigmas", c.worst_sigmas},
                   {"frames", r.frames},
                   {"oe", r.oe},
                   {"oe_nees", r.nees},
                   {"pt_nees", r.pt_nees},
                   {"worst_frame", r.worst},
                   {"sigma_over_error", r.sigma_over_error},
                   {"rms_px", r.rms_px},
                   {"relative_px", r.relative_px},
                   {"missed", marks},
                   {"seeds", each}});
    if (!options.json.empty()) {
      std::ofstream file(options.json);
      file << nlohmann::json{{"rows", all}, {"table", table.to_json()}, {"missed", missed}}.dump(1)
           << "\n";
      if (!file.flush()) throw std::runtime_error(options.json + ": cannot be written");
    }
  }
  table.print(std::cout);
  for (const std::string& refusal : refusals) std::cout << "refused: " << refusal << "\n";
  for (const std::string& mark : missed) std::cout << "MISSED: " << mark << "\n";
  return missed.empty() || options.measure ? 0 : 1;
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  using alidade::test::reality_rows;
  CLI::App app("Calibration and OE mode where cameras depart from the model");
  alidade::test::Options options;
  std::vector<std::string> names;
  for (const auto& row : reality_rows()) names.push_back(row.name);
  app.add_option("--rows", options.rows, "Of them only these")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  app.add_option("--seeds", options.seeds, "Films of each row")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--seed", options.first_seed, "The first one")->capture_default_str();
  app.add_option("--cache", options.cache, "Keeps the films")->capture_default_str();
  app.add_option("--results", options.results,
                 "Keeps calibrations, records and each frame's error here");
  app.add_flag("--calibrated", options.calibrated, "With the calibrations that --results holds");
  app.add_option("--alidade", options.alidade, "The program that is judged")
      ->envname("ALIDADE")
      ->check(CLI::ExistingFile);
  app.add_option("--json", options.json, "Also writes all numbers to this file");
  app.add_flag("--measure", options.measure, "Exit status 0 although marks are missed");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    std::filesystem::create_directories(options.cache);
    return alidade::test::run(options);
  } catch (const std::exception& error) {
    std::cerr << "alidade_reality: " << error.what() << "\n";
    return 2;
  }
}
