#include "platform/pan_tilt/query_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <mutex>
#include <thread>
#include <tuple>
#include <vector>

#include "platform/pan_tilt/pelco_d_protocol.h"
#include "platform/pan_tilt/ptu_protocol.h"
#include "platform/pan_tilt/visca_protocol.h"
#include "platform/system/clock.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/head_rig.h"
#include "test/platform/support/raw_server.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr int kReadingsBetweenFences = kQueriesPerFence / 2 + 1;  // each axis asked by itself

double difference_deg(double a_rad, double b_deg) {
  return std::abs(std::remainder(a_rad / kRadPerDeg - b_deg, 360));
}

long open_files() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                       std::filesystem::directory_iterator());
}

class QuerySourceTest : public ::testing::TestWithParam<HeadKind> {
 protected:
  PanTiltSample sample_;
};

const auto kind_name_of = [](const auto& tested) { return tested.param.name(); };

INSTANTIATE_TEST_SUITE_P(Heads, QuerySourceTest, ::testing::ValuesIn(all_head_kinds()),
                         kind_name_of);

TEST_P(QuerySourceTest, DeliversPositionsInTheAxesOfTheModel) {
  for (const HeadPosition& position :
       {HeadPosition{-123.45, 30.5, 0x1234}, HeadPosition{123.45, -30.5, 0x1234},
        HeadPosition{0, 0, 0x1234}}) {
    HeadRig rig(GetParam(), [&] { return position; });
    const auto zoom =
        GetParam().head->abilities.tells_zoom ? std::optional<double>(0x1234) : std::nullopt;
    const auto source = rig.open();
    for (int i = 0; i < 30; ++i) {
      ASSERT_EQ(source->read(sample_, kDeadline_s), ReadStatus::kOk) << source->error();
      EXPECT_LE(difference_deg(sample_.pan_rad, position.pan_deg), rig.step_deg());
      EXPECT_LE(difference_deg(sample_.tilt_rad, position.tilt_deg), rig.step_deg());
      EXPECT_EQ(sample_.zoom, zoom);
      EXPECT_EQ(sample_.restarted, i == 0);
    }
  }
}

// The head notes the moment at which it looks at its angles, and answers with that moment.
struct TurningHead {
  static constexpr double kRate = 10;  // deg/s
  const double origin_s = monotonic_now_s();
  HeadRig rig;

  explicit TurningHead(const HeadKind& kind)
      : rig(kind, [start_s = origin_s] {
          const double angle_deg = kRate * (monotonic_now_s() - start_s);
          return HeadPosition{std::remainder(angle_deg + 170, 360), std::remainder(angle_deg, 90),
                              1};
        }) {}

  void expect_true_within_its_interval(const PanTiltSample& sample) const {
    EXPECT_GE(sample.pan_rad, -180 * kRadPerDeg);
    EXPECT_LT(sample.pan_rad, 180 * kRadPerDeg);
    const double middle_s = (sample.earliest_time_s + sample.latest_time_s) / 2;
    const double half_s = (sample.latest_time_s - sample.earliest_time_s) / 2;
    const double angle_deg = kRate * (middle_s - origin_s);
    // Half a step by rounding; where both axes repeat, it turned by less than a step of the tilt.
    const double slack_s = 1.5 * rig.step_deg() / kRate;
    EXPECT_LE(difference_deg(sample.pan_rad, angle_deg + 170) / kRate, half_s + slack_s);
    const double tilt_error_deg = std::remainder(sample.tilt_rad / kRadPerDeg - angle_deg, 90);
    EXPECT_LE(std::abs(tilt_error_deg) / kRate, half_s + slack_s);
  }
};

TEST_P(QuerySourceTest, GivesAnIntervalThatHoldsTheMomentOfTheMeasurement) {
  TurningHead head(GetParam());
  const auto source = head.rig.open();
  double last_s = 0;
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(source->read(sample_, kDeadline_s), ReadStatus::kOk) << source->error();
    EXPECT_GE(sample_.latest_time_s, last_s);
    head.expect_true_within_its_interval(sample_);
    last_s = sample_.latest_time_s;
  }
}

// Late by more than the source waits, of a head that takes its time, over a link that keeps packets back.
TEST_P(QuerySourceTest, TakesNoLateAnswerForThatOfALaterQuery) {
  TurningHead head(GetParam());
  head.rig.server().answer_s = 0.012;
  head.rig.server().nagle = true;
  head.rig.server().late_s = 0.13;
  QuerySourceOptions options = head.rig.options();
  options.timeout_s = 0.4;
  const auto source = head.rig.open(options);
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  head.rig.server().fault = LineFault::kLate;
  int samples = 0;
  EXPECT_TRUE(eventually([&] {
    if (source->read(sample_, kDeadline_s) == ReadStatus::kOk) {
      head.expect_true_within_its_interval(sample_);
      ++samples;
    }
    return samples >= 5 && head.rig.server().faults >= 4;
  }));
}

