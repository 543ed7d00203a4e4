#pragma once
// RawServer: a TCP server on the loopback that does to each connection what the test says, for
// answers that no proper server gives: resets, silence, half answers.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "test/platform/support/eventually.h"

namespace alidade {

class RawServer {
 public:
  // handle gets the open connection, one at a time; the server closes it afterwards.
  explicit RawServer(std::function<void(int)> handle) : handle_(std::move(handle)) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    if (::bind(listener_, generic, size) != 0 || ::listen(listener_, 16) != 0 ||
        ::getsockname(listener_, generic, &size) != 0) {
      throw std::runtime_error("no listening socket");
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
  }

  ~RawServer() {
    closing_ = true;
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
  }
  RawServer(const RawServer&) = delete;
  RawServer& operator=(const RawServer&) = delete;

  int port() const { return port_; }
  int connections() const { return connections_; }
  bool closing() const { return closing_; }

  // The request's line and headers. False once the other side has closed or the server is closing.
  bool read_request(int fd) const {
    std::string request;
    return read_request(fd, &request);
  }

  bool read_request(int fd, std::string* text) const {
    std::string& request = *text;
    request.clear();
    char buffer[2048];
    while (request.find("\r\n\r\n") == std::string::npos) {
      if (!wait_readable(fd)) {
        return false;
      }
      const ssize_t count = ::recv(fd, buffer, sizeof buffer, 0);
      if (count <= 0) {
        return false;
      }
      request.append(buffer, static_cast<std::size_t>(count));
    }
    return true;
  }

  // False: the other side has closed.
  static bool send(int fd, const std::string& bytes) {
    return ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }

  // Says nothing until the other side closes.
  void stay_silent(int fd) const {
    char buffer[2048];
    while (wait_readable(fd) && ::recv(fd, buffer, sizeof buffer, 0) > 0) {
    }
  }

  // What a read without a time-out gives that is stopped once a connection has come.
  template <class Source, class Item>
  auto status_when_stopped(Source& source, Item& item) const {
    std::thread stopper([&] {
      eventually([&] { return connections() > 0; });
      source.stop();
    });
    const auto status = source.read(item, kNever_s);
    stopper.join();
    return status;
  }

  static void reset(int fd) {
    const linger abort{1, 0};
    ::setsockopt(fd, SOL_SOCKET, SO_LINGER, &abort, sizeof abort);
  }

 private:
  bool wait_readable(int fd) const {
    pollfd poll_fd{fd, POLLIN, 0};
    while (!closing_) {
      if (::poll(&poll_fd, 1, 20) > 0) {
        return true;
      }
    }
    return false;
  }

  void serve() {
    while (!closing_) {
      const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (fd >= 0) {
        ++connections_;
        handle_(fd);
        ::close(fd);
      }
    }
  }

  std::function<void(int)> handle_;
  int listener_ = -1;
  int port_ = 0;
  std::atomic<int> connections_{0};
  std::atomic<bool> closing_{false};
  std::thread thread_;
};

// A port on which nobody listens.
inline int unused_port() {
  return RawServer([](int) {}).port();
}

}  // namespace alidade
