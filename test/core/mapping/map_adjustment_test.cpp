#include "core/mapping/map_adjustment.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>

#include "test/core/mapping/seen_picture.h"

namespace alidade::test {
namespace {

constexpr double kWide_px = 1200;
constexpr double kTele_px = 4800;
constexpr double kTelemetry_rad = 2e-4;
constexpr double kEps = 1e-3;

// How the lens rests off its curve.
struct Rest {
  double eps_sigma = kEps;
  double distortion = -0.03;  // in the corner, at the widest
  double hold = 1;            // see lens_curve.h
};

// Six pictures at each of three zooms, one within the other.
struct SmallMap {
  std::vector<SeenPicture> truth;
  MapEvidence evidence;
  std::vector<int> wrong;  // observations
};

SmallMap small_map(std::uint64_t seed, double wrong_share, double apart = 0,
                   const Rest& rest = {}) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0, 1);
  SmallMap out;
  for (int i = 0; i < 18; ++i) {
    const int level = i / 6;
    const double log_nominal = std::log(kWide_px) + level * std::log(2.0) * (1 - 1e-3);
    const double eps = rest.eps_sigma * normal(random);
    SeenPicture picture = lively_picture(std::exp(log_nominal + eps), 0, 0, 0.01);
    const double field = picture.width / picture.focal_length;
    picture.pan = 3.1 + field * (0.5 * (i % 3 - 1) + 0.1 * part(random)) + (i < 3 ? apart : 0);
    picture.tilt = 0.2 + field * (0.25 * (i % 6 / 3) + 0.05 * part(random));
    // A lens that wanders over the zoom.
    picture.corner_distortion =
        rest.distortion * (1 - 0.5 * level) * std::exp(2 * (rest.hold - 1) * eps);
    picture.centre_offset = {6 - 3.0 * level, -4 + 2.0 * level};
    out.truth.push_back(picture);

    MapPicture known;
    known.position = log_nominal;
    known.eps_sigma = rest.eps_sigma;
    known.motion = picture.knowledge(true).motion;
    known.telemetry.emplace();
    known.telemetry->covariance = kTelemetry_rad * kTelemetry_rad * Eigen::Matrix3d::Identity();
    known.telemetry->R_base_from_camera =
        picture.base_from_camera(0) *
        exp_so3(Vector3<double>(kTelemetry_rad *
                                Eigen::Vector3d(normal(random), normal(random), normal(random))));
    known.R_start = known.telemetry->R_base_from_camera;
    out.evidence.pictures.push_back(known);
  }
  for (const SeenPicture& born : out.truth) {
    for (int i = 0; i < 25; ++i) {
      const Eigen::Vector3d d =
          born.direction_of({born.width * part(random), born.height * part(random)});
      const int landmark = out.evidence.landmarks++;
      for (std::size_t k = 0; k < out.truth.size(); ++k) {
        const SeenPicture& picture = out.truth[k];
        const auto u = picture.seen(d);
        if (!u || u->x() < 0 || u->y() < 0 || u->x() > picture.width || u->y() > picture.height) {
          continue;
        }
        MapObservation seen;
        seen.picture = static_cast<int>(k);
        seen.landmark = landmark;
        seen.u = *u + seen.sigma_px * Eigen::Vector2d(normal(random), normal(random));
        if (part(random) < wrong_share) {
          seen.u += Eigen::Vector2d(30 + 100 * part(random), -20);
          out.wrong.push_back(static_cast<int>(out.evidence.observations.size()));
        }
        out.evidence.observations.push_back(seen);
      }
    }
  }
  return out;
}

MapOptions small_options() {
  MapOptions out;
  out.lens = LensCurve({kWide_px, 1, {0}, 1280, 720}, std::log(kWide_px) - 0.01,
                       std::log(kTele_px) + 0.01, 0.35);
  return out;
}

// Errors of all pictures together, by their joint covariance: chi-square with 4 a picture.
double square_of_all(const SmallMap& map, const MapAdjustment& found) {
  Eigen::VectorXd error(4 * static_cast<Eigen::Index>(map.truth.size()));
  for (std::size_t i = 0; i < map.truth.size(); ++i) {
    error.segment<4>(4 * static_cast<Eigen::Index>(i)) << log_so3(Matrix3<double>(
        map.truth[i].base_from_camera(0).transpose() * found.pictures[i].R_base_from_camera)),
        std::log(found.pictures[i].camera.focal_length / map.truth[i].focal_length);
  }
  return error.dot(found.covariance.ldlt().solve(error));
}

