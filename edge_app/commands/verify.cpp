// `alidade verify`: replays a recording in OE and in PT mode, as `alidade replay` does, and
// compares directions of places that are seen again. The room edge_app/verify compares; this file
// reads the recording, prints and writes the report.

#include "edge_app/commands/verify.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/number_text.h"
#include "core/model/angle.h"
#include "core/realtime/telemetry/renewal_age.h"
#include "edge_app/clocks/fresh_beginning.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/output_directory.h"
#include "edge_app/commands/replay_input.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/config/noise_file.h"
#include "edge_app/self_calibration/stale_repeats.h"
#include "edge_app/verify/verification.h"
#include "edge_app/verify/verification_json.h"
#include "edge_app/verify/verification_report.h"
#include "edge_app/verify/verification_words.h"
#include "platform/pan_tilt/recording_pan_tilt_source.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

struct VerifiedReplay {
  std::vector<SeenFrame> frames;
  std::vector<KnownSight> known;
  int samples = 0;
  double telemetry_s = 0;  // from the first sample to the last
};

constexpr double kLater_s = 1;  // samples of so long after a frame enclose it with any clock offset

// What is read of a recording before its frames.
struct Recorded {
  std::string directory;
  std::vector<FrameStamp> stamps;
  std::vector<PanTiltSample> samples;
};

Recorded read_recorded(const std::string& directory) {
  Recorded out{directory, {}, {}};
  std::string error;
  if (!read_frames_csv(directory, &out.stamps, &error)) throw CommandError(kExitUsage, error);
  const auto source = open_recorded_pan_tilt({directory, false});
  while (const std::optional<PanTiltSample> sample = next_of<PanTiltSample>(*source))
    out.samples.push_back(*sample);
  return out;
}

// Gives them the samples up to a time that they do not have yet. next: the first of those.
void add_samples(const Recorded& recorded, double until_s, std::size_t* next,
                 std::initializer_list<OrientationStep*> steps) {
  const std::vector<PanTiltSample>& samples = recorded.samples;
  for (; *next < samples.size() && samples[*next].latest_time_s <= until_s; ++*next) {
    for (OrientationStep* step : steps) step->add_telemetry(samples[*next]);
  }
}

// visit(stamp, image): for each frame, in order. The image is lent for the call. Returns what there
// is to say of the pictures.
template <class Visit>
std::vector<std::string> for_each_frame(const Recorded& recorded, const Visit& visit) {
  RecordedImages images(recorded.directory);
  const auto video = open_recorded_frames({recorded.directory, false, false});
  StopSignals signals;
  while (const std::optional<Frame> frame = next_of<Frame>(*video)) {
    if (signals.wait(-1, 0) == StopSignals::Event::kSignal) {
      throw CommandError(kExitUsage, recorded.directory + ": interrupted; nothing was judged");
    }
    const std::optional<Frame> image = images.of(frame->stamp);
    visit(frame->stamp, view_of(image));
  }
  return images.remarks();
}

std::vector<KnownDirection> known_directions(const VerifyOptions& options,
                                             const Camera<double>& camera,
                                             const std::vector<FrameStamp>& stamps) {
  std::vector<KnownDirection> known;
  if (options.known.empty()) return known;
  KnownLimits limits{camera.width, camera.height, {}};
  for (const FrameStamp& stamp : stamps) limits.frames.push_back(stamp.frame);
  std::sort(limits.frames.begin(), limits.frames.end());
  std::string error;
  if (!read_known_directions(options.known, limits, &known, &error))
    throw CommandError(kExitUsage, error);
  return known;
}

// text: degrees, "free" or empty, as the command line has checked it.
double turn_sigma_of(const std::string& text) {
  if (text == "free") return TurnSigma::kFree;
  return number_of(text).value_or(0) * kPi / 180;
}

FrameOrientation orientation_in(const OrientationRecord& record, RecordMode mode) {
  return record.mode == mode && record.orientation && record.calibrated
             ? unpack(record.orientation->geometry, record.camera)
             : FrameOrientation{};
}

VerifiedReplay replay_both_modes(const Recorded& recorded, const std::vector<KnownDirection>& known,
                                 OrientationStepOptions of_step) {
  OrientationStep by_telemetry(of_step);
  OrientationStep by_all_samples(of_step);
  of_step.oe = oe_options(of_step.calibration.camera);
  OrientationStep by_landmarks(of_step);
  if (begins_fresh(recorded.stamps)) {
    by_telemetry.expect_fresh_frames();
    by_all_samples.expect_fresh_frames();
    by_landmarks.expect_fresh_frames();
  }
  const Camera<double>& camera = of_step.calibration.camera;
  FrameCollection collection(recorded.stamps.size(), camera.width, camera.height,
                             of_step.telemetry_noise.pan_tilt_sigma);
  VerifiedReplay out;
  std::size_t now = 0;    // the first sample that has not come yet
  std::size_t later = 0;  // likewise, so much later
  const auto visit = [&](const FrameStamp& stamp, const ImageView& image) {
    add_samples(recorded, stamp.receive_time_s, &now, {&by_telemetry, &by_landmarks});
    add_samples(recorded, stamp.receive_time_s + kLater_s, &later, {&by_all_samples});
    StepEvents events;
    const OrientationRecord of_telemetry = by_telemetry.add_frame(stamp, ImageView{}, &events);
    const OrientationRecord of_landmarks = by_landmarks.add_frame(stamp, image, &events);
    const OrientationRecord of_all_samples = by_all_samples.add_frame(stamp, ImageView{}, &events);
    collection.add(of_landmarks, of_telemetry, of_all_samples, image);
    for (const KnownDirection& each : known) {
      if (each.frame != stamp.frame) continue;
      out.known.push_back({each, orientation_in(of_telemetry, RecordMode::kPt),
                           orientation_in(of_landmarks, RecordMode::kOe)});
    }
    by_telemetry.maintain();
    by_all_samples.maintain();
    by_landmarks.maintain();
  };
  for (const std::string& remark : for_each_frame(recorded, visit)) spdlog::warn("{}", remark);
  out.frames = collection.frames();
  const std::vector<PanTiltSample>& samples = recorded.samples;
  out.samples = static_cast<int>(samples.size());
  if (!samples.empty())
    out.telemetry_s = samples.back().latest_time_s - samples.front().latest_time_s;
  return out;
}

