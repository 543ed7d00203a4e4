#include "core/realtime/oe_mode/scene_drift.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/model/angle.h"

namespace alidade {
namespace {

constexpr double kMemory_s = 4;
constexpr double kLeastLife_s = 0.3;
constexpr double kLeastSeen = 6;         // frames
constexpr double kRepeated_s = 0.12;     // as long a landmark's error stays alike
constexpr double kUnmodelled_px = 0.05;  // of a landmark's place over its life
constexpr double kApart = 20;            // chi-square, two degrees of freedom
constexpr double kAlike = 13.8;
constexpr int kLeastGroup = 8;  // landmarks
constexpr double kLeastShare = 0.1;
constexpr double kCoherent = 0.6;       // of what is apart
constexpr double kLeastShift_px = 0.3;  // between groups
constexpr double kLeastRate_px_s = 0.1;
constexpr double kLeastRateOfAll_px_s = 0.2;
// Of the camera's rate. By so much landmarks drift as they are near and the pupil is off the axes.
constexpr double kParallax = 0.002;
constexpr double kDecided = 12;  // difference of chi-squares
constexpr double kProven = 9;
constexpr double kMoves = 30;        // chi-square of one group
constexpr double kLeastTrial_s = 1;  // from when on one group can be said to move
constexpr double kLongTrial_s = 5;
constexpr double kShownBy = 20;  // degrees of freedom that show a misfit
constexpr double kLeastMisfit = 0.25;
constexpr double kSteady = 2;     // misfit
constexpr double kSlope = 0.002;  // of telemetry against angle, unless it is told
constexpr double kUnmodelledRate_px_s = 0.03;
constexpr double kSteep = 1.4;  // rad, elevation: azimuth says little

double chi_square(const Vector2<double>& rate, const Vector2<double>& variance) {
  return rate.cwiseAbs2().cwiseQuotient(variance).sum();
}

}  // namespace

void SceneDrift::reset() {
  begin_map();
  on_trial_ = false;
}

void SceneDrift::begin_map() {
  for (Record& record : records_) record.weight = 0;
  noted_count_ = 0;
  for (FadingFit<3>& line : lines_) line = {};
  has_offsets_ = false;
  mean_square_rate_ = 0;
  verdict_ = SceneVerdict::kRest;
  doubt_.setZero();
}

void SceneDrift::note(const SeenOffset& seen) {
  if (!all_finite(seen.offset) || !(seen.variance.minCoeff() > 0)) return;
  if (!has_offsets_) {
    begun_s_ = seen.time_s;
    begun_angle_ = seen.angle;
    noted_s_ = seen.time_s;
    has_offsets_ = true;
  }
  const double keep = std::exp(-std::max(0.0, seen.time_s - noted_s_) / kMemory_s);
  noted_s_ = std::max(noted_s_, seen.time_s);
  slope_sigma_ = seen.slope_sigma;
  for (int i = 0; i < 2; ++i) {
    const Vector3<double> row(1, seen.time_s - begun_s_,
                              wrap_angle(seen.angle[i] - begun_angle_[i]));
    lines_[static_cast<std::size_t>(i)].add(keep, row, seen.offset[i], 1 / seen.variance[i]);
  }
}

void SceneDrift::begin_frame(double time_s, const Vector2<double>& rate) {
  constexpr double kShare = 0.02;  // of a frame
  time_s_ = time_s;
  noted_count_ = 0;
  mean_square_rate_ += kShare * (rate.squaredNorm() - mean_square_rate_);
}

void SceneDrift::note_landmark(int slot, std::uint32_t id, const Vector3<double>& d) {
  if (noted_count_ == noted_.size() || !all_finite(d)) return;
  const double elevation = -std::asin(std::clamp(d.z(), -1.0, 1.0));
  if (std::abs(elevation) > kSteep) return;
  const Vector2<double> place(std::atan2(d.y(), d.x()), elevation);
  Record& record = records_[static_cast<std::size_t>(slot)];
  if (record.weight == 0 || record.id != id) {
    record = {};
    record.id = id;
    record.first = place;
    record.first_s = record.last_s = time_s_;
  }
  const double keep = std::exp(-std::max(0.0, time_s_ - record.last_s) / kMemory_s);
  const double t = time_s_ - record.first_s;
  const Vector2<double> y(-wrap_angle(place.x() - record.first.x()),
                          -(place.y() - record.first.y()));
  record.last_s = time_s_;
  record.weight = keep * record.weight + 1;
  record.t = keep * record.t + t;
  record.tt = keep * record.tt + t * t;
  record.y = keep * record.y + y;
  record.ty = keep * record.ty + t * y;
  record.yy = keep * record.yy + y.cwiseAbs2();
  Noted& noted = noted_[noted_count_++];
  noted = {};
  noted.slot = slot;
  noted.id = id;
  noted.d = d;
}

void SceneDrift::find_rates(double pixel) {
  for (std::size_t i = 0; i < noted_count_; ++i) {
    Noted& noted = noted_[i];
    const Record& record = records_[static_cast<std::size_t>(noted.slot)];
    noted.life_s = std::min(record.last_s - record.first_s, 2 * kMemory_s);
    const double spread = record.tt - record.t * record.t / record.weight;
    noted.tested = noted.life_s >= kLeastLife_s && record.weight >= kLeastSeen && spread > 0;
    if (!noted.tested) continue;
    noted.rate = (record.ty - record.t / record.weight * record.y) / spread;
    const Vector2<double> left =
        record.yy - record.y.cwiseAbs2() / record.weight - spread * noted.rate.cwiseAbs2();
    const double square = std::max(0.0, 0.5 * left.sum()) / std::max(1.0, record.weight - 2);
    const double alike = std::max(1.0, record.weight * kRepeated_s / noted.life_s);
    const double unmodelled = kUnmodelled_px * pixel / noted.life_s;
    noted.variance = alike * square / spread + unmodelled * unmodelled;
  }
}

Vector2<double> SceneDrift::median_rate(bool apart) {
  Vector2<double> out = Vector2<double>::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < noted_count_; ++i) {
      const Noted& noted = noted_[i];
      if (noted.tested && (!apart || noted.apart)) sorted_[count++] = noted.rate[axis];
    }
    if (count == 0) continue;
    double* middle = sorted_.data() + count / 2;
    std::nth_element(sorted_.data(), middle, sorted_.data() + count);
    out[axis] = *middle;
  }
  return out;
}

