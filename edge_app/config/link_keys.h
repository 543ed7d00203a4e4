#pragma once
// Keys that the sections of several links have in common. All throw ConfigError.

#include <string>
#include <vector>

#include "edge_app/config/yaml_section.h"
#include "platform/system/link_rules.h"

namespace alidade {

// Of timeout_s and max_backoff_s.
inline constexpr NumberRange kSeconds{0.1, 3600, "s"};

// Where a path stands that is relative to the configuration's folder.
[[nodiscard]] std::string path_relative_to(const std::string& config_path, const std::string& path);

[[nodiscard]] std::string required_text(YamlSection& section, const std::string& key,
                                        const std::string& example);

// An address with one of the given schemes and without a user or password in it.
[[nodiscard]] std::string required_url(YamlSection& section, const std::string& example,
                                       const std::vector<std::string>& schemes);

// user and password_env.
void read_login(YamlSection& section, std::string* user, std::string* password);

// follow_redirects and auth.
[[nodiscard]] LinkRules read_link_rules(YamlSection& section);

// Fails where something that is no file has the path. One that is missing its reader tells.
void refuse_other_than_file(const YamlSection& section, const std::string& key,
                            const std::string& path);

// The first line of a file that holds a secret, without the blanks around it. what: what it holds, for the error.
[[nodiscard]] std::string first_line_of(const YamlSection& section, const std::string& key,
                                        const std::string& file, const std::string& what);

// Whether an address is of this machine alone.
[[nodiscard]] bool is_loopback(const std::string& host);

}  // namespace alidade
