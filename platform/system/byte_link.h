#pragma once
// ByteLink: bytes to and from a device over a serial line, TCP or UDP, so that a protocol runs over
// any of them. A link can be closed and reopened any number of times (a plug pulled and put back).
// No call waits longer than its timeout, nor longer than 10 s.
//
// Serial: 8 data bits, no parity, 1 stop bit, raw, no flow control; one program at a time. TCP:
// without delay of small packets. UDP: to and from one address; each receive() returns one
// datagram. Used by one thread; stop() may be called from any other and wakes it.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "platform/system/file_descriptor.h"
#include "platform/system/name_lookup.h"

namespace alidade {

struct ByteLinkOptions {
  // /dev/ttyUSB0 (any path), tcp://host:port or udp://host:port, IPv6 addresses in brackets.
  std::string address;
  int baud = 9600;  // serial only
};

enum class LinkStatus {
  kOk,
  kTimeout,
  kStopped,
  kLost,     // not there, refused or gone: may come back; see error()
  kUnusable  // will never work; see error()
};

// True if a serial line can have this speed on this system.
[[nodiscard]] bool is_baud(int baud);

// s; the time of one byte on a serial line; 0 for TCP and UDP.
[[nodiscard]] double wire_time_of_byte_s(const ByteLinkOptions& options);

// True for tcp://host:port or udp://host:port without user, password and path.
[[nodiscard]] bool is_byte_link_url(const std::string& text);

class ByteLink {
 public:
  explicit ByteLink(const ByteLinkOptions& options);
  ByteLink(const ByteLink&) = delete;
  ByteLink& operator=(const ByteLink&) = delete;

  // Starts to open; on failure see error(). After kOk, finish_open() is to be called until its
  // result is not kTimeout, or the caller gives up. A name's look-up goes on over close() and
  // open().
  [[nodiscard]] LinkStatus open();
  [[nodiscard]] LinkStatus finish_open(double timeout_s);
  void close() { line_.reset(); }

  // For a few bytes: if the system does not take all of them at once, the link counts as lost.
  [[nodiscard]] LinkStatus send(std::string_view bytes);

  // Waits for bytes and puts what has come into *bytes, at most 512 bytes. While the link is closed
  // the call only waits.
  [[nodiscard]] LinkStatus receive(std::string* bytes, double timeout_s);

  void stop();  // every later call that could wait returns kStopped

  [[nodiscard]] bool is_datagram() const { return kind_ == Kind::kUdp; }
  // What is wrong, without the link's name. Valid after kLost, kUnusable and finish_open().
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] const std::string& name() const { return options_.address; }

 private:
  enum class Kind { kSerial, kTcp, kUdp, kNone };

  LinkStatus open_serial();
  LinkStatus connect_socket();
  LinkStatus wait(int descriptor, short events, double timeout_s);
  LinkStatus lost(const std::string& error);

  ByteLinkOptions options_;
  Kind kind_ = Kind::kNone;
  std::optional<NameLookup> host_;  // TCP and UDP
  std::size_t tries_ = 0;
  FileDescriptor line_;  // or socket
  FileDescriptor stop_;  // readable for good once stop() was called
  std::string error_;
};

}  // namespace alidade
