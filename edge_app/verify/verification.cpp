#include "edge_app/verify/verification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/model/angle.h"
#include "core/model/median.h"
#include "core/model/recording_needs.h"
#include "edge_app/verify/verification_words.h"

namespace alidade {
namespace {

constexpr double kFalseAlarms = 0.01;  // of all comparisons together
constexpr double kOtherPlace = 0.3;    // of the picture's width or height
constexpr double kOtherSpeed = 0.5;    // of the largest difference of speeds
constexpr double kOtherZoom = 0.02;    // of f
constexpr double kSharpEnough = 20;    // times the claimed sigma; a blunter test says nothing
constexpr double kDegrees = 180 / kPi;

double log_f(const SeenFrame& frame) {
  return std::log(frame.by_telemetry.calibration.camera.focal_length);
}

Vector2<double> rate_difference(const SeenFrame& a, const SeenFrame& b) {
  return (a.by_telemetry.rate.vector() - b.by_telemetry.rate.vector()).cwiseAbs();
}

bool is_of_kind(ReturnKind kind, const std::vector<SeenFrame>& frames, const PairRows& pair,
                const Vector2<double>& largest_rate_difference) {
  const SeenFrame& first = frames[pair.first];
  const SeenFrame& second = frames[pair.second];
  const Camera<double>& camera = first.by_telemetry.calibration.camera;
  switch (kind) {
    case ReturnKind::kAll:
      return true;
    case ReturnKind::kOtherSide:
      return first.heading.pan * second.heading.pan < 0 ||
             first.heading.tilt * second.heading.tilt < 0;
    case ReturnKind::kOtherSpeed:
      return (rate_difference(first, second).array() >
              kOtherSpeed * largest_rate_difference.array())
          .any();
    case ReturnKind::kOtherPlace: {
      Vector2<double> moved = Vector2<double>::Zero();
      for (const PlaceRow& place : pair.places) moved += place.moved.cwiseAbs();
      moved /= static_cast<double>(pair.places.size());
      return moved.x() > kOtherPlace * camera.width || moved.y() > kOtherPlace * camera.height;
    }
    case ReturnKind::kOtherZoom:
      return std::abs(log_f(first) - log_f(second)) > kOtherZoom;
    case ReturnKind::kCount:
      break;
  }
  return false;
}

std::vector<PairRows> of_kind(ReturnKind kind, const std::vector<SeenFrame>& frames,
                              const std::vector<PairRows>& pairs) {
  Vector2<double> largest(1e-12, 1e-12);
  for (const PairRows& pair : pairs)
    largest = largest.cwiseMax(rate_difference(frames[pair.first], frames[pair.second]));
  std::vector<PairRows> out;
  for (const PairRows& pair : pairs) {
    if (is_of_kind(kind, frames, pair, largest)) out.push_back(pair);
  }
  return out;
}

// A frame of the lens at which most frames were taken. frames: not empty.
std::size_t usual_zoom(const std::vector<SeenFrame>& frames) {
  std::size_t reference = 0;
  std::vector<std::size_t> order(frames.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return log_f(frames[a]) < log_f(frames[b]); });
  std::size_t most = 0;
  for (std::size_t low = 0, high = 0; low < order.size(); ++low) {
    while (high < order.size() &&
           log_f(frames[order[high]]) <= log_f(frames[order[low]]) + kSameZoom) {
      ++high;
    }
    if (high - low > most) reference = order[(low + high) / 2];
    most = std::max(most, high - low);
  }
  return reference;
}

bool is_at_zoom_of(const SeenFrame& frame, const SeenFrame& reference) {
  return is_same_zoom(frame.by_telemetry, reference.by_telemetry);
}

std::vector<PlacePair> at_one_zoom(const std::vector<SeenFrame>& frames,
                                   const std::vector<PlacePair>& pairs,
                                   const SeenFrame& reference) {
  std::vector<PlacePair> out;
  for (const PlacePair& pair : pairs) {
    const auto is_there = [&](std::size_t frame) {
      return is_at_zoom_of(frames[frame], reference);
    };
    if (is_there(pair.first) && is_there(pair.second)) out.push_back(pair);
  }
  return out;
}

Verdict verdict_of(const DepartureTest& test, double log_limit) {
  if (test.freedom == 0) return Verdict::kNotJudged;
  if (test.log_chance < log_limit) return Verdict::kContradicted;
  const bool is_blunt = test.claimed_sigma > 0 && !test.sigma.empty() &&
                        test.sigma.front() > kSharpEnough * test.claimed_sigma;
  return is_blunt ? Verdict::kNotJudged : Verdict::kHolds;
}

// Telemetry's samples have so much to say of slow errors; the frames' covariances, taken as
// independent, must not claim more.
double motion_inflation(const VerifyInput& input, OrientationFrom from) {
  if (input.frames.size() < 2 || !(input.telemetry_sigma_rad > 0)) return 1;
  std::vector<double> variances;
  for (const SeenFrame& frame : input.frames)
    variances.push_back(orientation(frame, from).motion_covariance(0, 0));
  const double duration_s = input.frames.back().time_s - input.frames.front().time_s;
  const double of_frames = static_cast<double>(input.frames.size()) / median(std::move(variances));
  const double of_samples = std::max(2.0, duration_s * input.telemetry_rate_hz) /
                            (input.telemetry_sigma_rad * input.telemetry_sigma_rad);
  return std::max(1.0, of_frames / of_samples);
}

// Nothing if all frames are of one zoom.
std::optional<JudgedZooms> judged_zooms(const std::vector<SeenFrame>& frames) {
  if (frames.empty()) return std::nullopt;
  const auto [least, most] = std::minmax_element(
      frames.begin(), frames.end(),
      [](const SeenFrame& a, const SeenFrame& b) { return log_f(a) < log_f(b); });
  if (log_f(*most) - log_f(*least) <= kOtherZoom) return std::nullopt;
  const SeenFrame& usual = frames[usual_zoom(frames)];
  JudgedZooms out{std::exp(log_f(*least)), std::exp(log_f(*most)), std::exp(log_f(usual)), 0};
  for (const SeenFrame& frame : frames) out.usual_frames += is_at_zoom_of(frame, usual) ? 1 : 0;
  return out;
}

struct Extent {
  double pan = 0, tilt = 0;  // rad
  double reversals = 0;      // of either axis
};

// frames: not empty.
Extent extent_of(const std::vector<const SeenFrame*>& frames) {
  const auto angle = [](const SeenFrame* frame) { return frame->by_telemetry.angle; };
  const auto [left, right] = std::minmax_element(
      frames.begin(), frames.end(),
      [&](const auto* a, const auto* b) { return angle(a).pan < angle(b).pan; });
  const auto [low, high] = std::minmax_element(
      frames.begin(), frames.end(),
      [&](const auto* a, const auto* b) { return angle(a).tilt < angle(b).tilt; });
  Extent out;
  out.pan = angle(*right).pan - angle(*left).pan;
  out.tilt = angle(*high).tilt - angle(*low).tilt;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (frames[i]->heading.pan * frames[i - 1]->heading.pan < 0) ++out.reversals;
    if (frames[i]->heading.tilt * frames[i - 1]->heading.tilt < 0) ++out.reversals;
  }
  return out;
}

