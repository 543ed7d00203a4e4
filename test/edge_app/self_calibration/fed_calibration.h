#pragma once
// What the real-time thread would tell the calibration thread of simulated cameras, and where that keeps its calibrations.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "edge_app/self_calibration/self_calibration.h"
#include "test/support/errors_in_sigmas.h"
#include "test/support/simulated_recording.h"

namespace alidade::test {

// In memory; refuses to store on demand, as a full disk does.
class MemoryArchive final : public CalibrationArchive {
 public:
  [[nodiscard]] const StoredCalibration* find(std::optional<double> zoom) const override {
    for (const StoredCalibration& stored : stored_) {
      if (stored.calibration.zoom == zoom) return &stored;
    }
    return stored_.size() == 1 && !zoom ? &stored_[0] : nullptr;
  }
  [[nodiscard]] const ZoomCurve& zoom_curve() const override { return curve; }
  [[nodiscard]] bool save(const StoredCalibration& calibration, std::string* error) override {
    stored_.push_back(calibration);
    if (!calibration.notes.zoom_curve.empty()) curve = calibration.notes.zoom_curve;
    pending_ = full;
    if (full) *error = "disk full";
    return !full;
  }
  [[nodiscard]] bool has_pending() const override { return pending_; }
  [[nodiscard]] bool save_pending(std::string* error) override {
    ++tries;
    pending_ = full;
    if (full) *error = "disk full";
    return !full;
  }

  [[nodiscard]] std::string set_zooms_aside() override {
    const bool any = !stored_.empty();
    stored_.clear();
    curve = {};
    return any ? "set aside" : "";
  }

  bool full = false;
  int tries = 0;
  ZoomCurve curve;
  std::vector<StoredCalibration> stored_;