TEST(MapAdjustment, IsAsGoodAsItSaysAndLeavesOutWhatIsWrong) {
  constexpr int kMaps = 6;
  double sum = 0;
  int missed = 0;
  int falsely = 0;
  for (std::uint64_t seed = 1; seed <= kMaps; ++seed) {
    const SmallMap map = small_map(seed, 0.03);
    const MapAdjustment found = adjust_map(map.evidence, small_options());
    ASSERT_EQ(found.status, MapStatus::kOk) << to_string(found.status);
    sum += square_of_all(map, found);
    EXPECT_NEAR(found.noise_scale, 1, 0.05);
    for (std::size_t i = 0; i < map.truth.size(); ++i) {
      EXPECT_LT(
          std::abs(std::log(found.pictures[i].camera.focal_length / map.truth[i].focal_length)),
          5 * std::sqrt(found.covariance_of(static_cast<int>(i))(3, 3)));
    }
    std::vector<bool> is_out(map.evidence.observations.size(), false);
    for (const int i : found.left_out) is_out[static_cast<std::size_t>(i)] = true;
    int wrong_in = 0;
    for (const int i : map.wrong) wrong_in += is_out[static_cast<std::size_t>(i)] ? 0 : 1;
    missed += wrong_in;
    falsely +=
        static_cast<int>(found.left_out.size()) - (static_cast<int>(map.wrong.size()) - wrong_in);
    ASSERT_GT(map.wrong.size(), 20U);
  }
  EXPECT_EQ(missed, 0);
  // Beyond 4 sigmas lie 3.4e-4 of the right ones; seen in one picture alone, about a tenth.
  EXPECT_LT(falsely, 0.15 * kMaps * 18 * 25);
  // Chi-square with 72 a map: 4 sigmas of the mean. Huber's weights and the gate cost 3 % at the most.
  const double freedom = 72.0 * kMaps;
  const double wide = 4 * std::sqrt(2 / freedom);
  EXPECT_GT(sum / freedom, 1 - wide);
  EXPECT_LT(sum / freedom, 1.03 + wide);
}

// Rates by telemetry have noise: taken as exact, it shortens every focal length, as the read-out of a moving picture shows
// the rate times f. Here it is half a pixel over the height of a picture.
TEST(MapAdjustment, RatesThatAreNoisyAreAsGoodAsTheySay) {
  constexpr int kMaps = 4;
  constexpr double kFields = 0.02;  // sigma of a rate, fields of view a second
  double sum = 0, sum_if_exact = 0;
  double told_off = 0, found_off = 0;  // (rad/s)^2, of turns across the view
  for (std::uint64_t seed = 11; seed < 11 + kMaps; ++seed) {
    SmallMap map = small_map(seed, 0);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < map.truth.size(); ++i) {
      const double sigma = kFields * map.truth[i].width / map.truth[i].focal_length;
      MapPicture& picture = map.evidence.pictures[i];
      picture.motion.angular_velocity +=
          sigma * Eigen::Vector3d(normal(random), normal(random), normal(random));
      picture.motion.zoom_rate += kFields * normal(random);
      picture.motion_sigma << sigma, sigma, sigma, kFields;
    }
    const MapAdjustment found = adjust_map(map.evidence, small_options());
    ASSERT_EQ(found.status, MapStatus::kOk) << to_string(found.status);
    sum += square_of_all(map, found);
    for (std::size_t i = 0; i < map.truth.size(); ++i) {
      const Vector3<double> told = map.evidence.pictures[i].motion.angular_velocity;
      const Vector3<double> truth = map.truth[i].knowledge(true).motion.angular_velocity;
      told_off += (told - truth).head<2>().squaredNorm();
      found_off += (found.pictures[i].motion.angular_velocity - truth).head<2>().squaredNorm();
    }
    for (MapPicture& picture : map.evidence.pictures) picture.motion_sigma.setZero();
    const MapAdjustment if_exact = adjust_map(map.evidence, small_options());
    if (if_exact.status == MapStatus::kOk) sum_if_exact += square_of_all(map, if_exact);
  }
  const double freedom = 72.0 * kMaps;
  const double wide = 4 * std::sqrt(2 / freedom);
  EXPECT_GT(sum / freedom, 1 - wide);
  EXPECT_LT(sum / freedom, 1.03 + wide);
  EXPECT_LT(found_off, 0.25 * told_off) << "pictures that share landmarks show their turns";
  EXPECT_GT(sum_if_exact / freedom, 2) << "a noise that could not tell proves nothing";
}

