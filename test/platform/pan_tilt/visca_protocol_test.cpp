#include "platform/pan_tilt/visca_protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <random>

#include "test/platform/support/bytes_of.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

std::string datagram(int type, std::uint32_t sequence, const std::string& payload) {
  std::string bytes = bytes_of({type / 256, type % 256, 0, static_cast<int>(payload.size())});
  for (int shift = 24; shift >= 0; shift -= 8) {
    bytes += static_cast<char>(sequence >> static_cast<unsigned>(shift) & 0xFFU);
  }
  return bytes + payload;
}

struct Position {
  const char* name;
  std::string bytes;
  int pan;
  int tilt;
};

void PrintTo(const Position& position, std::ostream* out) { *out << position.name; }

class ViscaPosition : public ::testing::TestWithParam<Position> {};

TEST_P(ViscaPosition, IsReadWithItsSign) {
  const Position& position = GetParam();
  const auto frame = find_visca_frame(position.bytes, 1);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->kind, ViscaFrame::Kind::kPosition);
  EXPECT_EQ(frame->pan, position.pan);
  EXPECT_EQ(frame->tilt, position.tilt);
  EXPECT_EQ(frame->length, position.bytes.size());
}

INSTANTIATE_TEST_SUITE_P(
    Lengths, ViscaPosition,
    ::testing::Values(
        Position{"Bytes11Zero", bytes_of({0x90, 0x50, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF}), 0, 0},
        Position{"Bytes11", bytes_of({0x90, 0x50, 0, 1, 2, 3, 0xF, 0xF, 0xF, 0xE, 0xFF}), 0x123,
                 -2},
        Position{"Bytes11Limits", bytes_of({0x90, 0x50, 8, 0, 0, 0, 7, 0xF, 0xF, 0xF, 0xFF}),
                 -32768, 32767},
        Position{"Bytes12", bytes_of({0x90, 0x50, 0xF, 0xF, 0xF, 0xF, 0xF, 0, 1, 0, 0, 0xFF}), -1,
                 256},
        Position{"Bytes12Limits", bytes_of({0x90, 0x50, 8, 0, 0, 0, 0, 8, 0, 0, 0, 0xFF}), -524288,
                 -32768},
        Position{"Bytes13", bytes_of({0x90, 0x50, 0, 0xA, 0, 0, 0, 0xF, 0x6, 0, 0, 0, 0xFF}), 40960,
                 -40960}),
    [](const auto& tested) { return tested.param.name; });

TEST(ViscaProtocol, FindsAFrameBehindNoiseAndHalfFrames) {
  const std::string answer = bytes_of({0x90, 0x50, 0, 0, 0, 5, 0, 0, 0, 6, 0xFF});
  for (const std::string& noise :
       {bytes_of({0xFF}), bytes_of({0x90}), bytes_of({0x90, 0x50}), bytes_of({0x90, 0x50, 0, 0}),
        bytes_of({0x90, 0x41, 0xFF, 0x90, 0x51, 0xFF}), bytes_of({0x90, 0x38, 0xFF}),
        std::string(400, '\x90')}) {
    const auto frame = find_visca_frame(noise + answer, 1);
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->kind, ViscaFrame::Kind::kPosition);
    EXPECT_EQ(frame->pan, 5);
    EXPECT_EQ(frame->tilt, 6);
    EXPECT_EQ(frame->begin, noise.size());
  }
}

TEST(ViscaProtocol, PassesOverWhatIsNoFrameOfTheDevice) {
  for (const std::string& bytes :
       {bytes_of({}), bytes_of({0xFF, 0xFF}), bytes_of({0x90, 0x50, 0xFF}),
        bytes_of({0x90, 0x50, 0, 0, 0, 5, 0, 0, 0, 6}),                    // no end
        bytes_of({0xA0, 0x50, 0, 0, 0, 5, 0, 0, 0, 6, 0xFF}),              // another address
        bytes_of({0x90, 0x50, 0, 0, 0, 5, 0, 0x10, 0, 6, 0xFF}),           // not a nibble
        bytes_of({0x90, 0x50, 0, 0, 0, 5, 0, 0, 0xFF}),                    // 9 bytes
        bytes_of({0x90, 0x50, 0, 0, 0, 5, 0, 0, 6, 0xFF}),                 // 10 bytes
        bytes_of({0x90, 0x50, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF})}) {  // 14 bytes
    EXPECT_FALSE(find_visca_frame(bytes, 1)) << ::testing::PrintToString(bytes);
  }
}