TEST_P(QuerySourceTest, AppliesSignAndZeroOfEachAxis) {
  HeadRig rig(GetParam());
  QuerySourceOptions options = rig.options();
  options.pan.sign = -options.pan.sign;
  options.pan.zero_deg = 10;
  options.tilt.zero_deg = -20;
  const auto source = rig.open(options);
  ASSERT_EQ(source->read(sample_, kDeadline_s), ReadStatus::kOk) << source->error();
  const double counted_pan = -options.pan.sign * -123.45;
  const double counted_tilt = options.tilt.sign * 30.5;
  EXPECT_LE(difference_deg(sample_.pan_rad, options.pan.sign * (counted_pan - 10)), rig.step_deg());
  EXPECT_LE(difference_deg(sample_.tilt_rad, options.tilt.sign * (counted_tilt + 20)),
            rig.step_deg());
}

TEST_P(QuerySourceTest, OutlivesUnpluggingAndComesBackByItself) {
  HeadRig rig(GetParam());
  QuerySourceOptions options = rig.options();
  options.timeout_s = 0.4;
  const auto source = rig.open(options);
  for (int turn = 0; turn < 3; ++turn) {
    ASSERT_EQ(read_until(*source, sample_, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    EXPECT_TRUE(sample_.restarted);
    rig.server().unplug();
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(read_until(*source, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
      EXPECT_THAT(source->error(), StartsWith(rig.server().address() + ": "));
      EXPECT_THAT(source->error(), Not(HasSubstr("\n")));
    }
    EXPECT_THAT(source->error(), AnyOf(HasSubstr("No such file"), HasSubstr("Connection refused")));
    rig.server().plug();
  }
}

TEST_P(QuerySourceTest, ReportsSilenceAndComesBackByItself) {
  HeadRig rig(GetParam());
  QuerySourceOptions options = rig.options();
  options.timeout_s = 0.4;
  const auto source = rig.open(options);
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kOk), ReadStatus::kOk);
  rig.server().fault = LineFault::kSilence;
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("; check power, wiring, address and baud or port"));
  rig.server().fault = LineFault::kNone;
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kOk), ReadStatus::kOk);
  EXPECT_TRUE(sample_.restarted);
}

TEST_P(QuerySourceTest, SaysThatAllAnswersComeTooLate) {
  HeadRig rig(GetParam());
  rig.server().answer_s = 0.16;
  QuerySourceOptions options = rig.options();
  options.timeout_s = 0.4;
  const auto source = rig.open(options);
  const auto says_so = HasSubstr("later than 100 ms; raise pan_tilt.timeout_s");
  int said = 0;
  // On a busy machine the head's thread may not come to answer at all before it is given up, or the
  // source wakes so late that an answer is there: one of VISCA, which asks for a second to believe it.
  for (int i = 0; said < 3 && i < 20; ++i) {
    const ReadStatus status = read_until(*source, sample_, [](ReadStatus is) {
      return is == ReadStatus::kOk || is == ReadStatus::kDisconnected;
    });
    ASSERT_EQ(status, ReadStatus::kDisconnected);
    EXPECT_THAT(source->error(),
                AnyOf(says_so, HasSubstr("no answer of "), HasSubstr("not confirmed by a second")));
    if (testing::Value(source->error(), says_so)) ++said;
  }
  EXPECT_EQ(said, 3);
  rig.server().answer_s = 0;
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kOk), ReadStatus::kOk) << source->error();
}

TEST_P(QuerySourceTest, ReportsBabbleAndComesBackByItself) {
  HeadRig rig(GetParam());
  QuerySourceOptions options = rig.options();
  options.timeout_s = 0.4;
  const auto source = rig.open(options);
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kOk), ReadStatus::kOk);
  rig.server().fault = LineFault::kBabble;
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  rig.server().fault = LineFault::kNone;
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kOk), ReadStatus::kOk);
}

using Numbers = ViscaHead::Numbers;

std::unique_ptr<ViscaHead> visca_with(Numbers numbers, unsigned highest_number = 0) {
  auto head = std::make_unique<ViscaHead>([] { return kPositionOfHeads; });
  head->header = true;
  head->numbers = numbers;
  head->highest_number = highest_number;
  return head;
}

