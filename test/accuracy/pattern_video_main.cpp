// alidade_pattern_video_accuracy: is a line delay from rendered video of a printed pattern as certain as it says? See
// pattern_calibration.h.
//   alidade_pattern_video_accuracy [--from N] [--recordings N] [--folder DIR]
//   alidade_pattern_video_accuracy --detections [--frames N]     how well points are found, see pattern_detections.h
// Exit status: 0 honest, 1 not (the last lines say in what), 2 a recording could not be made.

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "test/accuracy/pattern_calibration.h"
#include "test/accuracy/pattern_detections.h"
#include "test/accuracy/recording_range.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

constexpr double kWorstSigmas = 4;
constexpr double kWorstLineDelay_s = 0.15e-6;

int run(const RecordingRange& range) {
  Table each;
  each.title = "line delay and lens from video of a pattern: errors in sigmas";
  each.header = {"recording", "found", "sigma px", "error us", "sigma us"};
  for (const char* name : kLensParameterNames) each.header.emplace_back(name);
  each.header.emplace_back("CPU s");
  std::vector<std::string> missed;
  std::vector<std::vector<double>> squares(kLensParameterCount);
  for (int i = range.from; i < range.from + range.recordings; ++i) {
    const PatternRecording recording = pattern_recording(i);
    const PatternOutcome outcome =
        calibrate_pattern_recording(recording, range.folder / std::to_string(i));
    const PatternCalibration& calibration = outcome.calibration;
    if (calibration.status != PatternStatus::kOk) {
      missed.push_back(recording.name + ": refused: " + calibration.message);
      std::cout << missed.back() << std::endl;
      continue;
    }
    const LensVector error = calibration.lens - lens_truth(recording.config);
    const double line_delay_error = error[index(LensParameter::kLineDelay)];
    std::vector<std::string> row = {
        recording.name, std::to_string(outcome.found) + "/" + std::to_string(outcome.images),
        number(calibration.sigma_px), number(1e6 * line_delay_error),
        number(1e6 * calibration.sigma(LensParameter::kLineDelay))};
    for (int p = 0; p < kLensParameterCount; ++p) {
      const double z = error[p] / calibration.sigma(static_cast<LensParameter>(p));
      squares[static_cast<std::size_t>(p)].push_back(z * z);
      row.push_back(number(z, 2));
      if (!(std::abs(z) <= kWorstSigmas)) {
        missed.push_back(recording.name + ": " + kLensParameterNames[static_cast<std::size_t>(p)] +
                         " is off by " + number(z) + " sigmas");
      }
    }
    if (!(std::abs(line_delay_error) <= kWorstLineDelay_s)) {
      missed.push_back(recording.name + ": line delay off by " + number(1e6 * line_delay_error) +
                       " us");
    }
    row.push_back(number(outcome.detection_cpu_s, 2) + "+" + number(outcome.adjustment_cpu_s, 2));
    each.rows.push_back(row);
    show(row);
  }
  Table all;
  all.title = "mean of (error / sigma)^2";
  all.header = {"parameter", "ANEES", "low", "high"};
  for (std::size_t i = 0; i < squares.size(); ++i) {
    if (squares[i].empty()) continue;
    const Interval chance = mean_square_interval(static_cast<int>(squares[i].size()), 0.95);
    const double anees = mean(squares[i]);
    all.rows.push_back(
        {kLensParameterNames[i], number(anees), number(chance.low), number(chance.high)});
    if (i == static_cast<std::size_t>(index(LensParameter::kLineDelay)) && !chance.contains(anees))
      missed.emplace_back("line delay: sigmas are not honest");
  }
  return conclude(each, all, missed);
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  CLI::App app("Line delay and lens from rendered video of a pattern against the truth");
  alidade::test::RecordingRange range{0, alidade::test::kPatternRecordings, "pattern_accuracy"};
  int frames = 100;
  bool detections = false;
  alidade::test::add_options(&app, &range);
  app.add_flag("--detections", detections, "The table of detections alone");
  app.add_option("--frames", frames, "Of each line of that table")->check(CLI::Range(1, 100000));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    if (detections) {
      alidade::test::detection_table(frames).print(std::cout);
      return 0;
    }
    std::filesystem::create_directories(range.folder);
    return alidade::test::run(range);
  } catch (const std::exception& error) {
    std::cerr << "alidade_pattern_video_accuracy: " << error.what() << "\n";
    return 2;
  }
}