TEST(ViscaProtocol, ReadsZoomAndErrors) {
  const auto zoom = find_visca_frame(bytes_of({0xA0, 0x50, 4, 0, 0, 1, 0xFF}), 2);
  ASSERT_TRUE(zoom);
  EXPECT_EQ(zoom->kind, ViscaFrame::Kind::kZoom);
  EXPECT_EQ(zoom->zoom, 0x4001);
  for (const int code : {0x01, 0x02, 0x03, 0x04, 0x05, 0x41, 0x7F}) {
    const auto error = find_visca_frame(bytes_of({0x90, 0x61, code, 0xFF}), 1);
    ASSERT_TRUE(error);
    EXPECT_EQ(error->kind, ViscaFrame::Kind::kError);
    EXPECT_EQ(error->error, code);
    EXPECT_STRNE(visca_error_text(code), "");
  }
}

TEST(ViscaProtocol, FindsTheLatestWholeFrameBetweenRandomBytes) {
  std::mt19937 random(2);
  constexpr int kLikely[] = {0xFF, 0x90, 0x50, 0x61, 0x00, 0x0F, 0x01};
  const std::string answer = bytes_of({0x90, 0x50, 0, 0, 0, 5, 0, 0, 0, 6, 0xFF});
  const auto noise = [&] {
    std::string bytes(random() % (kMaxAnswer / 2), '\0');
    for (char& c : bytes) {
      c = static_cast<char>(random() % 2 == 0 ? kLikely[random() % 7] : static_cast<int>(random()));
    }
    return bytes;
  };
  int later = 0;
  for (int i = 0; i < 2000; ++i) {
    const std::string before = noise();
    const std::string bytes = before + answer + noise();
    const auto found = find_visca_frame(bytes, 1);
    ASSERT_TRUE(found) << i;
    ASSERT_GE(found->begin, before.size()) << i;
    ASSERT_LE(found->begin + found->length, bytes.size()) << i;
    // FF ends every frame and occurs nowhere else in it.
    ASSERT_EQ(bytes[found->begin], '\x90') << i;
    ASSERT_EQ(bytes.find('\xFF', found->begin), found->begin + found->length - 1) << i;
    if (found->begin == before.size()) {
      ASSERT_EQ(found->kind, ViscaFrame::Kind::kPosition) << i;
      ASSERT_EQ(found->pan, 5) << i;
      ASSERT_EQ(found->tilt, 6) << i;
    } else {
      ++later;  // a short frame, by chance
    }
  }
  EXPECT_LT(later, 1000);
}

TEST(ViscaProtocol, TakesRandomBytesForADatagramOnlyIfTheirLengthIsTheOneTheyState) {
  std::mt19937 random(3);
  int taken = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string bytes(random() % kMaxAnswer, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    const std::size_t stated = bytes.size() - 8 + random() % 2;
    if (bytes.size() > 8) {
      bytes[2] = static_cast<char>(stated / 256);
      bytes[3] = static_cast<char>(stated % 256);
    }
    const auto header = parse_visca_header(bytes);
    ASSERT_EQ(header.has_value(), bytes.size() > 8 && stated == bytes.size() - 8) << i;
    if (header) {
      ASSERT_EQ(header->payload, bytes.substr(8)) << i;
      ++taken;
    }
  }
  EXPECT_GT(taken, 500);
}

ViscaOptions options() {
  ViscaOptions options;
  options.pan_deg_per_step = 1 / 51.2;
  options.tilt_deg_per_step = 1 / 14.4;
  return options;
}

