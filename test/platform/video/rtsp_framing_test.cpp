#include "platform/video/rtsp_framing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace alidade {
namespace {

std::string packet(int channel, const std::string& payload) {
  std::string bytes = {'$', static_cast<char>(channel), static_cast<char>(payload.size() >> 8U),
                       static_cast<char>(payload.size())};
  return bytes + payload;
}

std::string rtp(const std::string& content) { return "\x80\x1a" + content; }

const std::string kAnswer = "RTSP/1.0 200 OK\r\nCSeq: 4\r\nContent-length: 7\r\n\r\n$\001body.";
const std::string kRequest = "SET_PARAMETER * RTSP/1.0\r\nCSeq: 5\r\n\r\n";

// "0:..." for a packet on channel 0, "m:..." for a message.
std::vector<std::string> items(RtspFraming& framing, const std::string& stream, std::size_t piece) {
  std::vector<std::string> found;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    const auto [room, size] = framing.room();
    const std::string bytes = stream.substr(at, piece);
    EXPECT_GE(size, bytes.size());
    std::copy(bytes.begin(), bytes.end(), room);
    framing.came(bytes.size(), static_cast<double>(at));
    for (auto item = framing.next(); item.kind != RtspFraming::Item::Kind::kNone;
         item = framing.next()) {
      const bool message = item.kind == RtspFraming::Item::Kind::kMessage;
      found.push_back((message ? "m" : std::to_string(item.channel)) + ":" +
                      std::string(item.bytes));
      EXPECT_EQ(item.arrival_s, static_cast<double>(at));
    }
  }
  return found;
}

using Items = std::vector<std::string>;

TEST(RtspFraming, GivesPacketsAndMessagesInPiecesOfAnySize) {
  const std::string one = rtp("content of the first");
  const std::string two = rtp(std::string("$\0\0\020\x80 and more", 15));
  const std::string stream = packet(0, one) + kAnswer + packet(1, two) + "\r\n" + kRequest +
                             packet(7, one) + packet(0, "") + packet(0, two);
  const Items expected = {"0:" + one,      "m:" + kAnswer, "1:" + two,
                          "m:" + kRequest, "7:" + one,     "0:" + two};
  for (std::size_t size = 1; size <= stream.size(); ++size) {
    RtspFraming framing;
    ASSERT_EQ(items(framing, stream, size), expected) << size;
    EXPECT_EQ(framing.garbage(), 0);
  }
}

TEST(RtspFraming, PassesOverGarbageBeforeAnything) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_int_distribution<int> length(1, 12);
  const std::string one = rtp(std::string(300, 'a'));
  std::size_t found = 0;
  constexpr std::size_t kRounds = 3000;
  RtspFraming framing;
  for (std::size_t i = 0; i < kRounds; ++i) {
    std::string garbage;
    for (int n = length(random); n > 0; --n) garbage += static_cast<char>(byte(random));
    for (const std::string& item :
         items(framing, garbage + packet(0, one) + packet(1, one) + kAnswer, 100)) {
      found += item == "0:" + one || item == "1:" + one || item == "m:" + kAnswer ? 1 : 0;
    }
  }
  // By chance some bytes look like the beginning of a packet, which then swallows what follows.
  EXPECT_GE(found, 3 * kRounds * 99 / 100);
  EXPECT_GT(framing.garbage(), static_cast<std::int64_t>(kRounds));
}

TEST(RtspFraming, KnowsTheChannelsThatWereAgreedUpon) {
  const std::string one = rtp("content");
  RtspFraming framing;
  framing.set_channels(4);
  const std::string stream = "?" + packet(0, one) + packet(4, one) + "?" + packet(5, one);
  EXPECT_EQ(items(framing, stream, 5), (Items{"4:" + one, "5:" + one}));
}

TEST(RtspFraming, GivesUpWhereNothingIsFoundForLong) {
  RtspFraming framing;
  (void)items(framing, std::string(RtspFraming::kMaxGarbage, 'x'), 10'000);
  EXPECT_FALSE(framing.is_lost());
  EXPECT_EQ(items(framing, "x" + packet(0, rtp("content")), 100), Items{});
  EXPECT_TRUE(framing.is_lost());
}

TEST(RtspFraming, TakesNoMessageWithoutEnd) {
  const std::string one = rtp("content");
  for (const std::string& begun :
       {"RTSP/1.0 200 OK\r\n" + std::string(20'000, 'h'), std::string("OPTIONS * RTSP/1.0\r\n\x01"),
        std::string("RTSP/1.0 200 OK\r\nContent-Length: 4000000000\r\n\r\n"),
        std::string("RTSP/1.0 200 OK\r\nContent-Length: x\r\n\r\n")}) {
    RtspFraming framing;
    EXPECT_EQ(items(framing, begun + packet(0, one), 1000), Items{"0:" + one});
    EXPECT_GE(framing.garbage(), static_cast<std::int64_t>(begun.size()));
  }
}

}  // namespace
}  // namespace alidade
