#pragma once
// HttpHandlers: the handlers' threads, and the order of requests: first those with a token, then
// those of the address with the fewest waiting requests, then the oldest. Nothing is allocated
// between the threads, so a hand-over cannot fail. All functions except serve() and stop() are for
// the network thread.

#include <array>
#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>

namespace alidade {

class HttpConnection;

class HttpHandlers {
 public:
  // Two, so that one long computation does not hold up all others.
  static constexpr int kThreads = 2;

  // done: an eventfd that is written when a request was answered.
  explicit HttpHandlers(int done) : done_(done) {}
  HttpHandlers(const HttpHandlers&) = delete;
  HttpHandlers& operator=(const HttpHandlers&) = delete;

  void ask(std::shared_ptr<HttpConnection> connection);
  // Removes a connection that still waits.
  void forget(const HttpConnection* connection);
  // Continues the connections whose requests were answered.
  void collect();

  // To be called on kThreads threads; returns after stop().
  void serve();
  void stop();
  // Only when no thread serves any more.
  void clear();

 private:
  // A list of fixed size for connections at work; guarded by mutex_.
  struct Some {
    std::array<HttpConnection*, kThreads> which{};
    std::size_t count = 0;
  };
  using Connections = std::list<std::shared_ptr<HttpConnection>>;

  void hand_over();
  [[nodiscard]] Connections::iterator next();

  const int done_;
  Connections waiting_;  // oldest first
  Connections at_work_;

  std::mutex mutex_;
  std::condition_variable handed_;
  Some to_do_;
  Some answered_;
  bool ended_ = false;
};

}  // namespace alidade