const std::string kEleven = bytes_of({0x90, 0x50, 0, 2, 0, 0, 0xF, 0xF, 7, 0, 0xFF});
const std::string kTwelve = bytes_of({0x90, 0x50, 0, 0, 2, 0, 0, 0xF, 0xF, 7, 0, 0xFF});

const std::string kZoomQuery = bytes_of({0x81, 0x09, 0x04, 0x47, 0xFF});
const std::string kZoomAnswer = bytes_of({0x90, 0x50, 1, 2, 3, 4, 0xFF});

// Answers the first fence.
void start(ViscaProtocol& protocol) {
  protocol.restart();
  const Query fence = protocol.next();
  EXPECT_EQ(fence.bytes, kZoomQuery);
  EXPECT_FALSE(fence.paced);
  EXPECT_EQ(protocol.find(kZoomAnswer).kind, Answer::Kind::kDone);
}

TEST(ViscaProtocol, BelievesALengthThatComesTwiceAndThenNoOther) {
  ViscaProtocol protocol(options());
  start(protocol);
  EXPECT_EQ(protocol.next().bytes, bytes_of({0x81, 0x09, 0x06, 0x12, 0xFF}));
  EXPECT_EQ(protocol.find(kTwelve).kind, Answer::Kind::kRefused);
  static_cast<void>(protocol.next());
  const Answer answer = protocol.find(kTwelve);
  ASSERT_EQ(answer.kind, Answer::Kind::kPanTilt);
  EXPECT_DOUBLE_EQ(answer.pan_deg, 10);
  EXPECT_DOUBLE_EQ(answer.tilt_deg, -10);
  // A nibble that is lost makes twelve bytes eleven.
  std::string damaged = kTwelve;
  damaged.erase(3, 1);
  EXPECT_EQ(protocol.find(damaged).kind, Answer::Kind::kRefused);
  EXPECT_EQ(protocol.find(damaged).kind, Answer::Kind::kRefused);
  EXPECT_EQ(protocol.find(kTwelve).kind, Answer::Kind::kPanTilt);
}

TEST(ViscaProtocol, BelievesNoLengthThatADamagedFirstPositionHas) {
  ViscaProtocol protocol(options());
  start(protocol);
  static_cast<void>(protocol.next());
  EXPECT_EQ(protocol.find(kEleven).kind, Answer::Kind::kRefused);
  EXPECT_EQ(protocol.find(kTwelve).kind, Answer::Kind::kRefused);
  EXPECT_EQ(protocol.find(kTwelve).kind, Answer::Kind::kPanTilt);
}

// Another device may answer on a new connection.
TEST(ViscaProtocol, LearnsTheLengthAnewAfterARestart) {
  ViscaProtocol protocol(options());
  for (const std::string& position : {kTwelve, kEleven}) {
    start(protocol);
    static_cast<void>(protocol.next());
    EXPECT_EQ(protocol.find(position).kind, Answer::Kind::kRefused);
    EXPECT_EQ(protocol.find(position).kind, Answer::Kind::kPanTilt);
  }
}

TEST(ViscaProtocol, AsksTheZoomAsAFenceWhenNoPositionCame) {
  ViscaProtocol protocol(options());
  start(protocol);
  static_cast<void>(protocol.next());
  EXPECT_EQ(protocol.give_up(), "");
  EXPECT_EQ(protocol.next().bytes, kZoomQuery);
  EXPECT_EQ(protocol.find(kEleven).kind, Answer::Kind::kNone);  // the late answer
  EXPECT_EQ(protocol.find(kEleven + kZoomAnswer).kind, Answer::Kind::kDone);
  EXPECT_EQ(protocol.next().bytes, bytes_of({0x81, 0x09, 0x06, 0x12, 0xFF}));
}

TEST(ViscaProtocol, TakesAnErrorForTheAnswerToAFence) {
  ViscaProtocol protocol(options());
  start(protocol);
  static_cast<void>(protocol.next());
  EXPECT_EQ(protocol.give_up(), "");
  EXPECT_EQ(protocol.next().bytes, kZoomQuery);
  EXPECT_EQ(protocol.find(bytes_of({0x90, 0x60, 0x02, 0xFF})).kind, Answer::Kind::kDone);
}

