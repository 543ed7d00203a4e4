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

#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"
#include "test/accuracy/video_calibration.h"

namespace alidade::test {
namespace {

constexpr double kWorst = 4;  // sigmas

std::string shown(double value) { return number(value); }

int run(int from, int recordings, const std::filesystem::path& folder) {
  std::array<std::vector<double>, kComparedParameters.size()> squares;
  Table each;
  each.title = "calibrations from video: errors in sigmas";
  each.header = {"recording"};
  for (const Parameter p : kComparedParameters) each.header.emplace_back(to_string(p));
  std::vector<std::string> missed;
  int refused = 0;
  for (int i = from; i < from + recordings + refused; ++i) {
    const VideoRecording recording = video_recording(i);
    std::string error;
    const auto errors = calibrate_video_recording(recording, folder / std::to_string(i), &error);
    if (!errors) {
      // Little contrast in much noise: no calibration is no wrong one. Another takes its place.
      std::cout << recording.name << ": refused: " << error << std::endl;
      if (++refused > recordings) {
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
    // They take minutes: whoever looks sees how far it is.
    for (const std::string& cell : row) std::cout << cell << ' ';
    std::cout << std::endl;
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
  each.print(std::cout);
  all.print(std::cout);
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  CLI::App app("Calibrations from video against the truth of rendered recordings");
  int recordings = alidade::test::kVideoRecordings;
  std::filesystem::path folder = "video_accuracy";
  int from = 0;
  app.add_option("--from", from, "Number of the first")->check(CLI::Range(0, 10000));
  app.add_option("--recordings", recordings, "How many")->check(CLI::Range(1, 10000));
  app.add_option("--folder", folder, "Where they are written, one at a time")
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    std::filesystem::create_directories(folder);
    return alidade::test::run(from, recordings, folder);
  } catch (const std::exception& error) {
    std::cerr << "alidade_video_accuracy: " << error.what() << "\n";
    return 2;
  }
}
