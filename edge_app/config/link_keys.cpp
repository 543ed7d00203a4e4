#include "edge_app/config/link_keys.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "platform/system/text.h"
#include "platform/system/whole_file.h"

namespace alidade {

namespace fs = std::filesystem;

std::string path_relative_to(const std::string& config_path, const std::string& path) {
  return (fs::path(config_path).parent_path() / path).string();
}

std::string required_text(YamlSection& section, const std::string& key,
                          const std::string& example) {
  const std::optional<std::string> value = section.text(key);
  if (!value) section.fail_missing(key, "expected for example " + key + ": " + example);
  return *value;
}

std::string required_choice(YamlSection& section, const std::string& key,
                            const std::vector<std::string>& names) {
  std::optional<std::string> name = section.choice(key, names);
  if (!name) section.fail_missing(key, "expected one of " + join(names));
  return *std::move(name);
}

std::string required_url(YamlSection& section, const std::string& example,
                         const std::vector<std::string>& schemes) {
  std::string url = required_text(section, "url", example);
  bool known = false;
  std::string rest;
  for (const std::string& scheme : schemes) {
    if (url.rfind(scheme, 0) != 0) continue;
    known = true;
    rest = url.substr(scheme.size());
  }
  if (!known || rest.empty() || rest[0] == '/') {
    section.fail("url", "is not an address that starts with " + join(schemes) +
                            "; expected for example " + example);
  }
  if (rest.substr(0, rest.find('/')).find('@') != std::string::npos) {
    section.fail("url",
                 "holds a user or password; give them as user and password_env or password_file");
  }
  return url;
}

void read_login(YamlSection& section, const std::string& config_path, std::string* user,
                std::string* password) {
  *user = section.text("user").value_or("");
  const std::optional<std::string> variable = section.text("password_env");
  const std::optional<std::string> file = section.text("password_file");
  if (!variable && !file) return;
  if (user->empty())
    section.fail(file ? "password_file" : "password_env", "is given without a user; add user");
  if (variable && file)
    section.fail("password_file", "and password_env exclude each other; keep one");
  if (file) {
    *password =
        first_line_of(section, "password_file", path_relative_to(config_path, *file), "password");
    return;
  }
  const char* value = std::getenv(variable->c_str());
  if (value == nullptr) {
    section.fail("password_env",
                 fmt::format("the environment has no variable '{}'; export it with the password",
                             *variable));
  }
  *password = value;
}

LinkRules read_link_rules(YamlSection& section) {
  LinkRules rules;
  if (section.choice("follow_redirects", {"same-host", "any"}) == "any") {
    rules.redirects = LinkRules::Redirects::kAny;
  }
  if (const auto auth = section.choice("auth", {"digest", "any"})) {
    rules.auth = *auth == "any" ? LinkRules::Auth::kAny : LinkRules::Auth::kDigest;
  }
  return rules;
}

void refuse_other_than_file(const YamlSection& section, const std::string& key,
                            const std::string& path) {
  std::error_code ignored;
  std::string error;
  if (fs::exists(path, ignored) && !open_to_read(path, &error).is_open()) section.fail(key, error);
}

std::string first_line_of(const YamlSection& section, const std::string& key,
                          const std::string& file, const std::string& what) {
  std::string text;
  std::string error;
  if (!read_file(file, &text, &error)) section.fail(key, error + "; put the " + what + " there");
  if (text.empty()) {
    section.fail(key, fmt::format("cannot read a line of {}; put the {} there", file, what));
  }
  return std::string(first_line(text));
}

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.compare(0, 4, "127.") == 0;
}

}  // namespace alidade
