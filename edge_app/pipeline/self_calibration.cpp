#include "edge_app/pipeline/self_calibration.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "core/model/direction.h"
#include "core/model/rolling_shutter.h"
#include "edge_app/pipeline/calibration_streams.h"
#include "edge_app/pipeline/keyframe_map.h"

namespace alidade {
namespace {

constexpr std::size_t kMostObservations = 15000;
constexpr std::size_t kHeldOut = 10;  // every so many-th frame
constexpr double kTelemetryMargin =
    2;                            // s, kept beyond the frames: the clock offset may be so large
constexpr double kNextTry = 1.5;  // s of new data
constexpr double kSlowTry = 5;    // s, once much was tried in vain
constexpr double kManyTries = 20;
constexpr double kWatchWindow = 12;  // s of data for a calibration that is held against another
constexpr double kFirstWatch = 12;   // s between two, doubling up to ...
constexpr double kLongestWatch = 600;
constexpr double kStoreRetry = 60;    // s
constexpr double kZoomArrives = 0.1;  // s, without a change: it does not just pass by
constexpr double kZoomSettles = 0.5;  // s
constexpr double kSilence = 2;        // s without a frame or sample, while the other stream goes on

// Published parameters as priors leave out their correlations; so much larger sigmas make up for it.
constexpr double kPriorInflation = 1.5;
// Chi-square of two estimates' difference: 99.9 % of 8 numbers' lie below 26; sigmas may be 1.5 times too small.
constexpr double kContradiction = 60;
constexpr double kWorthPublishing = 0.75;  // of a parameter's sigma

// A calibration that predicts frames it has not seen worse than so is not believed (rms of normalised residuals).
constexpr double kWorstHoldOut = 2;
constexpr double kWorstPixelRatio = 4;      // residuals against the tracker's own sigmas
constexpr double kWorstTelemetryRatio = 4;  // against the stated noise

constexpr double kDisagreementSpan = 8;  // s
constexpr double kDisagreement = 0.5;    // of the frames
constexpr int kFewFrames = 40;

struct KeptFrame {
  FrameStamp stamp;
  std::vector<TrackedPoint> points;
};

struct KeptPicture {
  std::int64_t frame;
  double receive_time_s;
  double pan, tilt;  // rad, as measured last before it
  std::shared_ptr<const PackedPicture> picture;
};

struct Checked {
  CalibrationResult result;
  std::string refusal;  // empty: it may be published
  double hold_out = 0;  // rms of normalised residuals in frames that were not used
};

CalibrationNeed need_of(const CalibrationResult& result) {
  switch (result.status) {
    case CalibrationStatus::kNoMotion:
      return CalibrationNeed::kMotion;
    case CalibrationStatus::kConstantVelocity:
      return CalibrationNeed::kAcceleration;
    case CalibrationStatus::kTooFewLandmarks:
      return CalibrationNeed::kTexture;
    case CalibrationStatus::kTelemetryMismatch:
      return CalibrationNeed::kAgreement;
    case CalibrationStatus::kWeak:
      return result.quality.weak_in_time ? CalibrationNeed::kAcceleration : CalibrationNeed::kTime;
    default:
      return CalibrationNeed::kTime;
  }
}

double sigma_of(const Calibration& c, Parameter p) {
  return std::sqrt(std::max(0.0, c.covariance(index(p), index(p))));
}

bool is_held_out(std::size_t frame) { return frame % kHeldOut == kHeldOut / 2; }

// The parameters by which two calibrations of one camera are compared. Scales and aspect rest on priors.
constexpr std::array<Parameter, 8> kCompared = {
    Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kLineDelay,
    Parameter::kPanAxis0,    Parameter::kPanAxis1,         Parameter::kTiltAxis0,
    Parameter::kTiltAxis1,   Parameter::kClockOffset};  // the last one

// b - a, by Parameter.
Eigen::Matrix<double, kParameterCount, 1> difference(const Calibration& a, const Calibration& b) {
  Eigen::Matrix<double, kParameterCount, 1> d = Eigen::Matrix<double, kParameterCount, 1>::Zero();
  d[index(Parameter::kFocalLength)] = b.camera.focal_length - a.camera.focal_length;
  d[index(Parameter::kRadialDistortion)] = b.camera.radial_distortion - a.camera.radial_distortion;
  d[index(Parameter::kLineDelay)] = b.line_delay - a.line_delay;
  d.segment<2>(index(Parameter::kPanAxis0)) =
      direction_minus(b.mechanics.pan_axis, a.mechanics.pan_axis);
  d.segment<2>(index(Parameter::kTiltAxis0)) =
      direction_minus(b.mechanics.tilt_axis, a.mechanics.tilt_axis);
  d[index(Parameter::kClockOffset)] = b.clock_offset - a.clock_offset;
  return d;
}

// Chi-square of their difference; with_clock_offset: false where the frames' clock began anew in between.
double disagreement(const Calibration& a, const Calibration& b, bool with_clock_offset) {
  constexpr int kCount = static_cast<int>(kCompared.size());
  const auto d = difference(a, b);
  Eigen::Matrix<double, kCount, kCount> covariance;
  Eigen::Matrix<double, kCount, 1> x;
  for (int i = 0; i < kCount; ++i) {
    const int row = index(kCompared[static_cast<std::size_t>(i)]);
    x[i] = d[row];
    for (int j = 0; j < kCount; ++j) {
      const int column = index(kCompared[static_cast<std::size_t>(j)]);
      covariance(i, j) = a.covariance(row, column) + b.covariance(row, column);
    }
  }
  if (!with_clock_offset) {
    covariance.row(kCount - 1).setZero();
    covariance.col(kCount - 1).setZero();
    covariance(kCount - 1, kCount - 1) = 1;
    x[kCount - 1] = 0;
  }
  // In units of the sigmas, as the parameters' own differ by many orders of magnitude.
  const Eigen::Matrix<double, kCount, 1> scale =
      covariance.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  const Eigen::Matrix<double, kCount, kCount> correlation =
      scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::Matrix<double, kCount, 1> normalised = scale.cwiseProduct(x);
  return normalised.dot(correlation.inverse() * normalised);
}

bool is_better(const Calibration& now, const Calibration& before) {
  return std::any_of(kCompared.begin(), kCompared.end(), [&](Parameter p) {
    return sigma_of(now, p) < kWorthPublishing * sigma_of(before, p);
  });
}

std::string describe(const Calibration& c) {
  return fmt::format(
      "focal length {:.1f} +- {:.1f} px, radial distortion {:.4g} +- {:.2g}, line delay {:.3f} +- "
      "{:.3f} us, clock offset {:.2f} +- {:.2f} ms",
      c.camera.focal_length, sigma_of(c, Parameter::kFocalLength), c.camera.radial_distortion,
      sigma_of(c, Parameter::kRadialDistortion), 1e6 * c.line_delay,
      1e6 * sigma_of(c, Parameter::kLineDelay), 1e3 * c.clock_offset,
      1e3 * sigma_of(c, Parameter::kClockOffset));
}

}  // namespace

struct SelfCalibration::State {
  State(const SelfCalibrationOptions& o, CalibrationArchive* a) : options(o), archive(a) {}

