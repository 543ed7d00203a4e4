#pragma once
// HttpTickets: if no token is set, a page of this server shows a ticket to open an endless answer.
// A page of another site can make a browser ask for a stream, but cannot read a ticket. Each ticket
// has 128 random bits and is for one use within kValidS. Any thread.

#include <cstddef>
#include <deque>
#include <mutex>
#include <string>

namespace alidade {

class HttpTickets {
 public:
  static constexpr double kValidS = 10;
  static constexpr std::size_t kMost = 1024;  // beyond that the oldest is forgotten

  // A new ticket. now_s: s, monotonic.
  [[nodiscard]] std::string issue(double now_s);
  // Whether the ticket was issued, is still valid and was not used before. Uses it up.
  [[nodiscard]] bool take(const std::string& ticket, double now_s);

 private:
  struct Ticket {
    std::string text;
    double issued_s;
  };

  void forget_the_old(double now_s);

  std::mutex mutex_;
  std::deque<Ticket> tickets_;  // oldest first
};

}  // namespace alidade
