// Links that stand still and go on: whatever waits behind them is old when it comes, and nobody tells how old. Each
// scenario is played for many seeds through the step, against a head whose path is known; no record that claims an
// orientation may be wrong beyond its sigma, and orientations must be back soon after the first fresh frame.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "edge_app/step/orientation_step.h"

namespace alidade {
namespace {

constexpr double kPeriod_s = 0.04;
constexpr double kLength_s = 80;
constexpr double kTimeout_s = 3;  // of the sources: a longer silence is a loss
constexpr double kPollPeriod_s = 1.0 / 30;
constexpr int kSeeds = 20;

class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator_);
  }
  double exponential(double mean) {
    return std::exponential_distribution<double>(1 / mean)(generator_);
  }
  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(generator_); }
  bool chance(double share) { return uniform(0, 1) < share; }

 private:
  std::mt19937_64 generator_;
};

// Two sines an axis: rates up to 0.5 rad/s, in all phases.
struct Head {
  double phase;
  [[nodiscard]] double pan(double t) const {
    return 0.3 * std::sin(0.9 * t + phase) + 0.1 * std::sin(2.3 * t);
  }
  [[nodiscard]] double tilt(double t) const {
    return 0.2 * std::sin(0.7 * t) + 0.05 * std::sin(1.9 * t + phase);
  }
};

struct Stall {
  double from_s = 0;
  double to_s = 0;
  [[nodiscard]] bool holds(double t) const { return t >= from_s && t < to_s; }
  [[nodiscard]] double length_s() const { return to_s - from_s; }
};

struct SentFrame {
  double captured_s = 0;
  double arrival_s = 0;
  double sender_s = 0;
  std::optional<double> utc_s;
  bool restarted = false;
};

// What becomes of the frames captured during a stall.
struct Keeping {
  std::size_t first = 0;   // so many of the first of them are kept
  std::size_t latest = 0;  // so many of the latest
};
constexpr std::size_t kAll = 100000;

struct Scenario {
  std::string name;
  // The sender's clock; its count of pictures for one; none; the driver's stamp and count.
  enum class Stamps { kClock, kCounted, kNone, kDriver } stamps = Stamps::kClock;
  // The sender's absolute time: in each packet; by reports on its clock; set by a step while the connection is lost, and
  // now and then; by reports each of which is wrong; the count of pictures for one.
  enum class Utc { kNone, kEach, kReports, kSet, kWild, kCounted } utc = Utc::kNone;
  double shortest_s = 0.5;
  double longest_s = 20;
  // The frames of the stall, while the connection lasts, and those that a new one begins with.
  Keeping kept;
  Keeping cached;
  bool camera_stands = false;  // it takes no pictures meanwhile
  bool telemetry_stands = false;
  bool video_stands = true;
};

void PrintTo(const Scenario& scenario, std::ostream* out) { *out << scenario.name; }

