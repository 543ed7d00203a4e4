#include "platform/pan_tilt/ptu_protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <random>
#include <utility>

namespace alidade {
namespace {

using ::testing::HasSubstr;

struct Line {
  const char* name;
  const char* text;
  PtuLine::Kind kind;
  double number;
  const char* words;
  std::size_t begin;
};

void PrintTo(const Line& line, std::ostream* out) { *out << line.name; }

class PtuLines : public ::testing::TestWithParam<Line> {};

TEST_P(PtuLines, AreRead) {
  const Line& line = GetParam();
  const auto found = find_ptu_line(line.text);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->kind, line.kind);
  EXPECT_EQ(found->number, line.number);
  EXPECT_EQ(found->words, line.words);
  EXPECT_EQ(found->begin, line.begin);
}

constexpr auto kOk = PtuLine::Kind::kOk;
constexpr auto kNumber = PtuLine::Kind::kNumber;
constexpr auto kError = PtuLine::Kind::kError;

INSTANTIATE_TEST_SUITE_P(
    Each, PtuLines,
    ::testing::Values(
        Line{"Terse", "* 1000\r\n", kNumber, 1000, "", 0},
        Line{"Negative", "* -2800\r\n", kNumber, -2800, "", 0},
        Line{"Zero", "*0\r", kNumber, 0, "", 0},
        Line{"Verbose", "* Current Pan position is -12\r\n", kNumber, -12,
             "current pan position is", 0},
        Line{"VerboseTilt", "* Current Tilt position is 7\n", kNumber, 7,
             "current tilt position is", 0},
        Line{"Resolution", "* 185.1428 seconds arc per position\r\n", kNumber, 185.1428, "", 0},
        Line{"Ok", "*\r\n", kOk, 0, "", 0},
        Line{"OkWithWords", "* ASCII terse\r\n", kOk, 0, "ascii terse", 0},
        Line{"BehindAnEcho", "PP * 5\r\n", kNumber, 5, "", 3},
        Line{"BehindNoise", "\xFF\x01*x* 5\r\n", kNumber, 5, "", 4},
        Line{"BehindHalfALine", "* 10* 77\r\n", kNumber, 77, "", 4},
        Line{"TheLatest", "* 1\r\n* 2\r\n* 3", kNumber, 2, "", 5},
        Line{"Error", "! Illegal argument: XX\r\n", kError, 0, "Illegal argument: XX", 0},
        Line{"LimitReached", "!P\r\n", kError, 0, "P", 0},
        Line{"ErrorCannotSpoilATerminal", "! \x1b[2J\r\n", kError, 0, "\\x1b[2J", 0}),
    [](const auto& tested) { return tested.param.name; });

TEST(PtuProtocol, PassesOverWhatIsNoWholeLine) {
  for (const char* text : {"", "\r\n", "* 1000", "1000\r\n", "PP \r\n", "* 10x0\r\n", "* 1-0\r\n",
                           "* -\r\n", "* 1.\r\n", "* 1.2.3\r\n", "* 1e5\r\n", "* 99999999999\r\n",
                           "* pos\xFFtion 5\r\n", "* nan5\r\n.5."}) {
    const auto found = find_ptu_line(text);
    EXPECT_FALSE(found && found->kind == kNumber && found->words.empty()) << text;
  }
}

TEST(PtuProtocol, SurvivesRandomBytes) {
  std::mt19937 random(3);
  const std::string likely = "*! \r\n0123456789.-PpTt";
  for (int i = 0; i < 5000; ++i) {
    std::string bytes(random() % kMaxAnswer, '\0');
    for (char& c : bytes) {
      c = random() % 8 == 0 ? static_cast<char>(random()) : likely[random() % likely.size()];
    }
    const auto found = find_ptu_line(bytes);
    if (found && found->kind == kNumber) {
      EXPECT_LE(std::abs(found->number), 1e7);
    }
  }
}

// Answers the queries of the start; returns the first query about the position.
std::string start(PtuProtocol& protocol, bool steps) {
  protocol.restart();
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(protocol.next().paced);
    EXPECT_EQ(protocol.find("*\r\n").kind, Answer::Kind::kDone);
  }
  if (steps) {
    for (const auto& [query, answer] : {std::pair("PR ", "* 36.0 seconds arc per position\r\n"),
                                        {"PR ", "* 36.0 seconds arc per position\r\n"},
                                        {"CI ", "*\r\n"},
                                        {"TR ", "* 18.0 seconds arc per position\r\n"},
                                        {"TR ", "* 18.0 seconds arc per position\r\n"},
                                        {"CI ", "*\r\n"}}) {
      EXPECT_EQ(protocol.next().bytes, query);
      EXPECT_EQ(protocol.find(answer).kind, Answer::Kind::kDone);
    }
  }
  return protocol.next().bytes;
}