// The landmarks that are apart, if they move as one.
bool SceneDrift::find_groups(double pixel) {
  int tested = 0;
  int apart = 0;
  group_ = median_rate(false);
  for (std::size_t i = 0; i < noted_count_; ++i) {
    Noted& noted = noted_[i];
    if (!noted.tested) continue;
    ++tested;
    noted.apart = (noted.rate - group_).squaredNorm() > kApart * noted.variance;
    apart += noted.apart ? 1 : 0;
  }
  const double least = std::max<double>(kLeastGroup, kLeastShare * tested);
  if (apart < least || tested - apart < least) return false;
  apart_group_ = median_rate(true);
  const Vector2<double> between = apart_group_ - group_;
  const double rate = between.norm();
  int alike = 0;
  double life_s = 0;
  for (std::size_t i = 0; i < noted_count_; ++i) {
    const Noted& noted = noted_[i];
    if (!noted.apart) continue;
    const double slack = 0.25 * rate;
    if ((noted.rate - apart_group_).squaredNorm() > kAlike * noted.variance + slack * slack)
      continue;
    ++alike;
    life_s += noted.life_s;
  }
  return alike >= least && alike >= kCoherent * apart &&
         rate > std::max(kLeastRate_px_s * pixel, kParallax * std::sqrt(mean_square_rate_)) &&
         rate * life_s > kLeastShift_px * pixel * alike;
}

