#pragma once
// HttpTokens: the tokens of a server and what each may do. They come from the configuration, or
// from a file that is read again when it changes, so that tokens can be replaced without a restart.
// If the new file cannot be used, the old tokens stay, and the failure is logged once.
//
//   one token       the first line of the file; it may do everything
//   several         one a line, `view TOKEN` or `control TOKEN`; empty lines and lines that begin
//                   with # are skipped; at most 1000
// A token has at least kShortestToken visible ASCII characters. For the network thread, except
// construction and parse_tokens().

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

// False: *error says which line is wrong and why, without showing a token.
[[nodiscard]] bool parse_tokens(const std::string& text, std::vector<HttpToken>* tokens,
                                std::string* error);

class HttpTokens {
 public:
  explicit HttpTokens(const HttpServerOptions& options);

  // Whether a token is needed. Never changes.
  [[nodiscard]] bool any() const { return any_; }
  // The right of the token in a header `Authorization`. Empty: no token, or an unknown one. The
  // duration does not depend on how much of the token was right.
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
