#include "edge_app/output/http/http_tickets.h"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace alidade {

std::optional<std::string> HttpTickets::issue(double now_s) {
  std::array<std::uint64_t, 2> bits{};
  if (::getrandom(bits.data(), sizeof bits, 0) != static_cast<ssize_t>(sizeof bits))
    return std::nullopt;
  const std::string text = fmt::format("{:016x}{:016x}", bits[0], bits[1]);
  const std::lock_guard<std::mutex> lock(mutex_);
  forget_the_old(now_s);
  if (tickets_.size() >= kMost) tickets_.pop_front();
  tickets_.push_back({text, now_s});
  return text;
}

bool HttpTickets::take(const std::string& ticket, double now_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  forget_the_old(now_s);
  const auto found = std::find_if(tickets_.begin(), tickets_.end(),
                                  [&](const Ticket& one) { return one.text == ticket; });
  if (found == tickets_.end()) return false;
  tickets_.erase(found);
  return true;
}

void HttpTickets::forget_the_old(double now_s) {
  while (!tickets_.empty() && now_s > tickets_.front().issued_s + kValidS) tickets_.pop_front();
}

}  // namespace alidade
