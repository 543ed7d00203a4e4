// alidade_endurance: a virtual hour, faster than real time, with a drifting clock, zoom changes, a bump and lost
// connections; each record held against the truth (endurance_judge.h).
//   alidade_endurance [--camera-bump] [--small] [--json FILE] [--plot FILE.html]     (README.md)
// Exit status: 0 all that is asked holds, 1 it does not (listed last), 2 wrong usage, unreadable files.

#include <CLI/CLI.hpp>
#include <chrono>
#include <fstream>
#include <future>
#include <iostream>

#include "core/model/direction.h"
#include "test/accuracy/endurance_consumer.h"
#include "test/accuracy/endurance_day.h"
#include "test/accuracy/endurance_judge.h"
#include "test/accuracy/resident_memory.h"

namespace alidade::test {
namespace {

constexpr std::size_t kBatch = 64;  // frames rendered before they are looked at

constexpr double kZoomTolerance = 2;  // device units: 0.04 % of the focal length
// Beyond what was in memory when a quarter of the day was over. Records kept for the report are up to 8 MiB of it, the
// rest is what the allocator cannot give back.
constexpr double kGrowthMib = 32;

OrientationStepOptions step_options(const VirtualDay& day) {
  OrientationStepOptions options;
  options.video_clock.stamp_resolution_s = 1.0 / 90000;
  options.telemetry_noise.pan_tilt_sigma = day.telemetry_sigma();
  options.telemetry_noise.acceleration_sigma = day.acceleration_sigma();
  options.telemetry_limits.max_repeat_s = 0;
  options.zoom_tolerance = kZoomTolerance;
  options.oe = oe_options(day.calibration(0).camera);
  return options;
}

// What the manufacturer says of the wide end: a few per cent off, and nothing of lens and axes.
Calibration data_sheet(const VirtualDay& day) {
  constexpr double kAxisSigma = 0.05;        // rad
  constexpr double kClockOffsetSigma = 0.1;  // s
  Calibration calibration;
  calibration.camera.focal_length = 1400.0 * day.plan().width / 480;
  calibration.camera.width = day.plan().width;
  calibration.camera.height = day.plan().height;
  for (const Parameter axis :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    calibration.covariance(index(axis), index(axis)) = kAxisSigma * kAxisSigma;
  }
  calibration.covariance(index(Parameter::kClockOffset), index(Parameter::kClockOffset)) =
      kClockOffsetSigma * kClockOffsetSigma;
  return calibration;
}

// As `alidade run` begins: with the data sheet, or, known, with the truth and nothing to calibrate.
EnduranceConsumer make_consumer(const VirtualDay& day, bool known) {
  OrientationStepOptions step = step_options(day);
  step.calibration = known ? day.calibration(0) : data_sheet(day);
  step.calibrated = known;
  if (known) return {step, std::nullopt};
  step.follow_points = true;
  SelfCalibrationOptions calibrating;
  calibrating.data_sheet = step.calibration;
  calibrating.noise.pan_tilt_sigma_rad = day.telemetry_sigma();
  calibrating.zoom_tolerance = kZoomTolerance;
  return {step, calibrating};
}

// The images of a day, some frames ahead.
class Images {
 public:
  Images(const VirtualDay& day, std::size_t threads)
      : day_(day),
        threads_(threads),
        size_(static_cast<std::size_t>(day.plan().width * day.plan().height)),
        bytes_(kBatch * size_) {}

  // Asked for frame after frame.
  ImageView of(std::size_t frame) {
    if (frame % kBatch == 0) render(frame);
    const std::uint8_t* image = bytes_.data() + frame % kBatch * size_;
    return {image, day_.plan().width, day_.plan().height, day_.plan().width};
  }

 private:
  void render(std::size_t first) {
    const std::size_t end = std::min(first + kBatch, day_.frames().size());
    std::vector<std::future<void>> workers;
    for (std::size_t n = 0; n < threads_; ++n) {
      workers.push_back(std::async(std::launch::async, [this, first, end, n] {
        for (std::size_t i = first + n; i < end; i += threads_) {
          day_.render(i, bytes_.data() + (i - first) * size_);
        }
      }));
    }
    for (auto& worker : workers) worker.get();
  }

