#pragma once
// SceneTeller: the localization thread, for a step without telemetry: asked where a frame looks, it tells some frames later, with an error
// that it states.

#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <utility>

#include "core/model/rotation.h"
#include "edge_app/step/orientation_step.h"

namespace alidade::test {

class SceneTeller {
 public:
  static constexpr int kAnswered = 6;     // frames later
  static constexpr double kSigma = 1e-4;  // rad, about each axis

  // When the frame's middle row was exposed.
  struct Truth {
    Matrix3<double> R_base_from_camera;
    double log_f = 0;
  };
  // truth: none where nothing is found. log_f_sigma: of what is told.
  SceneTeller(std::function<std::optional<Truth>(int frame)> truth, double log_f_sigma)
      : truth_(std::move(truth)), log_f_sigma_(log_f_sigma) {}

  void begin(std::uint64_t seed) {
    asked_.reset();
    random_.seed(seed);
    normal_.reset();
  }

  // After each frame. The angular velocity that a picture is to be localized with, where there is one.
  std::optional<Vector3<double>> follow(int k, const OrientationRecord& record,
                                        OrientationStep* step) {
    if (asked_ && k >= *asked_ + kAnswered) {
      if (told_) step->settle_base(*told_);
      asked_.reset();
    }
    Vector3<double> velocity;
    if (asked_ || record.orientation || !step->ask_where_it_looks(&velocity)) return std::nullopt;
    asked_ = k;
    told_.reset();
    const std::optional<Truth> truth = truth_(k);
    const Vector3<double> error(kSigma * normal_(random_), kSigma * normal_(random_),
                                kSigma * normal_(random_));
    if (!truth) return velocity;
    ToldBase& told = told_.emplace();
    told.frame = k;
    told.time_s = *record.time_s;
    told.is_whole = true;
    told.R_base_from_camera = pack_matrix(truth->R_base_from_camera * exp_so3(error));
    told.R_covariance = pack_matrix(kSigma * kSigma * Matrix3<double>::Identity());
    if (log_f_sigma_ > 0) told.log_f = truth->log_f + log_f_sigma_ * normal_(random_);
    told.log_f_variance = log_f_sigma_ * log_f_sigma_;
    return velocity;
  }

 private:
  std::function<std::optional<Truth>(int frame)> truth_;
  double log_f_sigma_;
  std::optional<int> asked_;
  std::optional<ToldBase> told_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace alidade::test
