#include "alidade_ros/sse_parser.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace alidade_ros {
namespace {

// As "type|id|data".
std::vector<std::string> events_of(const std::vector<std::string>& pieces) {
  std::vector<std::string> events;
  SseParser parser([&events](const SseEvent& event) {
    events.push_back(event.type + "|" + event.id + "|" + event.data);
  });
  for (const std::string& piece : pieces) EXPECT_TRUE(parser.feed(piece.data(), piece.size()));
  return events;
}

const char* const kStream =
    "\xEF\xBB\xBF: keep-alive\n"
    "event: hello\ndata: {\"a\":1}\n\n"
    "id: 7\nevent: orientation\ndata: one\ndata:two\ndata\n\n"
    ":\n\n"
    "event: without data\n\n"
    "unknown: field\nretry: 10\ndata:  x: y\n\n"
    "id\ndata: z\n\n"
    "id: 9\ndata: cut off";
const std::vector<std::string> kEvents = {"hello||{\"a\":1}", "orientation|7|one\ntwo\n",
                                          "message|7| x: y", "message||z"};

std::string with_line_ends(std::string text, const std::string& end) {
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += end.size()) {
    text.replace(at, 1, end);
  }
  return text;
}

TEST(SseParser, UnderstandsEveryLineEnd) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    EXPECT_EQ(events_of({with_line_ends(kStream, end)}), kEvents) << int(*end);
  }
}

TEST(SseParser, MayBeCutAtAnyByte) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    const std::string text = with_line_ends(kStream, end);
    std::vector<std::string> bytes;
    for (std::size_t at = 0; at < text.size(); ++at) {
      EXPECT_EQ(events_of({text.substr(0, at), text.substr(at)}), kEvents) << at;
      bytes.push_back(text.substr(at, 1));
    }
    EXPECT_EQ(events_of(bytes), kEvents);
  }
}

TEST(SseParser, RefusesAnEventWithoutEnd) {
  SseParser parser([](const SseEvent&) {});
  const std::string line = "data: " + std::string(1000, 'x') + "\n";
  bool good = true;
  std::size_t fed = 0;
  while (good) {
    good = parser.feed(line.data(), line.size());
    fed += line.size();
    ASSERT_LE(fed, 2 * SseParser::kMaxEventBytes);
  }
  EXPECT_GT(fed, SseParser::kMaxEventBytes / 2);
}

}  // namespace
}  // namespace alidade_ros
