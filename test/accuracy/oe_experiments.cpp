#include "test/accuracy/oe_experiments.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include "test/accuracy/oe_image.h"

namespace alidade::test {
namespace {

// Only where the read-out takes time can it be told from none.
bool reads_out(const RecordingPlan& plan) { return plan.config.camera.line_delay != 0; }

std::vector<RecordingPlan> plans_of(const OeExperimentOptions& options) {
  std::vector<RecordingPlan> plans =
      latin_square(options.scenes, options.fields_per_second, options.size);
  std::vector<RecordingPlan> chosen;
  for (RecordingPlan& plan : plans) {
    plan.config.telemetry.sigma *= options.telemetry_sigma_px;
    if (plan.name.find(options.only) != std::string::npos) chosen.push_back(plan);
  }
  return chosen;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

double share_in_oe(const Evaluation& evaluation) {
  int in_oe = 0;
  int judged = 0;
  for (const FrameEvaluation& frame : evaluation.frames) {
    if (frame.frame < kWarmUpFrames) continue;
    ++judged;
    in_oe += frame.mode == OrientationMode::kOe ? 1 : 0;
  }
  return judged > 0 ? static_cast<double>(in_oe) / judged : 0;
}

double mean_of(const Evaluation& evaluation, int OeStatistics::*count) {
  std::vector<double> values;
  for (const FrameEvaluation& frame : evaluation.frames) {
    if (frame.frame >= kWarmUpFrames) values.push_back(frame.statistics.*count);
  }
  return mean(values);
}

std::string interval_text(const Interval& interval) {
  return "[" + number(interval.low, 2) + ", " + number(interval.high, 2) + "]";
}

nlohmann::json frames_json(const Evaluation& evaluation) {
  nlohmann::json all = nlohmann::json::array();
  for (const FrameEvaluation& frame : evaluation.frames) {
    Eigen::Vector2d error = Eigen::Vector2d::Zero();
    double square = 0;
    double normalised = 0;
    for (const PointError& point : frame.errors) {
      error += point.px / kGridPoints;
      square += point.px.squaredNorm() / kGridPoints;
      normalised += point.normalised_square() / (2 * kGridPoints);
    }
    const Eigen::Vector2d offset =
        frame.J_angle[kGridPoints / 2] * frame.statistics.map_offset.vector();
    all.push_back({{"frame", frame.frame},
                   {"mode", to_string(frame.mode)},
                   {"status", static_cast<int>(frame.statistics.status)},
                   {"error_u_px", error.x()},
                   {"error_v_px", error.y()},
                   {"rms_px", std::sqrt(square)},
                   {"map_offset_u_px", offset.x()},
                   {"map_offset_v_px", offset.y()},
                   {"nees", normalised},
                   {"sigma_px", frame.sigma_px},
                   {"speed", frame.speed},
                   {"acceleration", frame.acceleration},
                   {"fine_visible", frame.statistics.fine_visible},
                   {"chosen", frame.statistics.chosen},
                   {"found", frame.statistics.found},
                   {"inliers", frame.statistics.inliers},
                   {"coarse_shift_px", frame.statistics.coarse_shift_px},
                   {"process_ms", frame.process_s * 1e3},
                   {"maintain_ms", frame.maintain_s * 1e3}});
  }
  return all;
}

// Root mean squares of a subset of the errors.
class Split {
 public:
  Split(Table* table, std::string name) : table_(table), name_(std::move(name)) {}

  template <class Class>
  void by(const std::string& what, const ErrorSet& errors,
          const std::vector<std::string>& class_names, const Class& class_of) {
    std::vector<ErrorSet> classes(class_names.size());
    for (std::size_t n = 0; n < errors.px.size(); ++n) {
      ErrorSet& set = classes[class_of(*errors.frame[n], errors.point[n])];
      set.px.push_back(errors.px[n]);
    }
    for (std::size_t i = 0; i < classes.size(); ++i) {
      Eigen::Vector2d sum = Eigen::Vector2d::Zero();
      for (const Eigen::Vector2d& px : classes[i].px) sum += px;
      const auto count = static_cast<double>(std::max<std::size_t>(1, classes[i].px.size()));
      table_->rows.push_back({name_, what + " " + class_names[i],
                              std::to_string(classes[i].px.size() / kGridRows / kGridColumns),
                              number(rms(classes[i])), number(sum.x() / count),
                              number(sum.y() / count)});
    }
  }

 private:
  Table* table_;
  std::string name_;
};

void add_details(const std::string& name, const Evaluation& evaluation, Table* octaves,
                 Table* splits) {
  for (std::size_t i = 0; i < evaluation.octaves.size(); ++i) {
    const OctaveEvaluation& octave = evaluation.octaves.at(i);
    if (octave.observations == 0) continue;
    octaves->rows.push_back({name, std::to_string(i), std::to_string(octave.observations),
                             number(static_cast<double>(octave.inliers) / octave.observations),
                             number(static_cast<double>(octave.edges) / octave.observations),
                             number(octave.residual_rms_px), number(octave.claimed_rms_px),
                             number(octave.scatter_rms_px)});
  }
  const ErrorSet errors = without_common_offset(map_errors_of(evaluation));
  Split split(splits, name);
  split.by("row", errors, {"1", "2", "3", "4", "5"}, [](const FrameEvaluation&, int point) {
    return static_cast<std::size_t>(point / kGridColumns);
  });
  split.by("fields/s", errors, {"< 0.01", "< 0.33", "< 0.67", "more"},
           [](const FrameEvaluation& frame, int) {
             return frame.speed < 0.01   ? std::size_t{0}
                    : frame.speed < 0.33 ? std::size_t{1}
                    : frame.speed < 0.67 ? std::size_t{2}
                                         : std::size_t{3};
           });
  split.by("fields/s^2", errors, {"< 1", "< 3", "more"}, [](const FrameEvaluation& frame, int) {
    return frame.acceleration < 1   ? std::size_t{0}
           : frame.acceleration < 3 ? std::size_t{1}
                                    : std::size_t{2};
  });
}

// Frames after the disturbance that were not in OE mode, up to the first that was; -1: none was.
int frames_to_return(const Evaluation& evaluation, double from_s) {
  const auto after = frames_between(evaluation, from_s, 1e9);
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (after[i]->mode == OrientationMode::kOe) return static_cast<int>(i);
  }
  return -1;
}

std::string share_of_modes(const std::vector<const FrameEvaluation*>& frames) {
  int in_oe = 0;
  for (const FrameEvaluation* frame : frames) in_oe += frame->mode == OrientationMode::kOe ? 1 : 0;
  return std::to_string(in_oe) + "/" + std::to_string(frames.size());
}

}  // namespace

std::vector<Scene> repository_scenes() {
  const std::filesystem::path data = ALIDADE_TEST_DATA;
  return {{"picos", data / "picosdeeuropa_by_Aitzol_Berasategi.jpg"},
          {"aitzgorri", data / "aitzgorri_by_Aitzol_Berasategi.jpg"}};
}

void run_oe_accuracy(const OeExperimentOptions& options, Report* report, nlohmann::json* frames) {
  Table accuracy;
  accuracy.title = "Error of a pixel's direction, px (root mean square of the length)";
  accuracy.header = {"recording", "noise",     "OE",      "landmarks",     "PT",   "OE",
                     "- offset",  "in map",    "claimed", "constant rate", "NEES", "95 %",
                     "frames",    "> 5 sigma", "delay 0", "times"};
  accuracy.notes = {
      "OE: share of the frames, then the error; '- offset': one common change of pan and tilt "
      "taken out",
      "in map: likewise, and the estimated offset of the map against telemetry undone, frame by "
      "frame",
      "claimed: median of the reported sigma (of one axis, absolute). constant rate: the least it "
      "would leave",
      "frames: independent ones that tell as much of NEES as these correlated ones",
      "delay 0: in map, with the line delay taken as 0; times: that over 'in map'"};
  Table times;
  times.title = "CPU time, ms, and memory";
  times.header = {"recording", "process p50", "p99", "max", "maintain p50",
                  "p99",       "max",         "map", "MiB"};
  Table octaves;
  octaves.title = "Landmarks by octave (px of the image, length)";
  octaves.header = {"recording", "octave",   "seen",    "inliers",
                    "edges",     "residual", "claimed", "scatter"};
  Table splits;
  splits.title = "Error 'in map' by";
  splits.header = {"recording", "class", "frames' worth", "rms", "mean u", "mean v"};

  for (const RecordingPlan& plan : plans_of(options)) {
    const RenderedRecording recording(plan.name, plan.config, options.cache);
    EvaluationOptions how;
    how.oe = options.oe;
    how.passes = options.warm ? 2 : 1;
    for (const FrameNoise noise : {FrameNoise::kSensorAndJpeg, FrameNoise::kNone}) {
      const bool noisy = noise == FrameNoise::kSensorAndJpeg;
      const std::vector<cv::Mat> images = recording.images(noise);
      const Evaluation evaluation = evaluate(recording, images, recording.calibration(), how);
      const std::string name = plan.name + (noisy ? "" : " clean");
      const double in_map = rms(without_common_offset(map_errors_of(evaluation)));
      const Honesty honesty = honesty_of(frames_between(evaluation, recording.time(kWarmUpFrames),
                                                        recording.time(recording.size())));
      std::vector<double> claimed;
      std::vector<double> process;
      std::vector<double> maintain;
      for (const FrameEvaluation& frame : evaluation.frames) {
        if (frame.frame < kWarmUpFrames) continue;
        claimed.push_back(frame.sigma_px);
        process.push_back(frame.process_s * 1e3);
        maintain.push_back(frame.maintain_s * 1e3);
      }
      std::string delay_zero = "-";
      std::string factor = "-";
      if (noisy && reads_out(plan)) {
        Calibration without_delay = recording.calibration();
        without_delay.line_delay = 0;
        const Evaluation worse = evaluate(recording, images, without_delay, how);
        const double error = rms(without_common_offset(map_errors_of(worse)));
        delay_zero = number(error);
        factor = number(error / in_map, 2);
        if (!(error >= kLineDelayFactor * in_map)) {
          report->fail(name + ": the line delay makes " + factor + " times the difference");
        }
      }
      accuracy.rows.push_back(
          {plan.name, noisy ? "yes" : "no", number(share_in_oe(evaluation)),
           number(mean_of(evaluation, &OeStatistics::inliers)),
           number(rms(pt_errors_of(evaluation))), number(rms(errors_of(evaluation))),
           number(rms(without_common_offset(errors_of(evaluation)))), number(in_map),
           number(median(claimed)),
           number(rms(without_common_offset(constant_rate_errors_of(evaluation)))),
           number(honesty.nees), interval_text(honesty.interval), number(honesty.independent, 2),
           std::to_string(honesty.beyond_five_sigmas), delay_zero, factor});
      times.rows.push_back({name, number(median(process)), number(quantile(process, 0.99)),
                            number(largest(process)), number(median(maintain)),
                            number(quantile(maintain, 0.99)), number(largest(maintain)),
                            std::to_string(evaluation.map_size),
                            number(static_cast<double>(evaluation.memory_bytes) / (1 << 20))});
      const double bound = noisy ? kErrorBoundPx : kCleanErrorBoundPx;
      if (!(in_map <= bound)) {
        report->fail(name + ": " + number(in_map) + " px in the map's frame, bound " +
                     number(bound));
      }
      if (!(share_in_oe(evaluation) > 0)) report->fail(name + ": never in OE mode");
      if (honesty.beyond_five_sigmas > 0) {
        report->fail(name + ": " + std::to_string(honesty.beyond_five_sigmas) +
                     " frames beyond five sigmas");
      }
      if (!(honesty.nees <= honesty.interval.high)) {
        report->fail(name + ": NEES " + number(honesty.nees));
      }
      if (options.details) add_details(name, evaluation, &octaves, &splits);
      (*frames)[name] = frames_json(evaluation);
    }
  }
  report->add(accuracy);
  report->add(times);
  if (options.details) {
    report->add(octaves);
    report->add(splits);
  }
}

void run_oe_robustness(const OeExperimentOptions& options, Report* report, nlohmann::json* frames) {
  Table table;
  table.title = "What goes wrong in life";
  table.header = {"disturbance",  "in OE: before", "during",     "after",
                  "NEES: before", "during",        "after",      "worst / sigma",
                  "> 5 sigma",    "frames to OE",  "in map, px", "PT, px"};
  table.notes = {
      "NEES and sigmas are those of the absolute direction; frames to OE: after the disturbance, "
      "of PT mode"};
  for (const Disturbance& disturbance : disturbances(options.scenes.front(), options.size)) {
    if (disturbance.name.find(options.only) == std::string::npos) continue;
    simulator::Config config = disturbance.config;
    config.telemetry.sigma *= options.telemetry_sigma_px;
    const RenderedRecording recording("robustness", config, options.cache);
    EvaluationOptions how;
    how.oe = options.oe;
    how.disturbance = &disturbance;
    const Evaluation evaluation = evaluate(recording, recording.images(FrameNoise::kSensorAndJpeg),
                                           recording.calibration(), how);
    const double end = recording.time(recording.size());
    const auto before = frames_between(evaluation, 0, disturbance.from);
    const auto during = frames_between(evaluation, disturbance.from, disturbance.to);
    const auto after = frames_between(evaluation, disturbance.to, end);
    const auto nees = [](const auto& part) {
      const Honesty honesty = honesty_of(part);
      return honesty.frames > 0 ? number(honesty.nees) + " " + interval_text(honesty.interval)
                                : "-";
    };
    const Honesty all = honesty_of(frames_between(evaluation, 0, end));
    const int frames_lost = frames_to_return(evaluation, disturbance.to);
    const bool returns = !after.empty();
    table.rows.push_back({disturbance.name, share_of_modes(before), share_of_modes(during),
                          share_of_modes(after), nees(before), nees(during), nees(after),
                          number(all.worst_sigmas), std::to_string(all.beyond_five_sigmas),
                          !returns          ? "-"
                          : frames_lost < 0 ? "never"
                                            : std::to_string(frames_lost),
                          number(rms(without_common_offset(map_errors_of(evaluation)))),
                          number(rms(pt_errors_of(evaluation)))});
    if (disturbance.honest && all.beyond_five_sigmas > 0) {
      report->fail(disturbance.name + ": " + std::to_string(all.beyond_five_sigmas) +
                   " frames beyond five sigmas");
    }
    if (returns && (frames_lost < 0 || frames_lost > kFramesToReturn)) {
      report->fail(disturbance.name + ": not back in OE mode within " +
                   std::to_string(kFramesToReturn) + " frames");
    }
    (*frames)[disturbance.name] = frames_json(evaluation);
  }
  report->add(table);
}

cv::Mat image_of(const OeExperimentOptions& options, int frame) {
  const std::vector<RecordingPlan> plans = plans_of(options);
  if (plans.empty()) return {};
  const RenderedRecording recording(plans.front().name, plans.front().config, options.cache);
  EvaluationOptions how;
  how.oe = options.oe;
  cv::Mat drawn;
  how.look = [&](int number, const cv::Mat& image, const OeMode& oe) {
    if (number == frame) drawn = draw_landmarks(image, oe);
  };
  const Evaluation evaluation = evaluate(recording, recording.images(FrameNoise::kSensorAndJpeg),
                                         recording.calibration(), how);
  return drawn;
}

}  // namespace alidade::test