  void begin_anew();
  void begin_fresh();
  void look_for_stored();
  void judge_agreement(const FrameTracks& tracks);
  [[nodiscard]] bool zoom_fits(const std::optional<double>& wanted) const;
  [[nodiscard]] bool calibrated_here() const;
  [[nodiscard]] double span_s() const;
  [[nodiscard]] bool storing_is_due() const;
  [[nodiscard]] bool adjusting_is_due() const;
  [[nodiscard]] CalibrationInput input() const;
  [[nodiscard]] Checked adjust(const Calibration* known) const;
  [[nodiscard]] std::unordered_map<std::int64_t, double> frame_times(
      const CalibrationResult& result) const;
  [[nodiscard]] double hold_out(const std::vector<CalibrationObservation>& held,
                                const CalibrationResult& result) const;
  [[nodiscard]] MapState make_map(const CalibrationResult& result) const;
  void try_first();
  void hold_against_published();
  void publish(const Checked& checked);
  void say_once(const std::string& line);

  SelfCalibrationOptions options;
  CalibrationArchive* archive;

  // The session: what was seen of one camera at one zoom through one connection.
  std::deque<KeptFrame> frames;
  std::deque<PanTiltSample> telemetry;
  std::vector<KeptPicture> pictures;
  FrameTracks::Tracker tracker = FrameTracks::Tracker::kNone;
  double began_s = 0;  // receive time of its first frame
  double last_try_s = 0;
  int tries = 0;