TEST(ViscaProtocol, AsksNoFenceTwiceInARow) {
  for (const bool read_zoom : {false, true}) {
    ViscaOptions zooming = options();
    zooming.read_zoom = read_zoom;
    ViscaProtocol protocol(zooming);
    protocol.restart();
    EXPECT_EQ(protocol.next().bytes, kZoomQuery);
    EXPECT_EQ(protocol.give_up(), "");
    EXPECT_EQ(protocol.next().bytes, bytes_of({0x81, 0x09, 0x06, 0x12, 0xFF}));
  }
}

TEST(ViscaProtocol, AsksAFenceNowAndThenAndInDoubt) {
  ViscaProtocol protocol(options());
  start(protocol);
  int fences = 0;
  for (int i = 0; i < 3 * (kQueriesPerFence + 1); ++i) {
    fences += protocol.next().bytes == kZoomQuery ? 1 : 0;
  }
  EXPECT_EQ(fences, 3);
  static_cast<void>(protocol.next());
  protocol.doubt();
  EXPECT_EQ(protocol.next().bytes, kZoomQuery);
}

TEST(ViscaProtocol, RepeatsTheDevicesError) {
  ViscaProtocol protocol(options());
  start(protocol);
  static_cast<void>(protocol.next());
  const Answer answer = protocol.find(bytes_of({0x90, 0x60, 0x41, 0xFF}));
  EXPECT_EQ(answer.kind, Answer::Kind::kRefused);
  EXPECT_EQ(answer.problem, "the device answers 'not executable now' (error 41)");
}

TEST(ViscaProtocol, RefusesMoreThanATurn) {
  ViscaOptions coarse = options();
  coarse.pan_deg_per_step = 1;
  ViscaProtocol protocol(coarse);
  start(protocol);
  static_cast<void>(protocol.next());
  EXPECT_THAT(protocol.find(kEleven).problem, HasSubstr("are the degrees per step right?"));
}

TEST(ViscaProtocol, AsksTheZoomNowAndThen) {
  ViscaOptions zooming = options();
  zooming.read_zoom = true;
  zooming.address = 2;
  ViscaProtocol protocol(zooming);
  protocol.restart();
  for (int turn = 0; turn < 2; ++turn) {
    EXPECT_EQ(protocol.next().bytes, bytes_of({0x82, 0x09, 0x04, 0x47, 0xFF}));
    const Answer answer = protocol.find(bytes_of({0xA0, 0x50, 1, 2, 3, 4, 0xFF}));
    EXPECT_EQ(answer.kind, Answer::Kind::kZoom);
    EXPECT_EQ(answer.zoom, 0x1234);
    for (int i = 0; i < kReadingsPerZoom; ++i) {
      EXPECT_EQ(protocol.next().bytes, bytes_of({0x82, 0x09, 0x06, 0x12, 0xFF}));
    }
  }
}

class ViscaWithHeader : public ::testing::Test {
 protected:
  ViscaWithHeader() {
    ViscaOptions with_header = options();
    with_header.header = true;
    protocol_ = std::make_unique<ViscaProtocol>(with_header);
    protocol_->restart();
  }
  void begin_numbering() {
    const Query query = protocol_->next();
    EXPECT_EQ(query.bytes, bytes_of({2, 0, 0, 1, 0, 0, 0, 0, 1}));
    EXPECT_FALSE(query.paced);
    EXPECT_EQ(protocol_->find(datagram(0x0201, 0, "\x01")).kind, Answer::Kind::kDone);
  }
  std::unique_ptr<ViscaProtocol> protocol_;
};

TEST_F(ViscaWithHeader, NumbersItsQueriesFromOne) {
  begin_numbering();
  for (std::uint32_t i = 1; i <= 300; ++i) {
    EXPECT_EQ(protocol_->next().bytes, datagram(0x0110, i, "\x81\x09\x06\x12\xFF"));
  }
}

