#pragma once
// Requests to the edge executable's HTTP API, and its event stream, by libcurl. The bearer token is
// read for each connection, so that a renewed one is used. It goes only into the Authorization
// header; no error, log or message contains it. Redirections are not followed. All calls block the
// calling thread and end soon after stop().

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

namespace alidade_ros {

struct EdgeAddress {
  std::string url = "http://127.0.0.1:8080";  // without a path; a trailing slash is dropped
  std::string token_env;                      // name of an environment variable; empty: none
  std::string token_file;                     // a file whose first line is the token; empty: none
  double connect_timeout_s = 5;
  double silence_timeout_s = 15;  // for the stream, which sends something every few seconds
};

// One line on what is wrong with the address; empty: nothing.
[[nodiscard]] std::string wrong_with(const EdgeAddress& address);

class HttpClient {
 public:
  struct Answer {
    long status = 0;  // 0: no answer
    std::string body;
    std::string error;  // one line; empty: status is 2xx
    [[nodiscard]] bool ok() const { return error.empty(); }
  };

  explicit HttpClient(EdgeAddress address);
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  // Thread-safe. An error after 10 s without data, or if the answer exceeds 16 MiB.
  [[nodiscard]] Answer get(const std::string& path);
  [[nodiscard]] Answer post(const std::string& path, const std::string& json);

  // Reads until the connection ends, silence_timeout_s passes without data, stop() is called, or
  // on_bytes returns false. Calls on_bytes on this thread, and only if the status is 200. Returns
  // one line on why it ended, never empty, even if on_bytes ended it. Thread-safe.
  [[nodiscard]] std::string stream(const std::string& path,
                                   const std::function<bool(const char*, std::size_t)>& on_bytes);

  // Waits; returns early after stop(). Thread-safe.
  void wait(double seconds);

  // Thread-safe, idempotent. All calls, current and later, return soon.
  void stop();
  [[nodiscard]] bool stopped() const;

  [[nodiscard]] const EdgeAddress& address() const { return address_; }

 private:
  class Transfer;
  [[nodiscard]] Answer request(const std::string& path, const std::string* json);

  EdgeAddress address_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;  // guarded by mutex_
};

}  // namespace alidade_ros
