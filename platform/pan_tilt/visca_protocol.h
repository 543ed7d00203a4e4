#pragma once
// VISCA over a serial line, TCP or UDP, the last with or without the header of eight bytes
// (big endian): type (2), length (2), sequence (4).
//
// Pan and tilt are asked at once, 8x 09 06 12 FF -> y0 50 nibbles FF (y = x + 8), one nibble of two's
// complement a byte: 4+4 (11 bytes), 5+4 (12) or 5+5 (13). Zoom: 8x 09 04 47 FF -> y0 50 0p 0q 0r 0s FF.
// Errors: y0 6z ee FF. FF ends every frame and stands nowhere else. There is no checksum: a nibble lost
// on the way turns 5+4 into 4+4, so a length counts once it came twice, and then no other does; a changed
// nibble is not noticed. Without the header a late position cannot be told from the next one: before it is
// asked again, and first of all, the zoom is asked as a fence (see query_protocol.h). Its answer, or an
// error, looks different.
//
// With the header, sequence numbers match answers to queries; the numbering begins anew (control type)
// with each connection and when the device complains of it. Some devices answer in the right order
// with other numbers (always 1, always 0, one off, bytes turned round) or without a header. Where a
// query got only such answers, numbers count no longer and fences do, as without the header, until
// the answer to a fence bears the fence's own number. Some of these devices answer none but their
// own number: where nothing came at all, it is sent that, or counted again. All that holds over a
// restart, as fences are right for every device.

#include <cstdint>
#include <optional>

#include "platform/pan_tilt/query_protocol.h"

namespace alidade {

struct ViscaOptions {
  int address = 1;              // 1..7
  bool header = false;          // for UDP
  double pan_deg_per_step = 0;  // of the model: there is no usual value
  double tilt_deg_per_step = 0;
  bool read_zoom = false;
};

struct ViscaHeader {
  std::uint16_t type = 0;
  std::uint32_t sequence = 0;
  std::string_view payload;
};

// None: not a datagram with a header whose length is right.
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

// The latest frame of the device that is a position, a zoom or an error.
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
  bool numbered_ = false;       // the numbering of the header has begun, or been tried
  std::uint32_t sequence_ = 0;  // of the latest query
  bool numbers_count_ = true;   // the device's answers bear the numbers of their queries
  bool number_stands_ = false;  // queries bear the number that the device answers with
  bool answered_ = false;       // the latest query, with whatever number
  bool other_number_ = false;   // ... but with none that is its own
  std::optional<std::uint32_t> heard_number_;  // of such an answer; none: it had no header
  bool fence_next_ = false;
  int since_fence_ = 0;            // positions
  int turn_ = 0;                   // readings since the zoom
  std::size_t heard_length_ = 0;   // of the latest position
  std::size_t answer_length_ = 0;  // of this device's; 0: not yet known
};

}  // namespace alidade
