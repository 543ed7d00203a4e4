#include "edge_app/localization/scene_localization.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/calibration/number_text.h"
#include "core/mapping/keyframe_outline.h"
#include "core/model/rotation.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

constexpr double kMilli = 1e3;
// Of a turn rate from points followed between two frames: the share that may change meanwhile, and
// px over the image's height.
constexpr double kFollowedShare = 0.25;
constexpr double kFollowed_px = 0.2;

// s, for all rows.
double read_out_of(const Calibration& calibration) {
  return std::abs(calibration.line_delay) * calibration.camera.height;
}

// For a frame whose direction is unknown.
LocalizationHint hint_of(const LocalizableFrame& frame, bool zooms) {
  const Calibration calibration = unpack(frame.record.camera);
  LocalizationHint hint;
  if (!zooms) hint.focal_length = focal_length_of(calibration);
  hint.angular_velocity = Eigen::Map<const Vector3<double>>(frame.angular_velocity_rad_s.data());
  hint.line_delay = calibration.line_delay;
  hint.motion_doubt.turn =
      kFollowedShare * read_out_of(calibration) * hint.angular_velocity.norm() +
      kFollowed_px / calibration.camera.focal_length;
  if (!zooms) hint.motion_doubt.log_f = 0;
  return hint;
}

// How uncertain a record is about the motion between its rows.
MotionDoubt motion_doubt_of(const OrientationRecord& record, const FrameOrientation& frame) {
  const Calibration& calibration = frame.calibration;
  const double rate_sigma = std::sqrt(frame.motion_covariance.block<2, 2>(2, 2).trace());
  const double rate = std::hypot(frame.rate.pan, frame.rate.tilt);
  const double delay_sigma =
      parameter_sigma(calibration, Parameter::kLineDelay) * calibration.camera.height;
  MotionDoubt out;
  out.turn = std::hypot(read_out_of(calibration) * rate_sigma, delay_sigma * rate);
  // Where telemetry alone answers, nothing shows whether the lens moves.
  const bool is_zoom_untold = frame.mode == OrientationMode::kPt && record.zoom.has_value();
  out.log_f = is_zoom_untold
                  ? kUnknownMotion.log_f
                  : std::hypot(read_out_of(calibration) * frame.zoom_rate_sigma.value_or(0),
                               delay_sigma * frame.zoom_rate);
  return out;
}

LocalizationHint hint_of(const OrientationRecord& record, double zero_sigma, double reference_row) {
  const FrameOrientation frame = unpack(record.orientation->geometry, record.camera);
  const Calibration& calibration = frame.calibration;
  const PanTilt<double> angle = angle_at_row(frame.motion(), calibration.line_delay, reference_row);
  LocalizationHint hint;
  hint.R_base_from_camera = R_base_from_camera(calibration.mechanics, angle);
  const auto& sigma = record.orientation->sigma_rad;
  hint.R_sigma = std::hypot(*std::max_element(sigma.begin(), sigma.end()),
                            record.localized ? 0.0 : zero_sigma);
  hint.focal_length = focal_length_of(calibration);
  hint.angular_velocity = angular_velocity(calibration.mechanics, angle, frame.rate);
  hint.zoom_rate = frame.zoom_rate;
  hint.motion_doubt = motion_doubt_of(record, frame);
  hint.line_delay = calibration.line_delay;
  return hint;
}

std::vector<SceneOutline> outlines_of(const SceneMap& map) {
  std::vector<SceneOutline> out;
  for (const SceneKeyframe& keyframe : map.keyframes) {
    out.push_back(
        {keyframe.id, map.camera_of(keyframe).focal_length, keyframe_outline(map, keyframe)});
  }
  return out;
}

std::string describe(const BaseOffset& offset) {
  const auto of = [&offset](double value, int i) {
    return estimate_text(kMilli * value, kMilli * std::sqrt(offset.covariance(i, i)), "mrad");
  };
  return fmt::format("pan {}, tilt {}, roll {} mrad", of(offset.zero.pan, 0),
                     of(offset.zero.tilt, 1), rounded_text(kMilli * offset.roll, 2));
}

}  // namespace

SceneLocalization::SceneLocalization(SceneMap map, const std::string& name,
                                     const BaseJudgeOptions& options, bool has_telemetry,
                                     std::optional<CurveRange> range, StoreMapChange store)
    : zero_sigma_(options.zero_sigma),
      has_telemetry_(has_telemetry),
      range_(range),
      map_(std::move(map)),
      reference_row_(map_.reference_row),
      outlines_(outlines_of(map_)),
      judge_(options),
      upkeep_(std::move(store)) {
  report_.name = name;
  report_.keyframes = static_cast<std::int64_t>(map_.keyframes.size());
  report_.landmarks = static_cast<std::int64_t>(map_.landmarks.size());
  if (upkeep_.keeps_up()) report_.upkeep.emplace();
}

SceneLocalization::~SceneLocalization() = default;

void SceneLocalization::prepare() {
  searcher_ = std::make_unique<const SceneSearch>(map_);
  upkeep_.index_made();
  if (!upkeep_.keeps_up()) map_ = SceneMap();
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.ready = true;
}

