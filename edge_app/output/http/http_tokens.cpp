#include "edge_app/output/http/http_tokens.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/algorithm/string/trim.hpp>
#include <sstream>
#include <utility>

#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr double kLookAtTokensAgainS = 1;
constexpr std::size_t kMostTokens = 1000;

// Compares in constant time: goes through all of `given`, wherever it first differs.
bool is_token(std::string_view given, const std::string& token) {
  std::size_t difference = given.size() ^ token.size();
  for (std::size_t i = 0; i < given.size(); ++i) {
    difference |= static_cast<std::size_t>(static_cast<unsigned char>(given[i]) ^
                                           static_cast<unsigned char>(token[i % token.size()]));
  }
  return difference == 0;
}

bool parse_only_token(const std::string& text, std::vector<HttpToken>* tokens, std::string* error) {
  std::string line = text.substr(0, text.find('\n'));
  boost::algorithm::trim(line);
  if (!is_usable_token(line)) {
    *error = "its first line is not a token that can be used";
    return false;
  }
  *tokens = {{line, HttpRight::kControl}};
  return true;
}

}  // namespace

bool is_usable_token(std::string_view token) {
  return token.size() >= kShortestToken &&
         std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < 0x7f; });
}

bool parse_tokens(const std::string& text, std::vector<HttpToken>* tokens, std::string* error) {
  tokens->clear();
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::string right;
    std::string token;
    std::string rest;
    if (!(words >> right) || right.front() == '#') continue;
    words >> token >> rest;
    const auto fail = [&](const std::string& what) {
      *error = fmt::format("line {} {}; expected `view TOKEN` or `control TOKEN`", number, what);
      return false;
    };
    if (right != "view" && right != "control") return fail("names no right");
    if (token.empty()) return fail("has no token");
    if (!rest.empty()) return fail("has more than a right and a token");
    if (!is_usable_token(token))
      return fail(
          fmt::format("has no token of at least {} letters, digits or signs", kShortestToken));
    const bool is_twice = std::any_of(tokens->begin(), tokens->end(),
                                      [&](const HttpToken& one) { return one.text == token; });
    if (is_twice) return fail("repeats an earlier token");
    if (tokens->size() == kMostTokens)
      return fail(fmt::format("is more than the {} tokens allowed", kMostTokens));
    tokens->push_back({token, right == "view" ? HttpRight::kView : HttpRight::kControl});
  }
  if (!tokens->empty()) return true;
  *error = "there is no token in it; expected lines `view TOKEN` or `control TOKEN`";
  return false;
}

HttpTokens::HttpTokens(const HttpServerOptions& options)
    : file_(options.token_file),
      file_holds_several_(options.token_file_holds_several),
      any_(!options.token.empty() || !options.tokens.empty()),
      tokens_(options.tokens),
      stamp_(options.token_file_stamp) {
  if (!options.token.empty()) tokens_.push_back({options.token, HttpRight::kControl});
}

std::optional<HttpRight> HttpTokens::right_of(std::string_view authorization, double now_s) {
  constexpr std::string_view kScheme = "Bearer ";
  if (!any_ || authorization.substr(0, kScheme.size()) != kScheme) return std::nullopt;
  read_if_changed(now_s);
  std::optional<HttpRight> right;
  for (const HttpToken& one : tokens_) {
    if (is_token(authorization.substr(kScheme.size()), one.text)) right = one.right;
  }
  return right;
}

void HttpTokens::read_if_changed(double now_s) {
  if (file_.empty() || now_s < looked_s_ + kLookAtTokensAgainS) return;
  looked_s_ = now_s;
  FileStamp stamp(file_);
  if (stamp == stamp_) return;
  stamp_ = stamp;
  std::string text;
  std::string error;
  std::vector<HttpToken> tokens;
  bool good = read_file(file_, &text, &error);
  if (good) {
    good = file_holds_several_ ? parse_tokens(text, &tokens, &error)
                               : parse_only_token(text, &tokens, &error);
    if (!good) error = file_ + ": " + error;
  }
  if (!good) {
    spdlog::warn("HTTP: {}; the earlier tokens stay in use", error);
    return;
  }
  tokens_ = std::move(tokens);
  const auto viewing = std::count_if(tokens_.begin(), tokens_.end(), [](const HttpToken& one) {
    return one.right == HttpRight::kView;
  });
  spdlog::info("HTTP: {}: read anew: {} to view, {} to control", file_, viewing,
               static_cast<std::ptrdiff_t>(tokens_.size()) - viewing);
  if (stamp_.is_public())
    spdlog::warn("HTTP: {}: other users of this machine can read it; chmod o= it", file_);
}

}  // namespace alidade
