#pragma once
// Keys that the sections of several links share. All of these functions throw ConfigError.

#include <string>
#include <vector>

#include "edge_app/config/yaml_section.h"
#include "platform/system/link_rules.h"

namespace alidade {

// The range of timeout_s and max_backoff_s.
inline constexpr NumberRange kSeconds{0.1, 3600, "s"};

// Resolves a path that is relative to the configuration's folder.
[[nodiscard]] std::string path_relative_to(const std::string& config_path, const std::string& path);

[[nodiscard]] std::string required_text(YamlSection& section, const std::string& key,
                                        const std::string& example);

// One of the names.
[[nodiscard]] std::string required_choice(YamlSection& section, const std::string& key,
                                          const std::vector<std::string>& names);

// The key url: an address with one of the given schemes and without a user or password in it.
[[nodiscard]] std::string required_url(YamlSection& section, const std::string& example,
                                       const std::vector<std::string>& schemes);

// The keys user, password_env (the environment variable that holds the password) and password_file
// (a file whose first line it is; relative to the configuration's folder). All may be missing. A
// password without user, both kinds of it, no such variable or no such file are errors.
void read_login(YamlSection& section, const std::string& config_path, std::string* user,
                std::string* password);

// The keys follow_redirects and auth.
[[nodiscard]] LinkRules read_link_rules(YamlSection& section);

// Fails if `path` exists and is not a file. A missing file passes: whoever reads it reports that.
void refuse_other_than_file(const YamlSection& section, const std::string& key,
                            const std::string& path);

// The first line of a file that holds a secret, without the blanks around it. `what` names the
// secret in errors.
[[nodiscard]] std::string first_line_of(const YamlSection& section, const std::string& key,
                                        const std::string& file, const std::string& what);

// Whether only this machine can reach the address.
[[nodiscard]] bool is_loopback(const std::string& host);

}  // namespace alidade
