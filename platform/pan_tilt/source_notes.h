#pragma once
// SourceNotes: collects a source's notes on its device, each once (PanTiltSource::take_notes).

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace alidade {

class SourceNotes {
 public:
  // of: the source's name, which precedes the note. An empty note is ignored.
  void add(const std::string& of, const std::string& note) {
    if (note.empty() || std::find(said_.begin(), said_.end(), note) != said_.end()) return;
    said_.push_back(note);
    new_.push_back(of + ": " + note);
  }
  [[nodiscard]] std::vector<std::string> take() { return std::exchange(new_, {}); }

 private:
  std::vector<std::string> said_;
  std::vector<std::string> new_;
};

}  // namespace alidade