std::vector<Scenario> scenarios() {
  using Stamps = Scenario::Stamps;
  using Utc = Scenario::Utc;
  const auto make = [](const char* name, auto set) {
    Scenario scenario;
    scenario.name = name;
    set(scenario);
    return scenario;
  };
  return {
      make("TCP, relay stopped briefly, all frames kept",
           [](Scenario& s) { s.longest_s = 2.5, s.kept.first = kAll; }),
      make("TCP, relay stopped for long, the new connection begins with the backlog",
           [](Scenario& s) { s.shortest_s = 3.5, s.cached.latest = 170; }),
      make("TCP, network away, the new connection begins with a group of pictures",
           [](Scenario& s) { s.cached.latest = 50; }),
      make("TCP, camera stopped, a few pictures in its ring",
           [](Scenario& s) { s.longest_s = 2.5, s.kept.first = 4, s.camera_stands = true; }),
      make("TCP, camera stopped, which counts its pictures for a clock",
           [](Scenario& s) {
             s.longest_s = 2.5, s.camera_stands = true, s.stamps = Stamps::kCounted;
           }),
      make("TCP, camera stopped for long, with a ring of seconds",
           [](Scenario& s) { s.shortest_s = 3.5, s.cached.latest = 120, s.cached.first = 4; }),
      make("UDP, relay or this process stopped, the first pictures fill the socket",
           [](Scenario& s) { s.kept.first = 12, s.cached.first = 12; }),
      make("UDP, network away, what was sent is lost", [](Scenario&) {}),
      make("MJPEG over HTTP, relay stopped briefly, all frames kept",
           [](Scenario& s) { s.longest_s = 2.5, s.kept.first = kAll, s.stamps = Stamps::kNone; }),
      make("MJPEG over HTTP, reader stopped, what does not fit into the socket is left out",
           [](Scenario& s) { s.longest_s = 2.9, s.kept.first = 20, s.stamps = Stamps::kNone; }),
      make(
          "MJPEG over HTTP, relay stopped for long, the new connection begins with the backlog",
          [](Scenario& s) { s.shortest_s = 3.5, s.cached.latest = 120, s.stamps = Stamps::kNone; }),
      make("V4L2, this process stopped, four pictures in the driver",
           [](Scenario& s) {
             s.stamps = Stamps::kDriver, s.kept.first = 4, s.cached.first = 4;
             s.telemetry_stands = true;
           }),
      make("absolute times, network away",
           [](Scenario& s) { s.shortest_s = 3.5, s.utc = Utc::kEach; }),
      make("absolute times, the new connection begins with the backlog",
           [](Scenario& s) { s.shortest_s = 3.5, s.cached.latest = 120, s.utc = Utc::kEach; }),
      make("absolute times, relay stopped briefly, all frames kept",
           [](Scenario& s) { s.longest_s = 2.5, s.kept.first = kAll, s.utc = Utc::kEach; }),
      make("reports, network away", [](Scenario& s) { s.shortest_s = 3.5, s.utc = Utc::kReports; }),
      make("reports, the new connection begins with the backlog",
           [](Scenario& s) { s.shortest_s = 3.5, s.cached.latest = 120, s.utc = Utc::kReports; }),
      make("absolute clock set while the network is away",
           [](Scenario& s) { s.shortest_s = 3.5, s.utc = Utc::kSet; }),
      make("absolute clock set, the new connection begins with the backlog",
           [](Scenario& s) { s.shortest_s = 3.5, s.cached.latest = 120, s.utc = Utc::kSet; }),
      make("absolute clock set, the new connection begins with the end of the backlog",
           [](Scenario& s) { s.shortest_s = 3.5, s.cached.latest = 4, s.utc = Utc::kSet; }),
      make("reports are nonsense, the new connection begins with the backlog",
           [](Scenario& s) { s.shortest_s = 3.5, s.cached.latest = 120, s.utc = Utc::kWild; }),
      make("camera stopped, which counts its pictures for both clocks",
           [](Scenario& s) { s.stamps = Stamps::kCounted, s.utc = Utc::kCounted; }),
      make("camera stopped, which counts its pictures for a clock, and reports",
           [](Scenario& s) { s.stamps = Stamps::kCounted, s.utc = Utc::kReports; }),
      make("telemetry's line",
           [](Scenario& s) { s.video_stands = false, s.telemetry_stands = true; }),
  };
}

// What the sender says of the time at which it took a picture. Its clock is off by up to 50 ppm.
class AbsoluteClock {
 public:
  AbsoluteClock(Scenario::Utc kind, Random* random) : kind_(kind), random_(random) {
    if (kind != Scenario::Utc::kNone) rate_ = 1 + random->uniform(-5e-5, 5e-5);
  }

  std::optional<double> read(double captured_s, double sender_s, std::int64_t count,
                             bool restarted) {
    using Utc = Scenario::Utc;
    if (kind_ == Utc::kNone) return std::nullopt;
    if (kind_ == Utc::kCounted) return kEpoch_s + static_cast<double>(count) * kPeriod_s;
    const bool reports = kind_ == Utc::kReports || kind_ == Utc::kWild;
    if (reports && (restarted || !first_report_s_)) {
      report_.reset();
      first_report_s_ = captured_s + random_->uniform(0, kLatestReport_s);
    }
    if (kind_ == Utc::kSet && (restarted || random_->chance(1e-3))) {
      set_s_ += (random_->chance(0.5) ? 1 : -1) * 1e-3 * std::pow(1e4, random_->uniform(0, 1));
    }
    const double true_s = kEpoch_s + rate_ * captured_s + set_s_;
    if (!reports) return true_s;
    if (captured_s < *first_report_s_) return std::nullopt;
    if (!report_ || captured_s > report_->captured_s + kReports_s) {
      const double wrong_s = kind_ == Utc::kWild ? random_->uniform(-0.5, 0.5) : 0;
      report_ = Report{captured_s, true_s + wrong_s, sender_s};
    }
    return report_->utc_s + sender_s - report_->sender_s;
  }

