#include "platform/pan_tilt/pelco_d_protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "test/platform/support/bytes_of.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

constexpr std::uint8_t kPanAnswer = 0x59;
constexpr std::uint8_t kTiltAnswer = 0x5B;

// As the vendor's manual counts, not as the parser does.
std::string answer_of(int address, int opcode, int value) {
  const int high = value / 256;
  const int low = value % 256;
  return bytes_of({0xFF, address, 0, opcode, high, low, (address + opcode + high + low) % 256});
}

std::optional<PelcoDAnswer> find(const std::string& bytes, std::string* problem = nullptr) {
  std::string ignored;
  return find_pelco_d_answer(bytes, 1, kPanAnswer, problem == nullptr ? &ignored : problem);
}

TEST(PelcoDProtocol, AsksAsTheManualShows) {
  EXPECT_EQ(pelco_d_query(1, 0x51), bytes_of({0xFF, 0x01, 0x00, 0x51, 0x00, 0x00, 0x52}));
  EXPECT_EQ(pelco_d_query(0xAE, 0x51), bytes_of({0xFF, 0xAE, 0x00, 0x51, 0x00, 0x00, 0xFF}));
}

TEST(PelcoDProtocol, ReadsTheManualsAnswerWhoseSumIsFF) {
  const auto found = find(bytes_of({0xFF, 0x01, 0x00, 0x59, 0x11, 0x94, 0xFF}));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->value, 4500);
  EXPECT_EQ(found->begin, 0U);
}

TEST(PelcoDProtocol, ReadsEveryValueOfPan) {
  for (int value = 0; value < 65536; ++value) {
    const auto found = find(answer_of(1, kPanAnswer, value));
    ASSERT_TRUE(found) << value;
    ASSERT_EQ(found->value, value);
  }
}

TEST(PelcoDProtocol, FindsAnAnswerBehindNoiseThatLooksLikeItsBeginning) {
  const std::string answer = answer_of(1, kPanAnswer, 0xFF01);
  for (const std::string& noise :
       {bytes_of({0xFF}), bytes_of({0xFF, 0xFF, 0xFF}), bytes_of({0xFF, 0x01}),
        bytes_of({0xFF, 0x01, 0x00, 0x59}), bytes_of({0xFF, 0x01, 0x00, 0x59, 0xFF, 0xFF}),
        bytes_of({0, 1, 2, 3, 4, 5, 6, 7, 8}), pelco_d_query(1, 0x51)}) {
    const auto found = find(noise + answer);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->value, 0xFF01);
    EXPECT_EQ(found->begin, noise.size());
  }
}

TEST(PelcoDProtocol, TakesTheLatestOfSeveralAnswers) {
  const auto found = find(answer_of(1, kPanAnswer, 100) + answer_of(1, kTiltAnswer, 5) +
                          answer_of(1, kPanAnswer, 200) + "\xFF");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->value, 200);
  EXPECT_EQ(found->begin, 14U);
}

TEST(PelcoDProtocol, MissesAnAnswerThatLostAnyOfItsBytes) {
  const std::string answer = answer_of(1, kPanAnswer, 4711);
  for (std::size_t i = 0; i < answer.size(); ++i) {
    std::string rest = answer;
    rest.erase(i, 1);
    EXPECT_FALSE(find(rest));
    // The next one is found all the same.
    const auto next = find(rest + answer);
    ASSERT_TRUE(next);
    EXPECT_EQ(next->value, 4711);
  }
}

TEST(PelcoDProtocol, MissesAnAnswerWithAnyByteChanged) {
  const std::string answer = answer_of(1, kPanAnswer, 4711);
  for (std::size_t i = 0; i < answer.size(); ++i) {
    for (int change = 1; change < 256; ++change) {
      std::string damaged = answer;
      damaged[i] = static_cast<char>(damaged[i] ^ change);
      EXPECT_FALSE(find(damaged)) << i << ' ' << change;
    }
  }
}

TEST(PelcoDProtocol, SaysWhatCameInsteadOfAnAnswer) {
  std::string problem;
  EXPECT_FALSE(find("", &problem));
  EXPECT_EQ(problem, "");
  EXPECT_FALSE(find(answer_of(7, kPanAnswer, 1), &problem));
  EXPECT_EQ(problem, "the device answers with address 7, not 1");
  EXPECT_FALSE(find(bytes_of({0xFF, 0x01, 0x00, 0x59, 0x11, 0x94, 0xFE}), &problem));
  EXPECT_THAT(problem, HasSubstr("wrong sum"));
  EXPECT_FALSE(find("* Current Pan position is 1000\r\n", &problem));
  EXPECT_THAT(problem, HasSubstr("no answer of Pelco-D"));
}

