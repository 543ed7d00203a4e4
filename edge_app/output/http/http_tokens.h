#pragma once
// HttpTokens: the tokens of a server and what each may do, from its configuration or from a file that is read anew when it has
// changed, so that tokens are replaced without a restart. What cannot be used then leaves those before, and is said once.
//
//   of one token   the file's first line; it may do everything
//   of several     a line each, `view TOKEN` or `control TOKEN`; empty lines and those that begin with # are left out
// A token is at least kShortest visible ASCII signs. Network thread, but for construction and parse_tokens().

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "edge_app/output/http/http_options.h"
#include "platform/system/file_stamp.h"

namespace alidade {

inline constexpr std::size_t kShortestToken = 8;
[[nodiscard]] bool is_usable_token(std::string_view token);

// False: *error says which line is wrong and why, without telling a token.
[[nodiscard]] bool parse_tokens(const std::string& text, std::vector<HttpToken>* tokens,
                                std::string* error);

class HttpTokens {
 public:
  explicit HttpTokens(const HttpServerOptions& options);

  // Whether tokens are asked for; for ever.
  [[nodiscard]] bool any() const { return any_; }
  // What the token in a header `Authorization` may do. Nothing: it has none, or none of these. Takes a time that does not
  // tell how much of it was right.
  [[nodiscard]] std::optional<HttpRight> right_of(std::string_view authorization, double now_s);

 private:
  void read_if_changed(double now_s);

  const std::string file_;
  const bool file_holds_several_;
  bool any_;
  std::vector<HttpToken> tokens_;
  FileStamp stamp_;
  double looked_s_ = 0;
};

}  // namespace alidade
