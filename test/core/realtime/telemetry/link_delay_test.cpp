// The delay of a link, on motions that are known in closed form: which delays are found, how soon,
// and whether sigma is what the errors are.

#include "core/realtime/telemetry/link_delay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <ostream>
#include <random>
#include <string>

#include "core/model/trigonometry.h"

namespace alidade {
namespace {

constexpr double kAngleNoise = 1e-4;     // rad
constexpr double kConnections_s = 5e-3;  // s

using Path = std::function<PanTilt<double>(double)>;

// Rest until 2 s.
PanTilt<double> sines(double t) {
  const double s = std::max(0.0, t - 2);
  const double begin = s * s / (1 + s * s);
  return {3.1 + 0.2 * begin * std::sin(0.9 * s), -0.1 + 0.1 * begin * std::sin(1.3 * s)};
}

// Rests and moves in turn, with 1 rad/s^2, on one axis.
double hops(double t) {
  constexpr double kPeriod_s = 3;
  const double s = std::max(0.0, t - 2);
  const double hop = std::floor(s / kPeriod_s);
  const double u = s - kPeriod_s * hop;
  const double there = u < 0.3   ? u * u / 2
                       : u < 1.3 ? 0.045 + 0.3 * (u - 0.3)
                       : u < 1.6 ? 0.39 - (1.6 - u) * (1.6 - u) / 2
                                 : 0.39;
  const bool back = static_cast<int>(hop) % 2 == 1;
  return back ? 0.39 - there : there;
}

// Moves all the time.
PanTilt<double> figure(double t) {
  return {0.06 * std::sin(0.5 * t + 1), 0.03 * std::sin(0.9 * t + 2)};
}

struct Link {
  double delay_s = 0;  // telemetry against pictures
  double samples_hz = 25;
  double frames_hz = 25;
  int polls = 1;               // of the device's value
  double step = 0;             // rad
  double gear = 0;             // rad
  double noise = kAngleNoise;  // rad
  double error_sigma = 0;      // rad, that the gear is known to have
  double change_s = 1e9;       // when the delay becomes changed_s
  double changed_s = 0;
};

// When the delay was found: s.
struct Ride {
  Ride(LinkDelay* told, const Path& head, const Link& of, unsigned seed)
      : delay(*told), path(head), link(of), random(seed), phase(0.01 * (seed % 7)) {}

  // To the time t.
  void go(double until_s) {
    for (; now_s < until_s; now_s += 1e-3) {
      if (now_s >= next_sample_s) sample();
      if (now_s >= next_frame_s) frame();
      if (!found_s && delay.state() == LinkDelayState::kFound) found_s = now_s;
    }
  }
  [[nodiscard]] double delay_now() const {
    return now_s < link.change_s ? link.delay_s : link.changed_s;
  }
  [[nodiscard]] double error() const { return delay.delay_s() - delay_now(); }

  LinkDelay& delay;
  Path path;
  Link link;
  std::mt19937 random;
  double phase;
  std::normal_distribution<double> normal;
  double now_s = 0;
  double next_sample_s = 0;
  double next_frame_s = 0;
  int samples = 0;
  TelemetrySample last;
  std::optional<double> found_s;

 private:
  void sample() {
    next_sample_s += 1 / link.samples_hz;
    if (samples++ % link.polls == 0) {
      const PanTilt<double> at = path(now_s + phase - delay_now());
      const auto reading = [this](double true_angle) {
        const double angle =
            true_angle + link.gear * std::sin(60 * true_angle) + link.noise * normal(random);
        return link.step > 0 ? link.step * std::round(angle / link.step) : angle;
      };
      last.pan = wrap_angle(reading(at.pan));
      last.tilt = reading(at.tilt);
    }
    last.time_s = now_s + phase;
    delay.add(last, Vector2<double>::Constant(link.error_sigma * link.error_sigma));
  }
  void frame() {
    next_frame_s += 1 / link.frames_hz;
    constexpr double kH = 1e-4;
    const PanTilt<double> at = path(now_s);
    const PanTilt<double> before = path(now_s - kH);
    const PanTilt<double> after = path(now_s + kH);
    ImageAngles image;
    image.time_s = now_s;
    image.angle = {wrap_angle(at.pan - 1), at.tilt + 0.2};
    image.rate = {(after.pan - before.pan) / (2 * kH), (after.tilt - before.tilt) / (2 * kH)};
    delay.add(image);
  }
};

struct DelayCase {
  friend void PrintTo(const DelayCase& one, std::ostream* out) { *out << one.name; }
  std::string name;
  Path path;
  Link link;
};

class LinkDelayOf : public ::testing::TestWithParam<DelayCase> {};

TEST_P(LinkDelayOf, IsFoundWithinTwoSecondsOfMovementWithItsSigma) {
  double squares = 0;
  int count = 0;
  for (const double delay_s : {-0.4, -0.3, -0.085, -0.02, 0.0, 0.02, 0.085, 0.3, 0.4}) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
      LinkDelay delay(kAngleNoise, kConnections_s);
      delay.open();
      EXPECT_EQ(delay.sigma_s(), LinkDelay::kOpenSigma_s);
      Link link = GetParam().link;
      link.delay_s = delay_s;
      Ride run(&delay, GetParam().path, link, seed);
      run.go(2.1);
      ASSERT_EQ(delay.state(), LinkDelayState::kOpen) << "before it moves " << delay_s;
      run.go(4.05);
      ASSERT_EQ(delay.state(), LinkDelayState::kFound) << delay_s;
      EXPECT_LT(std::abs(run.error()), 5 * delay.sigma_s()) << delay_s;
      EXPECT_LT(delay.sigma_s(), 0.013);
      run.go(14);
      EXPECT_LT(std::abs(run.error()), 5 * delay.sigma_s()) << delay_s;
      EXPECT_LT(delay.sigma_s(), 0.005);
      EXPECT_EQ(delay.found(), 1) << delay_s;
      squares += std::pow(run.error() / delay.sigma_s(), 2);
      ++count;
    }
  }
  EXPECT_LT(squares / count, 1.3);
}

