// The head of an HTTP request: what is accepted has a method and a body of a length within the limit; what
// is refused is the client's mistake, said in one line.

#include <algorithm>

#include "edge_app/output/http/http_head.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

void require_refusal(const ServerResponse& refusal) {
  FUZZ_REQUIRE(refusal.status >= 400 && refusal.status < 500);
  FUZZ_REQUIRE(refusal.body.back() == '\n');
  FUZZ_REQUIRE(is_one_line(refusal.body.substr(0, refusal.body.size() - 1)));
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  constexpr std::size_t kMaxHead = 8192;
  constexpr std::size_t kMaxBody = 1000;
  std::string text(text_of(data, std::min(size, kMaxHead)));
  // As the server cuts it.
  const std::string end = "\r\n\r\n";
  text = text.substr(0, text.find(end)) + end;
  HttpHead head;
  ServerResponse refusal;
  if (!parse_http_head(text, &head, &refusal)) {
    require_refusal(refusal);
    return 0;
  }
  FUZZ_REQUIRE(!head.method.empty());
  FUZZ_REQUIRE(head.method.find_first_of(" \t\r\n:/") == std::string::npos);
  FUZZ_REQUIRE(head.path.find('?') == std::string::npos || text.find("%3") != std::string::npos);
  std::size_t decoded = head.path.size();
  for (const auto& [name, value] : head.parameters) decoded += name.size() + value.size();
  FUZZ_REQUIRE(decoded <= text.size());
  std::size_t length = kMaxBody + 1;
  if (body_length(head, kMaxBody, &length, &refusal)) {
    FUZZ_REQUIRE(length <= kMaxBody && (length == 0 || head.content_lengths.size() == 1));
  } else {
    require_refusal(refusal);
  }
  return 0;
}