 private:
  static constexpr double kEpoch_s = 1.7e9;
  static constexpr double kReports_s = 5;
  static constexpr double kLatestReport_s = 2.5;  // the first of a connection (RFC 3550, 6.2)
  struct Report {
    double captured_s;
    double utc_s;
    double sender_s;
  };
  Scenario::Utc kind_;
  Random* random_;
  double rate_ = 1;
  double set_s_ = 0;
  std::optional<double> first_report_s_;  // when it comes
  std::optional<Report> report_;
};

// All frames of one run in the order of their arrival.
std::vector<SentFrame> play_video(const Scenario& scenario, const std::vector<Stall>& stalls,
                                  Random* random) {
  const double jitter_s = random->uniform(1e-3, 8e-3);
  const double slowest = scenario.stamps == Scenario::Stamps::kNone ? 1.25 : 1.1;
  const double transmission_s =
      kPeriod_s / (slowest * std::pow(32, random->uniform(0, 1)));  // of a picture that waited
  double origin_s = random->uniform(0, 47000);
  std::vector<SentFrame> frames;
  double free_s = 0;  // when the link is
  std::int64_t count = 0;
  AbsoluteClock absolute(scenario.utc, random);
  const auto send = [&](double captured_s, double from_s, bool restarted) {
    const bool waited = from_s > captured_s;
    SentFrame frame;
    frame.captured_s = captured_s;
    frame.arrival_s = std::max({captured_s + random->exponential(jitter_s), from_s, free_s});
    free_s = frame.arrival_s + (waited || free_s > captured_s ? transmission_s : 0);
    frame.sender_s = origin_s + (scenario.stamps == Scenario::Stamps::kCounted
                                     ? static_cast<double>(count) * kPeriod_s
                                     : captured_s);
    frame.utc_s = absolute.read(captured_s, frame.sender_s, count, restarted);
    frame.restarted = restarted;
    ++count;
    frames.push_back(frame);
  };
  // The first connection begins with a backlog, too, like those behind a long stall.
  std::vector<Stall> holes = {{0, 6}};
  if (scenario.stamps == Scenario::Stamps::kNone || scenario.stamps == Scenario::Stamps::kDriver) {
    holes.clear();  // see ReceiptClock; a driver has no cache
  }
  if (scenario.video_stands) holes.insert(holes.end(), stalls.begin(), stalls.end());
  std::vector<double> waiting;
  std::size_t hole = 0;
  double goes_on_s = 6;
  for (double t = random->uniform(0, kPeriod_s); t < kLength_s; t += kPeriod_s) {
    if (hole < holes.size() && t >= holes[hole].from_s) {
      const bool lost = holes[hole].length_s() > kTimeout_s;
      if (waiting.empty()) goes_on_s = holes[hole].to_s + (lost ? random->uniform(0.01, 0.5) : 0);
      if (t < goes_on_s) {
        waiting.push_back(t);
        continue;
      }
      ++hole;
      if (lost) origin_s = random->uniform(0, 47000);
      const Keeping& kept = lost ? scenario.cached : scenario.kept;
      const std::size_t firsts = std::min(kept.first, waiting.size());
      const auto most = static_cast<double>(std::min(kept.latest, waiting.size() - firsts));
      const auto latest = static_cast<std::size_t>(random->uniform(0, most + 1));
      bool anew = lost;
      for (std::size_t i = 0; i < waiting.size(); ++i) {
        if (i >= firsts && i + latest < waiting.size()) continue;
        send(waiting[i], goes_on_s, anew);
        anew = false;
      }
      waiting.clear();
      send(t, t, anew);
      continue;
    }
    send(t, t, false);
  }
  frames.front().restarted = true;
  return frames;
}

