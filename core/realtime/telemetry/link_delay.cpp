#include "core/realtime/telemetry/link_delay.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace alidade {
namespace {

constexpr double kStretch_s = 2;
constexpr double kFade = 0.9;          // of the sums, with each stretch
constexpr double kLongestGap_s = 0.3;  // between images of one motion
// Standard deviations of a sample, by which an axis must move within the range: else all delays say
// the same.
constexpr double kMoves = 5;
constexpr int kLeastDegrees = 16;
constexpr double kMostLagged = 0.95;  // correlation of neighbours
// Share of the samples, at least, that the variance of the residuals comes from.
constexpr double kCompared = 0.5;
// Samples that a candidate could not be compared with are taken for as well explained as the
// others, and by so many standard deviations of chi-square better.
constexpr double kDoubt = 2;
constexpr double kSure_s = 0.012;
// Share of the angle's noise that may be common to a whole motion, as a gear's error is.
constexpr double kCommon = 0.5;
// Of a shared error's square: the part that a stretch's zero does not take up. It is about the same
// in all samples of a stretch.
constexpr double kShared = 0.15;
constexpr double kAlike = 3;        // standard deviations
constexpr double kImprobable = 20;  // -log of a likelihood ratio
constexpr double kLeastSigma_s = 2e-4;

// Cubic by the angles and rates of two images.
struct Hermite {
  double of_first;
  double of_second;
  double of_first_rate;
  double of_second_rate;

  Hermite(double u, double h)
      : of_first((1 + 2 * u) * (1 - u) * (1 - u)),
        of_second(u * u * (3 - 2 * u)),
        of_first_rate(h * u * (1 - u) * (1 - u)),
        of_second_rate(h * u * u * (u - 1)) {}
  [[nodiscard]] double at(double first, double second, double first_rate,
                          double second_rate) const {
    return of_first * first + of_second * second + of_first_rate * first_rate +
           of_second_rate * second_rate;
  }
};

}  // namespace

LinkDelay::LinkDelay(double angle_sigma, double connections_sigma_s)
    : angle_sigma_(angle_sigma), connections_sigma_s_(connections_sigma_s) {}

void LinkDelay::forget() {
  stretch_ = {};
  break_images();
  sums_ = {};
  is_contradicted_ = false;
}

void LinkDelay::begin_calibrated() {
  forget();
  state_ = LinkDelayState::kCalibrated;
  delay_s_ = sigma_s_ = 0;
}

void LinkDelay::begin_found(double delay_s, double sigma_s) {
  forget();
  state_ = LinkDelayState::kFound;
  delay_s_ = delay_s;
  sigma_s_ = std::max(kLeastSigma_s, sigma_s);
}

void LinkDelay::open(double sigma_s) {
  forget();
  state_ = LinkDelayState::kOpen;
  sigma_s_ = sigma_s;
}

void LinkDelay::change_calibration(double by_s) {
  forget();
  if (state_ == LinkDelayState::kCalibrated) {
    state_ = LinkDelayState::kFound;
    sigma_s_ = connections_sigma_s_;
  }
  delay_s_ -= by_s;
}

void LinkDelay::break_images() {
  close_stretch();
  images_.clear();
  samples_.clear();
  has_last_ = false;
}

void LinkDelay::add(const TelemetrySample& sample, const Vector2<double>& error_variance) {
  const bool repeats = has_last_ && sample.pan == last_.pan && sample.tilt == last_.tilt;
  const bool is_late = has_last_ && !(sample.time_s > last_.time_s);
  if (repeats || is_late || !std::isfinite(sample.pan + sample.tilt + sample.time_s)) return;
  last_ = sample;
  has_last_ = true;
  samples_.push({sample, {error_variance.x(), error_variance.y()}});
}

void LinkDelay::add(const ImageAngles& image) {
  if (!std::isfinite(image.time_s) || !all_finite(image.angle.vector()) ||
      !all_finite(image.rate.vector())) {
    return;
  }
  ImageAngles next = image;
  if (images_.size() > 0) {
    const ImageAngles& last = images_[images_.size() - 1];
    const double elapsed_s = image.time_s - last.time_s;
    if (!(elapsed_s > 0 && elapsed_s < kLongestGap_s)) {
      close_stretch();
      images_.clear();
    } else {
      const Vector2<double> moved = minus(image.angle, last.angle);
      next.angle = {last.angle.pan + moved.x(), last.angle.tilt + moved.y()};
    }
  }
  images_.push(next);
  while (samples_.size() > 0 && samples_[0].reading.time_s + kRange_s <= next.time_s) {
    sum(samples_[0]);
    samples_.pop();
  }
  if (state_ == LinkDelayState::kOpen) find_early();
}