// RMS of both axes, rad/s.
double usual_rate(const std::vector<SeenFrame>& frames) {
  double square = 0;
  for (const SeenFrame& frame : frames) square += frame.by_all_samples.rate.vector().squaredNorm();
  return std::sqrt(square / (2 * static_cast<double>(frames.size())));
}

// What the noise would have to be stated as; empty if neither jitter nor noise was found.
std::string advice_of_noise(const VerifyInput& input, const std::vector<DepartureTest>& found) {
  const auto size_of_noise = [&found](Departure departure) {
    const DepartureTest* test = test_of(found, departure);
    return test == nullptr ? 0.0 : test->size.front();
  };
  const double jitter_rad = usual_rate(input.frames) * size_of_noise(Departure::kTimeJitter);
  const double noise_rad = size_of_noise(Departure::kAngleNoise);
  if (!(jitter_rad > 0 || noise_rad > 0)) return "";
  return fmt::format(
      "set pan_tilt.angle_sigma_rad: {:.2g}, which is what is stated now, the noise and the jitter "
      "at this recording's speeds together, and calibrate again; a recording keeps what was stated "
      "when it was made (pan_tilt_sigma_rad in its noise.yaml)",
      std::hypot(input.telemetry_sigma_rad, noise_rad, jitter_rad));
}

