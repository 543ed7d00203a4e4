#pragma once
// ConfigText: a configuration as text, to be written: sections with their keys in order. Values are
// quoted where YAML would read something else. It does not know which keys there are: the finished
// text is read by parse_config() before it is written.

#include <string>
#include <utility>
#include <vector>

namespace alidade {

class ConfigText {
 public:
  // Adds or replaces a key. value: YAML, as it is to stand there.
  void set(const std::string& section, const std::string& key, const std::string& value);
  // The same for a text of any origin, quoted.
  void set_text(const std::string& section, const std::string& key, const std::string& text);
  // "pan_tilt.pan_positive=left". False: *error says what would be right.
  [[nodiscard]] bool set_by_word(const std::string& word, std::string* error);

  // comment: lines for the top of the file, without '#'.
  [[nodiscard]] std::string text(const std::vector<std::string>& comment) const;

 private:
  struct Section {
    std::string name;
    std::vector<std::pair<std::string, std::string>> keys;
  };
  std::vector<Section> sections_;
};

// In double quotes, with escapes.
[[nodiscard]] std::string yaml_quoted(const std::string& text);

// "62" or "62:2.3" (wide:tele), horizontal fields of view in degrees, 0.05 to 150: the value of
// camera.focal_length_px for pictures of this width. False: *error says what would be right.
[[nodiscard]] bool focal_length_of(const std::string& field_of_view, int width_px,
                                   std::string* value, std::string* error);

}  // namespace alidade