// At the candidates for whose time there are images.
void LinkDelay::compare(const Sample& sample, std::array<Stretch, 2>* stretch) const {
  const TelemetrySample& reading = sample.reading;
  const double first = images_[0].time_s;
  const double last = images_[images_.size() - 1].time_s;
  const auto time_of = [&](std::size_t k) {
    return reading.time_s + kRange_s - kStep_s * static_cast<double>(k);
  };
  std::size_t begin = 0;
  while (begin < kCandidates && time_of(begin) > last) ++begin;
  std::size_t end = begin;
  std::array<std::array<double, kCandidates>, 2> angles;
  for (std::size_t i = images_.size() - 2; end < kCandidates; ++end) {
    const double t = time_of(end);
    if (!(t >= first)) break;
    while (i > 0 && images_[i].time_s > t) --i;
    const ImageAngles& a = images_[i];
    const ImageAngles& b = images_[i + 1];
    const double h = b.time_s - a.time_s;
    const Hermite cubic((t - a.time_s) / h, h);
    angles[0][end] = cubic.at(a.angle.pan, b.angle.pan, a.rate.pan, b.rate.pan);
    angles[1][end] = cubic.at(a.angle.tilt, b.angle.tilt, a.rate.tilt, b.rate.tilt);
  }
  if (end < begin + 2) return;
  const std::array<double, 2> measured = {reading.pan, reading.tilt};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto& shown = angles[axis];
    const auto ends = std::minmax_element(shown.begin() + begin, shown.begin() + end);
    if (!(*ends.second - *ends.first > kMoves * angle_sigma_)) continue;
    Stretch& s = (*stretch)[axis];
    if (s.samples == 0) s.reference = measured[axis] - shown[begin];
    double square = 0;
    for (std::size_t k = begin; k < end; ++k) {
      const double residual = wrap_angle(measured[axis] - s.reference - shown[k]);
      s.sum[k] += residual;
      s.squares[k] += residual * residual;
      if (s.count[k] > 0) {
        s.lagged[k] += residual * s.before[k];
      } else {
        s.begin[k] = residual;
      }
      s.before[k] = residual;
      ++s.count[k];
      if (k > begin) square += (shown[k] - shown[k - 1]) * (shown[k] - shown[k - 1]);
    }
    s.square_rate += square / static_cast<double>(end - begin - 1) / (kStep_s * kStep_s);
    s.shared += sample.error_variance[axis];
    ++s.samples;
  }
}

void LinkDelay::sum(const Sample& sample) {
  const double time_s = sample.reading.time_s;
  if (images_.size() < 2) return;
  if (stretch_[0].samples + stretch_[1].samples == 0) stretch_since_s_ = time_s;
  if (time_s > stretch_since_s_ + kStretch_s) {
    close_stretch();
    stretch_since_s_ = time_s;
  }
  compare(sample, &stretch_);
}

bool LinkDelay::moves() const {
  Vector2<double> least = images_[0].angle.vector();
  Vector2<double> most = least;
  for (std::size_t i = 1; i < images_.size(); ++i) {
    least = least.cwiseMin(images_[i].angle.vector());
    most = most.cwiseMax(images_[i].angle.vector());
  }
  return (most - least).maxCoeff() > kMoves * angle_sigma_;
}

// Takes the samples, too, that only part of the candidates can be compared with as yet: the
// pictures of kRange_s after them are to come.
void LinkDelay::find_early() {
  if (images_.size() < 2 || !moves()) return;
  std::array<Stretch, 2> stretch = stretch_;
  for (std::size_t i = 0; i < samples_.size(); ++i) compare(samples_[i], &stretch);
  const Told told = judge(with(stretch));
  if (told.sure) take(told);
}

void LinkDelay::add_stretch(const Stretch& stretch, Sums* sums) {
  if (stretch.samples < 2) return;
  for (std::size_t k = 0; k < kCandidates; ++k) {
    if (stretch.count[k] < 2) continue;
    const double n = stretch.count[k];
    const double mean = stretch.sum[k] / n;
    sums->squares[k] += std::max(0.0, stretch.squares[k] - n * mean * mean);
    // Of r_i - mean: each residual is in two products, but for the first and the last.
    sums->lagged[k] +=
        stretch.lagged[k] - mean * ((n + 1) * mean - stretch.begin[k] - stretch.before[k]);
    sums->degrees[k] += n - 1;
  }
  sums->square_rate += stretch.square_rate;
  sums->shared += stretch.shared;
  sums->samples += stretch.samples;
  sums->stretches += 1;
}

LinkDelay::BothAxes LinkDelay::with(const std::array<Stretch, 2>& stretch) const {
  BothAxes sums = sums_;
  for (std::size_t axis = 0; axis < 2; ++axis) add_stretch(stretch[axis], &sums[axis]);
  return sums;
}