std::vector<std::string> advice_for(const VerifyInput& input, const Verification& verification) {
  std::vector<std::string> out;
  if (input.frames.size() < 2) {
    out.push_back(
        fmt::format("record for {:g} s at least, with pictures and telemetry, while the head turns",
                    kVerificationLeast_s));
    return out;
  }
  const SeenFrame& usual = input.frames[usual_zoom(input.frames)];
  std::vector<const SeenFrame*> of_usual_zoom;
  for (const SeenFrame& frame : input.frames) {
    if (is_at_zoom_of(frame, usual)) of_usual_zoom.push_back(&frame);
  }
  const Extent extent = extent_of(of_usual_zoom);
  const Camera<double>& camera = usual.by_telemetry.calibration.camera;
  const double width = camera.width / camera.focal_length;
  const double height = camera.height / camera.focal_length;
  if (extent.pan < kVerificationRangeLeast * width)
    out.push_back(fmt::format("pan over {:.2g} degrees or more and back",
                              kVerificationRangeAsked * width * kDegrees));
  if (extent.tilt < kVerificationRangeLeast * height)
    out.push_back(fmt::format("tilt over {:.2g} degrees or more and back",
                              kVerificationRangeAsked * height * kDegrees));
  if (extent.reversals < kReversalsLeast)
    out.push_back(fmt::format(
        "turn back {} times or more, so that places are passed from both sides", kReversalsLeast));
  const auto is_judged = [](const ClaimComparison& claim) {
    return claim.verdict != Verdict::kNotJudged;
  };
  if (verification.pairs >= kReturnsLeast &&
      std::none_of(verification.claims.begin(), verification.claims.end(), is_judged)) {
    out.push_back(fmt::format("record longer, {:g} s or more{}, so that returns are judged, too",
                              kVerificationAsked_s, verification.zooms ? " at one zoom" : ""));
  }
  const auto is_clock = [](const DepartureTest& test) {
    return test.departure == Departure::kClockOffset;
  };
  if (std::any_of(verification.found.begin(), verification.found.end(), is_clock)) {
    out.emplace_back(
        "the clock offset is that of the link, which `run` finds anew at each start: did pictures "
        "or angles come later or earlier for a part of the recording?");
  }
  if (input.telemetry_is_seldom_new) {
    out.emplace_back(
        "the head's device repeats its angles while it turns, so that the time of an angle and the "
        "rates are uncertain, and the line delay is not judged: ask it for angles less often, or "
        "three times as often as it renews them (pan_tilt.rate_hz; `alidade check`, line changes)");
  }
  if (std::string noise = advice_of_noise(input, verification.found); !noise.empty())
    out.push_back(std::move(noise));
  if (verification.pairs < kReturnsLeast && out.empty())
    out.push_back(fmt::format("record longer, {:g} s or more, over a scene with more texture",
                              kVerificationAsked_s));
  return out;
}

bool is_noise(const DepartureTest& test) {
  return test.departure == Departure::kTimeJitter || test.departure == Departure::kAngleNoise;
}

// The turn of the platform that the known directions would agree with.
std::optional<KnownResult> turn_that_agrees(const VerifyInput& input, OrientationFrom from,
                                            double log_limit) {
  const TurnSigma& stated = input.turn_sigma;
  for (const TurnSigma& tried :
       {TurnSigma{TurnSigma::kFree, stated.level}, TurnSigma{TurnSigma::kFree, TurnSigma::kFree}}) {
    if (tried.heading == stated.heading && tried.level == stated.level) continue;
    KnownResult result = check_known(input.known, from, tried);
    const bool is_new = !result.turn_sigma.isZero();
    if (result.is_determined && is_new && result.log_chance >= log_limit) return result;
  }
  return std::nullopt;
}

void judge_known(const VerifyInput& input, double log_limit, Verification* out) {
  for (const OrientationFrom from : {OrientationFrom::kLandmarks, OrientationFrom::kTelemetry}) {
    KnownComparison comparison;
    comparison.from = from;
    comparison.result = check_known(input.known, from, input.turn_sigma);
    const KnownResult& result = comparison.result;
    if (result.is_determined && result.log_chance < log_limit) {
      comparison.verdict = Verdict::kContradicted;
      comparison.turned = turn_that_agrees(input, from, log_limit);
      out->verdict = Verdict::kContradicted;
    } else if (result.is_determined && result.share >= kLeastShare) {
      comparison.verdict = Verdict::kHolds;
      if (out->verdict == Verdict::kNotJudged) out->verdict = Verdict::kHolds;
    }
    comparison.sentence = sentence_of(comparison);
    out->known.push_back(std::move(comparison));
  }
}

}  // namespace

