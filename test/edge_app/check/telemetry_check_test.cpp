// What samples of pan and tilt show: healthy heads, stale ones, and values that make no sense.

#include "edge_app/check/telemetry_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/model/angle.h"
#include "test/edge_app/check/findings.h"
#include "test/support/not_a_number.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

constexpr double kRate = 30;  // Hz
double swing(double t) { return 0.5 * std::sin(0.7 * t) + 0.1 * std::sin(2.1 * t); }
double held(double t, double rate_hz) { return std::floor(t * rate_hz + 1e-6) / rate_hz; }

// 10 s of a head whose pan is pan(t); an answer takes 2 ms.
template <typename Pan>
std::vector<PanTiltSample> samples_of(const Pan& pan, int count = 300) {
  std::vector<PanTiltSample> samples;
  for (int i = 0; i < count; ++i) {
    const double t = i / kRate;
    PanTiltSample sample;
    sample.latest_time_s = 100 + t;
    sample.earliest_time_s = sample.latest_time_s - 2e-3;
    sample.pan_rad = pan(t);
    sample.tilt_rad = -0.2;
    sample.restarted = i == 0;
    samples.push_back(sample);
  }
  return samples;
}

TelemetryNeeds needs() {
  TelemetryNeeds needs;
  needs.source = "http://head";
  needs.rate_hz = kRate;
  needs.focal_length_px = 2000;
  return needs;
}

TelemetryReport check(const std::vector<PanTiltSample>& samples,
                      const TelemetryNeeds& needed = needs(), double held_back_s = 0) {
  std::vector<double> delivered_s;
  for (const PanTiltSample& sample : samples) {
    delivered_s.push_back(sample.latest_time_s + held_back_s);
  }
  return check_telemetry(samples, delivered_s, ClockFilterOptions(), needed);
}

TEST(TelemetryCheck, MeasuresAHealthyHead) {
  const TelemetryReport report = check(samples_of(swing));
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_NEAR(*report.rate_hz, kRate, 1e-6);
  EXPECT_NEAR(*report.change_hz, kRate, 1e-6);
  EXPECT_NEAR(report.bounds_s->median, 2e-3, 1e-9);
  // From the middle of one sample's interval to the coming of the next sample.
  EXPECT_NEAR(report.age_s->largest, 1 / kRate + 1e-3, 1e-9);
  EXPECT_THAT(describe(report),
              Contains(Pair("age", HasSubstr("34.3 ms median, 34.3 (95 %), 34.3 (worst)"))));
  EXPECT_EQ(report.stale, 0U);
  // But for 8 samples about each of up to 8 turns.
  EXPECT_GT(report.turning, 230U);
  EXPECT_EQ(report.pan.resolution, 0);
  EXPECT_EQ(report.fresh.size(), 300U);
  // The largest rate is 0.35 + 0.21 rad/s.
  EXPECT_LT(report.pan.top_rate, 0.56);
  EXPECT_GT(report.pan.top_rate, 0.28);
}

TEST(TelemetryCheck, MeasuresHowOftenADeviceMeasures) {
  const TelemetryReport report = check(samples_of([](double t) { return swing(held(t, 10)); }));
  EXPECT_NEAR(*report.change_hz, 10, 1e-6);
  EXPECT_NEAR(static_cast<double>(report.stale) / static_cast<double>(report.turning), 2.0 / 3,
              1e-9);
  EXPECT_NEAR(report.longest_stale_s, 2 / kRate, 1e-9);
  EXPECT_THAT(report.findings, IsEmpty());  // max_repeat_s of 0.1 s holds that
  EXPECT_LT(report.fresh.size(), 160U);
}

TEST(TelemetryCheck, AdvisesPollsThatDoNotBeatWithRenewals) {
  const auto samples = samples_of([](double t) { return swing(held(t, 20)); });
  TelemetryNeeds polled = needs();
  polled.rate_hz = kRate;
  EXPECT_THAT(advice(check(samples, polled).findings),
              ElementsAre(AllOf(HasSubstr("an angle's time is known to 33 ms only"),
                                HasSubstr("to 10 or less or, if it can answer so often, to 9"))));
  // A device that sends by itself has no rate that could be set.
  polled.rate_hz.reset();
  EXPECT_THAT(check(samples, polled).findings, IsEmpty());
}

