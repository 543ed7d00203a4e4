#include "edge_app/config/tracking_config.h"

#include <fmt/format.h>

#include "edge_app/config/link_keys.h"

namespace alidade {
namespace {

// The keys whose names end with a unit of the space.
struct SpaceKeys {
  const char* acceleration_density;
  const char* first_velocity_sigma;
  const char* most_sigma;
};
constexpr SpaceKeys kPlaneKeys{"acceleration_density_m2_s3", "first_velocity_sigma_m_s",
                               "most_sigma_m"};
constexpr SpaceKeys kSphereKeys{"acceleration_density_rad2_s3", "first_velocity_sigma_rad_s",
                                "most_sigma_rad"};

void read_space_keys(YamlSection& section, TargetTrackerOptions* tracker) {
  const bool on_plane = tracker->space == TargetSpace::kPlane;
  const SpaceKeys& keys = on_plane ? kPlaneKeys : kSphereKeys;
  const SpaceKeys& others = on_plane ? kSphereKeys : kPlaneKeys;
  for (const char* key :
       {others.acceleration_density, others.first_velocity_sigma, others.most_sigma}) {
    if (!section.has(key)) continue;
    section.fail(key, on_plane ? "is for targets on the sphere, but these are on the plane; "
                                 "expected the key with m, or space: sphere"
                               : "is for targets on a plane, but these are on the sphere; expected "
                                 "the key with rad, or plane: plane.yaml");
  }
  const NumberRange accelerations =
      on_plane ? NumberRange{1e-6, 1e4, "m^2/s^3"} : NumberRange{1e-12, 100, "rad^2/s^3"};
  const NumberRange velocities =
      on_plane ? NumberRange{1e-3, 1e3, "m/s"} : NumberRange{1e-6, 10, "rad/s"};
  const NumberRange places = on_plane ? NumberRange{1e-2, 1e5, "m"} : NumberRange{1e-6, 3, "rad"};
  tracker->acceleration_density = section.number(keys.acceleration_density, accelerations)
                                      .value_or(tracker->acceleration_density);
  tracker->sigma_first_velocity =
      section.number(keys.first_velocity_sigma, velocities).value_or(tracker->sigma_first_velocity);
  tracker->most_sigma = section.number(keys.most_sigma, places).value_or(tracker->most_sigma);
}

TargetSpace read_space(YamlSection& section, bool has_plane) {
  const auto space = section.choice("space", {"plane", "sphere"});
  if (!space) return has_plane ? TargetSpace::kPlane : TargetSpace::kSphere;
  if (*space == "sphere") return TargetSpace::kSphere;
  if (!has_plane)
    section.fail("space",
                 "is plane, but no plane is given; add plane: plane.yaml of alidade plane fit");
  return TargetSpace::kPlane;
}

}  // namespace

TrackingConfig read_tracking(YamlSection section, bool is_there, const std::string& config_path) {
  TrackingConfig tracking;
  if (!is_there) return tracking;
  if (const auto plane = section.text("plane"))
    tracking.plane = path_relative_to(config_path, *plane);
  TargetOptions targets = default_target_options(read_space(section, !tracking.plane.empty()));
  TargetTrackerOptions& tracker = targets.tracker;
  read_space_keys(section, &tracker);
  targets.detection_sigma_px =
      section.number("detection_sigma_px", {0.01, 1000, "px"}).value_or(targets.detection_sigma_px);
  targets.false_alarms =
      section.number("false_alarms_per_frame", {1e-6, 1000, "1"}).value_or(targets.false_alarms);
  targets.least_score = section.number("least_score", {0, 1, "1"}).value_or(targets.least_score);
  tracker.detection_probability = section.number("detection_probability", {0.01, 0.999, "1"})
                                      .value_or(tracker.detection_probability);
  const std::string association =
      section.choice("association", {"exact", "cheap", "nearest"}).value_or("exact");
  if (association == "cheap") tracker.association = AssociationMethod::kCheap;
  if (association == "nearest") tracker.association = AssociationMethod::kNearest;
  tracker.birth_looks =
      section.integer("birth_looks", {1, 32, "frames"}).value_or(tracker.birth_looks);
  tracker.birth_hits =
      section.integer("birth_hits", {1, 32, "frames"}).value_or(tracker.birth_hits);
  if (tracker.birth_hits > tracker.birth_looks) {
    section.fail(
        section.has("birth_hits") ? "birth_hits" : "birth_looks",
        fmt::format("asks for {} hits in {} looks; expected birth_hits no more than birth_looks",
                    tracker.birth_hits, tracker.birth_looks));
  }
  tracker.lose_after_s =
      section.number("lose_after_s", {0.01, 600, "s"}).value_or(tracker.lose_after_s);
  tracker.forget_after_s =
      section.number("forget_after_s", {0.01, 86400, "s"}).value_or(tracker.forget_after_s);
  if (tracker.forget_after_s < tracker.lose_after_s) {
    section.fail(
        section.has("forget_after_s") ? "forget_after_s" : "lose_after_s",
        fmt::format("forgets after {:g} s, but loses after {:g} s; expected lose_after_s no "
                    "more than forget_after_s",
                    tracker.forget_after_s, tracker.lose_after_s));
  }
  // At most 9 s, as records are kept for 10 s.
  tracker.history_s = section.number("history_s", {0, 9, "s"}).value_or(tracker.history_s);
  tracker.history_frames =
      section.integer("history_frames", {1, 500, "frames"}).value_or(tracker.history_frames);
  tracker.max_targets =
      section.integer("max_targets", {1, 500, "targets"}).value_or(tracker.max_targets);
  tracker.max_detections =
      section.integer("max_detections", {1, 500, "boxes a frame"}).value_or(tracker.max_detections);
  section.finish();
  tracking.targets = targets;
  return tracking;
}

}  // namespace alidade
