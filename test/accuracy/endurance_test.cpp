// The virtual day tells the truth about itself, and its judge notices what it is there to notice.

#include "test/accuracy/endurance_judge.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "core/model/direction.h"
#include "core/model/mechanics.h"

namespace alidade::test {
namespace {

DayPlan short_plan(double duration_s) {
  DayPlan plan;
  make_coarse(&plan);
  plan.duration_s = duration_s;
  return plan;
}

std::size_t frame_at(const VirtualDay& day, double time_s) {
  std::size_t frame = 0;
  while (frame + 1 < day.frames().size() && day.time(frame) < time_s) ++frame;
  return frame;
}

Eigen::Matrix3d orientation_by_core(const VirtualDay& day, std::size_t frame) {
  const simulator::Angles angles = day.angles(day.time(frame));
  return R_base_from_camera(day.calibration(frame).mechanics,
                            PanTilt<double>{angles.pan, angles.tilt});
}

TEST(VirtualDay, OrientsItsCameraAsTheCalibrationItTellsDoes) {
  DayPlan plan = short_plan(8);
  plan.zooms = {{2, 1}};
  plan.bumps = {{DayPlan::Bump::Kind::kBase, 4}, {DayPlan::Bump::Kind::kCamera, 6}};
  const VirtualDay day(plan, ALIDADE_TEST_DATA);
  for (const double time : {1.0, 2.5, 3.5, 5.0, 7.0}) {
    const std::size_t frame = frame_at(day, time);
    EXPECT_LT((orientation_by_core(day, frame) - day.base_from_camera(frame, 0)).norm(), 1e-12)
        << time;
  }
}

TEST(VirtualDay, BumpOfTheBaseLeavesTheAxesAndBumpOfTheCameraTurnsThem) {
  for (const auto kind : {DayPlan::Bump::Kind::kBase, DayPlan::Bump::Kind::kCamera}) {
    DayPlan plan = short_plan(4);
    plan.bumps = {{kind, 2, 5e-3}};
    const VirtualDay day(plan, ALIDADE_TEST_DATA);
    const Mechanics<double> before = day.calibration(frame_at(day, 1)).mechanics;
    const Mechanics<double> after = day.calibration(frame_at(day, 3)).mechanics;
    const double turned = std::max(direction_minus(after.pan_axis, before.pan_axis).norm(),
                                   direction_minus(after.tilt_axis, before.tilt_axis).norm());
    if (kind == DayPlan::Bump::Kind::kBase) {
      EXPECT_LT(turned, 1e-12);
    } else {
      // All of the turn but its part about the axis.
      EXPECT_GT(turned, 2e-3);
      EXPECT_LE(turned, 5e-3);
    }
  }
}

TEST(VirtualDay, ShowsAnotherImageAtOnceWhenItsBaseIsBumped) {
  DayPlan plan = short_plan(2);
  plan.motion = DayPlan::Motion::kAtRest;
  plan.bumps = {{DayPlan::Bump::Kind::kBase, 1, 5e-3}};
  const VirtualDay day(plan, ALIDADE_TEST_DATA);
  const auto image = [&](double time) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(plan.width * plan.height));
    day.render(frame_at(day, time), bytes.data());
    return bytes;
  };
  const auto difference = [](const std::vector<std::uint8_t>& a,
                             const std::vector<std::uint8_t>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(int{a[i]} - int{b[i]});
    return sum / static_cast<double>(a.size());
  };
  const auto before = image(0.2);
  const double noise = difference(before, image(0.6));
  // Two draws of 2 grey levels and of rounding: sqrt(2) * sqrt(4 + 1/12) * 0.798 = 2.28 in the mean.
  EXPECT_NEAR(noise, 2.28, 0.2);
  EXPECT_GT(difference(before, image(1.5)), 2 * noise);
}