  const VirtualDay& day_;
  std::size_t threads_, size_;
  std::vector<std::uint8_t> bytes_;
};

struct Options {
  bool small = false;
  bool camera_bump = false;
  bool known = false;
  bool narrow = false;
  bool unsuitable = false;
  bool coarse = false;
  std::size_t threads = 2;
  double minutes = 0;
  std::uint64_t seed = 1;
  std::string json, plot;
};

DayPlan plan_of(const Options& options) {
  DayPlan plan = options.small ? small_day_plan()
                               : hour_plan(options.camera_bump ? DayPlan::Bump::Kind::kCamera
                                                               : DayPlan::Bump::Kind::kBase);
  plan.seed = options.seed;
  if (options.minutes > 0) plan.duration_s = std::min(plan.duration_s, 60 * options.minutes);
  if (options.coarse) make_coarse(&plan);
  if (options.known) plan.zooms.clear();
  if (options.narrow) plan.zooms = {{-2 * VirtualDay::kZoomRamp, 1}};
  return plan;
}

// Lets the consumer live through the day; look is called with each frame's answer.
template <class Look>
void live(const VirtualDay& day, std::size_t threads, EnduranceConsumer* consumer,
          const Look& look) {
  Images images(day, threads);
  for (const DayEvent& event : day.events()) {
    switch (event.kind) {
      case DayEvent::Kind::kSample:
        consumer->add(day.samples()[event.index]);
        break;
      case DayEvent::Kind::kTelemetryLost:
        consumer->telemetry_lost();
        break;
      case DayEvent::Kind::kVideoLost:
        consumer->video_lost(event.host_time_s);
        break;
      case DayEvent::Kind::kFrame:
        look(event.index, consumer->add(day.frames()[event.index], images.of(event.index)));
        break;
    }
    for (const std::string& message : consumer->take_messages()) {
      std::cout << number(event.host_time_s - VirtualDay::kHostEpoch, 6) << " s: " << message
                << std::endl;
    }
  }
}

// Errors of a calibration in its own sigmas; of an axis the worse of its two components.
std::vector<std::string> errors_in_sigmas(const Calibration& found, const Calibration& truth) {
  const auto sigma = [&](Parameter p) { return std::sqrt(found.covariance(index(p), index(p))); };
  const auto of = [&](double error, Parameter p) { return number(error / sigma(p)); };
  const auto of_axis = [&](const Vector2<double>& error, Parameter first, Parameter second) {
    return number(std::max(std::abs(error[0]) / sigma(first), std::abs(error[1]) / sigma(second)));
  };
  return {of(found.camera.focal_length - truth.camera.focal_length, Parameter::kFocalLength),
          of(found.camera.distortion.radial - truth.camera.distortion.radial,
             Parameter::kRadialDistortion),
          of(found.line_delay - truth.line_delay, Parameter::kLineDelay),
          of(found.clock_offset - truth.clock_offset, Parameter::kClockOffset),
          of_axis(direction_minus(truth.mechanics.pan_axis, found.mechanics.pan_axis),
                  Parameter::kPanAxis0, Parameter::kPanAxis1),
          of_axis(direction_minus(truth.mechanics.tilt_axis, found.mechanics.tilt_axis),
                  Parameter::kTiltAxis0, Parameter::kTiltAxis1)};
}

void run_day(const Options& options, Report* report, nlohmann::json* series) {
  const auto begin = std::chrono::steady_clock::now();
  const VirtualDay day(plan_of(options), ALIDADE_TEST_DATA);
  EnduranceConsumer consumer = make_consumer(day, options.known);
  EnduranceJudge judge_of_day(day.marks());
  const double start_mib = resident_mib();
  double first_mib = 0;
  double most_mib = 0;
  Table taken_over;
  taken_over.title = "Calibrations taken over: errors in their own sigmas";
  taken_over.header = {"at, s", "f", "k", "line delay", "d", "pan axis", "tilt axis"};
  int published = 0;
  live(day, options.threads, &consumer, [&](std::size_t frame, const Answer& answer) {
    judge_of_day.add(judge(day, frame, answer));
    if (std::exchange(published, consumer.published()) != consumer.published()) {
      std::vector<std::string> row{number(day.time(frame), 5)};
      const auto errors = errors_in_sigmas(consumer.calibration(), day.calibration(frame));
      row.insert(row.end(), errors.begin(), errors.end());
      taken_over.rows.push_back(row);
    }
    most_mib = std::max(most_mib, resident_mib());
    if (day.time(frame) < day.plan().duration_s / 4) first_mib = most_mib;
  });
  if (!options.known) report->add(taken_over);
  judge_of_day.report(report);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  Table cost;
  cost.title = day.plan().name + ": " + std::to_string(day.frames().size()) + " frames, " +
               std::to_string(consumer.published()) + " calibrations taken over";
  cost.header = {"", "at the start", "most, first quarter", "most", "at the end"};
  cost.rows.push_back({"resident, MiB", number(start_mib, 4), number(first_mib, 4),
                       number(most_mib, 4), number(resident_mib(), 4)});
  cost.notes = {number(seconds) + " s on the clock"};
  report->add(cost);
  if (most_mib > first_mib + kGrowthMib) report->fail("memory grows");
  if (!options.json.empty()) *series = judge_of_day.to_json();
  if (!options.plot.empty()) judge_of_day.write_plot(options.plot, day.plan().name);
}

void run_unsuitable(const Options& options, Report* report) {
  Table table;
  table.title = "Minutes that no calibration can be made of";
  table.header = {"", "published", "needs", "expected"};
  for (const UnsuitableDay& unsuitable : unsuitable_days()) {
    const VirtualDay day(unsuitable.plan, ALIDADE_TEST_DATA);
    EnduranceConsumer consumer = make_consumer(day, false);
    int claimed = 0;
    live(day, options.threads, &consumer,
         [&](std::size_t, const Answer& answer) { claimed += answer.record.calibrated ? 1 : 0; });
    const CalibrationNeed need = consumer.report().need;
    table.rows.push_back({day.plan().name, std::to_string(consumer.published()), to_string(need),
                          to_string(unsuitable.need)});
    if (consumer.published() > 0 || claimed > 0) {
      report->fail(day.plan().name + ": a calibration was published");
    }
    if (need != unsuitable.need) report->fail(day.plan().name + ": another need is given");
  }
  report->add(table);
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  using namespace alidade::test;
  CLI::App app("A virtual hour of live orientation, held against its truth");
  Options options;
  app.add_flag("--small", options.small, "two and a half minutes with all that the hour has");
  app.add_flag("--camera-bump", options.camera_bump, "the camera is bumped, in place of the base");
  app.add_flag("--known", options.known, "begins with the true calibration; no zoom changes");
  app.add_flag("--narrow", options.narrow, "always at the narrow end of the zoom");
  app.add_flag("--unsuitable", options.unsuitable,
               "minutes of motion and scenes that do not suffice, in place of the hour");
  app.add_flag("--coarse", options.coarse, "fewer and smaller pictures: a third of the time");
  app.add_option("--minutes", options.minutes, "not all of it")->check(CLI::PositiveNumber);
  app.add_option("--seed", options.seed, "of all that is random");
  app.add_option("--threads", options.threads, "that render")->check(CLI::Range(1, 64));
  app.add_option("--json", options.json, "also write tables and every record to this file");
  app.add_option("--plot", options.plot, "also write errors and sigmas over time to this page");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  Report report(std::cout);
  nlohmann::json series;
  try {
    if (options.unsuitable) {
      run_unsuitable(options, &report);
    } else {
      run_day(options, &report, &series);
    }
    if (!options.json.empty()) {
      nlohmann::json all = report.to_json();
      all["records"] = series;
      std::ofstream file(options.json);
      file << all.dump() << "\n";
      if (!file.flush()) throw std::runtime_error(options.json + ": cannot be written");
    }
  } catch (const std::exception& error) {
    std::cerr << "alidade_endurance: " << error.what() << "\n";
    return 2;
  }
  for (const std::string& what : report.missed()) std::cout << "MISSED: " << what << "\n";
  return report.missed().empty() ? 0 : 1;
}
