#pragma once
// MjpegConnection: the connections to an MJPEG camera over HTTP (libcurl), one after the other:
// login, redirections, one deadline for each picture, and the pictures' parts of the stream as they
// come, each with the arrival of its first byte. Part of MjpegSource. For the receiving thread,
// except interrupt() and damaged(), which any thread may call.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "platform/streams/read_status.h"
#include "platform/system/curl_handles.h"
#include "platform/system/url.h"
#include "platform/video/mjpeg_source.h"
#include "platform/video/multipart_scanner.h"

namespace alidade {

class MjpegConnection {
 public:
  static constexpr const char* kNoCurl = "libcurl does not start";
  using TakePicture = std::function<void(MultipartPart picture)>;

  // options: user and password must be those to log in with, also if the URL gave them. url:
  // options.url, parsed.
  MjpegConnection(const MjpegSourceOptions& options, const Url& url, TakePicture take_picture);

  // False: kNoCurl.
  [[nodiscard]] bool is_ready() const { return multi_ != nullptr; }
  // One connection from start to end. ending(): asked again and again; true: give up (kStopped).
  // kFailed: the login was refused before any picture came. kDisconnected: any other end. Both set
  // *error, one line.
  [[nodiscard]] ReadStatus receive(const std::function<bool()>& ending, std::string* error);
  // Wakes receive(), which then asks ending().
  void interrupt();
  // Number of parts that should have been pictures and are not, or that were discarded.
  [[nodiscard]] std::int64_t damaged() const { return damaged_; }

 private:
  static int on_socket(void* self, curl_socket_t socket, curlsocktype purpose);
  static int on_close(void* self, curl_socket_t socket);
  static std::size_t on_header(char* data, std::size_t size, std::size_t count, void* self);
  static std::size_t on_body(char* data, std::size_t size, std::size_t count, void* self);
  bool make_handle(const std::string& url, bool logs_in);
  bool begin_stream();
  void take_bytes(std::string_view bytes, double arrival_s);
  ReadStatus receive_answer(const std::function<bool()>& ending, CURLcode* code,
                            std::string* error);
  void wait_for_bytes(double left_s);
  void set_low_water(std::size_t bytes);
  ReadStatus connection_end(CURLcode code, std::string* error);

  const MjpegSourceOptions options_;
  const Url configured_;
  const TakePicture take_picture_;
  std::atomic<std::int64_t> damaged_{0};

  char curl_error_[CURL_ERROR_SIZE] = "";
  std::string asked_;     // the URL, after redirections
  bool logs_in_ = false;  // at asked_
  long methods_ = 0;
  curl_socket_t socket_ = CURL_SOCKET_BAD;   // of the open connection
  int low_water_ = 1;                        // bytes at which poll() wakes
  CurlMultiPtr multi_;                       // interrupt() wakes it
  CurlEasyPtr easy_;                         // of this connection
  std::optional<MultipartScanner> scanner_;  // of this connection, created with its first bytes
  std::size_t header_bytes_ = 0;             // of this connection's answers
  std::string refusal_;                      // why the body of the answer was rejected
  int useless_in_a_row_ = 0;                 // parts
  int wakes_ = 0;                            // since the last picture
  std::int64_t discarded_ = 0;               // discarded by the scanner, as far as counted
  std::int64_t pictures_ = 0;                // of this connection
  bool worked_ = false;                      // a picture has come on any connection
  // Arrival of the last picture, or start of the connection.
  double last_picture_s_ = 0;
};

}  // namespace alidade
