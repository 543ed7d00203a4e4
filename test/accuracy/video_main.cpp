// alidade_video_accuracy: is a calibration from video as certain as it says? See video_calibration.h.
//   alidade_video_accuracy [--from N] [--recordings N] [--folder DIR]
// Exit status: 0 honest, 1 not (the last lines say in what), 2 a recording could not be made.

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "test/accuracy/recording_range.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"
#include "test/accuracy/video_calibration.h"

namespace alidade::test {
namespace {

constexpr double kWorst = 4;  // sigmas

std::string shown(double value) { return number(value); }

int run(const RecordingRange& range) {
  std::array<std::vector<double>, kComparedParameters.size()> squares;
  Table each;
  each.title = "calibrations from video: errors in sigmas";
  each.header = {"recording"};
  for (const Parameter p : kComparedParameters) each.header.emplace_back(to_string(p));
  std::vector<std::string> missed;
  int refused = 0;
  for (int i = range.from; i < range.from + range.recordings + refused; ++i) {
    const VideoRecording recording = video_recording(i);
    std::string error;
    const auto errors =
        calibrate_video_recording(recording, range.folder / std::to_string(i), &error);
    if (!errors) {
      // Little contrast in much noise: no calibration is no wrong one. Another takes its place.
      std::cout << recording.name << ": refused: " << error << std::endl;
      if (++refused > range.recordings) {
        missed.emplace_back("more than half of the recordings were refused");
        break;
      }
      continue;
    }
    std::vector<std::string> row = {recording.name};
    for (std::size_t p = 0; p < squares.size(); ++p) {
      const double z = errors->normalised[p];
      row.push_back(shown(z));
      squares[p].push_back(z * z);
      if (!(std::abs(z) <= kWorst)) {
        missed.push_back(recording.name + ": " + to_string(kComparedParameters[p]) + " is off by " +
                         shown(z) + " sigmas");
      }
    }
    each.rows.push_back(row);
    show(row);
  }
  // All eight keep theirs together in 95 of 100 experiments.
  const double probability = std::pow(0.95, 1.0 / static_cast<double>(squares.size()));
  Table all;
  all.title = "mean of (error / sigma)^2";
  all.header = {"parameter", "ANEES", "low", "high"};
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const char* name = to_string(kComparedParameters[i]);
    const Interval chance = mean_square_interval(static_cast<int>(squares[i].size()), probability);
    const double anees = mean(squares[i]);
    all.rows.push_back({name, shown(anees), shown(chance.low), shown(chance.high)});
    if (!(anees <= chance.high)) missed.push_back(std::string(name) + ": sigmas too small");
  }
  return conclude(each, all, missed);
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  CLI::App app("Calibrations from video against the truth of rendered recordings");
  alidade::test::RecordingRange range{0, alidade::test::kVideoRecordings, "video_accuracy"};
  alidade::test::add_options(&app, &range);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    std::filesystem::create_directories(range.folder);
    return alidade::test::run(range);
  } catch (const std::exception& error) {
    std::cerr << "alidade_video_accuracy: " << error.what() << "\n";
    return 2;
  }
}
