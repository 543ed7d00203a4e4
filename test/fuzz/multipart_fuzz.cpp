// A multipart stream: its first line is the Content-Type of the answer, all else its body. In whatever pieces
// the body comes, the parts are the same, and no more of it is kept than the cap on a part allows.

#include <random>
#include <vector>

#include "platform/video/multipart_scanner.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

constexpr std::size_t kMaxPart = 512;      // bytes
constexpr std::size_t kMaxBesides = 8192;  // bytes of headers, or of a delimiter's line

struct Scan {
  std::vector<MultipartPart> parts;
  std::int64_t discarded = 0;
};

// next_piece() gives the size of each piece.
template <class NextPiece>
Scan scan(const std::string& boundary, std::string_view body, NextPiece next_piece) {
  Scan result;
  MultipartScanner scanner(boundary, kMaxPart);
  double time_s = 0;
  while (!body.empty()) {
    const std::string_view piece = body.substr(0, next_piece());
    body.remove_prefix(piece.size());
    scanner.feed(piece, ++time_s);
    FUZZ_REQUIRE(scanner.pending_bytes() <= std::max(kMaxPart, kMaxBesides) + piece.size());
    MultipartPart part;
    while (scanner.next(&part)) {
      FUZZ_REQUIRE(!part.body.empty() && part.body.size() <= kMaxPart);
      FUZZ_REQUIRE(part.first_byte_s > 0 && part.first_byte_s <= time_s);
      FUZZ_REQUIRE(!part.timestamp_s || std::isfinite(*part.timestamp_s));
      result.parts.push_back(part);
    }
  }
  result.discarded = scanner.discarded();
  return result;
}

void require_same(const Scan& a, const Scan& b) {
  FUZZ_REQUIRE(a.discarded == b.discarded);
  FUZZ_REQUIRE(a.parts.size() == b.parts.size());
  for (std::size_t i = 0; i < a.parts.size(); ++i) {
    FUZZ_REQUIRE(a.parts[i].body == b.parts[i].body);
    FUZZ_REQUIRE(a.parts[i].content_type == b.parts[i].content_type);
    FUZZ_REQUIRE(a.parts[i].timestamp_s == b.parts[i].timestamp_s);
  }
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  FuzzInput input(data, size);
  std::string boundary;
  if (!parse_multipart_type(input.line(), &boundary)) FUZZ_REQUIRE(boundary.empty());
  const std::string_view body = input.rest();
  const Scan whole = scan(boundary, body, [&] { return body.size(); });
  // Pieces small and smaller, others for an input of another length.
  std::minstd_rand random(static_cast<unsigned>(size));
  const auto next_piece = [&] { return 1 + random() % (random() % 4 == 0 ? 200 : 5); };
  require_same(whole, scan(boundary, body, next_piece));
  return 0;
}