  std::optional<double> zoom;
  double zoom_changed_s = -1e9;
  double now_s = 0;  // the latest receive time of either stream
  double last_frame_s = 0;
  double last_sample_s = 0;
  bool video_is_lost = false;
  bool telemetry_is_lost = false;
  PanTilt<double> last_angle;

  std::shared_ptr<const PublishedCalibration> published;
  std::shared_ptr<const PublishedCalibration> next;  // to be published
  bool clock_offset_known = true;  // since the publication the frames' clock went on
  bool doubtful = false;
  int contradictions = 0;
  double watch_interval_s = kFirstWatch;
  std::deque<std::pair<double, bool>> agreement;  // time, whether landmarks contradicted telemetry

  CalibrationNeed need = CalibrationNeed::kNothing;
  double last_store_s = 0;
  std::atomic<bool> cancelled{false};
  std::atomic<bool> fresh_asked{false};
  bool fresh_wanted = false;  // a calibration in place of the one there is
  std::string said;
  std::vector<std::string> messages;
};

void SelfCalibration::State::say_once(const std::string& line) {
  if (line == said) return;
  said = line;
  messages.push_back(line);
}

void SelfCalibration::State::begin_fresh() {
  begin_anew();
  fresh_wanted = calibrated_here();
}

void SelfCalibration::State::begin_anew() {
  frames.clear();
  pictures.clear();
  tries = 0;
  agreement.clear();
}

bool SelfCalibration::State::zoom_fits(const std::optional<double>& wanted) const {
  return !zoom || !wanted || std::abs(*zoom - *wanted) <= options.zoom_tolerance;
}

bool SelfCalibration::State::calibrated_here() const {
  return published->calibrated && zoom_fits(published->calibration.zoom);
}

double SelfCalibration::State::span_s() const {
  return frames.empty() ? 0
                        : frames.back().stamp.receive_time_s - frames.front().stamp.receive_time_s;
}

// The zoom is another one: is it one that the camera had before?
void SelfCalibration::State::look_for_stored() {
  if (archive == nullptr || calibrated_here() || now_s < zoom_changed_s + kZoomArrives) return;
  const StoredCalibration* stored = archive->find(zoom);
  // One that claims to hold for any zoom would have fitted already.
  if (stored == nullptr || !stored->calibration.zoom) return;
  auto found = std::make_shared<PublishedCalibration>();
  found->calibration = stored->calibration;
  found->calibrated = true;
  found->map = stored->map;
  found->name = stored->path.empty() ? "live" : stored->path;
  messages.push_back(fmt::format("zoom {}: the calibration {} holds", *zoom, found->name));
  published = next = found;
  fresh_wanted = false;
  doubtful = false;
  contradictions = 0;
  // Which connection it was made with is not known.
  clock_offset_known = false;
  watch_interval_s = kFirstWatch;
  need = CalibrationNeed::kNothing;
}

void SelfCalibration::State::judge_agreement(const FrameTracks& tracks) {
  if (tracks.tracker != FrameTracks::Tracker::kOe || !calibrated_here()) return;
  const double time_s = tracks.stamp.receive_time_s;
  agreement.emplace_back(time_s, tracks.oe_status == OeStatus::kContradiction);
  while (agreement.front().first < time_s - kDisagreementSpan) agreement.pop_front();
  const auto against = std::count_if(agreement.begin(), agreement.end(),
                                     [](const auto& frame) { return frame.second; });
  const auto count = static_cast<double>(agreement.size());
  if (count < kFewFrames || static_cast<double>(against) < kDisagreement * count) return;
  auto withdrawn = std::make_shared<PublishedCalibration>();
  withdrawn->calibration = published->calibration;
  withdrawn->calibration.covariance = options.data_sheet.covariance;
  withdrawn->name = published->name + ", withdrawn";
  messages.push_back(
      fmt::format("landmarks contradict telemetry in {} of {} frames: the calibration {} is "
                  "withdrawn (was the camera moved on its mount, or its lens?); calibrating anew",
                  against, agreement.size(), published->name));
  published = next = withdrawn;
  doubtful = true;
  begin_anew();
}

bool SelfCalibration::State::storing_is_due() const {
  return archive != nullptr && archive->has_pending() && now_s > last_store_s + kStoreRetry;
}

bool SelfCalibration::State::adjusting_is_due() const {
  if (cancelled) return false;
  if (!options.automatic || frames.size() < 3 || now_s < zoom_changed_s + kZoomSettles)
    return false;
  const double newest_s = frames.back().stamp.receive_time_s;
  if (!calibrated_here() || fresh_wanted) {
    return span_s() >= options.first_try_s &&
           (tries == 0 || newest_s >= last_try_s + (tries < kManyTries ? kNextTry : kSlowTry));
  }
  return span_s() >= kWatchWindow && newest_s >= began_s + kWatchWindow &&
         newest_s >= last_try_s + (clock_offset_known ? watch_interval_s : kFirstWatch);
}

CalibrationInput SelfCalibration::State::input() const {
  CalibrationInput result;
  result.width = options.data_sheet.camera.width;
  result.height = options.data_sheet.camera.height;
  result.noise = options.noise;
  for (const KeptFrame& frame : frames) {
    for (const TrackedPoint& point : frame.points) {
      result.observations.push_back(
          {frame.stamp.frame, point.landmark, point.u_px, point.v_px, point.sigma_px});
    }
  }
  return result;
}

// When row 0 of each frame was captured; of frames that the calibration did not use between their neighbours, as
// their stamps say.
std::unordered_map<std::int64_t, double> SelfCalibration::State::frame_times(
    const CalibrationResult& result) const {
  std::unordered_map<std::int64_t, double> time_of;
  for (const FrameResult& frame : result.frames) time_of[frame.frame] = frame.time_s;
  for (std::size_t i = 1; i + 1 < frames.size(); ++i) {
    const FrameStamp& before = frames[i - 1].stamp;
    const FrameStamp& after = frames[i + 1].stamp;
    const FrameStamp& own = frames[i].stamp;
    const auto from = time_of.find(before.frame);
    const auto to = time_of.find(after.frame);
    if (!is_held_out(i) || from == time_of.end() || to == time_of.end()) continue;
    double share = 0.5;
    if (before.sender_time_s && own.sender_time_s && after.sender_time_s) {
      share = (*own.sender_time_s - *before.sender_time_s) /
              (*after.sender_time_s - *before.sender_time_s);
    } else if (before.sequence && own.sequence && after.sequence) {
      share = static_cast<double>(*own.sequence - *before.sequence) /
              static_cast<double>(*after.sequence - *before.sequence);
    }
    if (share > 0 && share < 1)
      time_of[own.frame] = from->second + share * (to->second - from->second);
  }
  return time_of;
}

// The rms of the normalised residuals in frames that the calibration did not see.
double SelfCalibration::State::hold_out(const std::vector<CalibrationObservation>& held,
                                        const CalibrationResult& result) const {
  const std::unordered_map<std::int64_t, double> time_of = frame_times(result);
  std::unordered_map<std::int64_t, const CalibrationLandmark*> landmark_of;
  for (const CalibrationLandmark& landmark : result.landmarks)
    landmark_of[landmark.landmark] = &landmark;
  const Calibration& c = result.calibration;
  std::vector<double> squares;
  for (const CalibrationObservation& seen : held) {
    const auto time_s = time_of.find(seen.frame);
    const auto landmark = landmark_of.find(seen.landmark);
    if (time_s == time_of.end() || landmark == landmark_of.end()) continue;
    const FrameMotion<double> motion{result.trajectory.position(time_s->second),
                                     result.trajectory.rate(time_s->second),
                                     0.0,
                                     {}};
    const Vector3<double>& d_b = landmark->second->d_b;
    Vector2<double> u = Vector2<double>::Zero();
    Matrix<double, 2, 3> J_d = Matrix<double, 2, 3>::Zero();
    if (rolling_shutter_project(c.camera, c.mechanics, c.line_delay, motion, d_b, &u, &J_d) !=
        ProjectionStatus::kOk) {
      continue;
    }
    const Matrix2<double> J = J_d * tangent_basis(d_b);
    const Matrix2<double> covariance = seen.sigma_px * seen.sigma_px * Matrix2<double>::Identity() +
                                       J * landmark->second->covariance * J.transpose();
    const Vector2<double> residual = Vector2<double>(seen.u_px, seen.v_px) - u;
    squares.push_back(residual.dot(covariance.inverse() * residual));
  }
  if (squares.empty()) return 0;
  // Robust: an outlier among them says nothing of the calibration. Half of chi-squares with 2 degrees of freedom lie
  // below 2 ln 2.
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle / (2 * std::log(2.0)));
}

