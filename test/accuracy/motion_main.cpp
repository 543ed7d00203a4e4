// alidade_motion_detection: what MotionDetector finds of small targets in rendered films (motion_film.h).
//   alidade_motion_detection --only speeds --keep DIR
// A target is found by a box whose centre is within half of its size, at least 4 px; each box finds one. Counted from a second after the beginning
// on, wherever a target is in the picture, whether it was seen before or not.
// Exit status: 0 all figures are as they should be, 1 some are not (listed last), 2 wrong usage.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <ctime>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/detection/motion_detector.h"
#include "test/accuracy/motion_film.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

constexpr double kWarmUp_s = 1;

struct Tally {
  int frames = 0, not_ok = 0;
  int targets = 0, found = 0, false_alarms = 0;
  double covered = 0, cpu_s = 0, spread = 0, shift_px = 0, miss_px = 0;
  std::vector<DetectionBox> alarms;  // false ones

  void add(const Tally& other) {
    frames += other.frames;
    not_ok += other.not_ok;
    targets += other.targets;
    found += other.found;
    false_alarms += other.false_alarms;
    covered += other.covered;
    cpu_s += other.cpu_s;
    miss_px += other.miss_px;
    spread = std::max(spread, other.spread);
    shift_px = std::max(shift_px, other.shift_px);
  }
};

double cpu_now_s() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void judge(const std::vector<DetectionBox>& boxes, std::vector<TrueTarget> truth, Tally* tally) {
  std::vector<bool> taken(truth.size());
  for (const DetectionBox& box : boxes) {
    const Eigen::Vector2d centre(box.u + box.width / 2, box.v + box.height / 2);
    double nearest = 1e9;
    std::size_t which = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const double distance = (truth[i].centre - centre).norm();
      if (distance < nearest && !(taken[i] && truth[i].counts)) {
        nearest = distance;
        which = i;
      }
    }
    const bool matches = !truth.empty() && nearest <= std::max(4.0, truth[which].size_px / 2);
    // One that does not count may be found in parts.
    const bool excused = std::any_of(truth.begin(), truth.end(), [&](const TrueTarget& target) {
      return !target.counts && (target.centre - centre).norm() < target.size_px + 30;
    });
    if (matches) {
      if (truth[which].counts) {
        ++tally->found;
        tally->miss_px += nearest;
      }
      taken[which] = true;
    } else if (!excused) {
      ++tally->false_alarms;
      tally->alarms.push_back(box);
    }
  }
  for (const TrueTarget& target : truth) tally->targets += target.counts ? 1 : 0;
}

// Boxes white, true targets circles: those that count black.
void show(const cv::Mat& image, const std::vector<DetectionBox>& boxes,
          const std::vector<TrueTarget>& truth, const std::filesystem::path& file) {
  cv::Mat shown = image.clone();
  for (const TrueTarget& target : truth) {
    cv::circle(shown, {cvRound(target.centre.x()), cvRound(target.centre.y())},
               cvRound(target.size_px) + 8, target.counts ? 0 : 128, 1);
  }
  for (const DetectionBox& box : boxes) {
    const cv::Rect2d around(box.u - 4, box.v - 4, box.width + 8, box.height + 8);
    cv::rectangle(shown, around, 255, 1);
    cv::putText(shown, number(box.score, 2), {cvRound(around.x), cvRound(around.y) - 3},
                cv::FONT_HERSHEY_PLAIN, 1, 255);
  }
  std::filesystem::create_directories(file.parent_path());
  cv::imwrite(file.string(), shown);
}

Tally run(const MotionFilmPlan& plan, const MotionOptions& options,
          const std::filesystem::path& kept, const std::filesystem::path& shown) {
  const MotionFilm film(plan, kept);
  MotionDetector detector(options);
  Tally tally;
  for (int i = 0; i < film.size(); ++i) {
    const cv::Mat image = film.image(i);
    const FrameOrientation orientation = film.orientation(i);
    const double before = cpu_now_s();
    const MotionAnswer answer = detector.find(view_of(image), orientation);
    const double took = cpu_now_s() - before;
    if (film.time_s(i) < kWarmUp_s) continue;
    ++tally.frames;
    tally.cpu_s += took;
    tally.covered += answer.covered;
    tally.spread = std::max(tally.spread, answer.spread);
    tally.shift_px = std::max(tally.shift_px, answer.shift_px);
    if (answer.status != MotionStatus::kOk) ++tally.not_ok;
    judge(detector.boxes(), film.truth(i), &tally);
    for (const DetectionBox& box : tally.alarms) {
      std::cerr << plan.name << ", frame " << i << ": false alarm at " << box.u << ", " << box.v
                << ", " << box.width << " x " << box.height << " px, " << number(box.score)
                << " sigmas, spread " << answer.spread << "\n";
    }
    tally.alarms.clear();
    if (!shown.empty()) {
      show(image, detector.boxes(), film.truth(i),
           shown / (plan.name + "_" + std::to_string(i) + ".png"));
    }
  }
  return tally;
}

