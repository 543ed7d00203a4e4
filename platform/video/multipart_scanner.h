#pragma once
// MultipartScanner: the pictures in a multipart/x-mixed-replace body, as cameras really send it.
//
//   --boundary CRLF  Name: value CRLF ... CRLF  picture CRLF  --boundary CRLF ...
//
// Bytes go in as they come, in pieces of any size. Tolerated: any number of dashes around the
// boundary, in the declaration, and many in the stream; a boundary that is not declared (the first line
// that begins with "--" tells it); lines that end in LF alone; no line end before a delimiter, and none
// behind it where a header or a JPEG follows at once, as browsers read it; parts without headers; a Content-Length that is missing or wrong.
// A part ends at its Content-Length if a JPEG ends there, too (FF D9), and at the next delimiter
// otherwise; so a camera that tells no length delivers a picture when the next delimiter comes.
// What a byte costs does not depend on how the bytes are cut into lines and parts. Pure: no I/O, no clock, no exceptions but for memory, which is bounded by max_part_bytes and the
// piece fed. After each feed() call next() until it has nothing more.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

namespace alidade {

struct MultipartPart {
  std::string body;
  double first_byte_s = 0;            // arrival of the first byte after the delimiter's line
  std::string content_type;           // lower case without parameters; empty if not told
  std::optional<double> timestamp_s;  // X-Timestamp: the sender's clock, any epoch
};

// False: content_type is not multipart/*. The boundary is empty if none is declared.
[[nodiscard]] bool parse_multipart_type(std::string_view content_type, std::string* boundary);

class MultipartScanner {
 public:
  // boundary as declared; empty, or not printable: not declared.
  MultipartScanner(std::string_view boundary, std::size_t max_part_bytes);

  void feed(std::string_view bytes, double arrival_s);

  // The next whole part, in order of arrival.
  [[nodiscard]] bool next(MultipartPart* part);

  // Parts given up because they were longer than max_part_bytes, or their headers too many or without an end.
  [[nodiscard]] std::int64_t discarded() const { return discarded_; }

  // How many bytes must come before a whole part can be there: those its Content-Length still wants if the part
  // before kept to its own, otherwise 1; never 0.
  [[nodiscard]] std::size_t missing_bytes() const;

  // Bytes kept until more come, whole parts aside.
  [[nodiscard]] std::size_t pending_bytes() const { return buffer_.size() - used_; }

 private:
  enum class State { kLearnBoundary, kSkip, kHeaders, kBody };
  struct Delimiter {
    std::size_t begin = 0;  // where what stands before it ends
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
  // What is not used up yet; places count from its beginning.
  [[nodiscard]] std::string_view rest() const { return std::string_view(buffer_).substr(used_); }

  std::string core_;  // the boundary without the dashes around it
  std::size_t max_part_bytes_;
  State state_;
  std::string buffer_;
  std::size_t used_ = 0;  // of it, at its beginning
  std::size_t scan_ = 0;  // no delimiter's core begins before this place in rest()
  double arrival_s_ = 0;  // of the piece being fed
  bool stamp_next_byte_ = false;
  MultipartPart part_;  // under way
  std::size_t header_bytes_ = 0;
  int header_lines_ = 0;
  std::optional<std::size_t> content_length_;
  bool lengths_hold_ = false;  // the last part ended at its Content-Length
  std::deque<MultipartPart> whole_;
  std::int64_t discarded_ = 0;
};

}  // namespace alidade