TEST_F(ViscaWithHeader, TakesOnlyTheAnswerWithTheNumberOfTheQuery) {
  begin_numbering();
  static_cast<void>(protocol_->next());
  EXPECT_EQ(protocol_->find(datagram(0x0111, 1, kEleven)).kind, Answer::Kind::kRefused);
  static_cast<void>(protocol_->next());
  EXPECT_EQ(protocol_->find(datagram(0x0111, 1, kEleven)).kind, Answer::Kind::kNone);
  EXPECT_EQ(protocol_->find(kEleven).kind, Answer::Kind::kNone);
  EXPECT_THAT(protocol_->find(kEleven).problem, HasSubstr("without a VISCA header"));
  EXPECT_EQ(protocol_->find(datagram(0x0111, 2, kEleven)).kind, Answer::Kind::kPanTilt);
}

// Some devices answer with the type of an inquiry.
TEST_F(ViscaWithHeader, TakesTheNumberOfTheQueryUnderAnyType) {
  begin_numbering();
  for (const int type : {0x0111, 0x0110, 0x0101}) {
    static_cast<void>(protocol_->next());
    static_cast<void>(protocol_->find(datagram(type, 1, kEleven)));
    static_cast<void>(protocol_->next());
    EXPECT_EQ(protocol_->find(datagram(type, 2, kEleven)).kind, Answer::Kind::kPanTilt);
    EXPECT_EQ(protocol_->peculiarity(), "");
    protocol_->restart();
    begin_numbering();
  }
}

TEST_F(ViscaWithHeader, BeginsTheNumberingAnewWhenTheDeviceComplains) {
  for (const int type : {0x0200, 0x0201}) {
    begin_numbering();
    static_cast<void>(protocol_->next());
    EXPECT_EQ(protocol_->find(datagram(type, 1, "\x0F\x01")).kind, Answer::Kind::kRefused);
    EXPECT_EQ(protocol_->give_up(), "");
  }
  begin_numbering();
}

TEST_F(ViscaWithHeader, RepeatsThatTheDeviceFindsTheMessageWrong) {
  for (const int type : {0x0200, 0x0201}) {
    protocol_->restart();
    begin_numbering();
    static_cast<void>(protocol_->next());
    const Answer answer = protocol_->find(datagram(type, 1, "\x0F\x02"));
    EXPECT_EQ(answer.kind, Answer::Kind::kRefused);
    EXPECT_EQ(answer.problem, "the device finds the type of the message wrong");
    EXPECT_EQ(protocol_->give_up(), "");
    EXPECT_EQ(protocol_->next().bytes, datagram(0x0110, 2, "\x81\x09\x06\x12\xFF"));
  }
}

TEST_F(ViscaWithHeader, DoesWithoutAnAnswerToTheNumbering) {
  static_cast<void>(protocol_->next());
  EXPECT_EQ(protocol_->give_up(), "");
  EXPECT_EQ(protocol_->next().bytes, datagram(0x0110, 1, "\x81\x09\x06\x12\xFF"));
}