TEST(TelemetryCheck, SaysWhatMaxRepeatHasToBe) {
  TelemetryNeeds needed = needs();
  needed.limits.max_repeat_s = 0;
  const TelemetryReport report =
      check(samples_of([](double t) { return swing(held(t, 5)); }), needed);
  // 1.2 times 200 ms.
  EXPECT_THAT(problems(report.findings), ElementsAre(HasSubstr("set max_repeat_s: 0.24")));
}

TEST(TelemetryCheck, DoesNotTakeARestForAnOldAngle) {
  const TelemetryReport report = check(samples_of([](double) { return 0.3; }));
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_FALSE(report.change_hz);
  EXPECT_EQ(report.turning, 0U);
  EXPECT_EQ(report.stale, 0U);
  EXPECT_EQ(report.pan.resolution, 0);
  EXPECT_EQ(report.pan.least, report.pan.largest);
}

TEST(TelemetryCheck, DoesNotTakeNoiseForATurn) {
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0.3, 1e-4);
  const TelemetryReport report = check(samples_of([&](double) { return noise(random); }));
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_FALSE(report.change_hz);
}

TEST(TelemetryCheck, AdvisesToTellTheQuantum) {
  constexpr double kQuantum = 3.4e-4;
  const auto samples =
      samples_of([](double t) { return kQuantum * std::round(swing(t) / kQuantum); });
  TelemetryNeeds needed = needs();
  needed.angle_sigma_rad = 5e-5;
  EXPECT_NEAR(check(samples, needed).pan.resolution, kQuantum, 1e-9);
  EXPECT_THAT(advice(check(samples, needed).findings),
              ElementsAre(HasSubstr("angle_quantum_rad: 0.00034")));
  needed.resolution_rad = kQuantum;
  EXPECT_THAT(check(samples, needed).findings, IsEmpty());
  needed.resolution_rad = 1e-2;
  EXPECT_THAT(advice(check(samples, needed).findings), ElementsAre(HasSubstr("set it to 0.00034")));
}

TEST(TelemetryCheck, CountsTurnsInTheRangeItUsed) {
  const TelemetryReport report = check(samples_of([](double t) { return wrap_angle(0.8 * t); }));
  EXPECT_NEAR(report.pan.largest - report.pan.least, 0.8 * 299 / kRate, 1e-9);
  EXPECT_NEAR(report.pan.top_rate, 0.8, 1e-6);
  EXPECT_NEAR(*report.change_hz, kRate, 1e-6);
}

TEST(TelemetryCheck, SaysThatSamplesAreTooFarApart) {
  const auto every = [](int n) {
    std::vector<PanTiltSample> some;
    const auto all = samples_of(swing);
    for (std::size_t i = 0; i < all.size(); i += static_cast<std::size_t>(n))
      some.push_back(all[i]);
    return some;
  };
  TelemetryNeeds needed = needs();
  needed.rate_hz = 1;
  EXPECT_THAT(problems(check(every(20), needed).findings),
              ElementsAre(HasSubstr("more than 0.5 s apart")));
  needed.rate_hz = 3;
  EXPECT_THAT(problems(check(every(10), needed).findings),
              ElementsAre(HasSubstr("max_extrapolation_s is 250 ms")));
  // So are those that are held back, or that a head at rest repeats.
  needed.rate_hz = 6;
  EXPECT_THAT(check(every(5), needed).findings, IsEmpty());
  EXPECT_THAT(
      problems(check(every(5), needed, 0.09).findings),
      ElementsAre(AllOf(HasSubstr("max_extrapolation_s is 250 ms"), HasSubstr("set it to 0.31"))));
  std::vector<PanTiltSample> at_rest = every(5);
  for (PanTiltSample& sample : at_rest) sample.pan_rad = 0.1;
  EXPECT_THAT(problems(check(at_rest, needed).findings),
              ElementsAre(HasSubstr("angle is up to 268 ms old (95 %)")));
  needed.limits.max_repeat_s = 0.05;
  EXPECT_THAT(check(at_rest, needed).findings, IsEmpty());
  needed = needs();
  needed.rate_hz = 3;
  // Images that come late are looked up in samples that are there.
  needed.clock_offset_s = -0.15;
  EXPECT_THAT(check(every(10), needed).findings, IsEmpty());
  needed.rate_hz = 30;
  EXPECT_THAT(advice(check(every(2), needed).findings),
              ElementsAre(HasSubstr("15.0 samples a second of the 30.0 asked for")));
}

