#pragma once
// FLIR (Directed Perception) PTU: ASCII commands that end with a space, answers of one line.
//   PP  -> "* Current Pan position is 1000", terse (after FT) "* 1000";  TP for tilt
//   PR  -> "* 185.1428 seconds arc per position";  TR for tilt;  errors "! text"
// On connection: FT or FV (terse or verbose), ED (no echo), CI (answers at once), then PR or TR for
// each axis whose degrees per step are not configured, until two answers in a row are equal, then
// PP and TP in turn. A verbose answer names its axis, which must be the axis of the query. A terse
// answer, or one to PR and TR, names no axis. Fences (query_protocol.h): docs/derivations.md. A
// lost digit is not noticed.

#include <optional>

#include "platform/pan_tilt/query_protocol.h"

namespace alidade {

struct PtuOptions {
  bool verbose = true;
  std::optional<double> pan_deg_per_step;  // nullopt: the device is asked
  std::optional<double> tilt_deg_per_step;
};

struct PtuLine {
  enum class Kind { kOk, kNumber, kError };
  Kind kind = Kind::kOk;
  double number = 0;
  std::string words;      // before the number, in lower case; the text of an error
  std::size_t begin = 0;  // index of the '*' or '!'
};

// The latest complete line with a '*' or '!'. Anything before the sign (noise, an echo, a partial
// line) is skipped, as are words after a number (the unit).
[[nodiscard]] std::optional<PtuLine> find_ptu_line(std::string_view bytes);

class PtuProtocol : public QueryProtocol {
 public:
  explicit PtuProtocol(const PtuOptions& options) : options_(options) {}

  [[nodiscard]] const char* name() const override { return "PTU"; }
  void restart() override;
  [[nodiscard]] Query next() override;
  [[nodiscard]] Answer find(std::string_view bytes) override;
  [[nodiscard]] std::string give_up() override;
  void doubt() override;
  [[nodiscard]] bool is_of_datagrams() const override { return false; }
  [[nodiscard]] int polls_per_reading() const override { return 2; }
  // "PP " and "* -12345\r\n", or "* Current Pan position is -12345\r\n", and the same for tilt.
  [[nodiscard]] int bytes_per_reading() const override { return options_.verbose ? 75 : 26; }

 private:
  enum class Asked { kFeedback, kEcho, kImmediate, kPanStep, kTiltStep, kPan, kTilt, kFence };

  void advance();
  void ask_fence_next(bool of_number);

  PtuOptions options_;
  Asked asked_ = Asked::kFeedback;
  bool begun_ = false;  // a query was sent on this connection
  bool fence_next_ = false;
  bool fence_is_number_ = false;
  int since_fence_ = 0;                    // queries since the last fence
  Asked behind_fence_ = Asked::kFeedback;  // asked before the fence
  double step_heard_ = 0;                  // arc seconds; in the latest answer to PR or TR
  double pan_deg_per_step_ = 0;
  double tilt_deg_per_step_ = 0;
};

}  // namespace alidade
