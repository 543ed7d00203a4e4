#pragma once
// ByteLink: bytes to and from a device over a serial line, TCP or UDP, so that one protocol runs on
// each of them. It opens and closes as often as its owner wants (a plug pulled and put back), and
// never waits longer than told.
//
// Serial: 8 data bits, no parity, 1 stop bit, raw, no flow control; one program at a time. TCP:
// without delay of small packets. UDP: from and to the one address, each receive() one datagram.
// One thread uses it; stop() may be called from any other and wakes it. Looking up a host name takes
// what the system's resolver takes: give a numeric address where that matters.

#include <cstddef>
#include <string>
#include <string_view>

#include "platform/system/file_descriptor.h"

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

// Whether a serial line can have this speed here.
[[nodiscard]] bool is_baud(int baud);

// Of one byte on the wire; 0 but for a serial line.
[[nodiscard]] double wire_time_of_byte_s(const ByteLinkOptions& options);

// Whether this is tcp://host:port or udp://host:port, without a user, a password or a path.
[[nodiscard]] bool is_byte_link_url(const std::string& text);

class ByteLink {
 public:
  explicit ByteLink(const ByteLinkOptions& options);
  ByteLink(const ByteLink&) = delete;
  ByteLink& operator=(const ByteLink&) = delete;

  // Begins to open, or says why not. On kOk finish_open() is next.
  [[nodiscard]] LinkStatus open();
  [[nodiscard]] LinkStatus finish_open(double timeout_s);
  void close() { line_.reset(); }

  // The bytes are few: what the system does not take at once counts as a lost link.
  [[nodiscard]] LinkStatus send(std::string_view bytes);

  // Waits for bytes and puts what is there into *bytes, at most 512. While closed it only waits.
  [[nodiscard]] LinkStatus receive(std::string* bytes, double timeout_s);

  void stop();  // every later call that could wait returns kStopped

  [[nodiscard]] bool is_datagram() const { return kind_ == Kind::kUdp; }
  // What is wrong, without the link's name; valid after kLost and kUnusable.
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] const std::string& name() const { return options_.address; }

 private:
  enum class Kind { kSerial, kTcp, kUdp, kNone };

  LinkStatus open_serial();
  LinkStatus open_socket();
  LinkStatus wait(short events, double timeout_s);
  LinkStatus lost(const std::string& error);

  ByteLinkOptions options_;
  Kind kind_ = Kind::kNone;
  std::string host_;
  std::string port_;
  std::size_t tries_ = 0;
  FileDescriptor line_;  // or socket
  FileDescriptor stop_;  // readable for good once stop() was called
  std::string error_;
};

}  // namespace alidade