TEST(PelcoDProtocol, FindsTheLatestWholeAnswerBetweenRandomBytesAndNoneThatIsCutOff) {
  std::mt19937 random(1);
  const auto noise = [&random] {
    std::string bytes(random() % (kMaxAnswer / 2), '\0');
    for (char& c : bytes) {
      c = static_cast<char>(random() % 3 == 0 ? 0xFF : random());
    }
    return bytes;
  };
  for (int i = 0; i < 2000; ++i) {
    const int value = static_cast<int>(random() % 65536);
    const std::string before = noise();
    const std::string answer = answer_of(1, kPanAnswer, value);
    const auto found = find(before + answer + noise());
    ASSERT_TRUE(found) << i;
    ASSERT_EQ(found->begin, before.size()) << i;
    ASSERT_EQ(found->value, value) << i;

    std::string problem;
    ASSERT_FALSE(find(before + answer.substr(0, 6), &problem)) << i;
    ASSERT_EQ(problem.empty(), before.empty()) << i;
  }
}

TEST(PelcoDProtocol, AsksPanAndTiltInTurnAndTheZoomNowAndThen) {
  PelcoDOptions options;
  PelcoDProtocol plain(options);
  plain.restart();
  options.read_zoom = true;
  PelcoDProtocol zooming(options);
  zooming.restart();
  EXPECT_EQ(zooming.next().bytes, pelco_d_query(1, 0x55));
  for (int i = 0; i < kReadingsPerZoom; ++i) {
    for (PelcoDProtocol* each : {&plain, &zooming}) {
      EXPECT_EQ(each->next().bytes, pelco_d_query(1, 0x51));
      EXPECT_EQ(each->next().bytes, pelco_d_query(1, 0x53));
    }
  }
  EXPECT_EQ(plain.next().bytes, pelco_d_query(1, 0x51));
  EXPECT_EQ(zooming.next().bytes, pelco_d_query(1, 0x55));
}

TEST(PelcoDProtocol, PassesOverTheAnswerToAnotherQuery) {
  PelcoDProtocol protocol({});
  static_cast<void>(protocol.next());
  EXPECT_EQ(protocol.find(answer_of(1, kTiltAnswer, 33000)).kind, Answer::Kind::kNone);
  static_cast<void>(protocol.next());
  const Answer tilt = protocol.find(answer_of(1, kTiltAnswer, 33000));
  EXPECT_EQ(tilt.kind, Answer::Kind::kTilt);
  EXPECT_DOUBLE_EQ(tilt.tilt_deg, 330);
  EXPECT_EQ(protocol.find(answer_of(1, kPanAnswer, 1)).kind, Answer::Kind::kNone);
}

TEST(PelcoDProtocol, LooksForNoAnswerInsideAnother) {
  const std::string answer = answer_of(1, kPanAnswer, 0xFF01);
  // With the answer's last three bytes, these would be another one.
  const std::string noise = bytes_of({0x59, 0x00, 0x05, 0x01 + 0x5A + 0x59 + 0x05});
  ASSERT_TRUE(find(answer.substr(4) + noise));
  const auto found = find(answer + noise);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->value, 0xFF01);
}

TEST(PelcoDProtocol, KnowsTheStepsOfEachAxis) {
  PelcoDOptions options;
  options.pan_deg_per_step = 0.01;
  options.tilt_deg_per_step = 0.02;
  PelcoDProtocol protocol(options);
  static_cast<void>(protocol.next());
  EXPECT_DOUBLE_EQ(protocol.find(answer_of(1, kPanAnswer, 1000)).pan_deg, 10);
  static_cast<void>(protocol.next());
  EXPECT_DOUBLE_EQ(protocol.find(answer_of(1, kTiltAnswer, 1000)).tilt_deg, 20);
}

TEST(PelcoDProtocol, RefusesMoreThanATurn) {
  PelcoDProtocol protocol({});
  static_cast<void>(protocol.next());
  EXPECT_EQ(protocol.find(answer_of(1, kPanAnswer, 36000)).kind, Answer::Kind::kPan);
  const Answer far = protocol.find(answer_of(1, kPanAnswer, 36001));
  EXPECT_EQ(far.kind, Answer::Kind::kRefused);
  EXPECT_THAT(far.problem, HasSubstr("36001 steps is more than a turn"));
}

TEST(PelcoDProtocol, KnowsWhatALineCanCarry) {
  const PelcoDProtocol protocol({});
  EXPECT_NEAR(ceiling_hz(protocol, 10.0 / 2400), 8.6, 0.05);
  EXPECT_NEAR(ceiling_hz(protocol, 10.0 / 4800), 17, 0.2);
  EXPECT_NEAR(ceiling_hz(protocol, 10.0 / 9600), 34, 0.4);
}

}  // namespace
}  // namespace alidade