bool SceneDrift::map_rate(const Vector2<double>& slope_sigma, double pixel, Rate* out) const {
  const double floor = kUnmodelledRate_px_s * pixel;
  double freedom = 0;
  out->misfit = 0;
  for (int i = 0; i < 2; ++i) {
    const FadingFit<3>& line = lines_[static_cast<std::size_t>(i)];
    if (line.weight < kLeastSeen) return false;
    Matrix3<double> normal = line.normal;
    // Exact, without the slope.
    normal(2, 2) += 1 / std::max(1e-20, slope_sigma[i] * slope_sigma[i]);
    const Vector3<double> scale = normal.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix3<double> scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    const Eigen::LLT<Matrix3<double>> llt(scaled);
    if (llt.info() != Eigen::Success) return false;
    const Matrix3<double> inverse = scale.asDiagonal() *
                                    Matrix3<double>(llt.solve(Matrix3<double>::Identity())) *
                                    scale.asDiagonal();
    const Vector3<double> x = inverse * line.gradient;
    if (!all_finite(x) || !(inverse(1, 1) > 0)) return false;
    // The camera turns by as much less.
    out->value[i] = -x[1];
    out->variance[i] = inverse(1, 1);
    out->misfit += std::max(0.0, line.left(x));
    freedom += std::max(1.0, line.weight - 3);
  }
  out->misfit /= freedom;
  // Variances allow for errors that frames share, and may say too much.
  if (freedom > kShownBy) out->variance *= std::clamp(out->misfit, kLeastMisfit, 1.0);
  out->variance.array() += floor * floor;
  return true;
}

SceneVerdict SceneDrift::judge(double pixel) {
  find_rates(pixel);
  const bool two = find_groups(pixel);
  if (!two) {
    for (std::size_t i = 0; i < noted_count_; ++i) noted_[i].apart = false;
  }
  return verdict_ = two ? judge_two(pixel) : judge_one(pixel);
}

SceneVerdict SceneDrift::judge_two(double pixel) {
  if (!has_offsets_) return SceneVerdict::kRest;
  Rate map;
  if (!map_rate(slope_sigma_, pixel, &map)) return SceneVerdict::kUndecided;
  rate_ = group_ + map.value;
  apart_rate_ = apart_group_ + map.value;
  const double of_group = chi_square(rate_, map.variance);
  const double of_apart = chi_square(apart_rate_, map.variance);
  if (of_apart - of_group > kDecided) return SceneVerdict::kPartMoves;
  return of_group - of_apart > kDecided ? SceneVerdict::kMapMoves : SceneVerdict::kUndecided;
}

bool SceneDrift::is_young() const { return noted_s_ - begun_s_ < kLeastTrial_s; }

SceneVerdict SceneDrift::judge_one(double pixel) {
  doubt_.setZero();
  Rate map;
  if (!map_rate(slope_sigma_.cwiseMax(kSlope), pixel, &map)) return SceneVerdict::kRest;
  // Landmarks that the map does not follow do not say where it goes.
  const bool follows = group_.norm() < 0.5 * map.value.norm();
  rate_ = map.value;
  const double chi = chi_square(rate_, map.variance);
  const double since_s = noted_s_ - begun_s_;
  const bool steady = map.misfit < kSteady;
  if (on_trial_) {
    const bool rests = chi < kAlike;
    const bool is_other = chi_square(rate_ - moved_rate_, map.variance) - chi > kProven;
    if (rests && (is_other || since_s > kLongTrial_s)) on_trial_ = false;
  }
  if (chi > kMoves && steady && follows && since_s >= kLeastTrial_s &&
      rate_.norm() > kLeastRateOfAll_px_s * pixel) {
    on_trial_ = true;
    moved_rate_ = rate_;
    return SceneVerdict::kAllMove;
  }
  if (steady && since_s >= kLeastLife_s && chi > kAlike) {
    // Half of the way that the map would have gone, by how likely it has.
    const Vector2<double> way = 0.5 * std::min(since_s, kMemory_s) * rate_;
    doubt_ = way * way.transpose() / (1 + std::exp(0.5 * (9 - chi)));
  }
  return SceneVerdict::kRest;
}

}  // namespace alidade