QuerySourceOptions options_over_udp(const HeadServer& server) {
  QuerySourceOptions options;
  options.link = {server.address(), 0};
  options.rate_hz = 1000;
  options.timeout_s = 0.4;
  options.max_backoff_s = 0.01;
  return options;
}

std::unique_ptr<QueryProtocol> visca_protocol_with_header() {
  ViscaOptions options;
  options.header = true;
  options.pan_deg_per_step = options.tilt_deg_per_step = 1 / 51.2;
  return make_protocol(options);
}

class ViscaNumbers : public ::testing::TestWithParam<Numbers> {
 protected:
  PanTiltSample sample_;
};

INSTANTIATE_TEST_SUITE_P(Each, ViscaNumbers,
                         ::testing::Values(Numbers::kOfTheQuery, Numbers::kOne, Numbers::kZero,
                                           Numbers::kOneLess, Numbers::kOneMore,
                                           Numbers::kTurnedRound, Numbers::kNoHeader));

TEST_P(ViscaNumbers, OfAnswersMayBeAnyAndThatIsSaidOnce) {
  HeadServer server(HeadServer::Link::kUdp, visca_with(GetParam()));
  QuerySource source(visca_protocol_with_header(), options_over_udp(server));
  std::string notes;
  for (int i = 0; i < 2 * kQueriesPerFence; ++i) {
    ASSERT_EQ(source.read(sample_, kDeadline_s), ReadStatus::kOk) << source.error();
    EXPECT_LE(difference_deg(sample_.pan_rad, kPositionOfHeads.pan_deg), 1 / 51.2);
    EXPECT_EQ(sample_.restarted, i == 0);
    for (const std::string& note : source.take_notes()) notes += note + "\n";
  }
  EXPECT_EQ(notes, GetParam() == Numbers::kOfTheQuery ? ""
                   : GetParam() == Numbers::kNoHeader
                       ? server.address() +
                             ": the device's answers have no valid VISCA header; they are "
                             "matched by their order instead\n"
                       : server.address() +
                             ": the device's answers do not have the sequence numbers of their "
                             "queries; they are matched by their order instead\n");
}

// As a camera that answers queries of the numbers 1 to 3 alone, each with a 1.
TEST(ViscaNumbersOf, AHeadThatAnswersTheFirstOnesAloneAreAnsweredWithItsOwn) {
  HeadServer server(HeadServer::Link::kUdp, visca_with(Numbers::kOne, 3));
  QuerySource source(visca_protocol_with_header(), options_over_udp(server));
  PanTiltSample sample;
  ASSERT_EQ(read_until(source, sample, ReadStatus::kOk), ReadStatus::kOk) << source.error();
  for (int i = 0; i < 2 * kQueriesPerFence; ++i) {
    ASSERT_EQ(source.read(sample, kDeadline_s), ReadStatus::kOk) << source.error();
    EXPECT_FALSE(sample.restarted);
  }
}

TEST(ViscaNumbersOf, AHeadThatIsLateNowAndThenMisleadNobody) {
  const std::vector<HeadKind> kinds = all_head_kinds();
  const auto numbered = std::find_if(kinds.begin(), kinds.end(), [](const HeadKind& kind) {
    return kind.name() == "ViscaHeaderUdp";
  });
  ASSERT_NE(numbered, kinds.end());
  HeadVariant variant = *numbered->head;
  variant.set_up = [](SimulatedHead& simulated, HeadServer::Link) {
    auto& its = dynamic_cast<ViscaHead&>(simulated);
    its.header = true;
    its.numbers = Numbers::kOne;
  };
  TurningHead head(HeadKind{&variant, HeadServer::Link::kUdp});
  head.rig.server().answer_s = 0.012;
  head.rig.server().late_s = 0.13;
  QuerySourceOptions options = head.rig.options();
  options.timeout_s = 0.4;
  const auto source = head.rig.open(options);
  PanTiltSample sample;
  ASSERT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  head.rig.server().fault = LineFault::kLate;
  int samples = 0;
  EXPECT_TRUE(eventually([&] {
    if (source->read(sample, kDeadline_s) == ReadStatus::kOk) {
      head.expect_true_within_its_interval(sample);
      ++samples;
    }
    return samples >= 5 && head.rig.server().faults >= 4;
  }));
}

class LineWithFaults : public QuerySourceTest {};

std::vector<HeadKind> other_kinds() {
  std::vector<HeadKind> others;
  for (const HeadKind& kind : all_head_kinds()) {
    const std::vector<HeadKind> those = last_kinds_in_turn();
    if (std::none_of(those.begin(), those.end(),
                     [&](const HeadKind& one) { return one.name() == kind.name(); })) {
      others.push_back(kind);
    }
  }
  return others;
}

