#pragma once
// Pelco-D: frames of seven bytes, FF address command1 command2 data1 data2 sum; `sum` is the sum of
// bytes 2 to 6 modulo 256. Queries 0x51 pan, 0x53 tilt, 0x55 zoom; answers 0x59, 0x5B, 0x5D with 16
// bits.
//   FF 01 00 51 00 00 52 -> FF 01 00 59 11 94 FF = 4500 steps
// Any byte can be FF, including the sum. So a frame is recognised by length, address, opcode and
// sum, never by FF alone. Pan is 0..35999 steps of 0.01 degree. Tilt is 0 at the horizon, 9000
// straight down, 33000 thirty degrees up. There is no negative answer: an unknown query gets none.

#include <cstdint>
#include <optional>

#include "platform/pan_tilt/query_protocol.h"

namespace alidade {

struct PelcoDOptions {
  int address = 1;  // 1..255
  double pan_deg_per_step = 0.01;
  double tilt_deg_per_step = 0.01;
  bool read_zoom = false;
};

struct PelcoDAnswer {
  std::uint16_t value = 0;
  std::size_t begin = 0;  // index of its first byte
};

[[nodiscard]] std::string pelco_d_query(int address, std::uint8_t opcode);

// The latest complete answer with this address and opcode. nullopt: *problem is one line on what
// came instead; unchanged if less than a frame came. If an answer is found, *problem is empty.
[[nodiscard]] std::optional<PelcoDAnswer> find_pelco_d_answer(std::string_view bytes, int address,
                                                              std::uint8_t opcode,
                                                              std::string* problem);

class PelcoDProtocol : public QueryProtocol {
 public:
  explicit PelcoDProtocol(const PelcoDOptions& options) : options_(options) {}

  [[nodiscard]] const char* name() const override { return "Pelco-D"; }
  void restart() override { turn_ = 0; }
  [[nodiscard]] Query next() override;
  [[nodiscard]] Answer find(std::string_view bytes) override;
  [[nodiscard]] std::string give_up() override { return {}; }
  void doubt() override {}  // not needed: an answer names its axis
  [[nodiscard]] bool is_of_datagrams() const override { return false; }
  [[nodiscard]] int polls_per_reading() const override { return 2; }
  [[nodiscard]] int bytes_per_reading() const override { return 28; }

 private:
  PelcoDOptions options_;
  int turn_ = 0;  // position in the sequence pan, tilt, pan, tilt, ... zoom
  Answer::Kind asked_ = Answer::Kind::kNone;
};

}  // namespace alidade
