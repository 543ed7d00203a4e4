#include "edge_app/verify/verification_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/model/angle.h"
#include "core/model/recording_needs.h"

namespace alidade {
namespace {

double largest_sigmas(const DepartureTest& test) {
  double out = 0;
  for (std::size_t i = 0; i < test.size.size(); ++i) {
    if (test.sigma[i] > 0) out = std::max(out, std::abs(test.size[i]) / test.sigma[i]);
  }
  return out;
}

// The sizes at those knots of a curve that are known to within some times the best one; not empty.
std::vector<double> well_known(const DepartureTest& test) {
  constexpr double kWorse = 30;
  double best = std::numeric_limits<double>::infinity();
  for (const double sigma : test.sigma) {
    if (sigma > 0) best = std::min(best, sigma);
  }
  std::vector<double> out;
  for (std::size_t i = 0; i < test.size.size(); ++i) {
    if (test.sigma[i] > 0 && test.sigma[i] <= kWorse * best) out.push_back(test.size[i]);
  }
  return out.size() < 2 ? test.size : out;
}

// The comparison with what is known from outside that decides; null: none.
const KnownComparison* worst_known(const Verification& verification) {
  const KnownComparison* worst = nullptr;
  for (const KnownComparison& each : verification.known) {
    if (each.verdict == Verdict::kNotJudged) continue;
    if (worst == nullptr || each.result.log_chance < worst->result.log_chance) worst = &each;
  }
  return worst;
}

std::string directions(std::size_t count) {
  return fmt::format("{} direction{}", count, count == 1 ? "" : "s");
}

// The platform's turn, axis by axis, if any was estimated.
std::string turn_of(const KnownResult& result, const char* if_none, const char* before) {
  constexpr double kDegrees = 180 / kPi;
  constexpr const char* kNames[] = {"roll", "pitch", "heading"};
  std::string out;
  for (const int axis : {2, 1, 0}) {
    if (!(result.turn_sigma[axis] > 0)) continue;
    out += fmt::format("{}{} {:.4f} +- {:.2g} deg", out.empty() ? before : ", ", kNames[axis],
                       kDegrees * result.turn[axis], kDegrees * result.turn_sigma[axis]);
  }
  return out.empty() ? if_none : out;
}

std::string joined(const std::vector<std::string>& parts) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : "; ") + part;
  return out;
}

const ClaimComparison* worst_claim(const Verification& verification) {
  const ClaimComparison* worst = nullptr;
  for (const ClaimComparison& each : verification.claims) {
    if (each.verdict == Verdict::kNotJudged) continue;
    const bool is_worse =
        worst == nullptr ||
        (each.verdict == Verdict::kContradicted) > (worst->verdict == Verdict::kContradicted) ||
        (each.verdict == worst->verdict && each.result.ratio > worst->result.ratio);
    if (is_worse) worst = &each;
  }
  return worst;
}

std::string names_of(const std::vector<DepartureTest>& found) {
  std::string out;
  for (const DepartureTest& test : found) {
    out += out.empty() ? "" : &test == &found.back() ? " and " : ", ";
    out += name_of(test.departure);
  }
  return out;
}

}  // namespace

const DepartureTest* test_of(const std::vector<DepartureTest>& found, Departure departure) {
  const auto at = std::find_if(found.begin(), found.end(), [departure](const DepartureTest& test) {
    return test.departure == departure;
  });
  return at == found.end() ? nullptr : &*at;
}

const char* mode_of(OrientationFrom from) {
  return from == OrientationFrom::kLandmarks ? "OE" : "PT";
}

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kHolds:
      return "holds";
    case Verdict::kContradicted:
      return "contradicted";
    case Verdict::kNotJudged:
      return "not judged";
  }
  return "unknown";
}