INSTANTIATE_TEST_SUITE_P(Heads, LineWithFaults, ::testing::ValuesIn(last_kinds_in_turn()),
                         kind_name_of);
INSTANTIATE_TEST_SUITE_P(OtherHeads, LineWithFaults, ::testing::ValuesIn(other_kinds()),
                         kind_name_of);

// Over UDP the second answer then waits behind each first one, that to a fence, too.
TEST_P(LineWithFaults, GivesReadingsWhereEachAnswerComesTwiceAndIsReadLate) {
  HeadRig rig(GetParam());
  const auto source = rig.open();
  rig.server().fault = LineFault::kRepeated;
  int samples = 0;
  EXPECT_TRUE(eventually([&] {
    samples += source->read(sample_, 0) == ReadStatus::kOk ? 1 : 0;
    return samples == 5;
  }));
}

TEST_P(LineWithFaults, CostsAnswersOnly) {
  const HeadPosition position{-123.45, 30.5, 0x1234};
  HeadRig rig(GetParam(), [position] { return position; });
  QuerySourceOptions options = rig.options();
  options.timeout_s = 0.4;
  rig.server().late_s = 0.3 * options.timeout_s;
  const auto source = rig.open(options);
  const auto is_right = [&] {
    return source->read(sample_, kDeadline_s) == ReadStatus::kOk &&
           difference_deg(sample_.pan_rad, position.pan_deg) <= rig.step_deg() &&
           difference_deg(sample_.tilt_rad, position.tilt_deg) <= rig.step_deg();
  };
  for (const LineFault fault :
       {LineFault::kNoise, LineFault::kRepeated, LineFault::kUnsolicited, LineFault::kLate,
        LineFault::kMerged, LineFault::kLostByte, LineFault::kChangedByte}) {
    SCOPED_TRACE(static_cast<int>(fault));
    rig.server().fault = fault;
    rig.server().faults = 0;
    const bool seen = shows(GetParam().head->abilities, fault);
    const double end_s = monotonic_now_s() + kDeadline_s;
    int samples = 0;
    while ((samples < 5 || rig.server().faults < 4) && monotonic_now_s() < end_s) {
      const ReadStatus status = source->read(sample_, kDeadline_s);
      ASSERT_TRUE(status == ReadStatus::kOk || status == ReadStatus::kDisconnected);
      if (status != ReadStatus::kOk) {
        continue;
      }
      ++samples;
      if (seen) {
        EXPECT_LE(difference_deg(sample_.pan_rad, position.pan_deg), rig.step_deg());
        EXPECT_LE(difference_deg(sample_.tilt_rad, position.tilt_deg), rig.step_deg());
      }
    }
    EXPECT_GE(samples, 5);
    EXPECT_GE(rig.server().faults, 4);
    // And then all is as before, once the line has been found silent.
    rig.server().fault = LineFault::kNone;
    int right = 0;
    EXPECT_TRUE(eventually([&] {
      right = is_right() ? right + 1 : 0;
      return right == kReadingsBetweenFences;
    }));
  }
}

TEST_P(QuerySourceTest, StopEndsAQueryThatIsNotAnswered) {
  HeadRig rig(GetParam());
  rig.server().fault = LineFault::kSilence;
  const auto source = rig.open();
  std::thread stopper([&] {
    eventually([&] { return rig.server().queries > 0; });
    source->stop();
  });
  EXPECT_EQ(source->read(sample_, kNever_s), ReadStatus::kStopped);
  stopper.join();
}

TEST_P(QuerySourceTest, StopEndsAPause) {
  HeadRig rig(GetParam());
  rig.server().unplug();
  QuerySourceOptions options = rig.options();
  options.max_backoff_s = kNever_s;
  options.timeout_s = 0.05;
  const auto source = rig.open(options);
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  std::thread stopper([&] { source->stop(); });
  ReadStatus status = ReadStatus::kDisconnected;
  while (status == ReadStatus::kDisconnected) {
    status = source->read(sample_, kNever_s);
  }
  EXPECT_EQ(status, ReadStatus::kStopped);
  stopper.join();
}