// known: what is published, as prior; null: from the data alone.
Checked SelfCalibration::State::adjust(const Calibration* known) const {
  CalibrationInput all = input();
  CalibrationOptions adjustment = options.adjustment;
  adjustment.progress = [this](double, const char*) { return !cancelled; };
  std::vector<FrameStamp> stamps;
  for (const KeptFrame& frame : frames) stamps.push_back(frame.stamp);
  std::vector<std::string> remarks;
  add_frames(std::move(stamps), &all, &adjustment, &remarks);
  add_telemetry({telemetry.begin(), telemetry.end()}, &all, &adjustment, &remarks);
  // What all polls have in common is in the published clock offset as in the new data: no two of them
  // average it out.
  const double common_s = std::exchange(all.noise.telemetry_common_sigma_s, 0.0);
  if (known != nullptr) {
    const auto prior = [&](double value, Parameter p) {
      return CalibrationPrior{value, kPriorInflation * sigma_of(*known, p)};
    };
    adjustment.focal_length = prior(known->camera.focal_length, Parameter::kFocalLength);
    adjustment.radial_distortion =
        prior(known->camera.radial_distortion, Parameter::kRadialDistortion);
    adjustment.line_delay = prior(known->line_delay, Parameter::kLineDelay);
    if (clock_offset_known) {
      constexpr double kLeastOwn = 0.2;
      const double sigma_s = sigma_of(*known, Parameter::kClockOffset);
      const double own_s = std::sqrt(
          std::max(sigma_s * sigma_s - common_s * common_s, std::pow(kLeastOwn * sigma_s, 2)));
      adjustment.clock_offset = CalibrationPrior{known->clock_offset, kPriorInflation * own_s};
    }
    adjustment.pan_axis = known->mechanics.pan_axis;
    adjustment.tilt_axis = known->mechanics.tilt_axis;
    adjustment.axis_sigma_rad = 0;
    for (const Parameter p : {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0,
                              Parameter::kTiltAxis1}) {
      adjustment.axis_sigma_rad =
          std::max(adjustment.axis_sigma_rad, kPriorInflation * sigma_of(*known, p));
    }
  }
  std::unordered_map<std::int64_t, std::size_t> order;
  for (std::size_t i = 0; i < frames.size(); ++i) order[frames[i].stamp.frame] = i;
  all.observations = choose_tracks(all.observations, kMostObservations);
  const auto held = std::stable_partition(
      all.observations.begin(), all.observations.end(),
      [&](const CalibrationObservation& seen) { return !is_held_out(order[seen.frame]); });
  const std::vector<CalibrationObservation> held_out(held, all.observations.end());
  all.observations.erase(held, all.observations.end());

  Checked checked;
  checked.result = calibrate(all, adjustment);
  CalibrationResult& result = checked.result;
  if (!result.ok()) {
    checked.refusal = result.message;
    return checked;
  }
  checked.hold_out = hold_out(held_out, result);
  const double unit = std::max(1.0, result.quality.pixel_sigma_ratio);
  if (checked.hold_out > kWorstHoldOut * unit) {
    checked.refusal = fmt::format(
        "landmarks in frames that were held out lie {:.1f} sigmas from where they should",
        checked.hold_out);
  } else if (result.quality.pixel_sigma_ratio > kWorstPixelRatio) {
    checked.refusal = fmt::format("the landmarks' residuals are {:.1f} times the tracker's noise",
                                  result.quality.pixel_sigma_ratio);
  } else if (result.quality.telemetry_sigma_ratio > kWorstTelemetryRatio) {
    checked.refusal = fmt::format(
        "telemetry is {:.1f} times as noisy as stated: is pan_tilt.angle_sigma_rad right?",
        result.quality.telemetry_sigma_ratio);
  }
  // What the model lacks shows where it was not fitted: a trajectory that is coarser than the motion, patches
  // that err alike.
  const double excess = std::max(1.0, checked.hold_out / unit);
  result.calibration.covariance *= excess * excess;
  const int d = index(Parameter::kClockOffset);
  result.calibration.covariance(d, d) += common_s * common_s;
  result.calibration.zoom = zoom;
  return checked;
}