Link with(const std::function<void(Link*)>& change) {
  Link link;
  change(&link);
  return link;
}

PanTilt<double> pan_hops(double t) { return {hops(t), 0.1}; }
PanTilt<double> tilt_hops(double t) { return {0.1, hops(t)}; }

INSTANTIATE_TEST_SUITE_P(
    Each, LinkDelayOf,
    testing::Values(DelayCase{"Sines", sines, {}}, DelayCase{"HopsOfPan", pan_hops, {}},
                    DelayCase{"HopsOfTilt", tilt_hops, {}},
                    DelayCase{"ManySamples", sines, with([](Link* l) { l->samples_hz = 100; })},
                    DelayCase{"SlowFrames", sines, with([](Link* l) { l->frames_hz = 12.5; })},
                    DelayCase{"PolledTooOften", pan_hops, with([](Link* l) {
                                l->samples_hz = 50;
                                l->polls = 3;
                              })},
                    DelayCase{"Steps", sines, with([](Link* l) {
                                l->step = 1.7e-4;
                                l->noise = 1e-5;
                              })},
                    DelayCase{"Gear", sines, with([](Link* l) { l->gear = 2e-4; })}),
    [](const auto& one) { return one.param.name; });

// The first pictures show a camera that moves already: what came before them is not known. A known
// error of the angles makes sigma larger, and so the search longer.
TEST(LinkDelay, OfACameraThatMovesIsFoundSoonAfterTheFirstPictures) {
  constexpr int kRides = 12;
  constexpr double kSmallNoise = kAngleNoise / 4;
  struct Known {
    double error_sigma;
    double found_s;
  };
  for (const Known& known : {Known{0, 2}, Known{4e-5, 2}, Known{1e-4, 4}}) {
    double squares = 0;
    int count = 0;
    for (const double delay_s :
         {-0.4027, -0.2976, -0.0873, -0.0224, 0.0012, 0.0226, 0.0841, 0.3023, 0.3974}) {
      for (unsigned seed = 1; seed <= kRides; ++seed) {
        LinkDelay delay(kSmallNoise, kConnections_s);
        delay.open();
        Link link;
        link.delay_s = delay_s;
        link.noise = kSmallNoise;
        link.error_sigma = known.error_sigma;
        link.gear = std::sqrt(2.0) * known.error_sigma;
        const double from_s = 0.7 * seed;
        const Path path = [from_s](double t) { return figure(from_s + t); };
        Ride run(&delay, path, link, seed);
        run.go(known.found_s);
        ASSERT_EQ(delay.state(), LinkDelayState::kFound) << delay_s << " " << seed;
        EXPECT_LT(std::abs(run.error()), 5 * delay.sigma_s()) << delay_s << " " << seed;
        squares += std::pow(run.error() / delay.sigma_s(), 2);
        ++count;
        if (known.error_sigma > 0 || seed > 1) continue;
        // Between the candidates, which are 5 ms apart: some 300 samples with 1 ms each.
        run.go(14);
        EXPECT_LT(std::abs(run.error()), 5e-4) << delay_s;
      }
    }
    // 99 % of chi-square for 108 values.
    EXPECT_LT(squares / count, 1.33) << known.error_sigma;
    EXPECT_GT(squares / count, 0.1) << known.error_sigma;
  }
}