// One kind of lens keeps the distortion in the corner where it rests off its curve, another keeps k.
TEST(MapAdjustment, FindsOutWhatALensKeepsThatRestsOffItsCurve) {
  constexpr int kMaps = 8;
  for (const double hold : {0.0, 1.0}) {
    double sum = 0;
    double error = 0;
    double variance = 0;
    double error_of_f = 0;
    double variance_of_f = 0;
    for (std::uint64_t seed = 21; seed < 21 + kMaps; ++seed) {
      const SmallMap map = small_map(seed, 0, 0, {5e-3, -0.08, hold});
      const MapAdjustment found = adjust_map(map.evidence, small_options());
      ASSERT_EQ(found.status, MapStatus::kOk) << to_string(found.status);
      sum += square_of_all(map, found);
      error += found.lens.hold() - hold;
      variance += found.hold_sigma * found.hold_sigma;
      EXPECT_LT(found.hold_sigma, 0.25);
      // Of f by what it rests off, each picture alone: those that rest too long and too short err alike.
      double by_eps = 0;
      double of_eps = 0;
      Eigen::VectorXd a = Eigen::VectorXd::Zero(4 * static_cast<Eigen::Index>(map.truth.size()));
      for (std::size_t i = 0; i < 6; ++i) {
        const double eps = std::log(map.truth[i].focal_length) - map.evidence.pictures[i].position;
        a[4 * static_cast<Eigen::Index>(i) + 3] = eps;
        by_eps += eps * std::log(found.pictures[i].camera.focal_length / map.truth[i].focal_length);
        of_eps += eps * eps;
      }
      error_of_f += by_eps / of_eps;
      variance_of_f += a.dot(found.covariance * a) / (of_eps * of_eps);
    }
    // The prior draws towards 0.5 by its share, some percent of what is off.
    EXPECT_LT(std::abs(error), 4 * std::sqrt(variance)) << hold;
    EXPECT_LT(std::abs(error_of_f), 4 * std::sqrt(variance_of_f)) << hold;
    const double freedom = 72.0 * kMaps;
    const double wide = 4 * std::sqrt(2 / freedom);
    EXPECT_GT(sum / freedom, 1 - wide) << hold;
    EXPECT_LT(sum / freedom, 1.03 + wide) << hold;
  }
}

TEST(MapAdjustment, WithoutTelemetryKeepsTheFirstOrientationAndFindsTheRest) {
  SmallMap map = small_map(11, 0);
  for (MapPicture& picture : map.evidence.pictures) picture.telemetry.reset();
  const MapAdjustment found = adjust_map(map.evidence, small_options());
  ASSERT_EQ(found.status, MapStatus::kOk) << to_string(found.status);
  EXPECT_LT((found.pictures[0].R_base_from_camera - map.evidence.pictures[0].R_start).norm(), 1e-6);
  const Matrix3<double> common =
      found.pictures[0].R_base_from_camera * map.truth[0].base_from_camera(0).transpose();
  for (std::size_t i = 0; i < map.truth.size(); ++i) {
    const Vector3<double> xi =
        log_so3(Matrix3<double>((common * map.truth[i].base_from_camera(0)).transpose() *
                                found.pictures[i].R_base_from_camera));
    const Matrix4<double> covariance = found.covariance_of(static_cast<int>(i));
    for (int k = 0; k < 3; ++k)
      EXPECT_LT(std::abs(xi[k]), 5 * std::sqrt(covariance(k, k)) + 1e-6) << i;
    // Determined: a pixel of the widest pictures.
    EXPECT_LT(std::sqrt(covariance(0, 0)), 1 / kWide_px) << i;
  }
}