SceneLocator::Outcome SceneLocalization::look(const LocalizableFrame& frame, ToldBase* told) {
  const double began_s = monotonic_now_s();
  const bool is_whole = !frame.record.orientation;
  const LocalizationHint hint = is_whole ? hint_of(frame, range_.has_value())
                                         : hint_of(frame.record, zero_sigma_, reference_row_);
  FeatureSet seen;
  const Localization found = searcher_->find(frame.image, hint, &seen);
  count(told->frame, found, monotonic_now_s() - began_s);
  if (found.status != LocalizationStatus::kOk) return Outcome::kNotFound;
  const Outcome outcome = is_whole ? tell_whole(frame, found, told) : judge(frame, found, told);
  // A result that a second picture has to confirm teaches nothing.
  if (outcome == Outcome::kTold) keep_up(found, seen);
  return outcome;
}

void SceneLocalization::keep_up(const Localization& found, const FeatureSet& seen) {
  if (!upkeep_.keeps_up()) return;
  upkeep_.show(found, seen, utc_now_s(), &map_);
  if (upkeep_.is_due()) {
    searcher_ = std::make_unique<const SceneSearch>(map_);
    upkeep_.index_made();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  report_.landmarks = static_cast<std::int64_t>(map_.landmarks.size());
  report_.upkeep = upkeep_.report();
}

SceneLocator::Outcome SceneLocalization::tell_whole(const LocalizableFrame& frame,
                                                    const Localization& found, ToldBase* told) {
  const Calibration calibration = unpack(frame.record.camera);
  const std::string name = fmt::format("frame {}", told->frame);
  const std::string other = another_lens(found, calibration, range_, name);
  if (!other.empty()) {
    if (!std::exchange(is_zoom_said_, true)) spdlog::warn("scene map: {}", other);
    return Outcome::kNotFound;
  }
  is_zoom_said_ = false;
  const Eigen::Map<const Vector3<double>> velocity(frame.angular_velocity_rad_s.data());
  const double to_middle_s =
      calibration.line_delay * (0.5 * calibration.camera.height - reference_row_);
  const Vector3<double> turn = velocity * to_middle_s;
  const Matrix3<double> R_reference_from_middle = exp_so3(turn);
  const Matrix3<double> covariance = R_reference_from_middle.transpose() *
                                     found.pose.covariance.topLeftCorner<3, 3>() *
                                     R_reference_from_middle;
  told->is_whole = true;
  told->R_base_from_camera = pack_matrix(found.pose.R_base_from_camera * R_reference_from_middle);
  told->R_covariance = pack_matrix(covariance);
  told->log_f = found.pose.log_f;
  told->log_f_variance = found.pose.covariance(3, 3);
  if (!std::exchange(is_start_said_, true)) {
    spdlog::info("scene map: frame {} is localized by {} landmarks; directions begin with it",
                 told->frame, found.matches);
  }
  return Outcome::kTold;
}

SceneLocator::Outcome SceneLocalization::judge(const LocalizableFrame& frame,
                                               const Localization& found, ToldBase* told) {
  BaseOffset offset;
  const BaseJudge::Verdict verdict =
      judge_.judge(frame.record, found, reference_row_, told, &offset);
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_first = !report_.offset;
  report_.offset = offset;
  report_.last->sigma_rad = {std::sqrt(told->covariance[0]), std::sqrt(told->covariance[2])};
  switch (verdict) {
    case BaseJudge::Verdict::kExpected:
      report_.uncorrected = false;
      if (is_first && has_telemetry_) {
        spdlog::info("scene map: frame {} is localized, where telemetry has it but for {}",
                     told->frame, describe(offset));
      }
      return Outcome::kTold;
    case BaseJudge::Verdict::kSuspected:
    case BaseJudge::Verdict::kVague:
      return Outcome::kOnceMore;
    case BaseJudge::Verdict::kMoved:
      say_moved(told->frame, offset, true);
      return Outcome::kTold;
    case BaseJudge::Verdict::kReported:
      say_moved(told->frame, offset, false);
      return Outcome::kNotTold;
  }
  return Outcome::kNotTold;
}

void SceneLocalization::say_moved(std::int64_t frame, const BaseOffset& offset, bool is_corrected) {
  const bool is_said =
      report_.uncorrected && minus(offset.zero, report_.moved->zero).norm() < zero_sigma_;
  report_.uncorrected = !is_corrected;
  if (is_said) return;
  ++report_.movements;
  report_.moved = offset;
  spdlog::warn("scene map: {} has moved, as frame {} shows: {} angles are too small by {}{}",
               has_telemetry_ ? "telemetry's zero or the base" : "the base, or what was followed,",
               frame, has_telemetry_ ? "telemetry's" : "the followed", describe(offset),
               is_corrected
                   ? "; corrected: directions are the map's"
                   : "; not corrected, as scene_map.on_moved_base says: set it to correct, or put "
                     "the base or the zero back");
}

void SceneLocalization::count(std::int64_t frame, const Localization& found, double took_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++report_.pictures;
  switch (found.status) {
    case LocalizationStatus::kOk:
      ++report_.found;
      if (found.by_hint) ++report_.found_by_hint;
      break;
    case LocalizationStatus::kNotInMap:
      ++report_.not_in_map;
      break;
    case LocalizationStatus::kAmbiguous:
      ++report_.ambiguous;
      break;
    case LocalizationStatus::kNoUsablePicture:
      ++report_.unusable;
      break;
  }
  report_.last = SceneReport::Last{
      frame, monotonic_now_s(), took_s, to_string(found.status), found.matches, found.by_hint, {}};
}

SceneReport SceneLocalization::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return report_;
}

}  // namespace alidade