const char* name_of(ReturnKind kind) {
  switch (kind) {
    case ReturnKind::kAll:
      return "all returns";
    case ReturnKind::kOtherSide:
      return "returns from the other side";
    case ReturnKind::kOtherSpeed:
      return "returns at another speed";
    case ReturnKind::kOtherPlace:
      return "elsewhere in the picture";
    case ReturnKind::kOtherZoom:
      return "returns at another zoom";
    case ReturnKind::kCount:
      break;
  }
  return "unknown";
}

const char* name_of(Departure departure) {
  switch (departure) {
    case Departure::kFocalLength:
      return "focal length";
    case Departure::kDistortion:
      return "radial distortion";
    case Departure::kCentre:
      return "optical centre";
    case Departure::kAspect:
      return "aspect, or the scale of one axis";
    case Departure::kLineDelay:
      return "line delay";
    case Departure::kPanAxis:
      return "pan axis";
    case Departure::kTiltAxis:
      return "tilt axis";
    case Departure::kClockOffset:
      return "clock offset";
    case Departure::kPanGear:
      return "pan's error over the angle (gear)";
    case Departure::kTiltGear:
      return "tilt's error over the angle (gear)";
    case Departure::kPanPlay:
      return "play of pan";
    case Departure::kTiltPlay:
      return "play of tilt";
    case Departure::kFocalDrift:
      return "focal length that drifts";
    case Departure::kPanDrift:
      return "zero of pan that drifts";
    case Departure::kTiltDrift:
      return "zero of tilt that drifts";
    case Departure::kTimeJitter:
      return "jitter of telemetry's times";
    case Departure::kAngleNoise:
      return "noise of telemetry's angles";
    case Departure::kCount:
      break;
  }
  return "unknown";
}

std::string size_of(const DepartureTest& test) {
  if (test.size.empty()) return "no size";
  const auto one = [&test](double unit, const char* name) {
    return fmt::format("off by {:.3g} +- {:.2g}{}", unit * test.size.front(),
                       unit * test.sigma.front(), name);
  };
  const auto curve = [&test](double unit, const char* name) {
    // What all knots have in common is no error. A knot that the recording does not show has a
    // sigma without end, and any size.
    const std::vector<double> shown = well_known(test);
    const auto n = static_cast<double>(shown.size());
    const double mean = std::accumulate(shown.begin(), shown.end(), 0.0) / n;
    double square = 0;
    for (const double size : shown) square += (size - mean) * (size - mean);
    return fmt::format("RMS {:.3g}{}, {:.1f} sigmas at most", unit * std::sqrt(square / n), name,
                       largest_sigmas(test));
  };
  const auto noise = [&test](double unit, const char* name) {
    return fmt::format("RMS {:.2g} +- {:.1g}{} beyond what is stated", unit * test.size.front(),
                       unit * test.sigma.front(), name);
  };
  constexpr double kMilli = 1e3;
  constexpr double kMicro = 1e6;
  switch (test.departure) {
    case Departure::kFocalLength:
      return one(1, " px");
    case Departure::kCentre:
      return fmt::format("off by ({:.3g}, {:.3g}) +- ({:.2g}, {:.2g}) px", test.size[0],
                         test.size[1], test.sigma[0], test.sigma[1]);
    case Departure::kDistortion:
    case Departure::kAspect:
      return one(1, "");
    case Departure::kLineDelay:
      return one(kMicro, " us/row");
    case Departure::kPanAxis:
    case Departure::kTiltAxis:
      return fmt::format("off by ({:.3g}, {:.3g}) +- ({:.2g}, {:.2g}) mrad", kMilli * test.size[0],
                         kMilli * test.size[1], kMilli * test.sigma[0], kMilli * test.sigma[1]);
    case Departure::kClockOffset:
      return one(kMilli, " ms");
    case Departure::kPanPlay:
    case Departure::kTiltPlay:
      return fmt::format("{:.3g} +- {:.2g} mrad", kMilli * std::abs(test.size.front()),
                         kMilli * test.sigma.front());
    case Departure::kPanGear:
    case Departure::kTiltGear:
    case Departure::kPanDrift:
    case Departure::kTiltDrift:
      return curve(kMilli, " mrad");
    case Departure::kFocalDrift:
      return curve(1, " px");
    case Departure::kTimeJitter:
      return noise(kMilli, " ms");
    case Departure::kAngleNoise:
      return noise(kMilli, " mrad");
    case Departure::kCount:
      break;
  }
  return "";
}

