// Movements of a zoom: tracks of a lens with formulas of its own (zoom_nodes.h), made without the model's code, to what
// observe_movement() and fit_zoom() say of the focal length, against the truth.

#include "core/calibration/zoom_movement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

#include "core/calibration/calibration_text.h"
#include "core/calibration/zoom_fit.h"
#include "test/support/simulated_recording.h"
#include "test/support/zoom_by_formula.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

constexpr double kSlip = 0.002;  // repeatability
constexpr double kRest_s = 2;
constexpr double kWay_s = 1.6;

// One movement of the lens, from rest to rest.
struct Ride {
  double from = 1250;  // readings
  double to = 1500;
  double slip_from = 0;  // eps at either rest, in log f
  double slip_to = 0;
  double late_s = 0;  // what is told of the zoom is so old
  std::uint64_t seed = 1;

  [[nodiscard]] double way(double time) const {
    const double x = std::clamp((time - kRest_s) / kWay_s, 0.0, 1.0);
    return x * x * x * (10 - 15 * x + 6 * x * x);
  }
  [[nodiscard]] double reading(double time) const { return from + way(time) * (to - from); }
  // Between the rests eps goes with log f.
  [[nodiscard]] double log_f_at(double reading) const {
    const double begin = std::log(test::zoom_focal_length(from));
    const double end = std::log(test::zoom_focal_length(to));
    const double here = std::log(test::zoom_focal_length(reading));
    const double share = (here - begin) / (end - begin);
    return here + slip_from + share * (slip_to - slip_from);
  }
};

ZoomMovement record(const Ride& ride) {
  constexpr double kDuration_s = 2 * kRest_s + kWay_s;
  constexpr double kPixelSigma = 0.1;
  const Calibration known = test::zoom_calibration(ride.from);
  std::mt19937_64 random(ride.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  test::Simulation s;
  s.width = known.camera.width;
  s.height = known.camera.height;
  s.line_delay = known.line_delay;
  s.pan_axis = Eigen::Vector3d::UnitZ();
  s.tilt_axis = Eigen::Vector3d::UnitY();
  s.optical_centre_offset_px = {known.camera.centre_u, known.camera.centre_v};
  s.path = [](double t) {
    return Eigen::Vector2d(0.1 * std::sin(1.3 * t), 0.05 * std::sin(2.1 * t + 1));
  };
  ZoomMovement movement;
  CalibrationInput& input = movement.input;
  input.width = s.width;
  input.height = s.height;
  input.noise.image_stamp_sigma_s = 1e-3;
  input.noise.telemetry_stamp_sigma_s = 1e-3;
  input.noise.pan_tilt_sigma_rad = 5e-5;
  std::vector<Eigen::Vector3d> landmarks;
  for (int i = 0; i < 500; ++i) {
    landmarks.push_back(
        Eigen::Vector3d(1, 0.5 * uniform(random), 0.35 * uniform(random)).normalized());
  }
  constexpr double kFramePeriod_s = 0.04;
  for (int n = 0; n * kFramePeriod_s < kDuration_s; ++n) {
    const double time = n * kFramePeriod_s;
    input.frames.push_back({n, time + 1e-3 * normal(random), n});
    for (std::size_t l = 0; l < landmarks.size(); ++l) {
      // The row that sees it: a fixed point, as rows are read out much faster than anything moves.
      double u = 0;
      double v = s.height / 2.0;
      bool is_seen = true;
      for (int step = 0; step < 12 && is_seen; ++step) {
        const double at = time + v * s.line_delay;
        s.focal_length = std::exp(ride.log_f_at(ride.reading(at)));
        is_seen = test::internal::pixel_at(s, s.angles(at), landmarks[l], &u, &v) &&
                  std::abs(v) < 2 * s.height;
      }
      if (!is_seen || u < 0 || u > s.width || v < 0 || v > s.height) continue;
      input.observations.push_back({n, static_cast<std::int64_t>(l),
                                    u + kPixelSigma * normal(random),
                                    v + kPixelSigma * normal(random), kPixelSigma});
    }
  }
  constexpr double kTelemetryPeriod_s = 1 / 30.0;
  movement.from.begin_s = movement.to.end_s = -1e9;
  for (int m = 0; m * kTelemetryPeriod_s < kDuration_s; ++m) {
    const double time = m * kTelemetryPeriod_s;
    const Eigen::Vector2d angle = s.angles(time);
    const double stamp = time + known.clock_offset + 1e-3 * normal(random);
    input.telemetry.push_back(
        {stamp, angle[0] + 5e-5 * normal(random), angle[1] + 5e-5 * normal(random), m});
    const double told = std::round(ride.reading(time - ride.late_s) * 100) / 100;
    movement.readings.push_back({stamp, told});
    if (m == 0) movement.from = {told, stamp, stamp};
    if (told == movement.from.zoom) movement.from.end_s = stamp;
    if (told == ride.to && movement.to.end_s < -1e8) movement.to = {told, stamp, stamp};
    if (told == ride.to) movement.to.end_s = stamp;
  }
  return movement;
}

const std::vector<double>& between() {
  static const std::vector<double> readings = {1300, 1350, 1400, 1450};
  return readings;
}

MovementObservation observe(const Ride& ride) {
  MovementObservation observation;
  std::string error;
  EXPECT_TRUE(observe_movement(record(ride), test::zoom_curve({1000, 1250, 1500, 2000}), between(),
                               &observation, &error))
      << error;
  return observation;
}

Eigen::VectorXd error_of(const MovementObservation& observation, const Ride& ride) {
  std::vector<double> readings = {ride.from, ride.to};
  readings.insert(readings.end(), observation.reading.begin(), observation.reading.end());
  Eigen::VectorXd error(static_cast<Eigen::Index>(readings.size()));
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    error[i] =
        observation.log_focal_length[i] - ride.log_f_at(readings[static_cast<std::size_t>(i)]);
  }
  return error;
}