MapState SelfCalibration::State::make_map(const CalibrationResult& result) const {
  const std::unordered_map<std::int64_t, double> time_of = frame_times(result);
  std::vector<Keyframe> keyframes;
  for (const KeptPicture& picture : pictures) {
    const auto time = time_of.find(picture.frame);
    if (time == time_of.end()) continue;
    keyframes.push_back({time->second, picture.picture});
  }
  return map_from_keyframes(result, keyframes);
}

void SelfCalibration::State::publish(const Checked& checked) {
  auto fresh = std::make_shared<PublishedCalibration>();
  fresh->calibration = checked.result.calibration;
  fresh->calibrated = true;
  fresh->map = make_map(checked.result);
  fresh->name = "live";
  const CalibrationQuality& quality = checked.result.quality;
  messages.push_back(
      fmt::format("calibrated from {} frames, {} landmarks: {}; residuals {:.2f} of the tracker's "
                  "noise, {:.2f} "
                  "in frames held out; map of {} landmarks",
                  quality.frames, quality.landmarks, describe(fresh->calibration),
                  quality.pixel_sigma_ratio, checked.hold_out, fresh->map.landmarks.size()));
  if (archive != nullptr) {
    StoredCalibration stored;
    stored.calibration = fresh->calibration;
    stored.notes.quality = quality;
    stored.notes.excluded = checked.result.exclusions.describe();
    stored.map = fresh->map;
    std::string error;
    if (!archive->save(stored, &error)) messages.push_back(error + "; kept, will be tried again");
    last_store_s = now_s;
  }
  published = next = fresh;
  doubtful = false;
  contradictions = 0;
  clock_offset_known = true;
  fresh_wanted = false;
  said.clear();
  need = CalibrationNeed::kNothing;
}