 private:
  bool pending_ = false;
};

inline Simulation calibrated_camera() {
  Simulation s = arrival_stamped_camera();
  s.duration_s = 14;
  return s;
}

inline SelfCalibrationOptions calibration_options(const Simulation& s) {
  SelfCalibrationOptions options;
  options.data_sheet.camera.focal_length = 1.15 * s.focal_length;
  options.data_sheet.camera.width = s.width;
  options.data_sheet.camera.height = s.height;
  options.noise.pan_tilt_sigma_rad = s.pan_tilt_sigma;
  return options;
}

struct Published {
  std::shared_ptr<const PublishedCalibration> calibration;
  double time_s;
};

// What the real-time thread would tell of a recording, in the order of its stamps.
struct Feed {
  FrameTracks::Tracker tracker = FrameTracks::Tracker::kStartUp;
  std::optional<double> zoom;
  double from_s = 0;      // shift of all stamps
  bool restarts = false;  // the first frame is of a new connection
  double contradicting_from_s = std::numeric_limits<double>::infinity();
  std::int64_t first_frame = 0;
  double poll_s = 0;  // so long before its stamp a sample was asked for; 0: it came by itself
  bool delay_steps = false;  // with the first frame the least delay of the video is another one
  double delay_wander_s = 0;
  std::function<double(double)> wander_at = {};  // in place of it, by the time
  std::function<void()> before_adjusting = {};
  // A machine with too much to do takes up this share of the frames, and stamps them late, by so much in the mean, but for
  // the sender's clock.
  double taken_up = 1;
  double late_s = 0;
  double head_back_s = 0;  // the connection to the head begins anew then
  std::function<std::optional<double>(double)> zoom_at = {};  // in place of zoom, by the time
  std::function<bool(double)> blurred = {};                   // nothing is seen then
  // The camera takes this share of the pictures, evenly; a converter sends the newest at each
  // frame's time.
  double converted = 1;
};

inline std::vector<Published> feed(SelfCalibration* calibration, const Simulation& s,
                                   const Feed& how) {
  const CalibrationInput input = simulate(s);
  std::map<std::int64_t, std::vector<TrackedPoint>> points;
  for (const CalibrationObservation& seen : input.observations) {
    points[seen.frame].push_back({static_cast<std::uint32_t>(seen.landmark),
                                  static_cast<float>(seen.u_px), static_cast<float>(seen.v_px),
                                  static_cast<float>(seen.sigma_px)});
  }
  std::vector<Published> published;
  std::size_t next_sample = 0;
  std::mt19937_64 random(s.seed);
  double stamped_s = 0;
  bool back = false;
  for (const CalibrationFrame& frame : input.frames) {
    if (std::uniform_real_distribution<double>(0, 1)(random) >= how.taken_up) continue;
    for (; next_sample < input.telemetry.size() &&
           input.telemetry[next_sample].stamp_s <= frame.stamp_s;
         ++next_sample) {
      const CalibrationTelemetry& from = input.telemetry[next_sample];
      PanTiltSample sample;
      sample.latest_time_s = how.from_s + from.stamp_s;
      sample.earliest_time_s = sample.latest_time_s - how.poll_s;
      sample.pan_rad = from.pan_rad;
      sample.tilt_rad = from.tilt_rad;
      if (how.poll_s == 0) sample.sequence = from.sequence;
      sample.zoom = how.zoom_at ? how.zoom_at(from.stamp_s) : how.zoom;
      sample.restarted = how.head_back_s > 0 && from.stamp_s >= how.head_back_s && !back;
      back = back || sample.restarted;
      calibration->add(sample);
    }
    FrameTracks tracks;
    tracks.stamp.frame = how.first_frame + frame.frame;
    tracks.stamp.receive_time_s = how.from_s + frame.stamp_s;
    if (how.late_s > 0) {
      stamped_s =
          std::max(stamped_s, tracks.stamp.receive_time_s +
                                  std::exponential_distribution<double>(1 / how.late_s)(random));
      tracks.stamp.receive_time_s = stamped_s;
      tracks.stamp.sender_time_s = 700 + static_cast<double>(*frame.sequence) / s.image_rate_hz;
    } else {
      tracks.stamp.sequence = frame.sequence;
    }
    tracks.time_s = tracks.stamp.receive_time_s;
    tracks.tracker = how.tracker;
    tracks.clock_restarted = tracks.stamp.restarted = how.restarts && frame.frame == 0;
    tracks.delay_stepped = how.delay_steps && frame.frame == 0;
    tracks.delay_wander_s = how.wander_at ? how.wander_at(frame.stamp_s) : how.delay_wander_s;
    tracks.oe_status =
        frame.stamp_s >= how.contradicting_from_s ? OeStatus::kContradiction : OeStatus::kOk;
    const auto taken = [&how](std::int64_t number) {
      return std::floor(static_cast<double>(number) * how.converted);
    };
    const double picture = taken(frame.frame);
    tracks.image_repeated = frame.frame > 0 && picture == taken(frame.frame - 1);
    if (tracks.image_repeated) tracks.tracker = FrameTracks::Tracker::kNone;
    const auto shown = static_cast<std::int64_t>(picture / how.converted);
    for (const TrackedPoint& point : points[shown]) {
      if (tracks.count == kMaxFramePoints || (how.blurred && how.blurred(frame.stamp_s))) break;
      tracks.points[static_cast<std::size_t>(tracks.count++)] = point;
    }
    calibration->add(tracks);
    if (how.before_adjusting && calibration->due()) how.before_adjusting();
    if (auto news = calibration->work()) published.push_back({news, frame.stamp_s});
  }
  return published;
}

// What it has for the log since the last call.
inline std::vector<std::string> lines_of(SelfCalibration& calibration,
                                         bool warnings_alone = false) {
  std::vector<std::string> out;
  for (CalibrationMessage& message : calibration.take_messages()) {
    if (message.is_warning || !warnings_alone) out.push_back(std::move(message.text));
  }
  return out;
}
// Of these the warnings.
inline std::vector<std::string> warnings_of(SelfCalibration& calibration) {
  return lines_of(calibration, true);
}

inline void expect_truth(const Simulation& s, const Calibration& c) {
  const auto error = calibration_error(s, c);
  // 9 numbers of which chance takes 1 in 30,000 beyond: 99.97 %.
  constexpr double kBeyondChance = 4.2;
  for (const Parameter p : kDecidedByData) {
    const double sigma = std::sqrt(c.covariance(index(p), index(p)));
    EXPECT_GT(sigma, 0) << to_string(p);
    EXPECT_LT(std::abs(error[index(p)]), kBeyondChance * sigma) << to_string(p);
  }
}

}  // namespace alidade::test
