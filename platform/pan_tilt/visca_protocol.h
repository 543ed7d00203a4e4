#pragma once
// VISCA over a serial line, TCP or UDP; over UDP with or without the header of eight bytes (big
// endian): type (2), length (2), sequence (4).
// Pan and tilt together: 8x 09 06 12 FF -> y0 50 nibbles FF (y = x + 8), one nibble of two's
// complement per byte: 4+4 (11 bytes), 5+4 (12) or 5+5 (13). Zoom: 8x 09 04 47 FF -> y0 50 0p 0q 0r
// 0s FF. Errors: y0 6z ee FF. FF ends every frame and occurs nowhere else. There is no checksum. A
// lost nibble turns 5+4 into 4+4. So a length is accepted once it came twice in a row, and from
// then on no other length. A changed nibble is not noticed. Sequence numbers and fences:
// docs/derivations.md.

#include <cstdint>
#include <optional>

#include "platform/pan_tilt/query_protocol.h"

namespace alidade {

struct ViscaOptions {
  int address = 1;              // 1..7
  bool header = false;          // for UDP
  double pan_deg_per_step = 0;  // depends on the model: there is no usual value
  double tilt_deg_per_step = 0;
  bool read_zoom = false;
};

struct ViscaHeader {
  std::uint16_t type = 0;
  std::uint32_t sequence = 0;
  std::string_view payload;
};

// nullopt: not a datagram with a header of the right length.
[[nodiscard]] std::optional<ViscaHeader> parse_visca_header(std::string_view datagram);

struct ViscaFrame {
  enum class Kind { kPosition, kZoom, kError };
  Kind kind = Kind::kPosition;
  int pan = 0;  // steps
  int tilt = 0;
  int zoom = 0;
  int error = 0;  // code
  std::size_t begin = 0;
  std::size_t length = 0;  // bytes
};

// The device's latest frame that is a position, a zoom or an error.
[[nodiscard]] std::optional<ViscaFrame> find_visca_frame(std::string_view bytes, int address);

[[nodiscard]] const char* visca_error_text(int code);

class ViscaProtocol : public QueryProtocol {
 public:
  explicit ViscaProtocol(const ViscaOptions& options) : options_(options) {}

  [[nodiscard]] const char* name() const override { return "VISCA"; }
  void restart() override;
  [[nodiscard]] Query next() override;
  [[nodiscard]] Answer find(std::string_view bytes) override;
  [[nodiscard]] std::string give_up() override;
  void doubt() override { fence_next_ = needs_fences(); }
  [[nodiscard]] std::string peculiarity() const override;
  [[nodiscard]] bool is_of_datagrams() const override { return options_.header; }
  [[nodiscard]] int polls_per_reading() const override { return 1; }
  [[nodiscard]] int bytes_per_reading() const override { return 18; }

 private:
  enum class Asked { kNumbering, kFence, kPosition, kZoom };

  [[nodiscard]] bool needs_fences() const { return !options_.header || !numbers_count_; }
  [[nodiscard]] bool fits(const ViscaFrame& frame) const;
  [[nodiscard]] Answer find_in_datagram(std::string_view bytes);
  [[nodiscard]] Answer find_control(const ViscaHeader& header);
  [[nodiscard]] Answer find_in_payload(std::string_view bytes);

  ViscaOptions options_;
  Asked asked_ = Asked::kPosition;
  bool numbered_ = false;       // the header's numbering has started, or the attempt was made
  std::uint32_t sequence_ = 0;  // of the latest query
  bool numbers_count_ = true;   // the device's answers bear the numbers of their queries
  bool number_stands_ = false;  // queries bear the number that the device answers with
  bool answered_ = false;       // the latest query was answered, with any number
  bool other_number_ = false;   // it was answered, but only with another number
  std::optional<std::uint32_t> heard_number_;  // the number of such an answer; nullopt: without
                                               // header
  bool fence_next_ = false;
  int since_fence_ = 0;            // positions since the last fence
  int turn_ = 0;                   // readings since the last zoom
  std::size_t heard_length_ = 0;   // bytes; of the latest position
  std::size_t answer_length_ = 0;  // bytes; confirmed for this device; 0: not yet known
};

}  // namespace alidade
