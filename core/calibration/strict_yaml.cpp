#include "core/calibration/strict_yaml.h"

#include <algorithm>
#include <set>

#include "core/calibration/one_line.h"

namespace alidade {

std::optional<int> line_of(const YAML::Node& node) {
  // yaml-cpp counts from 0 and gives -1 for a node that is not in the text.
  const int line = node.Mark().line;
  return line < 0 ? std::nullopt : std::optional<int>(line + 1);
}

std::optional<FaultyKey> find_faulty_key(const YAML::Node& map,
                                         const std::vector<std::string>& known) {
  std::set<std::string> seen;
  for (const auto& entry : map) {
    if (!entry.first.IsScalar()) return FaultyKey{KeyFault::kNoWord, entry.first};
    const std::string& key = entry.first.Scalar();
    if (!seen.insert(key).second) return FaultyKey{KeyFault::kDoubled, entry.first};
    if (!known.empty() && std::find(known.begin(), known.end(), key) == known.end()) {
      return FaultyKey{KeyFault::kUnknown, entry.first};
    }
  }
  return std::nullopt;
}

bool read_yaml(const std::string& text, const std::string& name, const NotYaml& not_yaml,
               const std::function<void(const YAML::Node&)>& read, std::string* error) {
  try {
    read(YAML::Load(text));
    return true;
  } catch (const YamlError& e) {
    *error = one_line(e.what());
  } catch (const YAML::Exception& e) {
    *error = one_line(name + ":" + std::to_string(std::max(e.mark.line, 0) + 1) + ": " +
                      not_yaml.before + e.msg + not_yaml.after);
  }
  return false;
}

std::string join(const std::vector<std::string>& words) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : ", ") + word;
  return joined;
}

}  // namespace alidade
