#include "edge_app/self_calibration/self_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/calibration/calibration_difference.h"
#include "core/calibration/number_text.h"
#include "core/calibration/zoom_fit.h"
#include "edge_app/self_calibration/calibration_refusal.h"
#include "edge_app/self_calibration/keyframe_map.h"

namespace alidade {
namespace {

std::string describe(const Calibration& c) {
  const auto estimate = [&c](double value, Parameter parameter, double unit, const char* name) {
    return estimate_text(value / unit, parameter_sigma(c, parameter) / unit, name);
  };
  return fmt::format("focal length {}, radial distortion {}, line delay {}, clock offset {}",
                     estimate(c.camera.focal_length, Parameter::kFocalLength, 1, "px"),
                     estimate(c.camera.distortion.only_term(), Parameter::kRadialDistortion, 1, ""),
                     estimate(c.line_delay, Parameter::kLineDelay, 1e-6, "us"),
                     estimate(c.clock_offset, Parameter::kClockOffset, 1e-3, "ms"));
}

}  // namespace

SelfCalibration::SelfCalibration(const SelfCalibrationOptions& options, CalibrationArchive* archive)
    : options_(options),
      archive_(archive),
      session_(options.session),
      steady_zoom_(options.zoom_tolerance),
      zooms_(options.zooms),
      contradiction_(options.contradiction),
      disagreement_(options.disagreement),
      watch_interval_s_(options.schedule.first_watch_s) {
  auto first = std::make_shared<PublishedCalibration>();
  const StoredCalibration* stored = archive != nullptr ? archive->find(std::nullopt) : nullptr;
  if (stored != nullptr) {
    first->calibration = stored->calibration;
    first->calibrated = true;
    first->map = kept_map(stored->map);
    first->name = stored->path;
  } else {
    first->calibration = options.data_sheet;
    first->name = "data sheet";
  }
  if (archive != nullptr) {
    const bool free_centre =
        stored != nullptr && stored->calibration.zoom && has_free_centre(stored->calibration);
    nodes_.begin_with(archive->zoom_curve(), free_centre ? &stored->calibration : nullptr);
  }
  zooms_ = zooms_ || !nodes_.empty();
  first->zoom_curve = nodes_.curve();
  published_ = first;
  // It was made over another connection.
  clock_offset_known_ = stored == nullptr;
}

void SelfCalibration::say_once(const std::string& line) {
  if (line == said_) return;
  said_ = line;
  messages_.push_back(line);
}

void SelfCalibration::begin_anew() {
  session_.clear();
  first_node_is_wanted_ = false;
  tries_ = 0;
  disagreement_.restart();
}

void SelfCalibration::begin_fresh() {
  begin_anew();
  fresh_wanted_ = is_calibrated_here();
}

bool SelfCalibration::zoom_fits(const std::optional<double>& wanted) const {
  return !zoom_ || !wanted || std::abs(*zoom_ - *wanted) <= steady_zoom_.tolerance();
}

bool SelfCalibration::is_calibrated_here() const {
  return published_->calibrated && zoom_fits(published_->calibration.zoom);
}

bool SelfCalibration::is_rejected(const Calibration& calibration) const {
  return std::find(rejected_.begin(), rejected_.end(), *calibration.zoom) != rejected_.end();
}

void SelfCalibration::clock_began_anew() {
  nodes_.clock_began_anew();
  if (first_node_) first_node_->clock_holds = false;
}

bool SelfCalibration::judge_delay(const FrameTracks& tracks) {
  constexpr double kSteady = 0.5;  // of the limit: wander fades slowly
  const double most_s = options_.schedule.most_wander_s;
  const bool wanders = tracks.delay_wander_s > (delay_wanders_ ? kSteady * most_s : most_s);
  if (wanders != delay_wanders_) {
    messages_.push_back(
        wanders
            ? fmt::format("the video's delay, or its time stamps, wander by {:.0f} ms and more, "
                          "as behind a relay: nothing is calibrated and nothing withdrawn until "
                          "they hold; the camera itself would be better read directly",
                          1e3 * tracks.delay_wander_s)
            : "the video's delay holds again; the clock offset is found anew");
    begin_anew();
    clock_offset_known_ = false;
    clock_began_anew();
  }
  return delay_wanders_ = wanders;
}

void SelfCalibration::judge_agreement(const FrameTracks& tracks) {
  if (tracks.tracker != FrameTracks::Tracker::kOe || !is_calibrated_here()) return;
  const bool contradicted = tracks.oe_status == OeStatus::kContradiction;
  if (!disagreement_.judge(tracks.stamp.receive_time_s, contradicted)) return;
  if (!options_.automatic) {
    // Nothing would take its place.
    say_once(
        fmt::format("landmarks contradict telemetry in half of the frames (was the camera "
                    "moved on its mount, or its lens?); the calibration {} stays in use, as "
                    "calibration.auto is false: calibrate again",
                    published_->name));
    disagreement_.restart();
    return;
  }
  auto withdrawn = std::make_shared<PublishedCalibration>();
  withdrawn->calibration = published_->calibration;
  withdrawn->calibration.covariance = options_.data_sheet.covariance;
  withdrawn->name = published_->name + ", withdrawn";
  messages_.push_back(
      fmt::format("landmarks contradict telemetry in {} of {} frames: the calibration {} is "
                  "withdrawn (was the camera moved on its mount, or its lens?); calibrating anew",
                  disagreement_.contradicted_frames(), disagreement_.frames(), published_->name));
  if (published_->calibration.zoom) rejected_.push_back(*published_->calibration.zoom);
  published_ = next_ = withdrawn;
  doubtful_ = true;
  begin_anew();
}

bool SelfCalibration::storing_is_due() const {
  return archive_ != nullptr && archive_->has_pending() &&
         now_s_ > last_store_s_ + options_.schedule.store_retry_s;
}

bool SelfCalibration::adjusting_is_due() const {
  const CalibrationSchedule& schedule = options_.schedule;
  if (cancelled_) return false;
  if (!options_.automatic || session_.frames() < 3 ||
      now_s_ < zoom_changed_s_ + schedule.zoom_settles_s) {
    return false;
  }
  const double newest_s = session_.newest_s();
  if (!is_calibrated_here() || fresh_wanted_) {
    const double pause_s = tries_ < schedule.many_tries ? schedule.next_try_s : schedule.slow_try_s;
    return session_.span_s() >= schedule.first_try_s &&
           (tries_ == 0 || newest_s >= last_try_s_ + pause_s);
  }
  if (makes_nodes() && !nodes_.has_visit()) {
    return session_.span_s() >= schedule.first_try_s && newest_s >= last_try_s_ + watch_interval_s_;
  }
  return session_.span_s() >= schedule.watch_window_s &&
         newest_s >= began_s_ + schedule.watch_window_s &&
         newest_s >=
             last_try_s_ + (clock_offset_known_ ? watch_interval_s_ : schedule.first_watch_s);
}

CheckedCalibration SelfCalibration::adjust(const Calibration* known, bool free_centre) const {
  CheckedCalibrationOptions options;
  options.width = options_.data_sheet.camera.width;
  options.height = options_.data_sheet.camera.height;
  options.adjustment = options_.adjustment;
  if (free_centre) options.adjustment.centre_sigma_px = kUsualCentreShare * options.width;
  options.camera = options_.camera;
  options.noise = options_.noise;
  options.checks = options_.checks;
  options.is_cancelled = [this] { return cancelled_.load(); };
  CheckedCalibration checked;
  if (known == nullptr) {
    checked = calibrate_session(session_, options, nullptr);
  } else {
    const KnownCalibration prior{*known, clock_offset_known_};
    checked = calibrate_session(session_, options, &prior);
  }
  checked.result.calibration.zoom = zoom_;
  return checked;
}

void SelfCalibration::store(const CalibrationResult& result, const MapState& map) {
  last_store_s_ = now_s_;
  if (archive_ == nullptr) return;
  StoredCalibration stored;
  stored.calibration = result.calibration;
  stored.notes.quality = result.quality;
  stored.notes.excluded = result.exclusions.describe();
  stored.notes.zoom_curve = nodes_.curve();
  stored.map = map;
  std::string error;
  if (!archive_->save(stored, &error)) messages_.push_back(error + "; kept, will be tried again");
}

void SelfCalibration::publish(const CheckedCalibration& checked) {
  auto fresh = std::make_shared<PublishedCalibration>();
  fresh->calibration = checked.result.calibration;
  fresh->calibrated = true;
  fresh->map = map_from_keyframes(checked.result, session_.keyframes(checked.result));
  fresh->name = "live";
  fresh->zoom_curve = nodes_.curve();
  const CalibrationQuality& quality = checked.result.quality;
  messages_.push_back(
      fmt::format("calibrated from {} frames, {} landmarks: {}; residuals {:.2f} of the tracker's "
                  "noise, {:.2f} "
                  "in frames held out; map of {} landmarks",
                  quality.frames, quality.landmarks, describe(fresh->calibration),
                  quality.pixel_sigma_ratio, checked.hold_out, fresh->map.landmarks.size()));
  messages_.insert(messages_.end(), checked.remarks.begin(), checked.remarks.end());
  store(checked.result, fresh->map);
  rejected_.erase(std::remove_if(rejected_.begin(), rejected_.end(),
                                 [this](double zoom) { return zoom_fits(zoom); }),
                  rejected_.end());
  published_ = next_ = fresh;
  doubtful_ = false;
  clock_offset_known_ = true;
  fresh_wanted_ = false;
  said_.clear();
  need_ = CalibrationNeed::kNothing;
}

// Calibrates without an earlier calibration as prior.
void SelfCalibration::try_first() {
  ++tries_;
  CheckedCalibration checked = adjust(nullptr);
  if (checked.refusal.empty()) {
    watch_interval_s_ = options_.schedule.first_watch_s;
    settle(std::move(checked));
    return;
  }
  // The program ends: nobody need do anything about it.
  if (checked.result.status == CalibrationStatus::kCancelled) return;
  const CalibrationRefusal refusal = why_refused(checked, session_.frames());
  need_ = refusal.need;
  say_once((fresh_wanted_ ? "no fresh calibration yet" : "not calibrated yet") + refusal.why);
}

void SelfCalibration::hold_against_published() {
  const CalibrationSchedule& schedule = options_.schedule;
  watch_interval_s_ = std::min(2 * watch_interval_s_, schedule.longest_watch_s);
  CheckedCalibration alone = adjust(nullptr);
  // Insufficient motion says nothing against what is known.
  if (!alone.refusal.empty()) return;
  const double chi_square =
      difference_chi_square(published_->calibration, alone.result.calibration, clock_offset_known_);
  // A reading that agrees with itself says nothing about the curve.
  const bool agrees = makes_nodes() && chi_square <= options_.contradiction.least_chi_square;
  const ContradictionJudge::Verdict verdict =
      agrees ? ContradictionJudge::Verdict::kAgrees : contradiction_.judge(chi_square);
  if (verdict != ContradictionJudge::Verdict::kAgrees) {
    watch_interval_s_ = schedule.first_watch_s;
    messages_.push_back(
        fmt::format("the camera is not what the calibration says (chi-square {:.0f}): {}",
                    chi_square, describe(alone.result.calibration)));
    if (verdict != ContradictionJudge::Verdict::kBelieved) return;
    contradiction_.restart();
    if (makes_nodes()) {
      begin_nodes_anew(alone);
    } else {
      publish(alone);
      first_node_.reset();
      first_node_is_wanted_ = true;
    }
    return;
  }
  if (makes_nodes()) {
    refine_node(std::move(alone));
    return;
  }
  if (!first_node_ || !first_node_->refusal.empty()) first_node_is_wanted_ = true;
  alone = {};  // frees a megabyte
  const CheckedCalibration refined = adjust(&published_->calibration);
  if (!refined.refusal.empty()) return;
  if (!clock_offset_known_ ||
      is_sharper(refined.result.calibration, published_->calibration, schedule.worth_publishing)) {
    publish(refined);
    first_node_is_wanted_ = true;
  }
}

void SelfCalibration::add(const FrameTracks& tracks) {
  now_s_ = std::max(now_s_, tracks.stamp.receive_time_s);
  last_frame_s_ = tracks.stamp.receive_time_s;
  video_is_lost_ = false;
  // Frames before and after have different clock offsets.
  if (tracks.clock_restarted || tracks.delay_stepped) {
    if (!session_.empty()) begin_anew();
    if (is_calibrated_here()) clock_offset_known_ = false;
    clock_began_anew();
  }
  telemetry_is_old_ = old_telemetry_.judge(now_s_, tracks.telemetry_too_old);
  if (judge_delay(tracks)) return;
  judge_agreement(tracks);
  if (tracks.tracker == FrameTracks::Tracker::kNone || !tracks.time_is_of_use) return;
  // On an overloaded machine, frames of the previous zoom may come after the new reading.
  if (tracks.stamp.receive_time_s < zoom_changed_s_ + options_.schedule.zoom_settles_s) return;
  if (tracks.tracker != tracker_) {
    begin_anew();
    tracker_ = tracks.tracker;
  }
  if (fresh_asked_.exchange(false)) begin_fresh();
  if (session_.empty()) {
    began_s_ = tracks.stamp.receive_time_s;
    last_try_s_ = began_s_;
  }
  session_.add(tracks);
}

bool SelfCalibration::wants_keyframe() const {
  return options_.automatic && session_.wants_keyframe(published_->calibration.camera);
}

void SelfCalibration::add_keyframe(const ImageView& image) {
  const Camera<double>& camera = options_.data_sheet.camera;
  if (session_.empty() || !image.valid() || image.width != camera.width ||
      image.height != camera.height) {
    return;
  }
  session_.add_keyframe(image);
}

void SelfCalibration::add(const PanTiltSample& sample) {
  now_s_ = std::max(now_s_, sample.latest_time_s);
  last_sample_s_ = sample.latest_time_s;
  telemetry_is_lost_ = false;
  judge_zoom(sample);
  look_for_stored();
  session_.add(sample);
}

void SelfCalibration::video_lost() { video_is_lost_ = true; }
void SelfCalibration::telemetry_lost() { telemetry_is_lost_ = true; }

bool SelfCalibration::ask_for_fresh() {
  if (!options_.automatic) return false;
  fresh_asked_ = true;
  return true;
}

void SelfCalibration::cancel() { cancelled_ = true; }

bool SelfCalibration::due() const {
  return storing_is_due() || first_node_is_wanted() || first_node_is_due() || adjusting_is_due();
}

std::shared_ptr<const PublishedCalibration> SelfCalibration::work() {
  if (storing_is_due()) {
    std::string error;
    last_store_s_ = now_s_;
    say_once(archive_->save_pending(&error) ? "the calibration is stored now" : error);
  }
  if (first_node_is_due()) take_first_node();
  if (first_node_is_wanted()) {
    make_first_node();
  } else if (adjusting_is_due()) {
    last_try_s_ = session_.newest_s();
    if (is_calibrated_here() && !fresh_wanted_) {
      hold_against_published();
    } else {
      try_first();
    }
  }
  return std::exchange(next_, nullptr);
}

CalibrationReport SelfCalibration::report() const {
  CalibrationReport report;
  if (!options_.automatic) return report;
  report.activity = is_calibrated_here() ? CalibrationActivity::kWatching
                    : doubtful_          ? CalibrationActivity::kDoubtful
                                         : CalibrationActivity::kCollecting;
  const bool wanders = delay_wanders_ && !video_is_lost_;
  if (wanders) report.need = CalibrationNeed::kSteadyDelay;
  const bool old = telemetry_is_old_ && !video_is_lost_ && !telemetry_is_lost_;
  if (old) report.need = CalibrationNeed::kYoungTelemetry;
  if (wanders || old || (is_calibrated_here() && !fresh_wanted_)) return report;
  if (video_is_lost_ || last_frame_s_ < now_s_ - options_.schedule.silence_s) {
    report.need = CalibrationNeed::kVideo;
  } else if (telemetry_is_lost_ || last_sample_s_ < now_s_ - options_.schedule.silence_s) {
    report.need = CalibrationNeed::kTelemetry;
  } else if (now_s_ < zoom_changed_s_ + options_.schedule.zoom_settles_s) {
    report.need = CalibrationNeed::kSteadyZoom;
  } else {
    report.need = tries_ > 0 ? need_ : CalibrationNeed::kTime;
  }
  return report;
}

std::vector<std::string> SelfCalibration::take_messages() { return std::exchange(messages_, {}); }

}  // namespace alidade
