#include "edge_app/output/http/http_handlers.h"

#include <sys/eventfd.h>

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include "edge_app/output/http/http_connection.h"

namespace alidade {

void HttpHandlers::ask(std::shared_ptr<HttpConnection> connection) {
  waiting_.push_back(std::move(connection));
  hand_over();
}

void HttpHandlers::forget(const HttpConnection* connection) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(),
                                  [&](const auto& one) { return one.get() == connection; });
  if (found != waiting_.end()) waiting_.erase(found);
}

void HttpHandlers::collect() {
  Some answered;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::swap(answered, answered_);
  }
  Connections these;
  for (std::size_t i = 0; i < answered.count; ++i) {
    const auto found = std::find_if(at_work_.begin(), at_work_.end(), [&](const auto& one) {
      return one.get() == answered.which[i];
    });
    these.splice(these.end(), at_work_, found);
  }
  hand_over();
  for (const auto& connection : these) connection->take_answer();
}

void HttpHandlers::hand_over() {
  while (!waiting_.empty() && at_work_.size() < kThreads) {
    at_work_.splice(at_work_.end(), waiting_, next());
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      to_do_.which[to_do_.count++] = at_work_.back().get();
    }
    handed_.notify_one();
  }
}

HttpHandlers::Connections::iterator HttpHandlers::next() {
  const auto rank = [this](const std::shared_ptr<HttpConnection>& one) {
    const HttpClient& client = one->client();
    const auto same = std::count_if(waiting_.begin(), waiting_.end(), [&](const auto& other) {
      return other->client().address == client.address;
    });
    return std::make_pair(!client.has_token, same);
  };
  auto best = waiting_.begin();
  if (waiting_.size() == 1) return best;
  auto best_rank = rank(*best);
  for (auto one = std::next(best); one != waiting_.end(); ++one) {
    const auto its = rank(*one);
    if (its < best_rank) std::tie(best, best_rank) = std::make_pair(one, its);
  }
  return best;
}

void HttpHandlers::serve() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    handed_.wait(lock, [this] { return ended_ || to_do_.count > 0; });
    if (ended_) return;
    HttpConnection* const connection = to_do_.which[--to_do_.count];
    lock.unlock();
    connection->work();
    lock.lock();
    answered_.which[answered_.count++] = connection;
    static_cast<void>(::eventfd_write(done_, 1));
  }
}

void HttpHandlers::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ended_ = true;
  }
  handed_.notify_all();
}

void HttpHandlers::clear() {
  waiting_.clear();
  at_work_.clear();
}

}  // namespace alidade
