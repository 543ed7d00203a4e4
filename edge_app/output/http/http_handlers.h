#pragma once
// HttpHandlers: the handlers' threads, and who is next: requests with the token first, then of the address that
// has the fewest waiting, then the oldest. Nothing is allocated between the threads: a hand-over cannot fail.
// All but serve() and stop() is the network thread's.

#include <array>
#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>

namespace alidade {

class HttpConnection;

class HttpHandlers {
 public:
  // So that one long computation does not hold up all others.
  static constexpr int kThreads = 2;

  // done: an eventfd that is written to when a request was answered.
  explicit HttpHandlers(int done) : done_(done) {}
  HttpHandlers(const HttpHandlers&) = delete;
  HttpHandlers& operator=(const HttpHandlers&) = delete;

  void ask(std::shared_ptr<HttpConnection> connection);
  // One that still waits is not asked for any more.
  void forget(const HttpConnection* connection);
  // Lets those go on whose requests were answered.
  void collect();

  // On kThreads threads, until stop().
  void serve();
  void stop();
  // Once no thread serves.
  void clear();

 private:
  // What a mutex guards, for so many as are at work.
  struct Some {
    std::array<HttpConnection*, kThreads> which{};
    std::size_t count = 0;
  };
  using Connections = std::list<std::shared_ptr<HttpConnection>>;

  void hand_over();
  [[nodiscard]] Connections::iterator next();

  const int done_;
  Connections waiting_;  // the oldest first
  Connections at_work_;

  std::mutex mutex_;
  std::condition_variable handed_;
  Some to_do_;
  Some answered_;
  bool ended_ = false;
};

}  // namespace alidade
