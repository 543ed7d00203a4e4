#include "platform/video/multipart_scanner.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace alidade {
namespace {

constexpr std::size_t kMax = 1000;  // bytes of a part

// What looks like a JPEG from outside: its first and last two bytes.
std::string jpeg(const std::string& content) { return "\xFF\xD8" + content + "\xFF\xD9"; }

std::string with_length(const std::string& body, std::size_t told) {
  return "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(told) +
         "\r\n\r\n" + body + "\r\n";
}

std::string with_length(const std::string& body) { return with_length(body, body.size()); }

std::vector<MultipartPart> taken(MultipartScanner& scanner) {
  std::vector<MultipartPart> parts;
  MultipartPart part;
  while (scanner.next(&part)) {
    parts.push_back(part);
  }
  return parts;
}

std::vector<std::string> bodies(const std::string& stream, const std::string& boundary = "frame",
                                std::size_t piece = std::string::npos) {
  MultipartScanner scanner(boundary, kMax);
  std::vector<std::string> found;
  for (std::size_t at = 0; at < stream.size(); at += std::min(piece, stream.size())) {
    scanner.feed(std::string_view(stream).substr(at, piece), 0);
    for (const MultipartPart& part : taken(scanner)) {
      found.push_back(part.body);
    }
  }
  return found;
}

using Bodies = std::vector<std::string>;

TEST(MultipartType, FindsTheBoundaryQuotedOrNot) {
  for (const auto& [type, expected] : std::vector<std::pair<std::string, std::string>>{
           {"multipart/x-mixed-replace; boundary=myboundary", "myboundary"},
           {"multipart/x-mixed-replace;boundary=\"my boundary;1\"; x=y", "my boundary;1"},
           {"Multipart/X-Mixed-Replace; charset=utf-8 ; Boundary = --MyBoundary ; x=y",
            "--MyBoundary"},
           {"multipart/x-mixed-replace; boundary=\"open", "open"},
           {"multipart/x-mixed-replace; noboundary=a", ""},
           {"multipart/x-mixed-replace; boundary", ""},
           {"multipart/x-mixed-replace; boundary=", ""},
           {"multipart/x-mixed-replace;", ""},
           {"multipart/x-mixed-replace", ""}}) {
    std::string boundary = "?";
    EXPECT_TRUE(parse_multipart_type(type, &boundary)) << type;
    EXPECT_EQ(boundary, expected) << type;
  }
}

TEST(MultipartType, RefusesOtherTypes) {
  std::string boundary;
  for (const char* type : {"image/jpeg", "text/html; boundary=a", "", "multipart"}) {
    EXPECT_FALSE(parse_multipart_type(type, &boundary)) << type;
  }
}

TEST(MultipartScanner, DeliversAPartAtItsLengthWithoutWaitingForTheNext) {
  const std::string body = jpeg("one");
  const std::string stream = with_length(body);
  MultipartScanner scanner("frame", kMax);
  scanner.feed(stream.substr(0, stream.size() - 3), 0);
  EXPECT_TRUE(taken(scanner).empty());
  scanner.feed(stream.substr(stream.size() - 3, 1), 0);
  const std::vector<MultipartPart> parts = taken(scanner);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].body, body);
  EXPECT_EQ(parts[0].content_type, "image/jpeg");
  EXPECT_FALSE(parts[0].timestamp_s);
}

TEST(MultipartScanner, GivesTheSamePartsForPiecesOfAnySize) {
  const Bodies expected{jpeg("one"), jpeg("\r\n--fram\r\n--framed\r\n"), jpeg("frame-- \r"),
                        jpeg(std::string(300, '-'))};
  std::string stream;
  for (const std::string& body : expected) {
    stream += with_length(body);
  }
  stream += "--frame\r\n";
  for (const std::string& body : expected) {
    stream += "X: y\r\n\r\n" + body + "\r\n--frame\r\n";
  }
  Bodies twice = expected;
  twice.insert(twice.end(), expected.begin(), expected.end());
  for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
    ASSERT_EQ(bodies(stream, "frame", piece), twice) << piece;
  }
}

TEST(MultipartScanner, TakesDashesAroundTheBoundaryAsTheyCome) {
  for (const char* declared : {"frame", "--frame", "----frame", "--frame--"}) {
    for (const std::string sent : {"frame", "--frame", "----frame", "--frame--", "--frame \t"}) {
      for (const std::string end : {"\r\n", "\n"}) {
        const std::string delimiter = sent + end;
        const std::string stream = delimiter + "Content-Type: image/jpeg" + end + end + jpeg("a") +
                                   end + delimiter + end + jpeg("b") + end + delimiter;
        EXPECT_EQ(bodies(stream, declared), (Bodies{jpeg("a"), jpeg("b")}))
            << declared << " " << sent;
      }
    }
  }
}