std::string sentence_of(const ClaimComparison& comparison) {
  const ClaimResult& r = comparison.result;
  const std::string where =
      fmt::format("{}, {} mode", name_of(comparison.kind), mode_of(comparison.from));
  if (comparison.verdict == Verdict::kNotJudged) {
    return fmt::format(
        "{}: not judged; {} pairs, worth {:.0f} independent numbers ({} and {:.0f} "
        "are needed)",
        where, r.pairs, r.freedom, kReturnsLeast, kLeastFreedom);
  }
  return fmt::format(
      "{}: directions of the same place differ by {:.2f} times what sigma claims (95 %: {:.2f} to "
      "{:.2f}){}",
      where, r.ratio, r.low, r.high,
      comparison.verdict == Verdict::kContradicted ? ", more than chance" : "");
}

std::string sentence_of(const ModelComparison& comparison,
                        const std::vector<DepartureTest>& found) {
  const DepartureTest& test = comparison.test;
  const char* name = name_of(test.departure);
  switch (comparison.verdict) {
    case Verdict::kNotJudged:
      return fmt::format("{}: not judged; this recording does not show it", name);
    case Verdict::kHolds:
      if (comparison.is_covered)
        return fmt::format("{}: {}; PT mode's sigmas cover that", name, size_of(test));
      return fmt::format("{}: as calibrated; by this recording alone {}", name, size_of(test));
    case Verdict::kContradicted:
      if (const DepartureTest* beside = test_of(found, test.departure);
          beside != nullptr && found.size() > 1)
        return fmt::format("{}: contradicted; beside the other causes {}", name, size_of(*beside));
      if (found.empty() || found.front().departure == test.departure)
        return fmt::format("{}: contradicted; by this recording alone {}", name, size_of(test));
      return fmt::format("{}: {} if nothing else were wrong; explained by {}", name, size_of(test),
                         names_of(found));
  }
  return name;
}

std::string sentence_of(const KnownComparison& comparison) {
  const KnownResult& r = comparison.result;
  std::string out = fmt::format("known directions, {} mode: ", mode_of(comparison.from));
  if (r.offsets.empty()) return out + "not judged; none of their frames has an orientation";
  if (!r.is_determined) {
    return out + fmt::format(
                     "not judged; {} do not tell how the platform is turned; give more, farther "
                     "apart, or its --heading-sigma and --level-sigma",
                     directions(r.offsets.size()));
  }
  const std::string off = fmt::format("{} off by RMS {:.3g} px, {:.3g} times what the sigmas claim",
                                      directions(r.offsets.size()), r.rms_px, r.ratio);
  const std::string turn = turn_of(r, "with the platform as stated", "with the platform's ");
  if (comparison.verdict == Verdict::kNotJudged) {
    return out +
           fmt::format("{}, {}; not judged, as their stated sigma is {:.0f} % of the variance", off,
                       turn, 100 * (1 - r.share));
  }
  if (comparison.verdict == Verdict::kHolds) return out + off + ", " + turn;
  out += off + ", more than chance, " + turn;
  if (comparison.turned) {
    return out + turn_of(*comparison.turned, "", "; they agree with the platform's ") +
           ": is the platform where the survey has it, and the head's zero?";
  }
  const auto worst = std::max_element(
      r.offsets.begin(), r.offsets.end(),
      [](const KnownOffset& a, const KnownOffset& b) { return a.sigmas < b.sigmas; });
  return out + fmt::format("; worst is that of frame {} at ({:g}, {:g}), by {:.3g} sigmas",
                           worst->known.frame, worst->known.pixel.x(), worst->known.pixel.y(),
                           worst->sigmas);
}