// Whatever the lens slips by: the tracks show f itself.
TEST(ZoomMovement, ErrorsAreWhatItsCovarianceSays) {
  double square = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Ride ride;
    ride.seed = seed;
    if (seed % 2 == 0) std::swap(ride.from, ride.to);
    ride.slip_from = 0.003;
    ride.slip_to = -0.002;
    const MovementObservation observation = observe(ride);
    ASSERT_EQ(observation.reading.size(), between().size());
    const Eigen::VectorXd error = error_of(observation, ride);
    const Eigen::VectorXd scale = observation.covariance.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd correlation =
        scale.asDiagonal() * observation.covariance * scale.asDiagonal();
    const Eigen::VectorXd whitened = scale.cwiseProduct(error);
    square += whitened.dot(correlation.ldlt().solve(whitened));
    count += static_cast<int>(error.size());
    EXPECT_LT(std::sqrt(observation.covariance.diagonal().maxCoeff()), 2e-3)
        << "what is not known at all tells nothing";
    EXPECT_NEAR(observation.pixel_sigma_ratio, 1, 0.1);
  }
  // Chi-square about its number of degrees of freedom, by five standard deviations.
  EXPECT_LT(square, count + 5 * std::sqrt(2.0 * count));
  EXPECT_GT(square, count - 5 * std::sqrt(2.0 * count));
}

TEST(ZoomMovement, OutliersAreLeftOut) {
  Ride ride;
  ZoomMovement movement = record(ride);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0, 400);
  for (std::size_t i = 0; i < movement.input.observations.size(); i += 20) {
    movement.input.observations[i].u_px = uniform(random);
    movement.input.observations[i].v_px = uniform(random);
  }
  MovementObservation observation;
  std::string error;
  ASSERT_TRUE(observe_movement(movement, test::zoom_curve({1000, 1250, 1500, 2000}), between(),
                               &observation, &error))
      << error;
  const Eigen::VectorXd off = error_of(observation, ride);
  for (Eigen::Index i = 0; i < off.size(); ++i) {
    EXPECT_LT(std::abs(off[i]), 5 * std::sqrt(observation.covariance(i, i))) << i;
  }
}

