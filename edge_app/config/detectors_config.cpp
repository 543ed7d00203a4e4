#include "edge_app/config/detectors_config.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "edge_app/config/link_keys.h"

namespace alidade {
namespace {

// Reads two keys; the second must not be below the first.
void read_sizes(YamlSection& section, const char* least_key, const char* most_key,
                const NumberRange& range, double* least, double* most) {
  *least = section.number(least_key, range).value_or(*least);
  *most = section.number(most_key, range).value_or(*most);
  if (*most >= *least) return;
  section.fail(section.has(most_key) ? most_key : least_key,
               fmt::format("leaves {:g} to {:g} px; expected {} no more than {}", *least, *most,
                           least_key, most_key));
}

MotionOptions read_motion(YamlSection section) {
  MotionOptions motion;
  motion.exposure_s = section.number("exposure_s", {0, 1, "s"}).value_or(motion.exposure_s);
  read_sizes(section, "least_size_px", "most_size_px", {1, 16384, "px"},
             &motion.change.least_size_px, &motion.change.most_size_px);
  section.finish();
  return motion;
}

PersonOptions read_people(YamlSection section) {
  PersonOptions people;
  people.height_m = section.number("height_m", {0.1, 10, "m"}).value_or(people.height_m);
  read_sizes(section, "least_height_px", "most_height_px", {24, 16384, "px"},
             &people.least_height_px, &people.most_height_px);
  people.threshold = section.number("threshold", {-10, 10, "1"}).value_or(people.threshold);
  section.finish();
  return people;
}

NetworkFiles read_onnx(YamlSection section, const std::string& config_path) {
  NetworkFiles network;
  NetworkOptions& options = network.options;
  const auto model = section.text("model");
  if (!model) section.fail_missing("model", "expected the path of a network, exported to ONNX");
  network.model = path_relative_to(config_path, *model);
  if (const auto labels = section.text("labels"))
    network.labels = path_relative_to(config_path, *labels);
  options.width_px = section.integer("width_px", {32, 4096, "px"}).value_or(options.width_px);
  options.height_px = section.integer("height_px", {32, 4096, "px"}).value_or(options.height_px);
  options.threshold = section.number("threshold", {0.001, 0.999, "1"}).value_or(options.threshold);
  options.most_overlap = section.number("most_overlap", {0, 1, "1"}).value_or(options.most_overlap);
  section.finish();
  return network;
}

}  // namespace

BuiltInDetectorOptions read_detectors(YamlSection section, const std::string& config_path) {
  BuiltInDetectorOptions detectors;
  std::vector<std::pair<DetectorKind, YamlSection>> given;
  for (const DetectorKindRow& row : kDetectorKinds) {
    const bool is_given = section.has(row.name);
    YamlSection of_kind = section.section(row.name);
    if (is_given) given.emplace_back(row.kind, std::move(of_kind));
  }
  section.finish();
  for (auto& [kind, of_kind] : given) {
    switch (kind) {
      case DetectorKind::kOnnx:
        detectors.onnx = read_onnx(of_kind, config_path);
        break;
      case DetectorKind::kPeople:
        detectors.people = read_people(of_kind);
        break;
      case DetectorKind::kMotion:
        detectors.motion = read_motion(of_kind);
        break;
      case DetectorKind::kCount:
        break;
    }
  }
  return detectors;
}

}  // namespace alidade