TEST(PtuProtocol, AsksTheDeviceForItsStepsUntilItSaysTheSameTwice) {
  PtuProtocol protocol({false, {}, {}});
  EXPECT_EQ(start(protocol, true), "PP ");
  Answer answer = protocol.find("* -100\r\n");
  ASSERT_EQ(answer.kind, Answer::Kind::kPan);
  EXPECT_DOUBLE_EQ(answer.pan_deg, -1);
  EXPECT_EQ(protocol.next().bytes, "TP ");
  answer = protocol.find("* -100\r\n");
  ASSERT_EQ(answer.kind, Answer::Kind::kTilt);
  EXPECT_DOUBLE_EQ(answer.tilt_deg, -0.5);
}

TEST(PtuProtocol, DoesNotAskForStepsThatAreConfigured) {
  PtuProtocol protocol({false, 0.05, 0.1});
  EXPECT_EQ(start(protocol, false), "PP ");
  EXPECT_DOUBLE_EQ(protocol.find("* 100\r\n").pan_deg, 5);
}

TEST(PtuProtocol, AsksForVerboseAnswersOnRequestAndThenTakesNoOthers) {
  PtuProtocol protocol({true, 0.05, 0.1});
  protocol.restart();
  EXPECT_EQ(protocol.next().bytes, "FV ");
  start(protocol, false);
  EXPECT_EQ(protocol.find("* 100\r\n").kind, Answer::Kind::kNone);
  EXPECT_EQ(protocol.find("* Current Pan position is 100\r\n").kind, Answer::Kind::kPan);
}

TEST(PtuProtocol, PassesOverAnAnswerThatNamesTheOtherAxis) {
  PtuProtocol protocol({false, 0.05, 0.1});
  start(protocol, false);
  EXPECT_EQ(protocol.find("* Current Tilt position is 100\r\n").kind, Answer::Kind::kNone);
  EXPECT_EQ(protocol.find("* Minimum Pan position is 100\r\n").kind, Answer::Kind::kNone);
  EXPECT_EQ(protocol.find("* Current Pan position is 100\r\n").kind, Answer::Kind::kPan);
}

TEST(PtuProtocol, RepeatsTheDevicesErrorAndPassesOverLimits) {
  PtuProtocol protocol({false, 0.05, 0.1});
  start(protocol, false);
  EXPECT_EQ(protocol.find("!P\r\n").kind, Answer::Kind::kNone);
  EXPECT_EQ(protocol.find("!P\r\n* 3\r\n").kind, Answer::Kind::kPan);
  const Answer answer = protocol.find("! Illegal command entered\r\n");
  EXPECT_EQ(answer.kind, Answer::Kind::kRefused);
  EXPECT_EQ(answer.problem, "the device answers '! Illegal command entered'");
}

TEST(PtuProtocol, SaysThatOtherBytesCome) {
  PtuProtocol protocol({false, 0.05, 0.1});
  start(protocol, false);
  EXPECT_EQ(protocol.find("* 10").problem, "");
  EXPECT_THAT(protocol.find(std::string(100, '\xFF')).problem, HasSubstr("no answer of a PTU"));
  EXPECT_THAT(protocol.find("login:\r\n").problem, HasSubstr("no answer of a PTU"));
}

TEST(PtuProtocol, RefusesMoreThanATurn) {
  PtuProtocol protocol({false, 1, 1});
  start(protocol, false);
  EXPECT_EQ(protocol.find("* -360\r\n").kind, Answer::Kind::kPan);
  EXPECT_THAT(protocol.find("* -361\r\n").problem, HasSubstr("-361 steps is more than a turn"));
}

