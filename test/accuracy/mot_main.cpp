// alidade_mot: how well a tracker's result follows the truth, both MOTChallenge files (mot_text.h, mot_metrics.h).
//   alidade_mot TRUTH.txt RESULT.txt [--json]
// Exit status: 0 done, 1 a file cannot be read or is not right, 2 wrong usage.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "test/accuracy/mot_metrics.h"
#include "test/accuracy/mot_text.h"

namespace {

using namespace alidade::test;

bool read(const std::string& path, bool truth, std::vector<MotBox>* boxes) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  std::string error;
  if (!file) {
    error = path + ": cannot be read";
  } else if (parse_mot(text.str(), path, truth, boxes, &error)) {
    return true;
  }
  std::cerr << "alidade_mot: " << error << "\n";
  return false;
}

void print(const MotMetrics& metrics) {
  for (const auto& [name, count] : counts_of(metrics)) {
    std::printf("%-20s %10lld\n", name.c_str(), static_cast<long long>(count));
  }
  for (const auto& [name, ratio] : ratios_of(metrics)) {
    if (std::isnan(ratio)) {
      std::printf("%-20s %10s\n", name.c_str(), "-");
    } else {
      std::printf("%-20s %10.4f\n", name.c_str(), ratio);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "How well tracks follow the truth: CLEAR MOT, identity and HOTA metrics of MOTChallenge "
      "files");
  std::string truth_path;
  std::string result_path;
  bool json = false;
  app.add_option("TRUTH", truth_path, "MOTChallenge file; lines of confidence below 1 do not count")
      ->required();
  app.add_option("RESULT", result_path, "MOTChallenge file")->required();
  app.add_flag("--json", json, "one JSON object; null where nothing is divided by nothing");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  std::vector<MotBox> truth;
  std::vector<MotBox> result;
  if (!read(truth_path, true, &truth) || !read(result_path, false, &result)) return 1;
  const MotMetrics metrics = mot_metrics(truth, result);
  if (!json) {
    print(metrics);
    return 0;
  }
  nlohmann::ordered_json object;
  for (const auto& [name, count] : counts_of(metrics)) object[name] = count;
  for (const auto& [name, ratio] : ratios_of(metrics)) object[name] = ratio;
  std::cout << object.dump() << "\n";
  return 0;
}