// A device that answers every query with the number 1, from its second position on.
TEST_F(ViscaWithHeader, CountsOnTheOrderOfAnswersWhereNumbersAreNoQuerys) {
  begin_numbering();
  static_cast<void>(protocol_->next());
  EXPECT_EQ(protocol_->find(datagram(0x0111, 1, kEleven)).kind, Answer::Kind::kRefused);
  EXPECT_EQ(protocol_->give_up(), "");
  static_cast<void>(protocol_->next());
  const Answer passed_over = protocol_->find(datagram(0x0111, 1, kEleven));
  EXPECT_EQ(passed_over.kind, Answer::Kind::kNone);  // it may be late
  EXPECT_EQ(passed_over.problem, "an answer with the sequence number 1 came to the query 2");
  EXPECT_EQ(protocol_->peculiarity(), "");
  EXPECT_EQ(protocol_->give_up(), "");
  const Query fence = protocol_->next();
  EXPECT_EQ(fence.bytes, datagram(0x0110, 3, kZoomQuery));
  EXPECT_FALSE(fence.paced);
  EXPECT_EQ(protocol_->find(datagram(0x0111, 1, kEleven)).kind, Answer::Kind::kNone);  // late
  EXPECT_EQ(protocol_->find(datagram(0x0111, 1, kZoomAnswer)).kind, Answer::Kind::kDone);
  EXPECT_EQ(protocol_->next().bytes, datagram(0x0110, 4, "\x81\x09\x06\x12\xFF"));
  EXPECT_EQ(protocol_->find(datagram(0x0111, 1, kZoomAnswer)).kind, Answer::Kind::kNone);
  EXPECT_EQ(protocol_->find(datagram(0x0111, 1, kEleven)).kind, Answer::Kind::kPanTilt);
  EXPECT_THAT(protocol_->peculiarity(), HasSubstr("do not have the sequence numbers"));
  // As without a header: a fence where bytes came too many.
  protocol_->doubt();
  EXPECT_EQ(protocol_->next().bytes, datagram(0x0110, 5, kZoomQuery));
}

// The answer to a query was lost, and that to the one before came in its place.
TEST_F(ViscaWithHeader, CountsOnNumbersAgainOnceAFenceIsAnsweredWithItsOwn) {
  begin_numbering();
  for (int i = 0; i < 2; ++i) {
    static_cast<void>(protocol_->next());
  }
  EXPECT_EQ(protocol_->find(datagram(0x0111, 1, kEleven)).kind, Answer::Kind::kNone);
  EXPECT_EQ(protocol_->give_up(), "");
  static_cast<void>(protocol_->next());
  EXPECT_EQ(protocol_->find(datagram(0x0111, 2, kZoomAnswer)).kind, Answer::Kind::kDone);
  EXPECT_NE(protocol_->peculiarity(), "");
  protocol_->doubt();
  static_cast<void>(protocol_->next());
  EXPECT_EQ(protocol_->find(datagram(0x0111, 4, kZoomAnswer)).kind, Answer::Kind::kDone);
  EXPECT_EQ(protocol_->peculiarity(), "");
  static_cast<void>(protocol_->next());
  EXPECT_EQ(protocol_->find(datagram(0x0111, 4, kEleven)).kind, Answer::Kind::kNone);
  protocol_->doubt();
  EXPECT_EQ(protocol_->next().bytes, datagram(0x0110, 6, "\x81\x09\x06\x12\xFF"));
}

TEST_F(ViscaWithHeader, KnowsAfterARestartThatNumbersDoNotCount) {
  begin_numbering();
  static_cast<void>(protocol_->next());
  static_cast<void>(protocol_->find(datagram(0x0111, 0, kEleven)));
  static_cast<void>(protocol_->give_up());
  EXPECT_NE(protocol_->peculiarity(), "");
  protocol_->restart();
  begin_numbering();
  EXPECT_EQ(protocol_->next().bytes, datagram(0x0110, 1, kZoomQuery));
  EXPECT_EQ(protocol_->find(datagram(0x0111, 0, kZoomAnswer)).kind, Answer::Kind::kDone);
  EXPECT_NE(protocol_->peculiarity(), "");
}

TEST(ViscaHeaderTest, RefusesDatagramsOfAnotherLengthThanTheySay) {
  const std::string whole = datagram(0x0111, 0xFFFFFFFF, kEleven);
  const auto header = parse_visca_header(whole);
  ASSERT_TRUE(header);
  EXPECT_EQ(header->type, 0x0111);
  EXPECT_EQ(header->sequence, 0xFFFFFFFF);
  EXPECT_EQ(header->payload, kEleven);
  EXPECT_FALSE(parse_visca_header(whole + "x"));
  EXPECT_FALSE(parse_visca_header(bytes_of({1, 0x11, 0, 0, 0, 0, 0, 7}))) << "no payload";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse_visca_header(whole.substr(0, size)));
  }
}

}  // namespace
}  // namespace alidade