TEST(PtuProtocol, AsksTheOtherAxisAfterASpaceAndAFenceWhenNoAnswerCame) {
  PtuProtocol protocol({false, 0.05, 0.1});
  EXPECT_EQ(start(protocol, false), "PP ");
  EXPECT_EQ(protocol.give_up(), " ");
  const Query fence = protocol.next();
  EXPECT_EQ(fence.bytes, "CI ");
  EXPECT_FALSE(fence.paced);
  EXPECT_EQ(protocol.find("* 100\r\n").kind, Answer::Kind::kNone);  // the late answer
  EXPECT_EQ(protocol.find("* 100\r\n*\r\n").kind, Answer::Kind::kDone);
  EXPECT_EQ(protocol.next().bytes, "TP ");
}

TEST(PtuProtocol, TakesAnErrorForTheAnswerToAFence) {
  PtuProtocol protocol({false, 0.05, 0.1});
  start(protocol, false);
  static_cast<void>(protocol.give_up());
  EXPECT_EQ(protocol.next().bytes, "CI ");
  EXPECT_EQ(protocol.find("! Illegal command entered\r\n").kind, Answer::Kind::kDone);
}

TEST(PtuProtocol, AsksAPositionAsTheFenceBehindACommand) {
  PtuProtocol protocol({false, 0.05, 0.1});
  protocol.restart();
  EXPECT_EQ(protocol.next().bytes, "FT ");
  EXPECT_EQ(protocol.give_up(), " ");
  EXPECT_EQ(protocol.next().bytes, "PP ");
  EXPECT_EQ(protocol.find("*\r\n").kind, Answer::Kind::kNone);
  EXPECT_EQ(protocol.find("*\r\n* 100\r\n").kind, Answer::Kind::kDone);
  EXPECT_EQ(protocol.next().bytes, "ED ");
}

TEST(PtuProtocol, AsksNoFenceTwiceInARow) {
  PtuProtocol protocol({false, 0.05, 0.1});
  start(protocol, false);
  static_cast<void>(protocol.give_up());
  EXPECT_EQ(protocol.next().bytes, "CI ");
  static_cast<void>(protocol.give_up());
  EXPECT_EQ(protocol.next().bytes, "TP ");
}

TEST(PtuProtocol, AsksAFenceNowAndThenAndInDoubtWhereAnswersDoNotNameTheirAxis) {
  for (const bool verbose : {false, true}) {
    PtuProtocol protocol({verbose, 0.05, 0.1});
    std::string query = start(protocol, false);
    int fences = 0;
    for (int i = 0; i < 3 * kQueriesPerFence; ++i) {
      query = protocol.next().bytes;
      fences += query == "CI " ? 1 : 0;
    }
    EXPECT_EQ(fences, verbose ? 0 : 3);
    protocol.doubt();
    EXPECT_EQ(protocol.next().bytes == "CI ", !verbose);
  }
}

// A second answer to PR, for which nobody asked, stands for that to TR.
TEST(PtuProtocol, DoesNotTakeTheStepOfPanForThatOfTilt) {
  PtuProtocol protocol({true, {}, {}});
  start(protocol, false);  // the first PR
  const std::string pan = "* 36.0 seconds arc per position\r\n";
  const std::string tilt = "* 18.0 seconds arc per position\r\n";
  static_cast<void>(protocol.find(pan));
  for (const auto& [query, answer] : {std::pair("PR ", pan),
                                      {"CI ", "*\r\n"},
                                      {"TR ", pan},
                                      {"TR ", tilt},
                                      {"TR ", tilt},
                                      {"CI ", "*\r\n"}}) {
    EXPECT_EQ(protocol.next().bytes, query);
    EXPECT_EQ(protocol.find(answer).kind, Answer::Kind::kDone);
  }
  EXPECT_EQ(protocol.next().bytes, "PP ");
  EXPECT_DOUBLE_EQ(protocol.find("* Current Pan position is 100\r\n").pan_deg, 1);
  EXPECT_EQ(protocol.next().bytes, "TP ");
  EXPECT_DOUBLE_EQ(protocol.find("* Current Tilt position is 100\r\n").tilt_deg, 0.5);
}

}  // namespace
}  // namespace alidade