void leave_out_covered_noise(Verification* out) {
  if (std::none_of(out->found.begin(), out->found.end(), is_noise)) return;
  for (const ClaimComparison& claim : out->claims) {
    if (claim.from != OrientationFrom::kTelemetry) continue;
    const bool covers = claim.verdict == Verdict::kNotJudged ||
                        (claim.verdict == Verdict::kHolds && claim.result.ratio <= 1);
    if (!covers) return;
    if (claim.kind == ReturnKind::kAll && claim.verdict == Verdict::kNotJudged) return;
  }
  for (ModelComparison& comparison : out->model) {
    const bool is_cause = test_of(out->found, comparison.test.departure) != nullptr;
    if (is_cause && !is_noise(comparison.test)) continue;
    if (!is_cause && comparison.verdict != Verdict::kContradicted) continue;
    comparison.is_covered = true;
    comparison.verdict = Verdict::kHolds;
  }
  out->found.erase(std::remove_if(out->found.begin(), out->found.end(), is_noise),
                   out->found.end());
}

Verification verify(const VerifyInput& input) {
  Verification out;
  const std::vector<SeenFrame>& frames = input.frames;
  const std::vector<PlacePair> pairs = match_places(frames);
  out.by_landmarks = pair_rows(frames, pairs, OrientationFrom::kLandmarks);
  out.by_telemetry = pair_rows(frames, pairs, OrientationFrom::kTelemetry);
  out.pairs = static_cast<int>(out.by_telemetry.size());
  out.zooms = judged_zooms(frames);
  out.link = input.link;
  constexpr int kKinds = static_cast<int>(ReturnKind::kCount);
  const int of_known = input.known.empty() ? 0 : 2;
  out.chance_limit = kFalseAlarms / (2 * kKinds + kDepartureCount + of_known);
  const double log_limit = std::log(out.chance_limit);
  if (!out.by_telemetry.empty()) {
    const SeenFrame& reference = frames[usual_zoom(frames)];
    const Calibration& calibration = reference.by_telemetry.calibration;
    const ModelCheckResult model = check_model(
        frames, at_one_zoom(frames, pairs, reference), calibration, input.telemetry_error,
        motion_inflation(input, OrientationFrom::kAllSamples), log_limit,
        input.telemetry_is_seldom_new ? std::vector{Departure::kLineDelay}
                                      : std::vector<Departure>());
    out.places = model.places;
    out.noise_ratio = model.noise_ratio;
    out.found = model.found;
    for (const DepartureTest& test : model.tests)
      out.model.push_back({verdict_of(test, log_limit), test, false, ""});
    const double noise_factor = std::max(1.0, model.noise_ratio * model.noise_ratio);
    for (const OrientationFrom from : {OrientationFrom::kLandmarks, OrientationFrom::kTelemetry}) {
      const std::vector<PairRows>& all =
          from == OrientationFrom::kLandmarks ? out.by_landmarks : out.by_telemetry;
      for (int kind = 0; kind < kKinds; ++kind) {
        ClaimComparison comparison;
        comparison.kind = static_cast<ReturnKind>(kind);
        comparison.from = from;
        comparison.result = check_claims(
            pair_means(of_kind(comparison.kind, frames, all), noise_factor), frames, from,
            from == OrientationFrom::kTelemetry ? motion_inflation(input, from) : 1);
        const ClaimResult& result = comparison.result;
        if (result.pairs >= kReturnsLeast && result.freedom >= kLeastFreedom) {
          comparison.verdict =
              result.log_chance < log_limit ? Verdict::kContradicted : Verdict::kHolds;
        }
        comparison.sentence = sentence_of(comparison);
        out.claims.push_back(std::move(comparison));
      }
    }
  }
  leave_out_covered_noise(&out);
  const bool is_enough = out.pairs >= kReturnsLeast;
  if (is_enough) out.verdict = Verdict::kHolds;
  for (ModelComparison& comparison : out.model) {
    // What is blunt by itself may be sharp once the other causes are allowed for.
    if (test_of(out.found, comparison.test.departure) != nullptr)
      comparison.verdict = Verdict::kContradicted;
    if (!is_enough) comparison.verdict = Verdict::kNotJudged;
    comparison.sentence = sentence_of(comparison, out.found);
    if (comparison.verdict == Verdict::kContradicted) out.verdict = Verdict::kContradicted;
  }
  for (const ClaimComparison& comparison : out.claims) {
    if (comparison.verdict == Verdict::kContradicted) out.verdict = Verdict::kContradicted;
  }
  if (!is_enough) out.found.clear();
  if (!input.known.empty()) judge_known(input, log_limit, &out);
  out.advice = advice_for(input, out);
  out.sentence = summary_of(out);
  return out;
}

}  // namespace alidade
