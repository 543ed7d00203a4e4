#pragma once
// HttpHead: the parts of a request's head that this server uses. Pure: bytes in, value or refusal
// out.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "edge_app/output/http/http_message.h"

namespace alidade {

struct HttpHead {
  std::string method;                                           // a method of RFC 9110 or 5789
  std::string path;                                             // decoded, without the query
  std::vector<std::pair<std::string, std::string>> parameters;  // of the query, decoded
  std::string host;
  std::string origin;
  std::string authorization;
  bool of_browser = false;       // has a header that browsers send and that no page can remove
  bool from_other_site = false;  // according to the browser; false for a link that is followed
  std::vector<std::string> content_lengths;  // unparsed, one for each field
  bool transfer_encoding = false;
  bool content_encoding = false;
  bool expects_continue = false;
};

// text: everything up to and including the blank line. False: *refusal is the answer.
[[nodiscard]] bool parse_http_head(std::string_view text, HttpHead* head, ServerResponse* refusal);

// The length of the body that the head states, in bytes, at most max_body. False: *refusal is the
// answer.
[[nodiscard]] bool body_length(const HttpHead& head, std::size_t max_body, std::size_t* length,
                               ServerResponse* refusal);

// Whether the head of a POST announces more body than the `came` bytes that have come.
[[nodiscard]] bool body_is_to_come(const HttpHead& head, std::size_t came);

}  // namespace alidade
