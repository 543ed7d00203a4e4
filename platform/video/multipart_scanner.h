#pragma once
// MultipartScanner: extracts the pictures of a multipart/x-mixed-replace body as real cameras send
// it.
//
//   --boundary CRLF  Name: value CRLF ... CRLF  picture CRLF  --boundary CRLF ...
//
// Bytes are fed in pieces of any size. A part ends at its Content-Length if a JPEG ends there, too
// (FF D9), otherwise at the next delimiter. So a camera that sends no length delivers a picture
// only when the next delimiter comes. The cost per byte does not depend on how lines and parts cut
// the bytes. No I/O, no clock; exceptions only for memory, which is bounded by max_part_bytes and
// the fed piece. After each feed(), next() is to be called until it returns false. Tolerated
// deviations: docs/derivations.md.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

namespace alidade {

struct MultipartPart {
  std::string body;
  double first_byte_s = 0;            // s; arrival of the first byte after the delimiter's line
  std::string content_type;           // lower case, without parameters; empty if not given
  std::optional<double> timestamp_s;  // s; X-Timestamp: sender's clock, any epoch
};

// False: content_type is not multipart/*. *boundary is empty if none is declared.
[[nodiscard]] bool parse_multipart_type(std::string_view content_type, std::string* boundary);

class MultipartScanner {
 public:
  // boundary: as declared. Empty or not printable means not declared.
  MultipartScanner(std::string_view boundary, std::size_t max_part_bytes);

  void feed(std::string_view bytes, double arrival_s);

  // Returns the next complete part, in order of arrival.
  [[nodiscard]] bool next(MultipartPart* part);

  // Parts given up because they were longer than max_part_bytes, or had more than 64 header lines
  // or 8192 bytes of headers.
  [[nodiscard]] std::int64_t discarded() const { return discarded_; }

  // Bytes that must still come before a part can be complete, at least 1: the rest of the part's
  // Content-Length if the previous part ended at its own Content-Length, else 1.
  [[nodiscard]] std::size_t missing_bytes() const;

  // Bytes kept for later, not counting complete parts.
  [[nodiscard]] std::size_t pending_bytes() const { return buffer_.size() - used_; }

 private:
  enum class State { kLearnBoundary, kSkip, kHeaders, kBody };
  struct Delimiter {
    std::size_t begin = 0;  // end of the content before it
    std::size_t end = 0;    // after its line
  };

  bool advance();
  bool learn_boundary();
  bool skip_to_delimiter();
  bool read_header_line();
  bool read_body();
  std::optional<Delimiter> find_delimiter();
  void take_header(std::string_view line);
  void begin_part(std::size_t delimiter_end);
  void end_part(std::size_t body_end);
  void drop_front(std::size_t count);
  // The bytes not used yet; positions count from its start.
  [[nodiscard]] std::string_view rest() const { return std::string_view(buffer_).substr(used_); }

  std::string core_;  // the boundary without the dashes around it
  std::size_t max_part_bytes_;
  State state_;
  std::string buffer_;
  std::size_t used_ = 0;  // bytes used at the start of buffer_
  std::size_t scan_ = 0;  // no delimiter's core begins before this position in rest()
  double arrival_s_ = 0;  // of the fed piece
  bool stamp_next_byte_ = false;
  MultipartPart part_;  // the part being read
  std::size_t header_bytes_ = 0;
  int header_lines_ = 0;
  std::optional<std::size_t> content_length_;
  bool lengths_hold_ = false;  // the previous part ended at its Content-Length
  std::deque<MultipartPart> whole_;
  std::int64_t discarded_ = 0;
};

}  // namespace alidade
