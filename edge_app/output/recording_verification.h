#pragma once
// What the page and the API say of a verification of the last recording (`alidade verify`).

#include <string>

namespace alidade {

struct RecordingVerification {
  enum class State {
    kNone,  // none was asked for yet
    kRunning,
    kDone,
    kFailed  // nothing was judged: see error
  };
  State state = State::kNone;
  std::string recording;  // its directory
  // kDone: as `alidade verify --json` gives them.
  std::string verdict;   // "holds", "contradicted", "not judged"
  std::string sentence;  // the verdict in words
  std::string report;    // path of verification.html
  std::string error;     // kFailed: one line
};

[[nodiscard]] constexpr const char* to_string(RecordingVerification::State state) {
  switch (state) {
    case RecordingVerification::State::kNone:
      return "none";
    case RecordingVerification::State::kRunning:
      return "running";
    case RecordingVerification::State::kDone:
      return "done";
    case RecordingVerification::State::kFailed:
      return "failed";
  }
  return "unknown";
}

}  // namespace alidade