TEST(ZoomMovement, SaysWhyItTellsNothing) {
  const ZoomCurve curve = test::zoom_curve();
  const ZoomMovement good = record({});
  const auto refusal = [&](const ZoomMovement& movement, const ZoomCurve& known) {
    MovementObservation observation;
    std::string error;
    EXPECT_FALSE(observe_movement(movement, known, between(), &observation, &error));
    EXPECT_EQ(error.find('\n'), std::string::npos);
    return error;
  };
  EXPECT_THAT(refusal(good, ZoomCurve()), HasSubstr("no zoom curve"));
  ZoomMovement bad = good;
  bad.input.observations.clear();
  EXPECT_THAT(refusal(bad, curve), HasSubstr("landmarks"));
  // Nothing is seen on the way, and what is seen after it are others than before.
  bad = good;
  auto& seen = bad.input.observations;
  seen.erase(std::remove_if(seen.begin(), seen.end(),
                            [](const CalibrationObservation& o) {
                              const double time = 0.04 * static_cast<double>(o.frame);
                              return time > kRest_s && time < kRest_s + kWay_s;
                            }),
             seen.end());
  for (CalibrationObservation& o : seen) {
    if (static_cast<double>(o.frame) > kRest_s / 0.04) o.landmark += 1000;
  }
  EXPECT_THAT(refusal(bad, curve), HasSubstr("no landmarks are followed through it"));
  bad = good;
  bad.to.begin_s += 100;
  EXPECT_THAT(refusal(bad, curve), HasSubstr("more than 20"));
  bad = good;
  const auto moving = std::find_if(bad.readings.begin(), bad.readings.end(),
                                   [](const ZoomReading& r) { return r.zoom > 1400; });
  ASSERT_NE(moving, bad.readings.end());
  moving->zoom = 1300;
  EXPECT_THAT(refusal(bad, curve), HasSubstr("to and fro"));
  bad = good;
  bad.readings[5].zoom = std::nan("");
  EXPECT_THAT(refusal(bad, curve), HasSubstr("not finite"));
  bad = good;
  for (CalibrationObservation& o : bad.input.observations) o.sigma_px = 0.005;
  EXPECT_THAT(refusal(bad, curve), HasSubstr("times their sigmas off"));
}

// Calibrations at the rests, each with the eps of its visit, and the movements between.
struct Tour {
  std::vector<Calibration> calibrations;
  std::vector<MovementObservation> movements;
};

Tour tour(std::uint64_t seed) {
  std::mt19937_64 random(100 + seed);
  std::normal_distribution<double> normal;
  Tour tour;
  const std::vector<double> rests = {1250, 1500};
  std::vector<double> slips;
  for (const double reading : rests) {
    Calibration c = test::zoom_calibration(reading);
    slips.push_back(kSlip * normal(random));
    c.camera.focal_length *= std::exp(slips.back() + 1e-4 * normal(random));
    tour.calibrations.push_back(c);
  }
  Ride ride;
  ride.seed = seed;
  ride.slip_from = slips[0];
  ride.slip_to = slips[1];
  tour.movements.push_back(observe(ride));
  tour.movements.back().from = 0;
  tour.movements.back().to = 1;
  return tour;
}

TEST(ZoomMovement, TellsTheCurveBetweenTheNodes) {
  double square = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Tour seen = tour(seed);
    ZoomFitOptions options;
    options.repeatability = kSlip;
    ZoomFit without;
    ZoomFit with;
    std::string error;
    ASSERT_TRUE(fit_zoom(seen.calibrations, options, &without, &error)) << error;
    ASSERT_TRUE(fit_zoom(seen.calibrations, seen.movements, options, &with, &error)) << error;
    for (const double reading : {1310.0, 1375.0, 1440.0}) {
      Calibration before;
      Calibration after;
      ASSERT_TRUE(without.curve.at(reading, &before));
      ASSERT_TRUE(with.curve.at(reading, &after));
      const double f = test::zoom_focal_length(reading);
      const double sigma = std::sqrt(after.covariance(0, 0));
      EXPECT_LT(sigma, 0.5 * std::sqrt(before.covariance(0, 0))) << reading;
      EXPECT_GT(sigma, kSlip * f) << "no curve knows more than the lens repeats";
      // What a movement to there would add is not in the truth.
      const double of_curve = std::sqrt(sigma * sigma - kSlip * kSlip * f * f);
      EXPECT_LT(std::abs(after.camera.focal_length - f), 5 * of_curve) << seed << ", " << reading;
      square += std::pow((after.camera.focal_length - f) / of_curve, 2);
      ++count;
    }
    // The dwells' own say is as it was.
    for (const auto& [curve, node] : {std::pair{&without.curve, 0}, {&without.curve, 1}}) {
      const Calibration c = curve->node(node);
      EXPECT_NEAR(c.camera.focal_length,
                  seen.calibrations[static_cast<std::size_t>(node)].camera.focal_length,
                  std::sqrt(c.covariance(0, 0)));
    }
  }
  // Three readings of one movement may have one error: five independent squares at least, by five standard deviations.
  EXPECT_LT(square / count, 1 + 5 * std::sqrt(2.0 / 5));
}