// Without what an earlier calibration says.
void SelfCalibration::State::try_first() {
  ++tries;
  const Checked checked = adjust(nullptr);
  if (checked.refusal.empty()) {
    watch_interval_s = kFirstWatch;
    publish(checked);
    return;
  }
  need = need_of(checked.result);
  if (checked.result.status == CalibrationStatus::kOneAxisOnly) {
    need = checked.refusal.rfind("pan", 0) == 0 ? CalibrationNeed::kPan : CalibrationNeed::kTilt;
  }
  say_once(fmt::format("{} ({}): {}",
                       fresh_wanted ? "no fresh calibration yet" : "not calibrated yet",
                       to_string(checked.result.status), checked.refusal));
}

void SelfCalibration::State::hold_against_published() {
  watch_interval_s = std::min(2 * watch_interval_s, kLongestWatch);
  const Checked alone = adjust(nullptr);
  // Motion that does not suffice tells nothing against what is known.
  if (!alone.refusal.empty()) return;
  const double chi_square =
      disagreement(published->calibration, alone.result.calibration, clock_offset_known);
  if (chi_square > kContradiction) {
    watch_interval_s = kFirstWatch;
    messages.push_back(
        fmt::format("the camera is not what the calibration says (chi-square {:.0f}): {}",
                    chi_square, describe(alone.result.calibration)));
    // Once may be chance: the second time it is believed.
    if (++contradictions >= 2) publish(alone);
    return;
  }
  contradictions = 0;
  const Checked refined = adjust(&published->calibration);
  if (!refined.refusal.empty()) return;
  if (!clock_offset_known || is_better(refined.result.calibration, published->calibration))
    publish(refined);
}