// An error of the angles that is as large as what the delay changes tells nothing of it.
TEST(LinkDelay, IsNotToldThroughAnErrorOfTheAnglesThatIsLarger) {
  LinkDelay delay(kAngleNoise, kConnections_s);
  delay.open();
  Link link;
  link.delay_s = 0.02;
  link.gear = 2e-3;
  link.error_sigma = 2e-3;
  Ride run(&delay, figure, link, 1);
  run.go(20);
  EXPECT_EQ(delay.state(), LinkDelayState::kOpen);
}

TEST(LinkDelay, IsNotToldByRestNorByAConstantRate) {
  for (const double rate : {0.0, 1e-6, 0.05, 0.4}) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      LinkDelay delay(kAngleNoise, kConnections_s);
      delay.open();
      Ride run(
          &delay,
          [rate](double t) {
            return PanTilt<double>{rate * t, -0.3 * rate * t};
          },
          {}, seed);
      run.go(20);
      EXPECT_EQ(delay.state(), LinkDelayState::kOpen) << rate << " " << seed;
      EXPECT_EQ(delay.delay_s(), 0);
      EXPECT_EQ(delay.sigma_s(), LinkDelay::kOpenSigma_s);
    }
  }
}

TEST(LinkDelay, IsNotToldBeyondItsRange) {
  LinkDelay delay(kAngleNoise, kConnections_s);
  delay.open();
  Link link;
  link.delay_s = 0.8;
  Ride run(&delay, sines, link, 1);
  run.go(20);
  EXPECT_EQ(delay.state(), LinkDelayState::kOpen);
}

// The calibration's offset is as good as its sigma says: noise and a gear's error change nothing.
TEST(LinkDelay, LeavesACalibrationAloneThatHolds) {
  for (const double gear : {0.0, 2e-4}) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      for (const Path& path : {Path(sines), Path(pan_hops)}) {
        LinkDelay delay(kAngleNoise, kConnections_s);
        Link link;
        link.gear = gear;
        Ride run(&delay, path, link, seed);
        run.go(60);
        EXPECT_EQ(delay.state(), LinkDelayState::kCalibrated) << gear << " " << seed;
        EXPECT_EQ(delay.delay_s(), 0);
        EXPECT_EQ(delay.sigma_s(), 0);
      }
    }
  }
}

TEST(LinkDelay, FollowsAJumpOnceTwoStretchesOfMotionShowIt) {
  for (const bool open : {false, true}) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
      LinkDelay delay(kAngleNoise, kConnections_s);
      if (open) delay.open();
      Link link;
      link.change_s = 15;
      link.changed_s = 0.085;
      Ride run(&delay, sines, link, seed);
      run.go(15);
      EXPECT_LE(std::abs(delay.delay_s()), 5 * delay.sigma_s());
      EXPECT_EQ(delay.found(), open ? 1 : 0);
      run.go(24);
      EXPECT_EQ(delay.found(), open ? 2 : 1);
      EXPECT_LT(std::abs(run.error()), 5 * delay.sigma_s());
      EXPECT_LT(delay.sigma_s(), 0.01);
    }
  }
}

TEST(LinkDelay, KeepsWhatItKnowsWithAnotherCalibration) {
  LinkDelay delay(kAngleNoise, kConnections_s);
  delay.open();
  Link link;
  link.delay_s = 0.085;
  Ride run(&delay, sines, link, 1);
  run.go(14);
  const double found_s = delay.delay_s();
  const double sigma_s = delay.sigma_s();
  delay.change_calibration(0.03);
  EXPECT_DOUBLE_EQ(delay.delay_s(), found_s - 0.03);
  EXPECT_EQ(delay.sigma_s(), sigma_s);
  delay.begin_calibrated();
  EXPECT_EQ(delay.sigma_s(), 0);
  delay.change_calibration(0.01);
  EXPECT_DOUBLE_EQ(delay.delay_s(), -0.01);
  EXPECT_EQ(delay.sigma_s(), kConnections_s);
}

TEST(LinkDelay, IsNotHarmedByValuesThatAreNone) {
  LinkDelay delay(kAngleNoise, kConnections_s);
  delay.open();
  Ride run(&delay, sines, {}, 1);
  for (int i = 0; i < 100; ++i) {
    run.go(0.1 * i);
    delay.add(TelemetrySample{std::nan(""), 0, 0, 0});
    delay.add(TelemetrySample{0.1 * i, 0, INFINITY, 0});
    ImageAngles image;
    image.time_s = -1e300;
    image.angle.pan = std::nan("");
    delay.add(image);
  }
  EXPECT_EQ(delay.state(), LinkDelayState::kFound);
  EXPECT_LT(std::abs(run.error()), 5 * delay.sigma_s());
}

}  // namespace
}  // namespace alidade