bool is_seldom_new(const std::vector<PanTiltSample>& samples, const OrientationStepOptions& of) {
  const bool has_clock = std::any_of(
      samples.begin(), samples.end(),
      [](const PanTiltSample& sample) { return sample.device_time_s || sample.sequence; });
  const TelemetryNoise& noise = of.telemetry_noise;
  return !has_clock &&
         renews_seldom(samples, RenewalAge::least_turn(noise.pan_tilt_sigma, noise.resolution),
                       of.telemetry_limits.max_repeat_s);
}

// Whether the calibration was made from this recording, or was in use during it.
bool is_own(const VerifyOptions& options) {
  if (options.calibration.empty()) return true;
  const fs::path recording = options.recording;
  const fs::path folder = fs::path(options.calibration).parent_path();
  std::error_code ignored;
  return fs::equivalent(folder, recording, ignored) ||
         fs::equivalent(folder, recording / "alidade", ignored);
}

// How late telemetry comes against the pictures in this recording, as `run` would find it: the
// clock offset is the link's, and a calibration of another recording has that of another connection.
std::optional<VerifiedLink> find_link(const Recorded& recorded, OrientationStepOptions of_step) {
  of_step.oe = oe_options(of_step.calibration.camera);
  of_step.other_connection = true;
  OrientationStep step(of_step);
  if (begins_fresh(recorded.stamps)) step.expect_fresh_frames();
  std::size_t next = 0;
  std::optional<VerifiedLink> found;
  // Its remarks come again with the replay.
  static_cast<void>(for_each_frame(recorded, [&](const FrameStamp& stamp, const ImageView& image) {
    add_samples(recorded, stamp.receive_time_s, &next, {&step});
    StepEvents events;
    static_cast<void>(step.add_frame(stamp, image, &events));
    if (events.link_delay && events.link_delay->state == LinkDelayState::kFound)
      found = VerifiedLink{events.link_delay->delay_s, events.link_delay->sigma_s};
    step.maintain();
  }));
  return found;
}

Verification judge_recording(const VerifyOptions& options) {
  std::string error;
  RecordingInfo info;
  if (!read_recording_info(options.recording, &info, &error)) throw CommandError(kExitUsage, error);
  const PublishedCalibration calibration = find_calibration(options.recording, options.calibration);
  error = size_error(info, calibration, options.recording);
  if (!error.empty()) throw CommandError(kExitUsage, error);
  RecordingNoise noise;
  if (!load_noise(options.recording, &noise, &error)) throw CommandError(kExitUsage, error);
  if (!has_images(options.recording)) {
    throw CommandError(kExitUsage, options.recording +
                                       ": has no pictures (video.mkv or frames/), in which places "
                                       "could be seen again; record with video");
  }
  OrientationStepOptions of_step = step_options(noise, calibration);
  of_step.zoom_tolerance = options.zoom_tolerance;
  of_step.wait_for_pace = !noise.image_stamp_sigma_s;
  const Recorded recorded = read_recorded(options.recording);
  const std::vector<KnownDirection> known =
      known_directions(options, of_step.calibration.camera, recorded.stamps);
  const std::optional<VerifiedLink> link =
      is_own(options) ? std::nullopt : find_link(recorded, of_step);
  if (link) of_step.link_delay = {LinkDelayState::kFound, link->delay_s, link->sigma_s};
  const VerifiedReplay replay = replay_both_modes(recorded, known, of_step);
  return verify({options.recording,
                 calibration.name,
                 replay.frames,
                 calibration.telemetry_error,
                 of_step.telemetry_noise.pan_tilt_sigma,
                 replay.telemetry_s > 0 ? (replay.samples - 1) / replay.telemetry_s : 0,
                 replay.known,
                 {turn_sigma_of(options.heading_sigma), turn_sigma_of(options.level_sigma)},
                 link,
                 is_seldom_new(recorded.samples, of_step)});
}

int exit_code_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kHolds:
      return kExitOk;
    case Verdict::kContradicted:
      return kExitFailed;
    case Verdict::kNotJudged:
      break;
  }
  return kExitUsage;
}

}  // namespace

int verify_calibration(const VerifyOptions& options) {
  try {
    const Verification verification = judge_recording(options);
    OutputDirectory directory(options.directory, options.recording);
    directory.add(
        "report", "verification.html",
        verification_report(
            verification, {options.recording, ALIDADE_VERSION,
                           fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)))}));
    std::fputs(options.json ? verification_json(verification, directory.files()).c_str()
                            : verification_text(verification).c_str(),
               stdout);
    if (std::fflush(stdout) != 0) throw CommandError(kExitUsage, "stdout: cannot be written");
    for (const auto& [kind, path] : directory.files()) spdlog::info("{}: {}", kind, path);
    return exit_code_of(verification.verdict);
  } catch (const CommandError& failure) {
    // 1 would say that the calibration is contradicted.
    throw CommandError(kExitUsage, failure.what());
  }
}

}  // namespace alidade