SelfCalibration::SelfCalibration(const SelfCalibrationOptions& options, CalibrationArchive* archive)
    : state_(std::make_unique<State>(options, archive)) {
  auto first = std::make_shared<PublishedCalibration>();
  const StoredCalibration* stored = archive != nullptr ? archive->find(std::nullopt) : nullptr;
  if (stored != nullptr) {
    first->calibration = stored->calibration;
    first->calibrated = true;
    first->map = stored->map;
    first->name = stored->path;
  } else {
    first->calibration = options.data_sheet;
    first->name = "data sheet";
  }
  state_->published = first;
  // The connection that it was made with is another one.
  state_->clock_offset_known = stored == nullptr;
}

SelfCalibration::~SelfCalibration() = default;

std::shared_ptr<const PublishedCalibration> SelfCalibration::first() { return state_->published; }

void SelfCalibration::add(const FrameTracks& tracks) {
  State& s = *state_;
  s.now_s = std::max(s.now_s, tracks.stamp.receive_time_s);
  s.last_frame_s = tracks.stamp.receive_time_s;
  s.video_is_lost = false;
  if (tracks.clock_restarted || tracks.floor_shifted) {
    if (!s.frames.empty()) s.begin_anew();
    if (s.calibrated_here()) {
      s.clock_offset_known = false;
    }
  }
  s.judge_agreement(tracks);
  if (tracks.tracker == FrameTracks::Tracker::kNone) return;
  if (tracks.tracker != s.tracker) {
    s.begin_anew();
    s.tracker = tracks.tracker;
  }
  if (s.fresh_asked.exchange(false)) s.begin_fresh();
  if (s.frames.empty()) {
    s.began_s = tracks.stamp.receive_time_s;
    s.last_try_s = s.began_s;
  }
  KeptFrame frame{tracks.stamp, {}};
  // Within one session a reconnection is none: begin_anew() saw to that.
  frame.stamp.restarted = false;
  frame.points.assign(tracks.points.begin(), tracks.points.begin() + tracks.count);
  s.frames.push_back(std::move(frame));
  while (s.frames.size() > s.options.max_frames || s.span_s() > s.options.window_s)
    s.frames.pop_front();
  const double oldest_s = s.frames.front().stamp.receive_time_s;
  while (!s.telemetry.empty() && s.telemetry.front().latest_time_s < oldest_s - kTelemetryMargin) {
    s.telemetry.pop_front();
  }
  s.pictures.erase(std::remove_if(s.pictures.begin(), s.pictures.end(),
                                  [oldest_s](const KeptPicture& picture) {
                                    return picture.receive_time_s < oldest_s;
                                  }),
                   s.pictures.end());
}

bool SelfCalibration::wants_keyframe() const {
  constexpr double kApart = 0.3;  // of the field of view
  const State& s = *state_;
  if (!s.options.automatic || s.frames.empty() || s.telemetry.empty()) return false;
  const Camera<double>& camera = s.published->calibration.camera;
  const double apart = kApart * camera.width / camera.focal_length;
  return std::all_of(s.pictures.begin(), s.pictures.end(), [&](const KeptPicture& picture) {
    const double pan = wrap_angle(picture.pan - s.last_angle.pan) * std::cos(picture.tilt);
    return std::hypot(pan, picture.tilt - s.last_angle.tilt) > apart;
  });
}

