// alidade_map_upkeep: a scene map through a month (test/core/mapping/changing_scene.h), with its upkeep and without: how far the
// absolute direction drifts, how many landmarks there are, what the paper's proximity check and its updating are worth, also to the tracking of targets.
//   alidade_map_upkeep --days 30 --file /tmp/month.map
// Exit status: 0 all figures are as they should be, 1 some are not (listed last), 2 wrong usage.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>

#include "edge_app/storage/scene_map_file.h"
#include "test/accuracy/map_tracking.h"
#include "test/accuracy/table.h"
#include "test/core/mapping/changing_scene.h"

namespace alidade::test {
namespace {

struct Lived {
  std::string name;
  std::vector<SceneDay> days;
};

std::string text(int number) { return std::to_string(number); }

// Every third day and the last.
void print_days(const std::string& scene, const Lived& lived) {
  Table table;
  table.title = scene + ", " + lived.name;
  table.header = {"day",       "refused", "matches", "error px",  "sigma px",   "drift px",
                  "landmarks", "born",    "died",    "not close", "candidates", "file KiB"};
  for (std::size_t i = 0; i < lived.days.size(); ++i) {
    if (i % 3 != 0 && i + 1 != lived.days.size()) continue;
    const SceneDay& d = lived.days[i];
    table.rows.push_back({text(static_cast<int>(i) + 1), text(d.refused) + "/" + text(d.views),
                          number(d.matches), number(d.error_px), number(d.sigma_px),
                          number(d.drift_px), text(d.landmarks), text(d.born), text(d.died),
                          text(d.not_close), text(d.candidates),
                          text(static_cast<int>(d.file_bytes / 1024))});
  }
  table.notes = {
      "error: root mean square of both coordinates of the image centre's direction; sigma: "
      "claimed, of one of them",
      "drift: the largest of the places, the day's mean error against the first day's"};
  table.print(std::cout);
}

void print_comparison(const std::string& scene, const std::vector<Lived>& all) {
  Table table;
  table.title = scene + ", all days";
  table.header = {"map",
                  "refused",
                  "matches, last day",
                  "error px",
                  "error px, last day",
                  "drift px, largest",
                  "landmarks, most"};
  for (const Lived& lived : all) {
    int refused = 0, views = 0, landmarks = 0;
    double square = 0, drift = 0;
    for (const SceneDay& d : lived.days) {
      refused += d.refused;
      views += d.views;
      landmarks = std::max(landmarks, d.landmarks);
      square += d.error_px * d.error_px * (d.views - d.refused);
      drift = std::max(drift, d.drift_px);
    }
    const SceneDay& last = lived.days.back();
    table.rows.push_back({lived.name, text(refused) + "/" + text(views), number(last.matches),
                          number(std::sqrt(square / std::max(1, views - refused))),
                          number(last.error_px), number(drift), text(landmarks)});
  }
  table.print(std::cout);
}

void print_tracking(const std::string& scene, const std::vector<Lived>& all, int views) {
  std::vector<TrackedMap> maps;
  for (const Lived& lived : all) maps.push_back({lived.name, lived.days.back()});
  track_through_maps(scene, maps, views).print(std::cout);
}

// The map as a file in which each change is a transaction, as in `alidade run`; the file's size with what SQLite has not written back.
class KeptMap {
 public:
  explicit KeptMap(std::string path) : path_(std::move(path)) {}

  [[nodiscard]] std::optional<std::int64_t> keep(const SceneMap& map, const MapChange& change) {
    std::string error;
    if (!(is_open_ ? change.empty() || file_.update(change, &error) : begin(map, &error))) {
      std::cerr << error << "\n";
      return std::nullopt;
    }
    is_open_ = true;
    std::int64_t bytes = 0;
    for (const char* end : {"", "-wal"}) {
      if (std::filesystem::exists(path_ + end)) {
        bytes += static_cast<std::int64_t>(std::filesystem::file_size(path_ + end));
      }
    }
    return bytes;
  }

 private:
  [[nodiscard]] bool begin(const SceneMap& map, std::string* error) {
    SceneMap stored;
    return save_scene_map(path_, map, error) && file_.open(path_, error) &&
           file_.read(&stored, error);
  }

  std::string path_;
  SceneMapFile file_;
  bool is_open_ = false;
};

std::vector<Lived> live_each_way(const ChangingSceneOptions& scene, const std::string& file) {
  SceneRunOptions full, without_check, without;
  if (!file.empty()) {
    const auto kept = std::make_shared<KeptMap>(file);
    full.keep = [kept](const SceneMap& map, const MapChange& change) {
      return kept->keep(map, change);
    };
  }
  without_check.options.least_proximity = 0;
  without.upkeep = false;
  return {{"upkeep", live_through(scene, full)},
          {"upkeep without the proximity check", live_through(scene, without_check)},
          {"without upkeep", live_through(scene, without)}};
}

int run(const ChangingSceneOptions& month, double bare_days, const std::string& file) {
  std::vector<std::string> missed;
  const std::clock_t begin = std::clock();
  const std::vector<Lived> lived = live_each_way(month, file);
  for (const Lived& way : lived) {
    if (way.days.empty()) return 1;
  }
  const auto clocks = static_cast<double>(std::clock() - begin);
  std::cout << "CPU " << number(clocks / static_cast<double>(CLOCKS_PER_SEC)) << " s\n";
  for (const Lived& way : lived) print_days("the month", way);
  print_comparison("the month", lived);
  print_tracking("the month", lived, month.views);
  const std::vector<SceneDay>& kept = lived.front().days;
  for (const SceneDay& day : kept) {
    if (!(day.drift_px <= 0.2)) missed.push_back("drift " + number(day.drift_px) + " px, mark 0.2");
  }
  // Bounded: in the last third it hardly grows any more.
  const SceneDay& earlier = kept[2 * kept.size() / 3];
  if (kept.back().landmarks > 1.25 * earlier.landmarks) {
    missed.push_back(text(kept.back().landmarks) + " landmarks at the end, " +
                     text(earlier.landmarks) + " after two thirds of the time");
  }
  if (static_cast<double>(kept.back().file_bytes) >
      1.25 * static_cast<double>(earlier.file_bytes)) {
    missed.push_back("a file of " + std::to_string(kept.back().file_bytes) + " bytes at the end, " +
                     std::to_string(earlier.file_bytes) + " after two thirds of the time");
  }
  ChangingSceneOptions bare = month;
  bare.days = bare_days;
  bare.bare = true;
  bare.trees = 50;
  bare.cars = 0;
  const std::vector<Lived> lived_with_trees = live_each_way(bare, "");
  print_comparison("a scene of which trees take more than half", lived_with_trees);
  print_tracking("a scene of which trees take more than half", lived_with_trees, bare.views);
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  CLI::App app("A scene map through a month, with its upkeep and without");
  alidade::test::ChangingSceneOptions month;
  month.season_px = 10;
  month.season_hours = 2;
  double bare_days = 4;
  std::string file;
  app.add_option("--days", month.days, "of the month")->check(CLI::Range(1.0, 365.0));
  app.add_option("--bare-days", bare_days, "of the scene with trees")
      ->check(CLI::Range(1.0, 365.0));
  app.add_option("--views", month.views, "of a visit, a second apart")->check(CLI::Range(20, 1000));
  app.add_option("--file", file, "where the map with its upkeep is kept; none: in memory alone");
  app.add_option("--places", month.places, "that are visited")->check(CLI::Range(1, 10));
  app.add_option("--replaced", month.replaced, "share of things that are replaced")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--seed", month.seed, "of all that is random");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return alidade::test::run(month, bare_days, file);
}