// Between two pictures that look apart, a landmark has no pixel in either.
TEST(MapAdjustment, WrongMatchesAcrossTheSceneAreLeftOut) {
  SmallMap map = small_map(15, 0);
  const auto right = static_cast<int>(map.evidence.observations.size());
  for (int i = 0; i < 12; ++i) {
    const int landmark = map.evidence.landmarks++;
    map.evidence.observations.push_back({3 * (i % 2), landmark, {20.0 + 10 * i, 300}});
    map.evidence.observations.push_back({12 + i % 6, landmark, {1000, 50.0 * i}});
  }
  MapOptions options = small_options();
  for (int i = 0; i < options.lens.control_points(); ++i) options.lens.control_point(i)[1] = -0.03;
  const MapAdjustment found = adjust_map(map.evidence, options);
  ASSERT_EQ(found.status, MapStatus::kOk) << to_string(found.status);
  ASSERT_GE(found.left_out.size(), 24U);
  for (int i = 0; i < 24; ++i) {
    EXPECT_EQ(found.left_out[found.left_out.size() - 24 + static_cast<std::size_t>(i)], right + i);
  }
  EXPECT_LT(square_of_all(map, found) / 72, 1 + 4 * std::sqrt(2 / 72.0));
}

TEST(MapAdjustment, NamesThePicturesThatDoNotConnect) {
  const SmallMap map = small_map(12, 0, -2.5);
  const MapAdjustment found = adjust_map(map.evidence, small_options());
  EXPECT_EQ(found.status, MapStatus::kNotConnected);
  ASSERT_EQ(found.groups.size(), 2U);
  EXPECT_EQ(found.groups[1], (std::vector<int>{0, 1, 2}));
  EXPECT_TRUE(found.pictures.empty());
}

TEST(MapAdjustment, RefusesWhatIsOutOfRange) {
  const SmallMap map = small_map(13, 0);
  const auto status_of = [](const MapEvidence& evidence, const MapOptions& options) {
    return adjust_map(evidence, options).status;
  };
  EXPECT_EQ(status_of({}, small_options()), MapStatus::kBadInput);
  EXPECT_EQ(status_of(map.evidence, {}), MapStatus::kBadInput);
  const auto with = [&](auto change) {
    MapEvidence evidence = map.evidence;
    change(&evidence);
    return status_of(evidence, small_options());
  };
  MapOptions held = small_options();
  held.hold_sigma = 0;
  EXPECT_EQ(status_of(map.evidence, held), MapStatus::kBadInput);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(with([](MapEvidence* e) { e->observations[5].picture = 18; }), MapStatus::kBadInput);
  EXPECT_EQ(with([](MapEvidence* e) { e->observations[5].landmark = -1; }), MapStatus::kBadInput);
  EXPECT_EQ(with([](MapEvidence* e) { e->observations[5].u.x() = kNan; }), MapStatus::kBadInput);
  EXPECT_EQ(with([](MapEvidence* e) { e->observations[5].sigma_px = 0; }), MapStatus::kBadInput);
  EXPECT_EQ(with([](MapEvidence* e) { e->pictures[3].position = 1; }), MapStatus::kBadInput);
  EXPECT_EQ(with([](MapEvidence* e) { e->pictures[3].eps_sigma = 0; }), MapStatus::kBadInput);
  EXPECT_EQ(with([](MapEvidence* e) { e->pictures[3].R_start(0, 0) = kNan; }),
            MapStatus::kBadInput);
  EXPECT_EQ(with([](MapEvidence* e) { e->pictures[3].telemetry->covariance(1, 1) = -1; }),
            MapStatus::kBadInput);
  // Pictures without anything in common.
  EXPECT_EQ(with([](MapEvidence* e) { e->observations.clear(); }), MapStatus::kNotConnected);
}

TEST(MapAdjustment, IsTheSameEachTime) {
  const SmallMap map = small_map(14, 0.03);
  const MapAdjustment first = adjust_map(map.evidence, small_options());
  const MapAdjustment second = adjust_map(map.evidence, small_options());
  ASSERT_EQ(first.status, MapStatus::kOk);
  EXPECT_EQ(first.covariance, second.covariance);
  EXPECT_EQ(first.left_out, second.left_out);
  for (std::size_t i = 0; i < first.pictures.size(); ++i) {
    EXPECT_EQ(first.pictures[i].R_base_from_camera, second.pictures[i].R_base_from_camera);
    EXPECT_EQ(first.pictures[i].camera.focal_length, second.pictures[i].camera.focal_length);
  }
}

}  // namespace
}  // namespace alidade::test
