// alidade_tag_table: Table VI of the PTCEE paper on a recording that shows an AprilTag, see tag_table.h.

#include <CLI/CLI.hpp>
#include <cstddef>
#include <fstream>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "edge_app/storage/calibration_file.h"
#include "platform/video/recording_frame_source.h"
#include "test/accuracy/tag_table.h"

namespace alidade::test {
namespace {

using RowArgument = std::tuple<std::string, std::string, std::string, std::string>;

struct Options {
  std::string recording;
  std::vector<RowArgument> rows;
  std::string reference;
  std::string truth;
  std::string json;
  int tag = 0;
};

bool find_tags(const Options& options, std::vector<TagSighting>* sightings, std::string* error) {
  const auto video = open_recorded_frames({options.recording, true, false});
  TagDetector detector(options.tag);
  Frame frame;
  for (;;) {
    const ReadStatus status = video->read(frame, std::numeric_limits<double>::infinity());
    if (status == ReadStatus::kEnd) return true;
    if (status != ReadStatus::kOk) {
      *error = video->error();
      return false;
    }
    const auto corners = detector.find({frame.luma, frame.width, frame.height, frame.stride});
    if (corners) sightings->push_back({frame.stamp.frame, *corners});
  }
}

bool read_rows(const Options& options, std::vector<TagRow>* rows, std::string* error) {
  for (const auto& [name, mode, records, calibration_file] : options.rows) {
    Calibration calibration;
    TagRow row{name, {}};
    if (!load_calibration(calibration_file, &calibration, error) ||
        !read_orientations(records, mode, calibration, &row.orientations, error)) {
      return false;
    }
    rows->push_back(std::move(row));
  }
  if (options.truth.empty()) return true;
  rows->push_back({"true orientation: the detector alone", {}});
  return read_true_orientations(options.truth, &rows->back().orientations, error);
}

bool make_table(const Options& options, std::string* error) {
  std::vector<TagRow> rows;
  std::vector<TagSighting> sightings;
  TagScatter scatter;
  if (!read_rows(options, &rows, error)) return false;
  std::size_t reference = 0;
  while (reference < rows.size() && rows[reference].name != options.reference) ++reference;
  if (reference == rows.size()) {
    *error = "--reference " + options.reference + ": no row has this name";
    return false;
  }
  if (!find_tags(options, &sightings, error) ||
      !scatter_of(sightings, rows, reference, &scatter, error)) {
    return false;
  }
  const TagRowResult* noise = options.truth.empty() ? nullptr : &scatter.rows.back();
  tag_table(scatter, noise).print(std::cout);
  if (options.json.empty()) return true;
  std::ofstream file(options.json);
  file << to_json(scatter, noise).dump(1) << "\n";
  file.flush();
  if (!file) *error = options.json + ": cannot be written";
  return static_cast<bool>(file);
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  alidade::test::Options options;
  CLI::App app(
      "How far an AprilTag scatters when every frame's is carried into one frame "
      "(Table VI of the PTCEE paper)");
  app.add_option("recording", options.recording, "Directory of the recording, with video")
      ->required();
  app.add_option("--row", options.rows,
                 "NAME PT|OE RECORDS CALIBRATION: records as JSON Lines, of which those of this "
                 "mode count, and the calibration "
                 "that they were made with; may be repeated")
      ->required();
  app.add_option(
         "--reference", options.reference,
         "The row whose record of the common frame tags are carried into; of a replay of the "
         "recording, whose frames it counts")
      ->required();
  app.add_option("--truth", options.truth,
                 "Folder with truth.yaml and truth.csv: adds the detector's noise");
  app.add_option("--json", options.json, "Also writes the table and every place to this file");
  app.add_option("--tag", options.tag, "Number of the tag in the family 36h11");
  CLI11_PARSE(app, argc, argv);
  std::string error;
  if (alidade::test::make_table(options, &error)) return 0;
  std::cerr << "alidade_tag_table: " << error << "\n";
  return 1;
}