struct Polled {
  PanTiltSample sample;
  bool lost = false;
};

std::vector<Polled> play_telemetry(const Scenario& scenario, const std::vector<Stall>& stalls,
                                   const Head& head, Random* random) {
  std::vector<Polled> samples;
  bool restarted = true;
  double sent_s = 0.5;
  while (sent_s < kLength_s) {
    const double away_s = random->uniform(1e-3, 4e-3);
    const double back_s = random->uniform(1e-3, 4e-3);
    double true_s = sent_s + away_s;
    double answered_s = true_s + back_s;
    if (scenario.telemetry_stands) {
      for (const Stall& stall : stalls) {
        // The question waits, or the answer does.
        if (stall.holds(true_s)) true_s = stall.to_s + away_s;
        answered_s = std::max(answered_s, true_s + back_s);
        if (stall.holds(answered_s)) answered_s = stall.to_s + back_s;
      }
    }
    if (answered_s > sent_s + 1) {  // the source's timeout
      samples.push_back({});
      samples.back().lost = true;
      samples.back().sample.latest_time_s = sent_s + 1;
      restarted = true;
      sent_s += 1.2;
      continue;
    }
    Polled polled;
    polled.sample.earliest_time_s = sent_s;
    polled.sample.latest_time_s = answered_s;
    polled.sample.pan_rad = head.pan(true_s) + random->normal(5e-5);
    polled.sample.tilt_rad = head.tilt(true_s) + random->normal(5e-5);
    polled.sample.restarted = restarted;
    restarted = false;
    samples.push_back(polled);
    sent_s = std::max(sent_s + kPollPeriod_s, answered_s);
  }
  return samples;
}

struct Outcome {
  double worst_sigmas = 0;
  int beyond = 0;  // records of more than 5 sigmas
  int claimed = 0;
  // From the first fresh frame, of all or after a stall, to the next orientation: the longest, and that after the last stall.
  double worst_back_s = 0;
  double last_back_s = 0;
};

// tells_utc: false leaves the sender's absolute times out.
Outcome play(const Scenario& scenario, std::uint64_t seed, bool tells_utc = true) {
  Random random(seed);
  const Head head{random.uniform(0, 6)};
  std::vector<Stall> stalls;
  for (const double from_s : {18.0, 48.0}) {
    const double length_s = scenario.shortest_s * std::pow(scenario.longest_s / scenario.shortest_s,
                                                           random.uniform(0, 1));
    const double begin_s = from_s + random.uniform(-9, 1);
    stalls.push_back({begin_s, begin_s + length_s});
  }
  const std::vector<SentFrame> frames = play_video(scenario, stalls, &random);
  const std::vector<Polled> samples = play_telemetry(scenario, stalls, head, &random);

  OrientationStepOptions options;
  options.calibration.camera.focal_length = 20000;
  options.calibration.camera.width = 1280;
  options.calibration.camera.height = 720;
  options.calibrated = true;
  options.video_clock.stamp_resolution_s = 1.0 / 90000;
  options.telemetry_noise.pan_tilt_sigma = 5e-5;
  options.wait_for_pace = options.other_connection = true;
  OrientationStep step(options);

  Outcome outcome;
  std::size_t next = 0;
  std::size_t stall = 0;
  std::optional<double> fresh_s;  // since then orientations are due
  bool answered = false;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const SentFrame& frame = frames[i];
    for (; next < samples.size() && samples[next].sample.latest_time_s <= frame.arrival_s; ++next) {
      if (samples[next].lost) {
        step.telemetry_lost();
      } else {
        step.add_telemetry(samples[next].sample);
      }
    }
    FrameStamp stamp;
    stamp.frame = static_cast<std::int64_t>(i);
    stamp.receive_time_s = frame.arrival_s;
    if (scenario.stamps == Scenario::Stamps::kDriver) {
      stamp.receive_time_s = frame.captured_s + 1e-3;
      stamp.sequence = std::lround(frame.captured_s / kPeriod_s);
    } else if (scenario.stamps != Scenario::Stamps::kNone) {
      stamp.sender_time_s = frame.sender_s;
      if (tells_utc) stamp.sender_utc_s = frame.utc_s;
    }
    stamp.restarted = frame.restarted;
    StepEvents events;
    const OrientationRecord record = step.add_frame(stamp, ImageView{}, &events);
    step.maintain();

    for (; stall < stalls.size() && frame.captured_s >= stalls[stall].to_s; ++stall)
      fresh_s.reset();
    const bool in_stall = stall < stalls.size() && frame.arrival_s >= stalls[stall].from_s;
    if (in_stall) fresh_s.reset();
    const bool is_fresh = frame.arrival_s < frame.captured_s + 0.1 && !in_stall;
    if (is_fresh && !fresh_s) {
      fresh_s = frame.arrival_s;
      answered = false;
    }
    const bool claims = record.mode != RecordMode::kNone;
    if (fresh_s && !answered) {
      outcome.worst_back_s = std::max(outcome.worst_back_s, frame.arrival_s - *fresh_s);
      answered = claims;
      if (claims && stall == stalls.size()) outcome.last_back_s = frame.arrival_s - *fresh_s;
    }
    if (!claims) continue;
    ++outcome.claimed;
    const double pan = std::abs(record.orientation->pan_rad - head.pan(frame.captured_s));
    const double tilt = std::abs(record.orientation->tilt_rad - head.tilt(frame.captured_s));
    const auto& sigma = record.orientation->sigma_rad;
    const double sigmas =
        std::max(pan * std::cos(record.orientation->tilt_rad) / sigma[1], tilt / sigma[0]);
    outcome.worst_sigmas = std::max(outcome.worst_sigmas, sigmas);
    outcome.beyond += sigmas > 5 ? 1 : 0;
  }
  return outcome;
}