std::string summary_of(const Verification& v) {
  const KnownComparison* known = worst_known(v);
  const ClaimComparison* worst = worst_claim(v);
  const std::string differ =
      worst == nullptr
          ? ""
          : fmt::format(
                "directions of the same place differ by {:.2f} times what "
                "sigma claims (limit {:.2f}; {}, {} mode)",
                worst->result.ratio, worst->result.ratio / std::max(1e-9, worst->result.low),
                name_of(worst->kind), mode_of(worst->from));
  std::vector<std::string> parts;
  switch (v.verdict) {
    case Verdict::kNotJudged:
      parts.push_back(fmt::format("{} pairs of pictures show the same places again ({} are needed)",
                                  v.pairs, kReturnsLeast));
      if (!v.known.empty()) parts.push_back(v.known.front().sentence);
      return "not judged: " + joined(parts);
    case Verdict::kHolds:
      if (!differ.empty()) parts.push_back(differ);
      if (known != nullptr) parts.push_back(known->sentence);
      if (parts.empty())
        parts.push_back(fmt::format("{} pairs of pictures show no departure", v.pairs));
      return "sigmas hold: " + joined(parts);
    case Verdict::kContradicted:
      break;
  }
  const bool by_known = known != nullptr && known->verdict == Verdict::kContradicted;
  const bool by_claims = worst != nullptr && worst->verdict == Verdict::kContradicted;
  if (by_known) parts.push_back(known->sentence);
  if (by_claims) parts.push_back(differ);
  if (!by_claims && !by_known && !differ.empty())
    parts.push_back("a cause is found, though " + differ);
  std::string causes;
  for (const DepartureTest& found : v.found) {
    causes += (causes.empty() ? "likeliest cause: " : ", then: ");
    causes += fmt::format("{} ({})", name_of(found.departure), size_of(found));
  }
  if (!causes.empty()) parts.push_back(causes);
  if (causes.empty() && (by_claims || !by_known))
    parts.emplace_back("none of the causes that are known here explains it");
  return "contradicted: " + joined(parts);
}

std::string sentence_of(const JudgedZooms& zooms) {
  return fmt::format(
      "returns: of pictures at f {:.0f} to {:.0f} px; each departure below: of the {} pictures at "
      "f {:.0f} px, as most are of this zoom",
      zooms.least_px, zooms.most_px, zooms.usual_frames, zooms.usual_px);
}

std::string sentence_of(const VerifiedLink& link) {
  constexpr double kMilli = 1e3;
  return fmt::format(
      "link: telemetry comes {:.1f} +- {:.1g} ms {} against the pictures than the calibration has "
      "it, as the motion of this recording shows; that is taken into account",
      kMilli * std::abs(link.delay_s), kMilli * link.sigma_s,
      link.delay_s < 0 ? "earlier" : "later");
}

std::string verification_text(const Verification& verification) {
  std::string out = fmt::format("{}\n", verification.sentence);
  if (verification.zooms) out += fmt::format("  {}\n", sentence_of(*verification.zooms));
  if (verification.link) out += fmt::format("  {}\n", sentence_of(*verification.link));
  for (const ClaimComparison& comparison : verification.claims) {
    if (comparison.result.pairs > 0) out += fmt::format("  {}\n", comparison.sentence);
  }
  for (const ModelComparison& comparison : verification.model)
    out += fmt::format("  {}\n", comparison.sentence);
  for (const KnownComparison& comparison : verification.known)
    out += fmt::format("  {}\n", comparison.sentence);
  for (const std::string& advice : verification.advice) out += fmt::format("advice: {}\n", advice);
  return out;
}

}  // namespace alidade