void LinkDelay::close_stretch() {
  if (stretch_[0].samples < 2 && stretch_[1].samples < 2) {
    stretch_ = {};
    return;
  }
  BothAxes alone;
  for (std::size_t axis = 0; axis < 2; ++axis) add_stretch(stretch_[axis], &alone[axis]);
  stretch_ = {};
  const auto add = [](const BothAxes& from, double fade, BothAxes* to) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const Sums& a = from[axis];
      Sums& b = (*to)[axis];
      for (std::size_t k = 0; k < kCandidates; ++k) {
        b.squares[k] = fade * b.squares[k] + a.squares[k];
        b.lagged[k] = fade * b.lagged[k] + a.lagged[k];
        b.degrees[k] = fade * b.degrees[k] + a.degrees[k];
      }
      b.shared = fade * b.shared + a.shared;
      b.square_rate = fade * b.square_rate + a.square_rate;
      b.samples = fade * b.samples + a.samples;
      b.stretches = fade * b.stretches + a.stretches;
    }
  };
  if (state_ != LinkDelayState::kOpen) {
    const Told told = judge(alone);
    const auto contradicts = [this](const Told& by) {
      return by.sure && by.improbable > kImprobable &&
             std::abs(by.delay_s - delay_s_) >
                 std::max(connections_sigma_s_, kAlike * std::hypot(by.sigma_s, sigma_s_));
    };
    if (contradicts(told)) {
      if (is_contradicted_) add(last_against_, 1, &alone);
      const Told both = judge(alone);
      if (is_contradicted_ && contradicts(both)) {
        sums_ = alone;
        take(both);
      } else {
        last_against_ = alone;
      }
      is_contradicted_ = !is_contradicted_;
      return;
    }
    if (told.sure) is_contradicted_ = false;
  }
  add(alone, kFade, &sums_);
  if (state_ != LinkDelayState::kFound) return;
  const Told told = judge(sums_);
  if (told.sure) take(told);
}

LinkDelay::Told LinkDelay::judge(const BothAxes& sums) const {
  Told out;
  std::array<double, kCandidates> q{};        // chi-square
  std::array<double, kCandidates> degrees{};  // of freedom
  double freedom = 0;                         // independent residuals
  double square_rate = 0;
  for (const Sums& axis : sums) {
    const double most = *std::max_element(axis.degrees.begin(), axis.degrees.end());
    if (!(most > 0)) continue;
    std::size_t best = 0;
    double variance = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < kCandidates; ++k) {
      if (axis.degrees[k] < kCompared * most) continue;
      if (!(axis.squares[k] / axis.degrees[k] < variance)) continue;
      variance = axis.squares[k] / axis.degrees[k];
      best = k;
    }
    const double lagged =
        variance > 0 ? std::clamp(axis.lagged[best] / axis.squares[best], 0.0, kMostLagged) : 0.0;
    variance = std::max(angle_sigma_ * angle_sigma_, variance);
    const double shared = kShared * most / axis.stretches * axis.shared / axis.samples;
    const double factor = (1 + lagged) / (1 - lagged) + shared / variance;
    for (std::size_t k = 0; k < kCandidates; ++k) {
      const double missing = (most - axis.degrees[k]) / factor;
      q[k] += axis.squares[k] / (factor * variance) + missing - kDoubt * std::sqrt(2 * missing);
      degrees[k] += axis.degrees[k];
    }
    freedom += axis.degrees[best] / factor;
    square_rate += axis.square_rate / axis.samples;
  }
  if (!(square_rate > 0)) return out;
  double least = std::numeric_limits<double>::infinity();
  std::size_t k = 0;
  for (std::size_t i = 0; i < kCandidates; ++i) {
    if (degrees[i] < kLeastDegrees || !(q[i] < least)) continue;
    least = q[i];
    k = i;
  }
  if (k == 0 || k + 1 == kCandidates) return out;
  // Too few samples tell nothing against a candidate.
  for (std::size_t i = 0; i < kCandidates; ++i) {
    if (degrees[i] < kLeastDegrees) q[i] = least;
  }
  const double curvature = q[k - 1] - 2 * q[k] + q[k + 1];
  if (!(curvature > 0)) return out;
  const auto place = [](double index) { return (index - kCentre) * kStep_s; };
  out.delay_s = place(static_cast<double>(k) + (q[k - 1] - q[k + 1]) / (2 * curvature));
  const auto log_likelihood = [&](double chi_square) {
    return -(freedom + 1) / 2 * std::log1p(std::max(0.0, chi_square - q[k]) / freedom);
  };
  double weights = 0;
  double squares = 0;
  for (std::size_t i = 0; i < kCandidates; ++i) {
    const double weight = std::exp(log_likelihood(q[i]));
    const double off = place(static_cast<double>(i)) - out.delay_s;
    weights += weight;
    squares += weight * off * off;
  }
  const double variance =
      std::max(2 * kStep_s * kStep_s / curvature * (1 + 2 / freedom), squares / weights);
  out.sigma_s = std::sqrt(variance + kCommon * kCommon * angle_sigma_ * angle_sigma_ / square_rate);
  out.sure = out.sigma_s < kSure_s;
  const double present = delay_s_ / kStep_s + kCentre;
  const double below = std::clamp(std::floor(present), 0.0, kCandidates - 2.0);
  const auto b = static_cast<std::size_t>(below);
  const double at_present =
      q[b] + (std::clamp(present, 0.0, kCandidates - 1.0) - below) * (q[b + 1] - q[b]);
  out.improbable = -log_likelihood(at_present);
  return out;
}

void LinkDelay::take(const Told& told) {
  delay_s_ = told.delay_s;
  sigma_s_ = std::max(kLeastSigma_s, told.sigma_s);
  if (state_ == LinkDelayState::kOpen || is_contradicted_) ++found_;
  state_ = LinkDelayState::kFound;
}

}  // namespace alidade
