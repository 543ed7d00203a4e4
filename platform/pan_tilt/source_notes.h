#pragma once
// SourceNotes: what a source has to say of its device, each line once (PanTiltSource::take_notes).

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace alidade {

class SourceNotes {
 public:
  // of: the source's name. An empty note is none.
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