void SelfCalibration::add_keyframe(const ImageView& picture) {
  State& s = *state_;
  if (s.frames.empty() || !picture.valid() || picture.width != s.options.data_sheet.camera.width ||
      picture.height != s.options.data_sheet.camera.height) {
    return;
  }
  if (s.pictures.size() >= s.options.max_keyframes) s.pictures.erase(s.pictures.begin());
  const FrameStamp& stamp = s.frames.back().stamp;
  s.pictures.push_back({stamp.frame, stamp.receive_time_s, s.last_angle.pan, s.last_angle.tilt,
                        std::make_shared<PackedPicture>(picture)});
}

void SelfCalibration::add(const PanTiltSample& sample) {
  State& s = *state_;
  s.now_s = std::max(s.now_s, sample.latest_time_s);
  s.last_sample_s = sample.latest_time_s;
  s.telemetry_is_lost = false;
  s.last_angle = {sample.pan_rad, sample.tilt_rad};
  if (sample.restarted) s.telemetry.clear();
  if (sample.zoom && !(s.zoom && std::abs(*sample.zoom - *s.zoom) <= s.options.zoom_tolerance)) {
    if (s.zoom) s.zoom_changed_s = sample.latest_time_s;
    s.zoom = sample.zoom;
    s.begin_anew();
  }
  s.look_for_stored();
  s.telemetry.push_back(sample);
  // Without frames nothing else bounds it.
  constexpr std::size_t kMostSamples = 20000;
  if (s.telemetry.size() > kMostSamples) s.telemetry.pop_front();
}

void SelfCalibration::video_lost() { state_->video_is_lost = true; }
void SelfCalibration::telemetry_lost() { state_->telemetry_is_lost = true; }

bool SelfCalibration::ask_for_fresh() {
  if (!state_->options.automatic) return false;
  state_->fresh_asked = true;
  return true;
}

void SelfCalibration::cancel() { state_->cancelled = true; }

bool SelfCalibration::due() const { return state_->storing_is_due() || state_->adjusting_is_due(); }

std::shared_ptr<const PublishedCalibration> SelfCalibration::work() {
  State& s = *state_;
  if (s.storing_is_due()) {
    std::string error;
    s.last_store_s = s.now_s;
    s.say_once(s.archive->save_pending(&error) ? "the calibration is stored now" : error);
  }
  if (s.adjusting_is_due()) {
    s.last_try_s = s.frames.back().stamp.receive_time_s;
    if (s.calibrated_here() && !s.fresh_wanted) {
      s.hold_against_published();
    } else {
      s.try_first();
    }
  }
  return std::exchange(s.next, nullptr);
}

CalibrationReport SelfCalibration::report() const {
  const State& s = *state_;
  CalibrationReport report;
  if (!s.options.automatic) return report;
  report.activity = s.calibrated_here() ? CalibrationActivity::kWatching
                    : s.doubtful        ? CalibrationActivity::kDoubtful
                                        : CalibrationActivity::kCollecting;
  if (s.calibrated_here() && !s.fresh_wanted) return report;
  if (s.video_is_lost || s.last_frame_s < s.now_s - kSilence) {
    report.need = CalibrationNeed::kVideo;
  } else if (s.telemetry_is_lost || s.last_sample_s < s.now_s - kSilence) {
    report.need = CalibrationNeed::kTelemetry;
  } else if (s.now_s < s.zoom_changed_s + kZoomSettles) {
    report.need = CalibrationNeed::kSteadyZoom;
  } else {
    report.need = s.tries > 0 ? s.need : CalibrationNeed::kTime;
  }
  return report;
}

std::vector<std::string> SelfCalibration::take_messages() {
  return std::exchange(state_->messages, {});
}

}  // namespace alidade
