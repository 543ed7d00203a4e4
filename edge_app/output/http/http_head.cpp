#include "edge_app/output/http/http_head.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/predicate.hpp>
#include <boost/algorithm/string/trim.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <limits>

namespace alidade {
namespace {

namespace http = boost::beast::http;

constexpr std::string_view kLineEnd = "\r\n";

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// "%41" is A. A % that is not followed by two hex digits stays. In a query + is a space.
std::string decoded(std::string_view text, bool in_query) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_code = text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 &&
                         hex_digit(text[i + 2]) >= 0;
    if (is_code) {
      out += static_cast<char>(16 * hex_digit(text[i + 1]) + hex_digit(text[i + 2]));
      i += 2;
    } else {
      out += in_query && text[i] == '+' ? ' ' : text[i];
    }
  }
  return out;
}

void parse_query(std::string_view query, HttpHead* head) {
  const auto text_between = [](const char* begin, const char* end) {
    return std::string_view(begin, static_cast<std::size_t>(end - begin));
  };
  const char* const end = query.data() + query.size();
  for (const char* begin = query.data(); begin < end;) {
    const char* const pair_end = std::find(begin, end, '&');
    const char* const equals = std::find(begin, pair_end, '=');
    if (begin < pair_end) {
      const char* const value = equals == pair_end ? pair_end : equals + 1;
      head->parameters.emplace_back(decoded(text_between(begin, equals), true),
                                    decoded(text_between(value, pair_end), true));
    }
    begin = pair_end == end ? end : pair_end + 1;
  }
}

// Reads them from the text, as the library only reports that they are faulty.
std::vector<std::string> content_lengths(std::string_view text) {
  constexpr std::string_view kName = "content-length:";
  std::vector<std::string> out;
  for (std::size_t begin = text.find(kLineEnd); begin != std::string_view::npos;
       begin = text.find(kLineEnd, begin + kLineEnd.size())) {
    std::string_view line = text.substr(begin + kLineEnd.size());
    line = line.substr(0, line.find(kLineEnd));
    if (!boost::algorithm::istarts_with(line, kName)) continue;
    out.emplace_back(line.substr(kName.size()));
    boost::algorithm::trim_if(out.back(), boost::algorithm::is_any_of(" \t"));
  }
  return out;
}

// Why the length of the body is not known. Then the end of the body is not known either.
std::optional<ServerResponse> length_refusal(const HttpHead& head) {
  if (head.transfer_encoding || head.content_lengths.size() > 1)
    return http_error(411, "the request must state the length of its body exactly once");
  if (head.content_encoding) return http_error(415, "the body must not be compressed");
  if (!head.content_lengths.empty() &&
      (head.content_lengths[0].empty() ||
       head.content_lengths[0].find_first_not_of("0123456789") != std::string::npos))
    return http_error(400, "Content-Length is not a number");
  return std::nullopt;
}

using Fields = http::request<http::empty_body>;

std::string_view text_of(const Fields& fields, http::field name) {
  const auto value = fields[name];
  return {value.data(), value.size()};
}
std::string_view text_of(const Fields& fields, const char* name) {
  const auto value = fields[name];
  return {value.data(), value.size()};
}

// One of these headers is enough: browsers differ, and send fewer of them over plain HTTP.
bool is_of_browser(const Fields& fields) {
  using boost::algorithm::istarts_with;
  for (const auto& field : fields) {
    const auto name = field.name_string();
    if (istarts_with(std::string_view(name.data(), name.size()), "sec-")) return true;
  }
  const std::string accepted(text_of(fields, http::field::accept));
  return fields.count(http::field::origin) > 0 || fields.count(http::field::referer) > 0 ||
         fields.count(http::field::accept_language) > 0 || fields.count(http::field::cookie) > 0 ||
         fields.count("Upgrade-Insecure-Requests") > 0 ||
         boost::algorithm::contains(accepted, "image/") ||
         boost::algorithm::contains(accepted, "text/html") ||
         istarts_with(text_of(fields, http::field::user_agent), "mozilla/");
}

bool is_from_other_site(const Fields& fields) {
  const std::string_view site = text_of(fields, "Sec-Fetch-Site");
  const bool followed = text_of(fields, "Sec-Fetch-Mode") == "navigate" &&
                        text_of(fields, "Sec-Fetch-Dest") == "document";
  return (site == "cross-site" || site == "same-site") && !followed;
}

}  // namespace

bool parse_http_head(std::string_view text, HttpHead* head, ServerResponse* refusal) {
  *head = HttpHead();
  head->content_lengths = content_lengths(text);
  http::request_parser<http::empty_body> parser;
  parser.skip(true);  // it must not read the body
  parser.header_limit(std::numeric_limits<std::uint32_t>::max());
  boost::beast::error_code error;
  parser.put(boost::asio::const_buffer(text.data(), text.size()), error);
  if (error == http::error::bad_content_length || error == http::error::bad_transfer_encoding) {
    head->transfer_encoding = error == http::error::bad_transfer_encoding;
    *refusal = length_refusal(*head).value_or(http_error(413, "the body is too large"));
    return false;
  }
  if (error) {
    *refusal = http_error(400, "malformed request");
    return false;
  }
  const auto& fields = parser.get();
  const std::string_view target(fields.target().data(), fields.target().size());
  const std::size_t end = std::min(target.find('?'), target.size());
  head->method = std::string(fields.method_string().data(), fields.method_string().size());
  head->path = decoded(target.substr(0, end), false);
  parse_query(target.substr(std::min(end + 1, target.size())), head);
  head->host = text_of(fields, http::field::host);
  head->origin = text_of(fields, http::field::origin);
  head->authorization = text_of(fields, http::field::authorization);
  head->of_browser = is_of_browser(fields);
  head->from_other_site = is_from_other_site(fields);
  head->transfer_encoding = fields.count(http::field::transfer_encoding) > 0;
  head->content_encoding = fields.count(http::field::content_encoding) > 0;
  head->expects_continue =
      fields.version() > 10 &&
      boost::algorithm::iequals(text_of(fields, http::field::expect), "100-continue");
  return true;
}

bool body_length(const HttpHead& head, std::size_t max_body, std::size_t* length,
                 ServerResponse* refusal) {
  *length = 0;
  if (auto error = length_refusal(head)) {
    *refusal = std::move(*error);
    return false;
  }
  if (head.content_lengths.empty()) return true;
  const std::string& digits = head.content_lengths[0];
  constexpr std::size_t kDigits = 9;
  if (digits.size() > kDigits || std::stoul(digits) > max_body) {
    *refusal = http_error(413, fmt::format("the body is too large; at most {} bytes", max_body));
    return false;
  }
  *length = std::stoul(digits);
  return true;
}

bool body_is_to_come(const HttpHead& head, std::size_t came) {
  std::size_t length = 0;
  ServerResponse ignored;
  return head.method == "POST" &&
         body_length(head, std::numeric_limits<std::size_t>::max(), &length, &ignored) &&
         length > came;
}

}  // namespace alidade
