// Zoom readings without their jitter: what devices of several makes report of a lens that stands, and of one that moves.

#include "core/model/steady_zoom.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <random>
#include <vector>

#include "test/support/allocation_guard.h"

namespace alidade {
namespace {

constexpr double kRate_hz = 30;

struct Steadied {
  std::vector<double> zoom;
  double tolerance = 0;
  double sigma = 0;
  double found_s = -1;
};

Steadied steadied(double duration_s, const std::function<double(double)>& reading_at,
                  SteadyZoom steady = SteadyZoom()) {
  Steadied out;
  for (int i = 0; i < duration_s * kRate_hz; ++i) {
    const double time_s = i / kRate_hz;
    const double reading = reading_at(time_s);
    const test::AllocationGuard guard;
    const double zoom = steady.add(time_s, reading);
    if (steady.found_now()) out.found_s = time_s;
    EXPECT_EQ(guard.count(), 0);
    out.zoom.push_back(zoom);
  }
  out.tolerance = steady.tolerance();
  out.sigma = steady.sigma();
  return out;
}

class Jitter {
 public:
  explicit Jitter(double sigma) : normal_(0, sigma) {}
  double operator()() { return normal_(random_); }

 private:
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_;
};

// So far from their level that they are of another zoom.
int odd_readings(const Steadied& all, double from_s, double level) {
  int odd = 0;
  for (auto i = static_cast<std::size_t>(from_s * kRate_hz); i < all.zoom.size(); ++i) {
    if (std::abs(all.zoom[i] - level) > all.tolerance) ++odd;
  }
  return odd;
}

TEST(SteadyZoom, JitterOfWhateverScaleIsOneZoomWithinASecond) {
  struct Device {
    double level;
    double sigma;
    double step;  // 0: none
  };
  for (const Device& d : {Device{8171.3, 1, 1}, Device{8171.3, 0.5, 1}, Device{0.8171, 3e-4, 0},
                          Device{0, 3e-4, 0}, Device{33000, 20, 1}, Device{1.4, 1, 1}}) {
    Jitter jitter(d.sigma);
    const Steadied all = steadied(600, [&](double) {
      const double reading = d.level + jitter();
      return d.step > 0 ? d.step * std::round(reading / d.step) : reading;
    });
    EXPECT_GT(all.found_s, 0) << d.level;
    EXPECT_LT(all.found_s, 2) << d.level;
    EXPECT_EQ(odd_readings(all, all.found_s + 0.1, d.level), 0) << d.level;
    EXPECT_GT(all.sigma, 0.9 * d.sigma) << d.level;
    EXPECT_LT(all.sigma, 1.7 * d.sigma) << d.level;
  }
}

TEST(SteadyZoom, AReadingBetweenTwoStepsIsOneZoom) {
  std::mt19937 random(1);
  for (const double step : {1.0, 0.01, 100.0}) {
    const Steadied all =
        steadied(60, [&](double) { return step * (50 + static_cast<double>(random() % 2)); });
    EXPECT_GT(all.found_s, 0);
    EXPECT_EQ(odd_readings(all, all.found_s, 50.5 * step), 0);
    EXPECT_LT(all.tolerance, 1.5 * step) << "the next but one is another zoom";
  }
}

// What is exact goes through as it is, whatever it does.
TEST(SteadyZoom, ExactReadingsAreLeftAlone) {
  std::mt19937 random(2);
  const std::vector<std::function<double(double)>> exact = {
      [](double) { return 8171.0; },
      [](double t) { return std::floor(t); },
      [](double t) { return std::floor(20 * t); },
      [](double t) { return 1e-4 * std::floor(300 * t); },
      [](double t) { return std::round(5000 + 1500 * std::sin(5 * t)); },
      [](double t) { return std::fmod(t, 6) < 3 ? 1000.0 : 8000.0; },
      [](double t) { return 10 * std::floor(std::abs(std::fmod(t, 2) - 1) * 10); },
      [&](double) { return random() % 10 == 0 ? 0.0 : 8171.0; },
      [&](double) { return random() % 20 == 0 ? 65535.0 : 100.0; },
  };
  for (std::size_t which = 0; which < exact.size(); ++which) {
    std::vector<double> readings;
    const Steadied all = steadied(120, [&](double t) {
      readings.push_back(exact[which](t));
      return readings.back();
    });
    EXPECT_EQ(all.zoom, readings) << which;
    EXPECT_EQ(all.tolerance, 0) << which;
  }
}

// 15 of 10,000 readings are half a per cent of the focal length of a lens that zooms 30 times.
TEST(SteadyZoom, TwoZoomsThatDifferByLittleStayTwo) {
  for (const double sigma : {1.0, 3.0}) {
    Jitter jitter(sigma);
    const Steadied all =
        steadied(24, [&](double t) { return std::round((t < 12 ? 8000 : 8015) + jitter()); });
    const double before = all.zoom[static_cast<std::size_t>(11.9 * kRate_hz)];
    const double after = all.zoom[static_cast<std::size_t>(12.3 * kRate_hz)];
    EXPECT_GT(after - before, all.tolerance) << sigma;
    EXPECT_NEAR(before, 8000, sigma);
    EXPECT_NEAR(all.zoom.back(), 8015, sigma);
  }
}

TEST(SteadyZoom, FollowsAMovementHoweverSlow) {
  for (const double rate : {0.2, 1.0, 5.0, 20.0, 100.0, 1000.0}) {
    Jitter jitter(1);
    const auto truth = [rate](double t) { return 3000 + rate * std::max(t - 10, 0.0); };
    const Steadied all = steadied(40, [&](double t) { return std::round(truth(t) + jitter()); });
    for (std::size_t i = 60; i < all.zoom.size(); ++i) {
      // Readings by themselves are up to four off; three of the movement are not yet believed.
      EXPECT_LT(std::abs(all.zoom[i] - truth(static_cast<double>(i) / kRate_hz)), 11) << rate;
    }
  }
}

TEST(SteadyZoom, AGlitchMovesNoLevel) {
  Jitter jitter(1);
  const Steadied all = steadied(
      30, [&](double t) { return std::abs(t - 20) < 0.01 ? 0 : std::round(8171 + jitter()); });
  EXPECT_EQ(odd_readings(all, 2, 8171), 1);
  EXPECT_EQ(all.zoom[600], 0) << "as it was told";
}

TEST(SteadyZoom, AToleranceThatIsGivenTakesItsPlace) {
  Jitter jitter(1);
  std::vector<double> readings;
  const auto reading = [&](double) {
    readings.push_back(8171 + jitter());
    return readings.back();
  };
  for (const double tolerance : {0.0, 8.0}) {
    readings.clear();
    const Steadied all = steadied(10, reading, SteadyZoom(tolerance));
    EXPECT_EQ(all.zoom, readings);
    EXPECT_EQ(all.tolerance, tolerance);
  }
}

}  // namespace
}  // namespace alidade
