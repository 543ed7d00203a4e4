#include "test/simulator/zoom.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "test/simulator/camera_model.h"
#include "test/simulator/scene.h"
#include "test/simulator/telemetry.h"
#include "test/support/temporary_directory.h"

namespace alidade::simulator {
namespace {

using testing::HasSubstr;
using Type = ZoomPathConfig::Type;

// A zoom of 20 that dwells at both ends and at one place between them.
Config zooming_camera() {
  Config config;
  config.path.amplitude = 0;
  ZoomConfig& zoom = config.zoom.emplace();
  zoom.distortion = {-0.05, 0.02};
  zoom.centre = {4, -3};
  zoom.centre_wander = 12;
  zoom.path.type = Type::kDwell;
  for (const double reading : {1.0, 5000.0, 9999.0}) {
    zoom.path.stops.push_back({reading, std::nullopt, 1});
  }
  return config;
}

TEST(VirtualZoomCurve, RisesEverywhereSmoothlyBetweenItsEnds) {
  for (const double shape : {0.25, 1.0, 4.0}) {
    for (const double ripple : {0.0, 0.5}) {
      ZoomConfig config;
      config.shape = shape;
      config.ripple = ripple;
      const ZoomCurve curve(config);
      EXPECT_NEAR(curve.log_focal_length(0), std::log(1200), 1e-12);
      EXPECT_NEAR(curve.log_focal_length(1), std::log(24000), 1e-12);
      constexpr int kSteps = 4096;
      const auto bend = [&](int i, int step) {
        return curve.log_focal_length((i + step) / double{kSteps}) -
               2 * curve.log_focal_length(i / double{kSteps}) +
               curve.log_focal_length((i - step) / double{kSteps});
      };
      for (int i = 1; i < kSteps; ++i) {
        const double at = i / double{kSteps};
        ASSERT_GT(curve.log_focal_length(at), curve.log_focal_length(at - 1.0 / kSteps));
        ASSERT_NEAR(curve.part_at(curve.log_focal_length(at)), at, 1e-13);
        // A bend grows with the square of the step; a kink would with the step.
        if (i >= 2 && i + 2 <= kSteps) {
          ASSERT_NEAR(bend(i, 2), 4 * bend(i, 1), 1e-3 * std::abs(bend(i, 2)) + 1e-7);
        }
      }
    }
  }
}

TEST(VirtualZoomCurve, ReadingsMayFallTowardsTheTeleEnd) {
  Config config = zooming_camera();
  config.zoom->reading = {1, 0};
  config.zoom->step = 1e-4;
  config.zoom->path = {};
  config.zoom->path.reading = 0.25;
  const Zoom falling(config);
  config.zoom->reading = {0, 1};
  config.zoom->path.reading = 0.75;
  const Zoom rising(config);
  EXPECT_NEAR(falling.lens(0).focal_length, rising.lens(0).focal_length, 1e-9);
  EXPECT_NEAR(falling.reading(0), 0.25, 1e-12);
  EXPECT_NEAR(falling.reported(0), 0.25, 1e-12);
}

TEST(VirtualZoomCurve, LensHasTheDistortionAndTheCentreOfItsReading) {
  const Zoom zoom(zooming_camera());
  const Lens wide = zoom.nominal_lens(1);
  const Lens tele = zoom.nominal_lens(9999);
  // At the middle of the left border: half the width over f is the slope.
  EXPECT_NEAR(wide.radial_distortion * std::pow(640 / 1200.0, 2), -0.05, 1e-12);
  EXPECT_NEAR(tele.radial_distortion * std::pow(640 / 24000.0, 2), 0.02, 1e-12);
  EXPECT_NEAR(wide.centre.x(), 644, 1e-12);
  EXPECT_NEAR(wide.centre.y(), 357, 1e-12);
  Eigen::AlignedBox2d places;
  for (int reading = 1; reading <= 9999; ++reading) {
    places.extend(zoom.nominal_lens(reading).centre);
  }
  EXPECT_GT(places.sizes().minCoeff(), 6);
  EXPECT_LT(places.sizes().maxCoeff(), 18);
}

TEST(VirtualZoomCurve, RayOfAPixelProjectsBackOntoItAtAnyZoom) {
  Config config = zooming_camera();
  config.zoom->distortion = {-0.1, 0.3};
  config.camera.aspect = 1.01;
  const Zoom zoom(config);
  for (const double reading : {1.0, 3000.0, 9999.0}) {
    const Lens lens = zoom.nominal_lens(reading);
    for (double u = 0.5; u < 1280; u += 31) {
      for (double v = 0.5; v < 720; v += 31) {
        const Eigen::Vector2d slope = lens.slope(u, v);
        ASSERT_FALSE(slope.hasNaN()) << reading << ' ' << u << ' ' << v;
        const auto pixel = lens.project({slope.x(), slope.y(), 1});
        ASSERT_TRUE(pixel.has_value());
        EXPECT_LT((*pixel - Eigen::Vector2d(u, v)).norm(), 1e-9);
      }
    }
  }
}

struct Limits {
  double rate = 0, acceleration = 0;
};

// Largest quotients of differences of log f: none exceeds the largest derivative.
Limits limits_seen(const ZoomPath& path, double from, double to) {
  constexpr double kStep = 1e-3;
  Limits seen;
  double before = path.at(from - kStep).log_focal_length;
  double now = path.at(from).log_focal_length;
  for (double time = from; time < to; time += kStep) {
    const double after = path.at(time + kStep).log_focal_length;
    seen.rate = std::max(seen.rate, std::abs(after - now) / kStep);
    seen.acceleration =
        std::max(seen.acceleration, std::abs(after - 2 * now + before) / (kStep * kStep));
    before = now;
    now = after;
  }
  return seen;
}

TEST(VirtualZoomMotor, NeverExceedsItsSpeedNorItsAcceleration) {
  for (const double acceleration : {0.3, 3.0, 100.0}) {
    for (const Type type : {Type::kDwell, Type::kSweep, Type::kCreep}) {
      Config config = zooming_camera();
      config.zoom->acceleration = acceleration;
      config.zoom->path.type = type;
      config.zoom->path.factor = 1.5;
      config.zoom->path.rate = 0.05;
      const auto path = make_zoom_path(*config.zoom);
      const Limits seen = limits_seen(*path, -path->period_s(), path->period_s());
      EXPECT_LE(seen.rate, 0.75 * (1 + 1e-6));
      EXPECT_LE(seen.acceleration, acceleration * (1 + 1e-6) + 1e-7);
      EXPECT_GT(seen.acceleration, 0.9 * std::min(acceleration, 30.0)) << static_cast<int>(type);
      if (type == Type::kDwell && acceleration > 1) {
        EXPECT_GT(seen.rate, 0.75 * (1 - 1e-6));
      }
      if (type == Type::kCreep) {
        EXPECT_NEAR(seen.rate, 0.05, 1e-6);
      }
    }
  }
}

TEST(VirtualZoomMotor, DwellsAtEveryStopAndComesBackToTheFirst) {
  const Zoom zoom(zooming_camera());
  const double period = zoom.path().period_s();
  // The whole range there and back at the highest speed, in three movements with a ramp of pi v / (2 a) each; three rests.
  const double ramp = 3.14159265358979323846 * 0.75 / (2 * 3);
  EXPECT_NEAR(period, 2 * std::log(20) / 0.75 + 3 * ramp + 3, 1e-9);
  std::vector<double> rests;
  for (double time = 0; time < period; time += 0.01) {
    const double reading = zoom.reading(time);
    EXPECT_NEAR(zoom.reading(time - 3 * period), reading, 1e-6);
    if (zoom.reading(time + 0.01) == reading && (rests.empty() || rests.back() != reading)) {
      rests.push_back(reading);
    }
  }
  ASSERT_EQ(rests.size(), 3U);
  EXPECT_NEAR(rests[0], 1, 1e-9);
  EXPECT_NEAR(rests[1], 5000, 1e-9);
  EXPECT_NEAR(rests[2], 9999, 1e-9);
}

TEST(VirtualZoomMotor, SweepsItsFactorInItsTimeOrSaysHowLongItNeeds) {
  ZoomConfig config;
  config.path.type = Type::kSweep;
  config.path.duration = 4;
  config.path.stop = 0.5;
  config.path.reading = 9999;
  config.path.factor = 0.1;
  const auto path = make_zoom_path(config);
  EXPECT_NEAR(path->at(4).log_focal_length, std::log(2400), 1e-9);
  EXPECT_LT(path->at(3.9).done, 1);
  EXPECT_NEAR(path->at(4.4).log_focal_length, std::log(2400), 1e-9);
  EXPECT_NEAR(path->at(8.5).log_focal_length, std::log(24000), 1e-9);
  config.path.duration = 1;
  std::string message;
  try {
    (void)make_zoom_path(config);
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  ASSERT_THAT(message, HasSubstr("path: a sweep_s of 1 is too short for the motor, which needs "));
  const double needed = std::stod(message.substr(message.rfind(' ')));
  config.path.duration = needed + 1e-5;
  EXPECT_NO_THROW((void)make_zoom_path(config));
  config.path.duration = needed - 1e-3;
  EXPECT_THROW((void)make_zoom_path(config), std::invalid_argument);
}

TEST(VirtualZoomMotor, FollowsATableAndNamesTheLineItCannot) {
  const TemporaryDirectory directory;
  Config config = zooming_camera();
  config.zoom->path = {};
  config.zoom->path.type = Type::kCsv;
  const auto load = [&](const std::string& rows) {
    config.zoom->path.file = directory.write("zoom.csv", "time_s,zoom\n" + rows);
    return Zoom(config);
  };
  const Zoom zoom = load("0,1000\n2,1000\n4,2000\n6,2500\n8,2500\n10,1500\n");
  EXPECT_NEAR(zoom.reading(-5), 1000, 1e-9);
  EXPECT_EQ(zoom.reading(1.9), zoom.reading(0));
  EXPECT_NEAR(zoom.reading(4), 2000, 1e-9);
  EXPECT_EQ(zoom.reading(6.5), zoom.reading(7.9));
  EXPECT_NEAR(zoom.reading(60), 1500, 1e-9);
  for (double time = 2; time < 5.98; time += 0.01) {
    EXPECT_GT(zoom.reading(time + 0.01), zoom.reading(time)) << time;
  }
  EXPECT_EQ(zoom.path().at(5).movement, 0);
  EXPECT_EQ(zoom.path().at(7).movement, 0);
  EXPECT_EQ(zoom.path().at(9).movement, 1);
  EXPECT_EQ(zoom.path().direction(1), -1);
  const Limits seen = limits_seen(zoom.path(), -1, 11);
  EXPECT_LE(seen.rate, 0.75);
  EXPECT_LE(seen.acceleration, 3);

  const auto error_of = [&](const std::string& rows) {
    try {
      (void)load(rows);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error_of("0,1\n1,1\n2,9999\n"), HasSubstr("zoom.csv:4: this point needs a zoom of "));
  EXPECT_THAT(error_of("0,1\n0.01,8\n0.02,8\n"),
              HasSubstr("zoom.csv:3: this point needs an acceleration of "));
  EXPECT_THAT(error_of("0,1\n1,20000\n"),
              HasSubstr("zoom.csv:3: path: zoom 20000 is not between 1 and 9999"));
  EXPECT_THAT(error_of("0,1\n1,x\n"),
              HasSubstr("zoom.csv:3: a path needs a number in time_s and zoom"));
}

TEST(VirtualZoom, ComesBackWithTheRepeatabilityAskedForAndDrawsAnewEachTime) {
  Config config = zooming_camera();
  config.zoom->sigma_rep = 2e-3;
  config.zoom->path.stops = {{2000.0, std::nullopt, 1}, {8000.0, std::nullopt, 1}};
  const Zoom zoom(config);
  EXPECT_EQ(zoom.period_s(), 0);
  const double period = zoom.path().period_s();
  constexpr int kReturns = 4000;
  double sum = 0;
  double squares = 0;
  double products = 0;
  double last = 0;
  for (int i = 0; i < kReturns; ++i) {
    // The middle of a rest at the first stop, and two other moments of it.
    const double time = i * period + 0.5;
    const double focal_length = zoom.lens(time).focal_length;
    ASSERT_EQ(zoom.lens(time - 0.4).focal_length, focal_length);
    ASSERT_EQ(zoom.lens(time + 0.4).focal_length, focal_length);
    const double eps = std::log(focal_length / zoom.nominal_lens(2000).focal_length);
    sum += eps;
    squares += eps * eps;
    products += eps * last;
    last = eps;
  }
  const double variance = 4e-6;
  EXPECT_NEAR(sum / kReturns, 0, 4 * 2e-3 / std::sqrt(kReturns));
  EXPECT_NEAR(squares / kReturns, variance, 4 * variance * std::sqrt(2.0 / kReturns));
  EXPECT_NEAR(products / kReturns, 0, 4 * variance / std::sqrt(kReturns));
  config.seed = 2;
  EXPECT_NE(Zoom(config).lens(0).focal_length, zoom.lens(0).focal_length);
}

TEST(VirtualZoom, BacklashDependsOnTheDirectionOfApproach) {
  Config config = zooming_camera();
  config.zoom->backlash = 1e-3;
  config.zoom->path.stops = {{2000.0, std::nullopt, 1},
                             {5000.0, std::nullopt, 1},
                             {8000.0, std::nullopt, 1},
                             {5000.0, std::nullopt, 1}};
  const Zoom zoom(config);
  EXPECT_EQ(zoom.period_s(), zoom.path().period_s());
  std::vector<double> eps;
  for (double time = 0; time < zoom.period_s(); time += 0.01) {
    if (std::abs(zoom.reading(time) - 5000) > 1e-6) continue;
    eps.push_back(std::log(zoom.lens(time).focal_length / zoom.nominal_lens(5000).focal_length));
  }
  ASSERT_GT(eps.size(), 150U);
  EXPECT_NEAR(eps.front(), 0.5e-3, 1e-9);
  EXPECT_NEAR(eps.back(), -0.5e-3, 1e-9);
}

TEST(VirtualZoom, FocalLengthNeverJumps) {
  Config config = zooming_camera();
  config.zoom->sigma_rep = 5e-3;
  config.zoom->backlash = 2e-3;
  const Zoom zoom(config);
  // Movements of log 4.4 or more, by which eps changes by less than six sigmas of a difference and twice the backlash.
  const double slack = (6 * std::sqrt(2.0) * 5e-3 + 4e-3) / std::log(4.4);
  double last = std::log(zoom.lens(-5).focal_length);
  for (double time = -5; time < 200; time += 2e-3) {
    const double now = std::log(zoom.lens(time + 2e-3).focal_length);
    ASSERT_LE(std::abs(now - last), 2e-3 * 0.75 * (1 + slack)) << time;
    last = now;
  }
}

TEST(VirtualZoom, EachRowIsSeenWithTheLensOfItsOwnTime) {
  for (const double line_delay : {-14.2e-6, 40e-6}) {
    Config config = zooming_camera();
    config.camera.line_delay = line_delay;
    config.zoom->sigma_rep = 3e-3;
    const std::unique_ptr<Path> path = make_path(config);
    const Zoom zoom(config);
    const CameraModel camera(config.camera, config.image, *path, zoom);
    const double t0 = 2.2;  // between the first two stops
    EXPECT_GT(
        std::abs(zoom.lens(t0 + 720 * line_delay).focal_length / zoom.lens(t0).focal_length - 1),
        5e-3);
    int rows = 0;
    for (double elevation = -0.09; elevation <= 0.09; elevation += 0.02) {
      const Eigen::Vector3d d_base = direction(0.1, elevation);
      const auto pixel = camera.project_rolling(d_base, t0);
      if (!pixel) continue;
      ++rows;
      const Lens lens = zoom.lens(t0 + pixel->y() * line_delay);
      const double x = d_base.y() / d_base.x();
      const double y = d_base.z() / d_base.x();
      const double radial = 1 + lens.radial_distortion * (x * x + y * y);
      EXPECT_NEAR(pixel->x(), lens.focal_length * x * radial + lens.centre.x(), 1e-6);
      EXPECT_NEAR(pixel->y(), lens.focal_length * y * radial + lens.centre.y(), 1e-6);
    }
    EXPECT_GE(rows, 5);
  }
}

TEST(VirtualZoom, TellsItsReadingInWholeStepsOfTheTimeAskedFor) {
  Config config = zooming_camera();
  config.zoom->reading = {0, 1000};
  config.zoom->step = 20;
  for (auto& stop : config.zoom->path.stops) stop.reading = *stop.reading / 10;
  const Zoom zoom(config);
  for (double time = -1; time < 20; time += 0.013) {
    const double told = zoom.reported(time);
    EXPECT_EQ(std::remainder(told, 20), 0);
    EXPECT_LE(std::abs(told - zoom.reading(time)), 10 + 1e-9);
  }
  config.zoom->late = 1;
  config.zoom->stuck = {{6, 8}};
  const Zoom late(config);
  for (double time = -1; time < 20; time += 0.013) {
    const bool stuck = time >= 6 && time < 8;
    EXPECT_EQ(late.reported(time), zoom.reported((stuck ? 6 : time) - 1)) << time;
  }
}

TEST(VirtualZoom, TelemetryHasTheReadingOfTheSameMomentAsTheAnglesAndDrawsNothingForIt) {
  Config config = zooming_camera();
  config.path.amplitude = 1;
  config.path.focal_length = 1500;
  config.telemetry.sigma = 1e-4;
  config.telemetry.internal_rate_hz = 10;
  config.telemetry.stale_repeat_probability = 0.3;
  Config without = config;
  without.zoom.reset();
  const std::unique_ptr<Path> path = make_path(config);
  const Zoom zoom(config);
  Telemetry telemetry(config, *path);
  Telemetry still(without, *path);
  double time_of_angles = 0;
  Angles last;
  for (double time = 0; time < 20; time += 0.03) {
    const Angles angles = telemetry.measure(time);
    EXPECT_EQ(angles.pan, still.measure(time).pan);
    if (angles.pan != last.pan) time_of_angles = std::floor(time * 10) / 10;
    last = angles;
    EXPECT_EQ(telemetry.zoom(), zoom.reported(time_of_angles)) << time;
  }
  EXPECT_FALSE(still.zoom().has_value());
}

TEST(VirtualZoom, PathsFieldsOfViewAreThoseOfItsLongestFocalLengthUnlessTold) {
  Config config = zooming_camera();
  EXPECT_NEAR(horizontal_field_of_view(config), 2 * std::atan(640 / 24000.0), 1e-12);
  config.path.focal_length = 2000;
  EXPECT_NEAR(horizontal_field_of_view(config), 2 * std::atan(640 / 2000.0), 1e-12);
}

// As many fields of view to either side of the centre at whatever zoom there is.
TEST(VirtualZoom, APathThatFollowsTheZoomTurnsByTheFieldsOfViewOfEachMoment) {
  Config config = zooming_camera();
  config.path = {};
  config.path.pan = 1;
  config.path.tilt = -0.2;
  config.path.period = 10;
  config.zoom->path.round = 20;
  const auto steady = make_path(config);
  config.path.follows_zoom = true;
  const auto path = make_path(config);
  const Zoom zoom(config);
  EXPECT_EQ(path->period_s(), 20);
  for (const double time : {0.5, 2.7, 6.1, 9.3, 15.0}) {
    const double part = field_of_view(config.image, zoom.lens(time).focal_length) /
                        field_of_view(config.image, 24000);
    EXPECT_NEAR(path->at(time).pan - 1, part * (steady->at(time).pan - 1), 1e-12) << time;
    EXPECT_NEAR(path->at(time).tilt + 0.2, part * (steady->at(time).tilt + 0.2), 1e-12) << time;
    EXPECT_NEAR(path->at(time + 20).pan, path->at(time).pan, 1e-9) << time;
  }
  config.path.period = 7;  // no whole number of these makes a round of the zoom
  EXPECT_EQ(make_path(config)->period_s(), 0);
}

TEST(VirtualZoom, ARoundThatIsStatedRepeatsWithAllThatIsRandom) {
  Config config = zooming_camera();
  config.zoom->sigma_rep = 0.01;
  EXPECT_EQ(Zoom(config).period_s(), 0);
  config.zoom->path.round = 30;
  const Zoom zoom(config);
  EXPECT_EQ(zoom.period_s(), 30);
  for (const double time : {0.0, 3.0, 5.5, 29.0}) {
    EXPECT_NEAR(zoom.lens(time + 60).focal_length, zoom.lens(time).focal_length, 1e-6) << time;
  }
  EXPECT_NE(zoom.slip(0), zoom.slip(1));
  // It waits where it began.
  EXPECT_EQ(zoom.reading(29), zoom.reading(29.9));
}

}  // namespace
}  // namespace alidade::simulator
