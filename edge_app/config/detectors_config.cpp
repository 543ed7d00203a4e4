#include "edge_app/config/detectors_config.h"

#include <fmt/format.h>

namespace alidade {
namespace {

// Two keys of which the second is not to be below the first.
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

}  // namespace

BuiltInDetectorOptions read_detectors(YamlSection section) {
  BuiltInDetectorOptions detectors;
  const bool has_motion = section.has("motion");
  const bool has_people = section.has("people");
  const YamlSection motion = section.section("motion");
  const YamlSection people = section.section("people");
  section.finish();
  if (has_motion) detectors.motion = read_motion(motion);
  if (has_people) detectors.people = read_people(people);
  return detectors;
}

}  // namespace alidade