// What is told late is told so of all movements: it is in the sigmas.
TEST(ZoomMovement, AReadingThatIsLateIsWithinTheSigmas) {
  Ride ride;
  ride.late_s = 0.015;
  MovementObservation observation = observe(ride);
  observation.from = 0;
  observation.to = 1;
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom({test::zoom_calibration(1250), test::zoom_calibration(1500)}, {observation},
                       {}, &fit, &error))
      << error;
  for (const double reading : {1310.0, 1375.0, 1440.0}) {
    Calibration c;
    ASSERT_TRUE(fit.curve.at(reading, &c));
    EXPECT_LT(std::abs(c.camera.focal_length - test::zoom_focal_length(reading)),
              3 * std::sqrt(c.covariance(0, 0)))
        << reading;
  }
}

TEST(ZoomMovement, NodesBetweenDwellsAreStoredAndExtended) {
  const Tour seen = tour(1);
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom(seen.calibrations, seen.movements, {}, &fit, &error)) << error;
  const auto& content = fit.curve.content();
  const auto betweens = std::count(content.is_between.begin(), content.is_between.end(), true);
  // The readings passed, and the rests' own.
  EXPECT_EQ(betweens, static_cast<long>(between().size() + seen.calibrations.size()));
  CalibrationNotes notes;
  notes.zoom_curve = fit.curve;
  Calibration calibration;
  ZoomCurve again;
  ASSERT_TRUE(parse_calibration(format_calibration(fit.curve.node(0), notes), "zoom.yaml",
                                &calibration, &error, &again))
      << error;
  Calibration a;
  Calibration b;
  for (const double reading : {1250.0, 1333.0, 1500.0}) {
    ASSERT_TRUE(fit.curve.at(reading, &a));
    ASSERT_TRUE(again.at(reading, &b));
    EXPECT_NEAR(b.camera.focal_length / a.camera.focal_length, 1, 1e-9);
    EXPECT_NEAR(b.covariance(0, 0) / a.covariance(0, 0), 1, 1e-6);
  }
  // One more dwell, far from these, takes nothing away from what the movement said.
  ZoomFit extended;
  ASSERT_TRUE(extend_zoom(fit.curve, test::zoom_calibration(2000), {}, {}, &extended, &error))
      << error;
  ASSERT_TRUE(fit.curve.at(1375, &a));
  ASSERT_TRUE(extended.curve.at(1375, &b));
  EXPECT_LT(std::abs(b.camera.focal_length - a.camera.focal_length), std::sqrt(a.covariance(0, 0)));
  EXPECT_LT(b.covariance(0, 0), 1.5 * a.covariance(0, 0));
}

TEST(ZoomMovement, ReadingsBetweenFillTheWidestGapsAndLeaveRoom) {
  std::vector<Calibration> calibrations;
  for (const double reading : {2000.0, 1000.0, 1100.0})
    calibrations.push_back(test::zoom_calibration(reading));
  const std::vector<double> readings = readings_between(calibrations);
  ASSERT_FALSE(readings.empty());
  EXPECT_TRUE(std::is_sorted(readings.begin(), readings.end()));
  EXPECT_LE(readings.size() + 2 * calibrations.size(),
            static_cast<std::size_t>(ZoomCurve::kMaxNodes));
  EXPECT_GT(std::count_if(readings.begin(), readings.end(), [](double r) { return r > 1100; }), 5);
  EXPECT_EQ(std::count(readings.begin(), readings.end(), 1100.0), 0);
  EXPECT_TRUE(readings_between({}).empty());
}

TEST(ZoomMovement, SaysWhatWasNeverSeen) {
  const Tour seen = tour(1);
  std::vector<Calibration> calibrations = seen.calibrations;
  calibrations.push_back(test::zoom_calibration(2000));
  ZoomFit fit;
  std::string error;
  ASSERT_TRUE(fit_zoom(calibrations, seen.movements, {}, &fit, &error)) << error;
  const std::vector<std::string> advice = zoom_advice(fit.curve);
  ASSERT_EQ(advice.size(), 1u);
  EXPECT_THAT(advice[0], HasSubstr("between readings 1500 and 2000 was never seen"));
}

}  // namespace
}  // namespace alidade