class StallTest : public testing::TestWithParam<Scenario> {};

TEST_P(StallTest, NoRecordIsConfidentlyWrongAndAllAreBackSoon) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(testing::Message() << GetParam().name << ", seed " << seed);
    const Outcome outcome = play(GetParam(), seed);
    EXPECT_LT(outcome.worst_sigmas, 5) << outcome.beyond << " of " << outcome.claimed;
    EXPECT_LT(outcome.worst_back_s, 3);
    EXPECT_GT(outcome.claimed, 300);
  }
}

class AbsoluteTimesInStalls : public testing::TestWithParam<Scenario> {};

// Seconds from the first fresh frame after a stall to the first orientation, with the sender's absolute times and without:
// by the last stall the line is known, 10 s of it. Without a backlog the third frame of a new connection is answered, with
// one half a second of the pace does in place of one. A clock that is set, or nonsense, costs nothing.
TEST_P(AbsoluteTimesInStalls, BringOrientationsBackSooner) {
  using Utc = Scenario::Utc;
  const Scenario& scenario = GetParam();
  double with_s = 0;
  double without_s = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    with_s += play(scenario, seed).last_back_s / kSeeds;
    without_s += play(scenario, seed, false).last_back_s / kSeeds;
  }
  std::printf("%s: %.2f s with, %.2f s without\n", scenario.name.c_str(), with_s, without_s);
  EXPECT_LE(with_s, without_s + 1e-9);
  if (scenario.utc == Utc::kEach && scenario.shortest_s > kTimeout_s) {
    EXPECT_LT(with_s, without_s - 0.2);
  }
}

std::vector<Scenario> scenarios_with_absolute_times() {
  std::vector<Scenario> with = scenarios();
  with.erase(std::remove_if(with.begin(), with.end(),
                            [](const Scenario& s) { return s.utc == Scenario::Utc::kNone; }),
             with.end());
  return with;
}

INSTANTIATE_TEST_SUITE_P(Stalls, StallTest, testing::ValuesIn(scenarios()),
                         [](const auto& one) { return std::to_string(one.index); });

INSTANTIATE_TEST_SUITE_P(Stalls, AbsoluteTimesInStalls,
                         testing::ValuesIn(scenarios_with_absolute_times()),
                         [](const auto& one) { return std::to_string(one.index); });

}  // namespace
}  // namespace alidade
