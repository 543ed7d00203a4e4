#include "test/accuracy/target_tracking.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <random>
#include <utility>

#include "test/accuracy/sky_tracking.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"
#include "test/accuracy/tracked_scene.h"

namespace alidade::test {

namespace {

constexpr double kMinutes = 1;  // of a run

const std::vector<std::string> kHeader = {"",      "MOTA %", "1 - motp %", "FN %",    "FP %",
                                          "ID SW", "FR",     "MT %",       "PT %",    "ML %",
                                          "FAF",   "IDF1 %", "HOTA %",     "SW a min"};

struct Row {
  std::string name;
  MotMetrics metrics;
  double switches_a_minute = 0;
  TrackedScene scene;
};

std::string percent(double share) { return number(100 * share, 3); }

std::vector<std::string> cells(const Row& row) {
  const MotMetrics& m = row.metrics;
  const auto objects = static_cast<double>(m.num_objects);
  const auto unique = static_cast<double>(m.num_unique_objects);
  return {row.name,
          percent(m.mota),
          percent(1 - m.motp),
          percent(static_cast<double>(m.num_misses) / objects),
          percent(static_cast<double>(m.num_false_positives) / objects),
          std::to_string(m.num_switches),
          std::to_string(m.num_fragmentations),
          percent(static_cast<double>(m.mostly_tracked) / unique),
          percent(static_cast<double>(m.partially_tracked) / unique),
          percent(static_cast<double>(m.mostly_lost) / unique),
          number(m.faf, 2),
          percent(m.idf1),
          percent(m.hota),
          number(row.switches_a_minute, 2)};
}

Row track(const std::string& name, const TargetTrackingOptions& options, TargetSceneOptions scene,
          TrackingSpace space, AssociationMethod association) {
  Row row;
  row.name = name;
  TargetTrackerOptions tracker = tracker_for(space, scene.kind);
  tracker.association = association;
  tracker.detection_probability = std::min(scene.recall, 0.99);
  scene.duration_s = 60 * kMinutes;
  for (int run = 0; run < options.runs; ++run) {
    scene.seed = options.first_seed + static_cast<std::uint64_t>(run);
    append_scene(
        track_scene(simulate_targets(scene), scene.noise_px, scene.false_alarms, space, tracker),
        &row.scene);
  }
  row.metrics = mot_metrics(row.scene.truth, row.scene.result);
  row.switches_a_minute = static_cast<double>(row.metrics.num_switches) / (kMinutes * options.runs);
  return row;
}

TargetSceneOptions scene_of(const TargetTrackingOptions& options, SceneKind kind, int targets) {
  TargetSceneOptions scene;
  scene.kind = kind;
  scene.targets = targets;
  scene.recall = options.recall;
  scene.false_alarms = options.false_alarms;
  scene.noise_px = options.noise_px;
  return scene;
}

void check(bool as_it_should, const std::string& what, std::vector<std::string>* missed) {
  if (!as_it_should) missed->push_back(what);
}

void make_poor(const TargetTrackingOptions& options, TargetSceneOptions* scene) {
  scene->noise_px = 3 * options.noise_px;
  scene->false_alarms = 10 * options.false_alarms;
  scene->recall = std::max(options.recall - 0.2, 0.1);
}

// Tables 2, 3 and 4.
void in_three_spaces(const TargetTrackingOptions& options, std::ostream& out,
                     std::vector<std::string>* missed) {
  struct Setting {
    const char* name;
    SceneKind kind;
    int targets;
    double least_mota;
    bool poor;
  };
  const Setting settings[] = {
      {"1 walker", SceneKind::kWalkers, 1, 0.95, false},
      {"2 walkers", SceneKind::kWalkers, 2, 0.92, false},
      {"3 walkers", SceneKind::kWalkers, 3, 0.90, false},
      {"3 walkers, poor detector", SceneKind::kWalkers, 3, 0, true},
      {"group of 3", SceneKind::kGroup, 3, 0.90, false},
      {"12 hockey players", SceneKind::kHockey, 12, 0.85, false},
      {"12 hockey players, poor detector", SceneKind::kHockey, 12, 0, true}};
  Table table;
  table.notes = {"A poor detector: noise x 3, false alarms x 10, recall less by 0.2."};
  table.title = "On the plane (3D) and in pixels (2D)";
  table.header = kHeader;
  for (const Setting& setting : settings) {
    TargetSceneOptions scene = scene_of(options, setting.kind, setting.targets);
    if (setting.poor) make_poor(options, &scene);
    const std::string name = setting.name;
    const Row plane =
        track(name + ", 3D", options, scene, TrackingSpace::kPlane, AssociationMethod::kExact);
    const Row mosaic = track(name + ", 2D, camera's motion taken out", options, scene,
                             TrackingSpace::kMosaic, AssociationMethod::kExact);
    const Row picture = track(name + ", 2D as seen", options, scene, TrackingSpace::kPicture,
                              AssociationMethod::kExact);
    for (const Row* row : {&plane, &mosaic, &picture}) table.rows.push_back(cells(*row));
    check(
        plane.metrics.mota >= setting.least_mota,
        name + ": MOTA " + percent(plane.metrics.mota) + " %, mark " + percent(setting.least_mota),
        missed);
    // MOTA has little left to say where nothing but the first two frames is missed.
    check(plane.metrics.hota > mosaic.metrics.hota && plane.metrics.hota > picture.metrics.hota,
          name + ": 3D is not ahead of 2D by HOTA", missed);
    if (setting.targets == 12 && !setting.poor) {
      check(plane.switches_a_minute <= 1,
            name + ": " + number(plane.switches_a_minute) + " switches a minute, mark 1", missed);
    }
  }
  table.print(out);
}

void by_association(const TargetTrackingOptions& options, std::ostream& out,
                    std::vector<std::string>* missed) {
  Table table;
  table.title = "Associations where people cross";
  table.header = kHeader;
  TargetSceneOptions clear = scene_of(options, SceneKind::kCrossing, 4);
  TargetSceneOptions hard = clear;
  make_poor(options, &hard);
  const TargetSceneOptions hockey = scene_of(options, SceneKind::kHockey, 12);
  for (const auto& [name, scene] : {std::pair<std::string, TargetSceneOptions>{"4 crossing", clear},
                                    {"4 crossing, poor detector", hard},
                                    {"12 hockey players", hockey}}) {
    const Row exact = track(name + ": exact JPDA", options, scene, TrackingSpace::kPlane,
                            AssociationMethod::kExact);
    const Row cheap = track(name + ": cheap JPDA", options, scene, TrackingSpace::kPlane,
                            AssociationMethod::kCheap);
    const Row nearest = track(name + ": nearest", options, scene, TrackingSpace::kPlane,
                              AssociationMethod::kNearest);
    for (const Row* row : {&exact, &cheap, &nearest}) table.rows.push_back(cells(*row));
    // Who is who is what an association decides; MOTA has next to nothing of it.
    check(exact.metrics.hota > nearest.metrics.hota &&
              exact.metrics.num_switches < nearest.metrics.num_switches,
          name + ": exact JPDA is not ahead of nearest neighbour by HOTA and switches", missed);
  }
  table.print(out);
}

// People who move as the filter believes: chi-square of two degrees for each.
void normalised_errors(const TargetTrackingOptions& options, std::ostream& out,
                       std::vector<std::string>* missed) {
  Table table;
  table.title = "Normalised errors squared of places, a degree of freedom";
  table.header = {"", "mean", "95 % low", "95 % high", "errors"};
  TrackedScene all;
  TargetSceneOptions scene = scene_of(options, SceneKind::kModel, 3);
  scene.duration_s = 8;
  TargetTrackerOptions tracker = tracker_for(TrackingSpace::kPlane, scene.kind);
  tracker.acceleration_density = kModelAccelerationDensity;
  for (int run = 0; run < 20 * options.runs; ++run) {
    scene.seed = options.first_seed + static_cast<std::uint64_t>(run);
    append_scene(track_scene(simulate_targets(scene), scene.noise_px, scene.false_alarms,
                             TrackingSpace::kPlane, tracker),
                 &all);
  }
  // Beyond 27.6 chance leaves one in a million: there somebody else is followed.
  std::vector<double> own;
  for (const double nees : all.last_nees) {
    if (nees <= 27.6) own.push_back(nees);
  }
  const Interval interval = mean_square_interval(2 * static_cast<int>(own.size()), 0.95);
  const double model = mean(own) / 2;
  const std::string others = std::to_string(all.last_nees.size() - own.size());
  table.rows.push_back({"as the filter believes, 3 targets, after 8 s", number(model),
                        number(interval.low), number(interval.high), std::to_string(own.size())});
  table.notes = {"Of the first row " + others +
                 " more are beyond chance: they follow somebody else."};
  check(interval.contains(model), "normalised errors squared: " + number(model), missed);
  for (const auto& [name, kind, targets] :
       {std::tuple<const char*, SceneKind, int>{"3 walkers, one a second", SceneKind::kWalkers, 3},
        {"12 hockey players, one a second", SceneKind::kHockey, 12}}) {
    const Row row = track(name, options, scene_of(options, kind, targets), TrackingSpace::kPlane,
                          AssociationMethod::kExact);
    table.rows.push_back(
        {name, number(mean(row.scene.nees) / 2), "-", "-", std::to_string(row.scene.nees.size())});
  }
  table.notes.push_back(
      "People who walk or skate do not move by white acceleration: no interval is theirs.");
  table.print(out);
}

void in_the_sky(const TargetTrackingOptions& options, std::ostream& out,
                std::vector<std::string>* missed) {
  Table table;
  table.title = "Three drones that cross the sky past the zenith";
  table.header = kHeader;
  MotMetrics metrics[2];
  std::vector<double> nees;
  for (const bool sphere : {true, false}) {
    Row row;
    row.name = sphere ? "on the sphere" : "in pixels as seen";
    SkyOptions sky;
    sky.recall = options.recall;
    sky.false_alarms = options.false_alarms;
    sky.noise_px = options.noise_px;
    sky.on_the_sphere = sphere;
    for (int run = 0; run < options.runs; ++run) {
      sky.seed = options.first_seed + static_cast<std::uint64_t>(run);
      TrackedSky tracked = track_sky(sky);
      nees.insert(nees.end(), tracked.nees.begin(), tracked.nees.end());
      TrackedScene scene;
      scene.truth = std::move(tracked.truth);
      scene.result = std::move(tracked.result);
      append_scene(scene, &row.scene);
    }
    row.metrics = mot_metrics(row.scene.truth, row.scene.result);
    row.switches_a_minute =
        static_cast<double>(row.metrics.num_switches) / (kMinutes * options.runs);
    table.rows.push_back(cells(row));
    metrics[sphere ? 0 : 1] = row.metrics;
  }
  table.notes = {"Normalised errors squared of directions, a degree of freedom, one a second: " +
                 number(mean(nees) / 2)};
  table.print(out);
  check(metrics[0].mota >= 0.9, "drones: MOTA " + percent(metrics[0].mota) + " %, mark 90", missed);
  check(metrics[0].hota > metrics[1].hota, "drones: the sphere is not ahead of pixels by HOTA",
        missed);
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// Of this thread alone: a machine that others share says nothing by its clock.
double processor_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// As many detections as may be, all within each other's gates, in each frame: the dearest step there is.
std::vector<double> crowded_steps_s(std::uint64_t seed, std::size_t* targets) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const TargetTrackerOptions options;
  TargetTracker tracker(options);
  std::vector<double> step_s;
  std::vector<TargetMeasurement> detections(static_cast<std::size_t>(options.max_detections));
  for (int k = 0; k < 200; ++k) {
    for (TargetMeasurement& detection : detections) {
      detection = {{10 * unit(random), 10 * unit(random)}, 25 * Matrix2<double>::Identity()};
    }
    TargetFrame frame;
    frame.time_s = 0.04 * k;
    frame.false_alarm_density = 1;
    frame.detections = detections.data();
    frame.count = options.max_detections;
    const double start_s = processor_time_s();
    (void)tracker.add(frame, 1e6);
    if (k >= 20) step_s.push_back(processor_time_s() - start_s);
  }
  *targets = tracker.targets().size();
  return step_s;
}

// 200 targets on a square, places measured on the plane.
void times(const TargetTrackingOptions& options, std::ostream& out,
           std::vector<std::string>* missed) {
  Table table;
  table.title = "Processor time of a step, 200 targets at 25 frames/s";
  table.header = {"", "mean ms", "p99 ms", "most ms", "late by 1 s ms", "targets"};
  for (const double side : {200.0, 60.0, 30.0}) {
    std::mt19937_64 random(options.first_seed);
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> normal;
    std::vector<Vector4<double>> people;
    for (int i = 0; i < 200; ++i) {
      people.emplace_back(side * unit(random), side * unit(random), normal(random), normal(random));
    }
    TargetTracker tracker({});
    std::vector<double> step_s;
    std::vector<double> late_s;
    std::vector<TargetMeasurement> late;
    TargetFrame frame;
    frame.view = picture_region(side, side);
    frame.false_alarm_density = 10 / (side * side);
    for (int k = 0; k < 60 * 25; ++k) {
      std::vector<TargetMeasurement> detections;
      for (Vector4<double>& person : people) {
        for (int axis = 0; axis < 2; ++axis) {
          person[axis] += 0.04 * person[axis + 2];
          if (person[axis] < 0 || person[axis] > side) {
            person[axis + 2] *= -1;
            person[axis] = std::clamp(person[axis], 0.0, side);
          }
        }
        if (unit(random) < 0.9) {
          const Vector2<double> noise(normal(random), normal(random));
          detections.push_back(
              {person.head<2>() + 0.15 * noise, 0.0225 * Matrix2<double>::Identity()});
        }
      }
      for (int i = 0; i < 10; ++i) {
        detections.push_back(
            {{side * unit(random), side * unit(random)}, 0.0225 * Matrix2<double>::Identity()});
      }
      // One frame in 50 is kept back for a second.
      const bool held = k % 50 == 10;
      if (held) late = detections;
      frame.time_s = 0.04 * k;
      frame.detections = detections.data();
      frame.count = static_cast<int>(detections.size());
      std::vector<double>* into = &step_s;
      if (held) continue;
      if (k % 50 == 35 && k > 50) {
        frame.time_s = 0.04 * (k - 25);
        frame.detections = late.data();
        frame.count = static_cast<int>(late.size());
        into = &late_s;
      }
      const double start_s = processor_time_s();
      (void)tracker.add(frame, 1e6);
      if (k >= 50) into->push_back(processor_time_s() - start_s);
    }
    const auto confirmed = std::count_if(tracker.targets().begin(), tracker.targets().end(),
                                         [](const Target& target) { return target.identity != 0; });
    const double p99 = percentile(step_s, 0.99);
    table.rows.push_back({"on " + number(side) + " m x " + number(side) + " m",
                          number(1e3 * mean(step_s)), number(1e3 * p99),
                          number(1e3 * largest(step_s)), number(1e3 * mean(late_s)),
                          std::to_string(confirmed)});
    check(p99 <= 2e-3,
          "time of a step on " + number(side) + " m: p99 " + number(1e3 * p99) + " ms, mark 2",
          missed);
  }
  std::size_t targets = 0;
  const std::vector<double> crowded_s = crowded_steps_s(options.first_seed, &targets);
  table.rows.push_back({"256 detections, each in each gate", number(1e3 * mean(crowded_s)),
                        number(1e3 * percentile(crowded_s, 0.99)), number(1e3 * largest(crowded_s)),
                        "-", std::to_string(targets)});
  table.print(out);
}

}  // namespace

std::vector<std::string> run_target_tracking(const TargetTrackingOptions& options,
                                             std::ostream& out) {
  std::vector<std::string> missed;
  const std::pair<const char*,
                  void (*)(const TargetTrackingOptions&, std::ostream&, std::vector<std::string>*)>
      tables[] = {{"spaces", in_three_spaces},
                  {"associations", by_association},
                  {"errors", normalised_errors},
                  {"sky", in_the_sky},
                  {"times", times}};
  for (const auto& [name, table] : tables) {
    if (options.only.empty() || options.only == name) table(options, out, &missed);
  }
  return missed;
}

}  // namespace alidade::test