struct Scene {
  std::string name;
  std::filesystem::path photo;
};

struct Study {
  std::filesystem::path kept, shown;
  std::vector<Scene> scenes;
  MotionOptions options;
  MotionFilmPlan plan;
  std::vector<std::string> missed;
};

std::string film_name(const Scene& scene, const MotionFilmPlan& plan) {
  return scene.name + (plan.back_and_forth ? "_cosine_" : "_pan_") + number(plan.fields_per_second);
}

std::vector<std::string> row(const std::string& what, const Tally& t) {
  return {what,
          number(static_cast<double>(t.found) / t.targets),
          number(static_cast<double>(t.false_alarms) / t.frames, 2),
          std::to_string(t.targets),
          std::to_string(t.frames),
          std::to_string(t.not_ok),
          number(t.covered / t.frames, 2),
          number(t.spread, 2),
          number(t.shift_px, 2),
          number(t.miss_px / std::max(t.found, 1), 2),
          number(1e3 * t.cpu_s / t.frames, 3)};
}

const std::vector<std::string> kHeader = {
    "film",    "recall", "false alarms/frame", "targets", "frames", "not ok",
    "covered", "spread", "shift px",           "off px",  "CPU ms"};

Tally add(Study* study, Table* table, const std::string& what, MotionFilmPlan plan) {
  Tally sum;
  for (const Scene& scene : study->scenes) {
    plan.photo = scene.photo;
    plan.name = film_name(scene, plan);
    const Tally t = run(plan, study->options, study->kept, study->shown);
    table->rows.push_back(row(what + ", " + scene.name, t));
    std::cerr << table->rows.back()[0] << " " << table->rows.back()[1] << " "
              << table->rows.back()[2] << " " << table->rows.back()[10] << "ms\n";
    sum.add(t);
  }
  table->rows.push_back(row(what + ", all", sum));
  return sum;
}

void require_mark(Study* study, const std::string& what, const Tally& t) {
  const double recall = static_cast<double>(t.found) / t.targets;
  const double alarms = static_cast<double>(t.false_alarms) / t.frames;
  if (recall < 0.9) study->missed.push_back(what + ": recall " + number(recall));
  if (alarms > 0.1) study->missed.push_back(what + ": " + number(alarms) + " false alarms a frame");
}

void run_speeds(Study* study, const std::vector<double>& speeds) {
  Table table{"Pan speeds, fields of view a second; " + number(study->plan.size_px) +
                  " px, contrast " + number(study->plan.contrast),
              kHeader,
              {},
              {}};
  for (const double speed : speeds) {
    MotionFilmPlan plan = study->plan;
    plan.fields_per_second = speed;
    const Tally sum = add(study, &table, number(speed), plan);
    if (speed == 0.5) require_mark(study, "half a field of view a second", sum);
  }
  MotionFilmPlan plan = study->plan;
  plan.back_and_forth = true;
  add(study, &table, "cosine, 0.5 at most", plan);
  table.print(std::cout);
}

void run_targets(Study* study) {
  Table table{"Targets, at half a field of view a second", kHeader, {}, {}};
  for (const double size : {4.0, 8.0, 16.0, 32.0}) {
    for (const double contrast : {10.0, 20.0, 40.0}) {
      MotionFilmPlan plan = study->plan;
      plan.size_px = size;
      plan.contrast = contrast;
      const std::string what = number(size) + " px, contrast " + number(contrast);
      const Tally sum = add(study, &table, what, plan);
      if (size == 8 || size == 16) require_mark(study, what, sum);
    }
  }
  table.print(std::cout);
}