TEST(TelemetryCheck, SaysWhatLongWaysCost) {
  auto samples = samples_of(swing);
  for (PanTiltSample& sample : samples) sample.earliest_time_s = sample.latest_time_s - 0.15;
  EXPECT_THAT(advice(check(samples).findings), ElementsAre(HasSubstr("known to 150 ms")));
}

TEST(TelemetryCheck, LooksAtTheZoom) {
  auto samples = samples_of(swing);
  for (PanTiltSample& sample : samples) sample.zoom = 100;
  TelemetryNeeds needed = needs();
  needed.zoom = 100;
  EXPECT_THAT(check(samples, needed).findings, IsEmpty());
  needed.zoom = 200;
  EXPECT_THAT(advice(check(samples, needed).findings), ElementsAre(HasSubstr("is for 200")));
  needed.makes_calibrations = false;
  EXPECT_THAT(problems(check(samples, needed).findings), ElementsAre(HasSubstr("is for 200")));
  samples.back().zoom = 120;
  EXPECT_EQ(check(samples).other_zoom, 100);
  EXPECT_THAT(advice(check(samples).findings), ElementsAre(HasSubstr("changed from 100 to 120")));
  needed = needs();
  needed.has_zoom_curve = true;
  EXPECT_THAT(problems(check(samples, needed).findings), IsEmpty()) << "the curve holds at both";
  EXPECT_THAT(advice(check(samples, needed).findings),
              ElementsAre(HasSubstr("keep it at rest during the check")));
}

TEST(TelemetryCheck, TellsJitterOfTheZoomFromAMovement) {
  auto samples = samples_of(swing);
  std::mt19937 random(3);
  std::normal_distribution<double> jitter(0, 1);
  for (PanTiltSample& sample : samples) sample.zoom = std::round(8171 + jitter(random));
  TelemetryNeeds needed = needs();
  needed.zoom = 8172;
  const TelemetryReport report = check(samples, needed);
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_FALSE(report.other_zoom);
  EXPECT_THAT(describe(report),
              Contains(Pair("zoom", AllOf(HasSubstr("unchanged"), HasSubstr("jitters by 1")))));
}

TEST(TelemetryCheck, SaysThatIntervalsEndBeforeTheyBegin) {
  auto samples = samples_of(swing);
  for (std::size_t i = 0; i < 10; ++i)
    std::swap(samples[i].earliest_time_s, samples[i].latest_time_s);
  EXPECT_THAT(problems(check(samples).findings),
              ElementsAre(HasSubstr("10 of 300 samples end before they begin")));
}

TEST(TelemetryCheck, LeavesOutWhatIsNoNumber) {
  auto samples = samples_of(swing);
  samples[5].pan_rad = kNan;
  samples[6].latest_time_s = std::numeric_limits<double>::infinity();
  const TelemetryReport report = check(samples);
  EXPECT_EQ(report.useless, 2U);
  EXPECT_THAT(problems(report.findings), ElementsAre(HasSubstr("2 of 300 samples are no numbers")));
  EXPECT_EQ(report.fresh.size(), 298U);
}

TEST(TelemetryCheck, BearsHardlyAnything) {
  for (const int count : {0, 1, 2, 3}) {
    const TelemetryReport report = check(samples_of(swing, count));
    EXPECT_THAT(report.findings, IsEmpty()) << count;
    static_cast<void>(describe(report));
  }
  EXPECT_FALSE(check(samples_of(swing, 1)).rate_hz);
  std::vector<PanTiltSample> equal(50, samples_of(swing, 1).front());
  EXPECT_FALSE(check(equal).rate_hz);
  EXPECT_EQ(check(equal).fresh.size(), 1U);
}

TEST(TelemetryCheck, TellsTheStateOfADevicesClock) {
  auto samples = samples_of(swing);
  for (PanTiltSample& sample : samples) sample.device_time_s = sample.latest_time_s - 50;
  const TelemetryReport report = check(samples);
  EXPECT_EQ(report.clock.kind, StampKind::kSender);
  EXPECT_NEAR(report.clock.rate_error, 0, 1e-5);
  EXPECT_THAT(report.findings, IsEmpty());
}

}  // namespace
}  // namespace alidade
