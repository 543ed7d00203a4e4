#pragma once
// A client of an HttpServer that sends just what a test tells it to.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <string>

#include "edge_app/output/http/http_server.h"

namespace alidade::test {

class Client {
 public:
  // from: another address of this machine's own network, as 127.0.0.2.
  explicit Client(const HttpServer& server, const std::string& from = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    EXPECT_EQ(::inet_pton(AF_INET, from.c_str(), &address.sin_addr), 1);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0) << from;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const std::string text = server.address();
    address.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(text.substr(text.rfind(':') + 1))));
    EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // The server may have had enough already.
  void send(const std::string& text) {
    static_cast<void>(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL));
  }

  [[nodiscard]] int descriptor() const { return socket_; }

  // It will send nothing more.
  void end() { ::shutdown(socket_, SHUT_WR); }

  // All up to the end of the connection, or until `enough` was seen.
  std::string receive(const std::string& enough = "") {
    std::string text;
    std::array<char, 4096> piece{};
    while (enough.empty() || text.find(enough) == std::string::npos) {
      const ssize_t count = ::recv(socket_, piece.data(), piece.size(), 0);
      if (count <= 0) break;
      text.append(piece.data(), static_cast<std::size_t>(count));
    }
    return text;
  }

 private:
  int socket_;
};

}  // namespace alidade::test