void run_sizes(Study* study, int seeds) {
  Table table{"Sizes, at half a field of view a second; contrast " + number(study->plan.contrast),
              kHeader,
              {},
              {}};
  for (const double size : {8.0, 16.0, 32.0}) {
    Tally sum;
    MotionFilmPlan plan = study->plan;
    plan.size_px = size;
    const std::string what = number(size) + " px";
    for (int i = 0; i < seeds; ++i) {
      sum.add(add(study, &table, what + ", seed " + std::to_string(plan.seed), plan));
      ++plan.seed;
    }
    table.rows.push_back(row(what + ", all seeds", sum));
    require_mark(study, what, sum);
  }
  table.print(std::cout);
}

void run_errors(Study* study) {
  Table table{"Errors of orientation, px, at half a field of view a second", kHeader, {}, {}};
  for (const double sigma : {0.0, 0.05, 0.2, 0.5, 1.0}) {
    MotionFilmPlan plan = study->plan;
    plan.sigma_orientation_px = sigma;
    add(study, &table, number(sigma), plan);
  }
  table.print(std::cout);
}

void run_noise(Study* study) {
  Table table{"Noise, grey levels, and JPEG, at half a field of view a second", kHeader, {}, {}};
  for (const double noise : {0.5, 2.0, 5.0}) {
    for (const int quality : {0, 95, 85, 70}) {
      MotionFilmPlan plan = study->plan;
      plan.noise = noise;
      plan.jpeg_quality = quality;
      add(study, &table,
          number(noise) + ", " + (quality == 0 ? "no JPEG" : "JPEG " + std::to_string(quality)),
          plan);
    }
  }
  table.print(std::cout);
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  using namespace alidade::test;
  CLI::App app("Detection of small targets that move while the camera pans, in rendered films");
  Study study;
  std::string only;
  std::vector<std::string> photos;
  std::vector<double> speeds{0, 0.25, 0.5, 1};
  int seeds = 4;
  const std::string data = ALIDADE_TEST_DATA;
  app.add_option("--only", only, "one table")
      ->check(CLI::IsMember({"speeds", "targets", "sizes", "errors", "noise"}));
  app.add_option("--keep", study.kept, "folder for rendered frames, which are made once")
      ->required();
  app.add_option("--show", study.shown,
                 "folder for pictures with what was found and what was there");
  app.add_option("--speed", speeds, "of the table of speeds, fields of view a second");
  app.add_option("--photo", photos, "scenes in place of the usual three");
  app.add_option("--duration", study.plan.duration_s, "of a film, s");
  app.add_option("--seed", study.plan.seed, "of targets and noise");
  app.add_option("--seeds", seeds, "of the table of sizes, from --seed on")
      ->check(CLI::PositiveNumber);
  app.add_option("--size", study.plan.size_px, "of targets, px");
  app.add_option("--contrast", study.plan.contrast, "of targets, grey levels");
  app.add_option("--threshold", study.options.change.threshold, "of the detector, sigmas");
  app.add_option("--alignment", study.options.sigma_alignment_px, "that it forgives, px");
  app.add_option("--blur", study.options.sigma_blur_px2, "that it forgives, px^2");
  app.add_option("--spacing", study.options.spacing_s, "of its earlier pictures, s");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const char* problem = nullptr;
  if (!study.options.validate(&problem)) {
    std::cerr << "alidade_motion_detection: " << problem << "\n";
    return 2;
  }
  if (photos.empty()) {
    study.scenes = {{"picos", data + "/picosdeeuropa_by_Aitzol_Berasategi.jpg"},
                    {"leaves", data + "/life_by_Aitzol_Berasategi.jpg"},
                    {"generated", {}}};
  }
  for (const std::string& photo : photos) {
    study.scenes.push_back({std::filesystem::path(photo).stem().string(), photo});
  }
  if (only.empty() || only == "speeds") run_speeds(&study, speeds);
  if (only.empty() || only == "targets") run_targets(&study);
  if (only.empty() || only == "sizes") run_sizes(&study, seeds);
  if (only.empty() || only == "errors") run_errors(&study);
  if (only.empty() || only == "noise") run_noise(&study);
  for (const std::string& what : study.missed) std::cout << "MISSED: " << what << "\n";
  return study.missed.empty() ? 0 : 1;
}