TEST(MultipartScanner, LearnsABoundaryThatIsNotDeclared) {
  const std::string stream =
      "\r\nhello\r\n--\r\n" + with_length(jpeg("a")) + with_length(jpeg("b"), 3) + "--frame\r\n";
  for (const char* declared : {"", "--"}) {
    EXPECT_EQ(bodies(stream, declared, 7), (Bodies{jpeg("a"), jpeg("b")}));
  }
  EXPECT_EQ(bodies(std::string(5000, 'x') + "\r\n" + stream, "", 7),
            (Bodies{jpeg("a"), jpeg("b")}));
}

TEST(MultipartScanner, NeedsNoLineEndBeforeADelimiter) {
  const std::string part = "--frame\r\nContent-Type: image/jpeg\r\n\r\n" + jpeg("a");
  EXPECT_EQ(bodies(part + part + "--frame\r\n"), (Bodies{jpeg("a"), jpeg("a")}));
}

// The headers, or the picture, follow the boundary at once.
TEST(MultipartScanner, NeedsNoLineEndBehindABoundary) {
  const Bodies expected{jpeg("a"), jpeg("--frame "), jpeg("--framed\r\n--frame7:")};
  for (const std::string end : {"\r\n", "\n"}) {
    for (const std::string& before : {end, std::string()}) {
      for (const std::string blanks : {"", " ", "  \t"}) {
        for (const bool told : {true, false}) {
          const std::string boundary = "--frame" + blanks;
          std::string with_headers;
          std::string without;
          for (const std::string& body : expected) {
            const std::string length =
                told ? "Content-Length: " + std::to_string(body.size()) + end : "";
            with_headers +=
                boundary + "Content-Type: image/jpeg" + end + length + end + body + before;
            without += boundary + body + before;
          }
          for (const char* declared : {"frame", "--frame", ""}) {
            for (const std::size_t piece : {1U, 7U, 10'000U}) {
              EXPECT_EQ(bodies(with_headers + "--frame" + end, declared, piece), expected)
                  << declared << " " << told << " " << piece;
            }
          }
          EXPECT_EQ(bodies(without + "--frame" + end, "frame", 3), expected);
        }
      }
    }
  }
}

TEST(MultipartScanner, LearnsABoundaryWhoseHeadersFollowAtOnce) {
  std::string stream;
  for (const char* body : {"a", "longer than ten"}) {
    stream += "--frameContent-Length: " + std::to_string(jpeg(body).size()) +
              "\r\nContent-Type: image/jpeg\r\n\r\n" + jpeg(body) + "\r\n";
  }
  EXPECT_EQ(bodies(stream, ""), (Bodies{jpeg("a"), jpeg("longer than ten")}));
}

TEST(MultipartScanner, TakesNoTextWithinAPartForAHeaderBehindABoundary) {
  const std::string body = jpeg("\nframes: 3\n--frame-rate: 25\n--frame\xFF\xD9 ");
  EXPECT_EQ(bodies("--frame\r\n\r\n" + body + "\r\n--frame\r\n"), Bodies{body});
}

TEST(MultipartScanner, NeedsNoHeaders) {
  EXPECT_EQ(
      bodies("--frame\r\n\r\n" + jpeg("a") + "\r\n--frame\r\n" + jpeg("b") + "\r\n--frame\r\n"),
      (Bodies{jpeg("a"), jpeg("b")}));
}

TEST(MultipartScanner, DoesNotBelieveAWrongLength) {
  for (const std::size_t told : {0U, 1U, 2U, 5U, 6U, 8U, 9U, 10U, 11U, 20U, 500U, 99'999U}) {
    const std::string stream =
        with_length(jpeg("abc"), told) + with_length(jpeg("second")) + "--frame\r\n";
    EXPECT_EQ(bodies(stream), (Bodies{jpeg("abc"), jpeg("second")})) << told;
    EXPECT_EQ(bodies(stream, "frame", 1), (Bodies{jpeg("abc"), jpeg("second")})) << told;
  }
  for (const char* told : {"-7", "7 bytes", "", "99999999999999999999999999"}) {
    const std::string stream = std::string("--frame\r\nContent-Length: ") + told + "\r\n\r\n" +
                               jpeg("abc") + "\r\n--frame\r\n";
    EXPECT_EQ(bodies(stream), Bodies{jpeg("abc")}) << told;
  }
}

TEST(MultipartScanner, TellsHowManyBytesAreMissingOnceLengthsHold) {
  std::mt19937 random(3);
  const std::string first = with_length(jpeg("one"));
  const std::string second = with_length(jpeg(std::string(200, '2')));
  const std::size_t end = second.size() - 2;  // the part ends before its line does
  for (int i = 0; i < 200; ++i) {
    MultipartScanner scanner("frame", kMax);
    for (std::size_t at = 0; at < first.size(); ++at) {
      EXPECT_EQ(scanner.missing_bytes(), 1U);
      scanner.feed(std::string_view(first).substr(at, 1), 0);
    }
    ASSERT_EQ(taken(scanner).size(), 1U);
    const std::size_t come = random() % end;
    scanner.feed(std::string_view(second).substr(0, come), 0);
    const std::size_t missing = scanner.missing_bytes();
    EXPECT_EQ(missing,
              come < second.size() - 2 - jpeg(std::string(200, '2')).size() ? 1 : end - come);
    scanner.feed(std::string_view(second).substr(come, missing - 1), 0);
    EXPECT_TRUE(taken(scanner).empty() || missing == 1);
    scanner.feed(std::string_view(second).substr(come + missing - 1), 0);
    EXPECT_EQ(taken(scanner).size(), 1U);
    EXPECT_EQ(scanner.missing_bytes(), 1U);
  }
}

TEST(MultipartScanner, WaitsForNoLengthOnceOneWasWrong) {
  MultipartScanner scanner("frame", kMax);
  scanner.feed(with_length(jpeg("one")), 0);
  const std::string told_too_much = with_length(jpeg("two"), 600);
  scanner.feed(told_too_much, 0);
  EXPECT_GT(scanner.missing_bytes(), 500U);
  scanner.feed("--frame\r\nContent-Length: 300\r\n\r\n\xFF", 0);
  EXPECT_EQ(taken(scanner).size(), 2U);
  EXPECT_EQ(scanner.missing_bytes(), 1U);
}

TEST(MultipartScanner, SkipsWhatStandsBetweenAPartAndTheDelimiter) {
  EXPECT_EQ(bodies("preamble\r\n" + with_length(jpeg("a")) + "padding" + with_length(jpeg("b"))),
            (Bodies{jpeg("a"), jpeg("b")}));
}

TEST(MultipartScanner, PassesOverPartsWithoutBody) {
  EXPECT_EQ(bodies("--frame\r\nContent-Type: image/jpeg\r\n--frame\r\n\r\n--frame\r\n\r\n\r\n" +
                   with_length(jpeg("a"))),
            Bodies{jpeg("a")});
}

TEST(MultipartScanner, StampsAPartWhenItsFirstByteComes) {
  MultipartScanner scanner("frame", kMax);
  scanner.feed("--frame\r", 1);
  scanner.feed("\n", 2);  // the delimiter came with the picture before
  scanner.feed("", 3);
  scanner.feed("C", 4);
  scanner.feed("ontent-Length: 5\r\n\r\n", 5);
  scanner.feed(jpeg("a"), 6);
  scanner.feed("\r\n--frame\r\nX-Timestamp", 7);
  scanner.feed(": 1234.5\r\n\r\n" + jpeg("b") + "\r\n--frame\r\n", 8);
  scanner.feed("\r\n" + jpeg("c") + "\r\n--frame\r\nX-Timestamp: soon\r\n\r\n", 9);
  scanner.feed(jpeg("d") + "\r\n--frame\r\n", 10);
  const std::vector<MultipartPart> parts = taken(scanner);
  ASSERT_EQ(parts.size(), 4U);
  EXPECT_EQ(parts[0].first_byte_s, 4);
  EXPECT_EQ(parts[1].first_byte_s, 7);
  EXPECT_EQ(parts[1].timestamp_s, 1234.5);
  EXPECT_EQ(parts[2].first_byte_s, 9);
  EXPECT_EQ(parts[3].first_byte_s, 9);
  EXPECT_FALSE(parts[3].timestamp_s);
}

TEST(MultipartScanner, GivesUpAPartThatIsTooLongAndGoesOnWithTheNext) {
  for (const std::size_t piece : {1U, 100U, 100'000U}) {
    MultipartScanner scanner("frame", kMax);
    const std::string stream = with_length(jpeg(std::string(5000, 'x'))) + with_length(jpeg("a")) +
                               "--frame\r\nX: " + std::string(10'000, 'y') + "\r\n\r\n" +
                               with_length(jpeg("b"));
    Bodies found;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      scanner.feed(std::string_view(stream).substr(at, piece), 0);
      for (const MultipartPart& part : taken(scanner)) {
        found.push_back(part.body);
      }
    }
    EXPECT_EQ(found, (Bodies{jpeg("a"), jpeg("b")})) << piece;
    EXPECT_EQ(scanner.discarded(), 2) << piece;
  }
}

TEST(MultipartScanner, GivesUpHeadersWithoutEnd) {
  MultipartScanner scanner("frame", kMax);
  scanner.feed("--frame\r\n", 0);
  for (int i = 0; i < 20; ++i) scanner.feed("X: " + std::string(1000, 'y') + "\r\n", 0);
  EXPECT_EQ(scanner.discarded(), 1);
  scanner.feed("\r\n" + jpeg("lost") + "\r\n" + with_length(jpeg("a")), 0);
  const auto parts = taken(scanner);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].body, jpeg("a"));
}

TEST(MultipartScanner, GivesUpHeadersOfTooManyLines) {
  for (const char* line : {"a\n", "a:b\r\n", "Content-Type: image/jpeg\r\n"}) {
    MultipartScanner scanner("b", 1000);
    std::string part = "--b\n";
    for (int i = 0; i < 100; ++i) part += line;
    scanner.feed(part + "\n\xFF\xD8x\xFF\xD9\r\n--b\n\n\xFF\xD8y\xFF\xD9\r\n--b\n", 0);
    MultipartPart next;
    ASSERT_TRUE(scanner.next(&next));
    EXPECT_EQ(next.body, "\xFF\xD8y\xFF\xD9");
    EXPECT_FALSE(scanner.next(&next));
    EXPECT_EQ(scanner.discarded(), 1);
  }
}

TEST(MultipartScanner, TakesNoBoundaryWithinALine) {
  const std::string body = jpeg("a frame\r\nof a -frame\n");
  EXPECT_EQ(bodies("--frame\r\n\r\n" + body + "\r\n--frame\r\n"), Bodies{body});
}

TEST(MultipartScanner, TakesAPartOfTheGreatestLengthInPiecesOfAnySize) {
  const std::string greatest = jpeg(std::string(kMax - 4, 'x'));
  const std::string start = "--frame\r\n\r\n";
  const std::string stream = start + greatest + "\r\n--frame\r\n\r\n" + greatest +
                             "y\r\n--frame\r\n\r\n" + jpeg("a") + "\r\n--frame\r\n";
  for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
    ASSERT_EQ(bodies(stream, "frame", piece), (Bodies{greatest, jpeg("a")})) << piece;
  }
}

