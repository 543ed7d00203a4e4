#include "edge_app/output/http/http_tickets.h"

#include <algorithm>

#include "platform/system/random.h"

namespace alidade {

std::string HttpTickets::issue(double now_s) {
  std::string text = random_hex(32);
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
