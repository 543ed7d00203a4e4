#pragma once
// FLIR (Directed Perception) PTU: ASCII commands that end with a space, answers of one line.
//   PP  -> "* Current Pan position is 1000", terse (after FT) "* 1000";  TP  the tilt
//   PR  -> "* 185.1428 seconds arc per position";  TR  the tilt's;  errors "! text"
// After a connection: FT or FV (terse or verbose), ED (no echo), CI (answers at once), then PR and TR
// unless the configuration states the degrees per step, then PP and TP in turn.
//
// Answer N need not belong to query N. A verbose answer names its axis and must name the one asked. A
// terse one does not, nor does that to PR and TR. After a query without answer a space ends what the device
// may have half received; then CI (whose answer has no number) is asked as a fence (see query_protocol.h),
// or PP where the query was such a command, and the other axis is next. CI also stands between the
// resolutions and what follows them. A digit lost on the way is not noticed.

#include <optional>

#include "platform/pan_tilt/query_protocol.h"

namespace alidade {

struct PtuOptions {
  bool verbose = true;
  std::optional<double> pan_deg_per_step;  // else the device is asked
  std::optional<double> tilt_deg_per_step;
};

struct PtuLine {
  enum class Kind { kOk, kNumber, kError };
  Kind kind = Kind::kOk;
  double number = 0;
  std::string words;      // before the number, in lower case; of an error: its text
  std::size_t begin = 0;  // of the '*' or '!'
};

// The latest whole line of the device with a '*' or '!' in it. What stands before the sign (noise, an
// echo, half a line) is passed over; words after a number (the unit) too.
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
  // "PP " and "* -12345\r\n", or "* Current Pan position is -12345\r\n", and the tilt's.
  [[nodiscard]] int bytes_per_reading() const override { return options_.verbose ? 75 : 26; }

 private:
  enum class Asked { kFeedback, kEcho, kImmediate, kPanStep, kTiltStep, kPan, kTilt, kFence };

  void advance();
  void ask_fence_next(bool of_number);

  PtuOptions options_;
  Asked asked_ = Asked::kFeedback;
  bool begun_ = false;  // a query of this connection has been sent
  bool fence_next_ = false;
  bool fence_is_number_ = false;
  int since_fence_ = 0;                    // queries
  Asked behind_fence_ = Asked::kFeedback;  // asked before it
  double step_heard_ = 0;                  // arc seconds, in the latest answer about it
  double pan_deg_per_step_ = 0;
  double tilt_deg_per_step_ = 0;
};

}  // namespace alidade