TEST(MultipartScanner, LearnsTheSameBoundaryInPiecesOfAnySize) {
  const std::string part = "--frame\r\n\r\n" + jpeg("a") + "\r\n";
  for (const std::size_t blanks : {193U, 194U, 300U}) {
    const std::string stream = "--x" + std::string(blanks, ' ') + "y\r\n--no" +
                               std::string(blanks, ' ') + "\n" + part + part;
    const Bodies whole = bodies(stream, "");
    for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
      ASSERT_EQ(bodies(stream, "", piece), whole) << blanks << " " << piece;
    }
  }
}

TEST(MultipartScanner, TakesNoLineThatIsNotPrintableForABoundary) {
  const std::string stream = "--b\xFF\xD9\n\n" + with_length(jpeg("a")) + "--frame\r\n";
  for (const char* declared : {"", "\xFF\xD9"}) {
    EXPECT_EQ(bodies(stream, declared), (Bodies{jpeg("a")}));
  }
}

TEST(MultipartScanner, KeepsPartsWithinTheirCapWhateverComes) {
  std::mt19937 random(1);
  const std::vector<std::string> words{"--frame", "frame", "\r\n", "\n",       "-",
                                       "\xFF",    "\xD9",  " ",    "\r\n\r\n", "Content-Length: 4",
                                       "x",       ":"};
  std::uniform_int_distribution<std::size_t> pick(0, words.size() - 1);
  std::uniform_int_distribution<std::size_t> times(1, 300);
  std::size_t parts = 0;
  for (const char* boundary : {"frame", "", "-", "x"}) {
    MultipartScanner scanner(boundary, kMax);
    for (int i = 0; i < 20'000; ++i) {
      std::string piece = words[pick(random)];
      if (i % 50 == 0) {
        for (std::size_t n = times(random); n > 0; --n) {
          piece += words[pick(random)];
        }
      }
      scanner.feed(piece, i);
      for (const MultipartPart& part : taken(scanner)) {
        ++parts;
        EXPECT_LE(part.body.size(), kMax);
        EXPECT_FALSE(part.body.empty());
        EXPECT_LE(part.first_byte_s, i);
      }
    }
  }
  EXPECT_GT(parts, 1000U);
}

}  // namespace
}  // namespace alidade