TEST(VirtualDay, SendersClockDriftsAndBeginsAnewWithAnotherLatencyAfterALoss) {
  DayPlan plan = short_plan(60);
  plan.losses = {{DayPlan::Loss::Link::kVideo, 20, 23, 3e-3},
                 {DayPlan::Loss::Link::kTelemetry, 40, 44, 0}};
  const VirtualDay day(plan, ALIDADE_TEST_DATA);
  const auto& frames = day.frames();
  const std::size_t back = frame_at(day, 21);
  EXPECT_TRUE(frames.front().restarted);
  EXPECT_TRUE(frames[back].restarted);
  EXPECT_EQ(std::count_if(frames.begin(), frames.end(), [](const auto& f) { return f.restarted; }),
            2);
  EXPECT_DOUBLE_EQ(day.time(back) - day.time(back - 1), 3 + 1 / plan.rate_hz);
  const double sent = *frames.back().sender_time_s - *frames[back].sender_time_s;
  const double passed = day.time(frames.size() - 1) - day.time(back);
  EXPECT_NEAR(sent / passed - 1, plan.sender_skew, 2.0 / 90000 / passed);
  EXPECT_NEAR(day.calibration(back).clock_offset - day.calibration(0).clock_offset, -3e-3, 1e-12);
  // Each part's earliest arrival is the least latency, but for the mean of the exponential over its count.
  const auto least = [&](std::size_t from, std::size_t to) {
    double delay = 1;
    for (std::size_t i = from; i < to; ++i) {
      delay = std::min(delay, frames[i].receive_time_s - VirtualDay::kHostEpoch - day.time(i));
    }
    return delay;
  };
  EXPECT_NEAR(least(back, frames.size()) - least(0, back), 3e-3, 1e-4);
  for (const PanTiltSample& sample : day.samples()) {
    const double asked = sample.earliest_time_s - VirtualDay::kHostEpoch;
    EXPECT_FALSE(asked >= 40 && asked < 44);
  }
  EXPECT_TRUE(std::is_sorted(
      day.events().begin(), day.events().end(),
      [](const DayEvent& a, const DayEvent& b) { return a.host_time_s < b.host_time_s; }));
}

// An answer that is `sigmas` of its own sigma away from the truth, about the camera's x axis.
Answer answer_beside_truth(const VirtualDay& day, std::size_t frame, double sigmas) {
  constexpr double kSigma = 1e-4;
  Answer answer;
  answer.calibration = day.calibration(frame);
  answer.record.mode = RecordMode::kPt;
  answer.record.calibrated = true;
  const Eigen::Quaterniond q(
      day.base_from_camera(frame, 0) *
      Eigen::AngleAxisd(sigmas * kSigma, Eigen::Vector3d::UnitX()).toRotationMatrix());
  const simulator::Angles angles = day.angles(day.time(frame));
  OrientationRecord::Orientation orientation;
  orientation.pan_rad = angles.pan;
  orientation.tilt_rad = angles.tilt;
  orientation.q_base_from_camera = {q.x(), q.y(), q.z(), q.w()};
  orientation.sigma_rad = {kSigma, kSigma, kSigma};
  answer.record.orientation = orientation;
  return answer;
}

TEST(EnduranceJudge, MeasuresAnErrorInTheRecordsOwnSigmas) {
  const VirtualDay day(short_plan(2), ALIDADE_TEST_DATA);
  const JudgedRecord judged = judge(day, 7, answer_beside_truth(day, 7, -6));
  EXPECT_NEAR(judged.sigmas, 6, 1e-6);
  EXPECT_NEAR(judged.nees, 12, 1e-5);
  EXPECT_NEAR(judged.error_rad, 6e-4, 1e-9);
  EXPECT_FALSE(judged.says_so);
}

TEST(EnduranceJudge, HearsARecordThatSaysThatItIsNotToBeTrusted) {
  const VirtualDay day(short_plan(2), ALIDADE_TEST_DATA);
  const Answer silent = answer_beside_truth(day, 3, 6);
  Answer with_status = silent;
  with_status.record.status = RecordStatus::kContradiction;
  EXPECT_TRUE(judge(day, 3, with_status).says_so);
  Answer uncalibrated = silent;
  uncalibrated.record.calibrated = false;
  EXPECT_TRUE(judge(day, 3, uncalibrated).says_so);
  Answer doubtful = silent;
  doubtful.record.calibration.activity = CalibrationActivity::kDoubtful;
  EXPECT_TRUE(judge(day, 3, doubtful).says_so);
  Answer without = silent;
  without.record.orientation.reset();
  EXPECT_TRUE(judge(day, 3, without).says_so);
}

TEST(EnduranceJudge, CountsSilentRecordsInARowAsOneEpisode) {
  EnduranceJudge judge_of_day({{"start", 0}});
  auto add = [&, time = 0.0](double sigmas, bool says_so) mutable {
    JudgedRecord record;
    record.time_s = time++;
    record.sigmas = sigmas;
    record.says_so = says_so;
    judge_of_day.add(record);
  };
  for (int i = 0; i < 3; ++i) add(4.9, false);
  for (int i = 0; i < 6; ++i) add(i == 4 ? 9 : 6, false);
  add(1, false);
  for (int i = 0; i < 8; ++i) add(6, true);
  add(5.1, false);
  ASSERT_EQ(judge_of_day.episodes().size(), 2U);
  EXPECT_EQ(judge_of_day.episodes()[0].time_s, 3);
  EXPECT_EQ(judge_of_day.episodes()[0].frames, 6);
  EXPECT_EQ(judge_of_day.episodes()[0].worst.sigmas, 9);
  EXPECT_EQ(judge_of_day.episodes()[1].frames, 1);
  EXPECT_EQ(judge_of_day.longest_episode(), 6);
}

}  // namespace
}  // namespace alidade::test