TEST_P(QuerySourceTest, LeaksNoFileDescriptorOverManyReconnections) {
  HeadRig rig(GetParam());
  rig.server().unplug();
  QuerySourceOptions options = rig.options();
  options.max_backoff_s = 1e-4;
  options.timeout_s = 0.02;
  const auto source = rig.open(options);
  ASSERT_EQ(read_until(*source, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  const long before = open_files();
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(read_until(*source, sample_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  }
  EXPECT_LE(open_files(), before);
}

QuerySourceOptions options_for(const std::string& address) {
  QuerySourceOptions options;
  options.link.address = address;
  options.timeout_s = 0.2;
  options.max_backoff_s = 0.01;
  return options;
}

TEST(QuerySource, FailsForGoodOnWhatIsNoLine) {
  const TemporaryDirectory directory;
  const std::string file = directory.write("file", "text");
  PanTiltSample sample;
  for (const auto& [address, says] : {std::pair<std::string, const char*>{"", "no device is given"},
                                      {file, "is not a serial line"},
                                      {"tcp://127.0.0.1", "expected a path"},
                                      {"http://127.0.0.1:80", "expected a path"},
                                      {"tcp://user:secret@127.0.0.1:80", "expected a path"},
                                      {"udp://127.0.0.1:80/path", "expected a path"}}) {
    QuerySource source(std::make_unique<PelcoDProtocol>(PelcoDOptions{}), options_for(address));
    EXPECT_EQ(read_until(source, sample, ReadStatus::kFailed), ReadStatus::kFailed) << address;
    EXPECT_THAT(source.error(), AllOf(HasSubstr(says), Not(HasSubstr("secret"))));
    EXPECT_EQ(source.read(sample, 0), ReadStatus::kFailed);
  }
  QuerySourceOptions odd = options_for("/dev/null");
  odd.link.baud = 9601;
  QuerySource source(std::make_unique<PelcoDProtocol>(PelcoDOptions{}), odd);
  EXPECT_EQ(read_until(source, sample, ReadStatus::kFailed), ReadStatus::kFailed);
  EXPECT_THAT(source.error(), HasSubstr("9601 baud is not a speed"));
}

TEST(QuerySource, LetsOneProgramAtATimeHaveTheLine) {
  HeadRig rig(head_kinds_over(HeadServer::Link::kSerial).front());
  const auto first = rig.open();
  PanTiltSample sample;
  ASSERT_EQ(first->read(sample, kDeadline_s), ReadStatus::kOk) << first->error();
  const auto second = rig.open();
  EXPECT_EQ(second->read(sample, kDeadline_s), ReadStatus::kDisconnected);
  EXPECT_THAT(second->error(), HasSubstr("in use by another program"));
  EXPECT_EQ(first->read(sample, kDeadline_s), ReadStatus::kOk) << first->error();
}

TEST(QuerySource, SaysWhatAnswersInPlaceOfTheHead) {
  const auto error_of = [](std::unique_ptr<QueryProtocol> protocol, HeadServer::Link link,
                           std::unique_ptr<SimulatedHead> head) {
    HeadServer server(link, std::move(head));
    QuerySource source(std::move(protocol), options_for(server.address()));
    PanTiltSample sample;
    // On a busy machine an answer may be late, which is said in its place.
    EXPECT_TRUE(eventually([&] {
      return source.read(sample, kDeadline_s) == ReadStatus::kDisconnected &&
             source.error().find("later than") == std::string::npos;
    }));
    return source.error();
  };
  const auto position = [] { return HeadPosition{}; };
  PelcoDOptions seven;
  seven.address = 7;
  EXPECT_THAT(error_of(std::make_unique<PelcoDProtocol>(seven), HeadServer::Link::kSerial,
                       std::make_unique<PelcoDHead>(position)),
              HasSubstr("no answer of Pelco-D; check power, wiring, address and baud"));
  auto pan_only = std::make_unique<PelcoDHead>(position);
  pan_only->knows_tilt = false;
  EXPECT_THAT(error_of(std::make_unique<PelcoDProtocol>(PelcoDOptions{}), HeadServer::Link::kSerial,
                       std::move(pan_only)),
              HasSubstr("does the head tell both pan and tilt?"));
  auto refusing = std::make_unique<ViscaHead>(position);
  refusing->error = 0x41;
  EXPECT_THAT(error_of(std::make_unique<ViscaProtocol>(ViscaOptions{}), HeadServer::Link::kUdp,
                       std::move(refusing)),
              HasSubstr("the device answers 'not executable now' (error 41)"));
  ViscaOptions with_header;
  with_header.header = true;
  EXPECT_THAT(error_of(std::make_unique<ViscaProtocol>(with_header), HeadServer::Link::kUdp,
                       std::make_unique<ViscaHead>(position)),
              HasSubstr("without a VISCA header"));
  EXPECT_THAT(error_of(std::make_unique<ViscaProtocol>(ViscaOptions{}), HeadServer::Link::kTcp,
                       std::make_unique<PtuHead>(position)),
              AnyOf(HasSubstr("no answer of VISCA"), HasSubstr("bytes come")));
}

// As after a loss of power, which nothing else tells over UDP.
TEST(QuerySource, BeginsTheNumberingAnewWithEitherTypeOfError) {
  for (const bool error_is_reply : {false, true}) {
    auto head = std::make_unique<ViscaHead>([] { return HeadPosition{}; });
    head->header = true;
    head->error_is_reply = error_is_reply;
    std::atomic<bool>& forgets = head->forgets_numbering;
    HeadServer server(HeadServer::Link::kUdp, std::move(head));
    ViscaOptions visca;
    visca.header = true;
    visca.pan_deg_per_step = visca.tilt_deg_per_step = 1 / 51.2;
    QuerySourceOptions options = options_for(server.address());
    options.timeout_s = 4 * kDeadline_s;
    QuerySource source(std::make_unique<ViscaProtocol>(visca), options);
    PanTiltSample sample;
    ASSERT_EQ(source.read(sample, kDeadline_s), ReadStatus::kOk) << source.error();
    forgets = true;
    EXPECT_TRUE(eventually([&] {
      return source.read(sample, kDeadline_s) == ReadStatus::kOk && !forgets;
    })) << source.error();
  }
}

// Servers of serial lines send what has come when they feel like it.
TEST(QuerySource, PutsAnAnswerInTwoDatagramsTogether) {
  for (const HeadKind& kind : all_head_kinds()) {
    HeadRig rig(kind);
    if (kind.link != HeadServer::Link::kUdp || rig.protocol()->is_of_datagrams()) continue;
    rig.server().in_two = true;
    const auto source = rig.open();
    PanTiltSample sample;
    EXPECT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << kind.name();
  }
}

// However slowly the rest comes: the last byte would make the interval as long as the line is slow.
TEST(QuerySource, EndsTheIntervalWithTheFirstByteOfTheAnswer) {
  for (const HeadKind& kind : head_kinds_over(HeadServer::Link::kSerial)) {
    HeadRig rig(kind);
    rig.server().in_two = true;
    rig.server().between_s = 0.1;
    const auto source = rig.open();
    PanTiltSample sample;
    double shortest_s = kNever_s;  // on a busy machine both pieces may be found at once
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
      shortest_s = std::min(shortest_s, sample.latest_time_s - sample.earliest_time_s);
    }
    EXPECT_LT(shortest_s, rig.server().between_s) << kind.name();
  }
}

TEST(QuerySource, ForgetsTheZoomWithTheConnection) {
  auto head = std::make_unique<PelcoDHead>([] { return HeadPosition{10, 20, 7}; });
  PelcoDHead& its_head = *head;
  HeadServer server(HeadServer::Link::kTcp, std::move(head));
  PelcoDOptions with_zoom;
  with_zoom.read_zoom = true;
  QuerySource source(std::make_unique<PelcoDProtocol>(with_zoom), options_for(server.address()));
  PanTiltSample sample;
  ASSERT_EQ(read_until(source, sample, ReadStatus::kOk), ReadStatus::kOk) << source.error();
  EXPECT_EQ(sample.zoom, 7);
  server.unplug();
  ASSERT_EQ(read_until(source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  its_head.knows_zoom = false;  // another lens
  server.plug();
  ASSERT_EQ(read_until(source, sample, ReadStatus::kOk), ReadStatus::kOk) << source.error();
  EXPECT_TRUE(sample.restarted);
  EXPECT_EQ(sample.zoom, std::nullopt);
}

// A tilt that waits for its pan is forgotten with the connection.
TEST(QuerySource, PairsNothingAcrossTwoConnections) {
  std::atomic<int> asked = 0;
  HeadServer server(HeadServer::Link::kTcp, std::make_unique<PelcoDHead>([&] {
                      ++asked;
                      return HeadPosition{10, 20, 7};
                    }));
  QuerySourceOptions options = options_for(server.address());
  options.rate_hz = 5;
  QuerySource source(std::make_unique<PelcoDProtocol>(PelcoDOptions{}), options);
  PanTiltSample sample;
  ASSERT_EQ(read_until(source, sample, ReadStatus::kOk), ReadStatus::kOk) << source.error();
  const int at_pan = asked;
  while (asked == at_pan) ASSERT_EQ(source.read(sample, 0.01), ReadStatus::kTimeout);
  ASSERT_EQ(source.read(sample, 0.02), ReadStatus::kTimeout);
  server.unplug();
  ASSERT_EQ(read_until(source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  const double plugged_s = monotonic_now_s();
  server.plug();
  ASSERT_EQ(read_until(source, sample, ReadStatus::kOk), ReadStatus::kOk) << source.error();
  EXPECT_GT(sample.earliest_time_s, plugged_s);
}

// Whether a reading takes one query or two, and whoever did not read for a while.
TEST(QuerySource, ReadsAtTheRateThatIsAskedFor) {
  for (const HeadKind& kind : head_kinds_over(HeadServer::Link::kTcp)) {
    HeadRig rig(kind);
    constexpr double kPeriod_s = 0.05;
    QuerySourceOptions options = rig.options();
    options.rate_hz = 1 / kPeriod_s;
    const auto source = rig.open(options);
    PanTiltSample sample;
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    std::this_thread::sleep_for(std::chrono::duration<double>(8 * kPeriod_s));
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    const double first_s = sample.latest_time_s;
    double shortest_s = kNever_s;
    for (int i = 0; i < 6; ++i) {
      const double before_s = sample.latest_time_s;
      ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
      // The first one may still end what was asked before the pause.
      if (i > 0) shortest_s = std::min(shortest_s, sample.latest_time_s - before_s);
    }
    EXPECT_GT(sample.latest_time_s - first_s, 4 * kPeriod_s) << kind.name() << ": no burst";
    EXPECT_LT(shortest_s, 1.5 * kPeriod_s) << kind.name();
  }
}

// The answers to them may come on the new connection; nothing would tell them from those to new queries.
TEST(QuerySource, AsksNothingOnANewConnectionWhileOldQueriesMayBeAnswered) {
  std::mutex mutex;
  std::vector<double> asked_s;  // as the head takes the queries
  HeadServer server(HeadServer::Link::kUdp, std::make_unique<PelcoDHead>([&] {
                      const std::lock_guard<std::mutex> lock(mutex);
                      asked_s.push_back(monotonic_now_s());
                      return HeadPosition{};
                    }));
  server.fault = LineFault::kSilence;
  QuerySource source(std::make_unique<PelcoDProtocol>(PelcoDOptions{}),
                     options_for(server.address()));
  const auto count = [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return asked_s.size();
  };
  PanTiltSample sample;
  ASSERT_EQ(read_until(source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  ASSERT_TRUE(eventually([&] { return count() == 3; }));  // a lost head has left three unanswered
  ASSERT_EQ(read_until(source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  ASSERT_GT(count(), 3U);
  // 1 s after the last of them was sent, which the head may have taken a little later.
  EXPECT_GT(asked_s[3] - asked_s[2], 0.5);
}

// A converter between network and line stood still: the answer that it has kept is of long ago.
TEST(QuerySource, ThrowsAwayAnAnswerKeptFromTheConnectionBefore) {
  PelcoDHead before([] { return HeadPosition{10, 20, 0}; });
  PelcoDHead now([] { return HeadPosition{30, 40, 0}; });
  std::atomic<int> connections = 0;
  RawServer server([&](int fd) {
    const bool stands = ++connections == 1;
    bool first = true;
    std::array<char, 64> bytes{};
    for (ssize_t n = 0; (n = ::recv(fd, bytes.data(), bytes.size(), 0)) > 0;) {
      if (stands) continue;
      const std::string query(bytes.data(), static_cast<std::size_t>(n));
      std::vector<std::string> answers;
      if (std::exchange(first, false)) answers = before.take(query);
      for (const std::string& answer : now.take(query)) answers.push_back(answer);
      for (const std::string& answer : answers) {
        static_cast<void>(::send(fd, answer.data(), answer.size(), MSG_NOSIGNAL));
      }
    }
  });
  QuerySource source(std::make_unique<PelcoDProtocol>(PelcoDOptions{}),
                     options_for("tcp://127.0.0.1:" + std::to_string(server.port())));
  PanTiltSample sample;
  ASSERT_EQ(read_until(source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  ASSERT_EQ(read_until(source, sample, ReadStatus::kOk), ReadStatus::kOk) << source.error();
  EXPECT_LT(difference_deg(sample.pan_rad, 30), 0.1);
  source.stop();
}

// Query and answer take longer on the wire than a quarter of the time-out, and the head as long again.
TEST(QuerySource, WaitsForWhatTheLineCarriesWhateverTheTimeOut) {
  for (const HeadKind& kind : head_kinds_over(HeadServer::Link::kSerial)) {
    HeadRig rig(kind);
    QuerySourceOptions options = rig.options();
    options.link.baud = 1200;
    options.timeout_s = 0.02;
    const auto protocol = rig.protocol();
    rig.server().answer_s = wire_time_of_byte_s(options.link) * protocol->bytes_per_reading() /
                            protocol->polls_per_reading();
    ASSERT_GT(rig.server().answer_s, options.timeout_s / 4) << kind.name();
    const auto source = rig.open(options);
    PanTiltSample sample;
    // The head's thread may be late, where others want the processor.
    EXPECT_EQ(read_until(*source, sample, ReadStatus::kOk), ReadStatus::kOk)
        << kind.name() << source->error();
  }
}

// A protocol that finds an answer where no byte has come.
struct AnswersBeyondWhatCame : QueryProtocol {
  [[nodiscard]] const char* name() const override { return "nothing"; }
  void restart() override {}
  [[nodiscard]] Query next() override { return {asked_twice_ ? "a" : "b"}; }
  [[nodiscard]] Answer find(std::string_view bytes) override {
    Answer answer;
    answer.kind = Answer::Kind::kPanTilt;
    answer.begin = bytes.size();
    return answer;
  }
  [[nodiscard]] std::string give_up() override {
    asked_twice_ = !asked_twice_;
    return {};
  }
  void doubt() override {}
  [[nodiscard]] bool is_of_datagrams() const override { return false; }
  [[nodiscard]] int polls_per_reading() const override { return 1; }
  [[nodiscard]] int bytes_per_reading() const override { return 2; }

 private:
  bool asked_twice_ = false;
};

TEST(QuerySource, TakesNoAnswerThatBeginsBehindWhatCame) {
  RawServer server([&server](int fd) {
    char query = 0;
    while (!server.closing() && ::recv(fd, &query, 1, 0) == 1) {
      if (::send(fd, "x", 1, MSG_NOSIGNAL) != 1) return;
    }
  });
  QuerySource source(std::make_unique<AnswersBeyondWhatCame>(),
                     options_for("tcp://127.0.0.1:" + std::to_string(server.port())));
  PanTiltSample sample;
  const ReadStatus status = read_until(source, sample, [](ReadStatus is) {
    return is == ReadStatus::kOk || is == ReadStatus::kDisconnected;
  });
  EXPECT_EQ(status, ReadStatus::kDisconnected);
  EXPECT_THAT(source.error(), HasSubstr("takes an answer from where no byte has come"));
}

TEST(QuerySource, SurvivesConnectionsThatAreReset) {
  RawServer server([](int fd) { RawServer::reset(fd); });
  QuerySource source(std::make_unique<PtuProtocol>(PtuOptions{}),
                     options_for("tcp://127.0.0.1:" + std::to_string(server.port())));
  PanTiltSample sample;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(read_until(source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  }
  EXPECT_GE(server.connections(), 20);
}

TEST(QuerySource, ReturnsFromAFloodInTime) {
  RawServer server([&server](int fd) {
    const std::string flood(4096, '*');
    while (!server.closing() && ::send(fd, flood.data(), flood.size(), MSG_NOSIGNAL) > 0) {
    }
  });
  QuerySource source(std::make_unique<PtuProtocol>(PtuOptions{}),
                     options_for("tcp://127.0.0.1:" + std::to_string(server.port())));
  PanTiltSample sample;
  EXPECT_EQ(read_until(source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source.error(), HasSubstr("no answer of a PTU"));
}

TEST(QuerySource, NeverPollsFasterThanAskedOrThanTheLineCarries) {
  for (const auto& [rate_hz, baud, is_too_fast] :
       {std::tuple(50.0, 115200, false), {1000.0, 19200, true}}) {
    HeadRig rig(head_kinds_over(HeadServer::Link::kSerial).front());
    constexpr double kBitsOfAByte = 10;
    const double expected_hz =
        is_too_fast ? ceiling_hz(*rig.protocol(), kBitsOfAByte / baud) : rate_hz;
    QuerySourceOptions options = rig.options();
    options.rate_hz = rate_hz;
    options.link.baud = baud;
    const auto source = rig.open(options);
    PanTiltSample sample;
    ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    const double first_s = monotonic_now_s();
    for (int i = 0; i < 20; ++i) {
      ASSERT_EQ(source->read(sample, kDeadline_s), ReadStatus::kOk) << source->error();
    }
    // The first may have come late, by no more than its own answer took: one cycle is spared.
    EXPECT_GT(monotonic_now_s() - first_s, 19 / expected_hz);
  }
}

TEST(QuerySource, SurvivesAnAddressWithoutAHost) {
  QuerySource source(std::make_unique<ViscaProtocol>(ViscaOptions{}),
                     options_for("udp://no-such-host.invalid:52381"));
  PanTiltSample sample;
  // A busy machine may not answer a lookup within the time of one try.
  const double until_s = monotonic_now_s() + kDeadline_s;
  do {
    EXPECT_EQ(read_until(source, sample, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  } while (source.error().find("not looked up in time") != std::string::npos &&
           monotonic_now_s() < until_s);
  EXPECT_THAT(source.error(), HasSubstr("the host is not found"));
}

}  // namespace
}  // namespace alidade
