// The server where memory or descriptors run out for a moment: clients are lost, and those that come later are served.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <climits>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "test/edge_app/output/http_client.h"

namespace {

thread_local bool is_network_thread = false;
// So many more allocations of that thread succeed, and so many behind them fail.
std::atomic<int> until_failure{INT_MAX};
std::atomic<int> to_fail{0};

bool fails() {
  if (!is_network_thread || until_failure == INT_MAX) return false;
  if (until_failure > 0) {
    --until_failure;
    return false;
  }
  return to_fail > 0 && to_fail-- > 0;
}

}  // namespace

void* operator new(std::size_t size) {
  void* const memory = fails() ? nullptr : std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return fails() ? nullptr : std::malloc(size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace alidade {
namespace {

using test::Client;
using ::testing::EndsWith;
using ::testing::StartsWith;

// Tells which thread is the network's.
class Teller final : public HttpStream {
 public:
  void next(std::string* piece) override {
    is_network_thread = true;
    if (!told_) *piece += "x";
    told_ = true;
  }

 private:
  bool told_ = false;
};

class HttpMemoryTest : public ::testing::Test {
 protected:
  HttpMemoryTest() {
    server_.get("/open", HttpAccess::kOpen, [](const ServerRequest&) { return ServerResponse(); });
    server_.post("/echo", HttpAccess::kOpen, 100000, [](const ServerRequest& request) {
      ServerResponse response;
      response.body = request.body;
      return response;
    });
    server_.get("/stream", HttpAccess::kOpen, [](const ServerRequest&) {
      ServerResponse response;
      response.stream = std::make_unique<Teller>();
      return response;
    });
    std::string error;
    EXPECT_TRUE(server_.start(&error)) << error;
    Client client(server_);
    client.send("GET /stream HTTP/1.1\r\nHost: localhost\r\n\r\n");
    client.receive("x");
  }
  ~HttpMemoryTest() override { until_failure = INT_MAX; }

  void fail(int after, int count) {
    to_fail = count;
    until_failure = after;
  }

  std::string ask(const std::string& request) {
    Client client(server_);
    client.send(request);
    client.end();
    return client.receive("\r\n\r\n");
  }
  void expect_service() {
    until_failure = INT_MAX;
    EXPECT_THAT(ask(kGet), StartsWith("HTTP/1.1 200 "));
  }

  // What the library had no memory for is waited for up to its deadline.
  static HttpServerOptions impatient() {
    HttpServerOptions options;
    options.limits.head_timeout_s = options.limits.body_timeout_s = 0.1;
    return options;
  }

  const std::string kGet = "GET /open HTTP/1.1\r\nHost: localhost\r\n\r\n";
  HttpServer server_{impatient()};
};

// Wherever in the life of a connection it is.
TEST_F(HttpMemoryTest, AnyAllocationMayFail) {
  const std::string body(50000, 'x');
  const std::string post =
      "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 50000\r\n\r\n";
  for (const std::string& request :
       {kGet, post + body, std::string("GET /stream HTTP/1.1\r\nHost: localhost\r\n\r\n"),
        std::string("GET /nothing HTTP/1.1\r\nHost: localhost\r\n\r\n")}) {
    int after = 0;
    do {
      fail(after++, 1);
      static_cast<void>(ask(request));
    } while (to_fail == 0);
    EXPECT_GT(after, 5) << "not one failed";
    expect_service();
  }
}

TEST_F(HttpMemoryTest, AllMayFailForAMoment) {
  constexpr int kFailures = 30;
  fail(0, kFailures);
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; to_fail > 0; ++i) {
    clients.push_back(std::make_unique<Client>(server_));
    clients.back()->send(i % 2 == 0 ? kGet : kGet.substr(0, 20));
    if (i % 2 == 0) clients.back()->receive();
  }
  expect_service();
  clients.clear();
  // All but the stream that told the thread.
  while (server_.counters().connections > 1) std::this_thread::yield();
}

TEST_F(HttpMemoryTest, DescriptorsMayRunOutForAMoment) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  Client waiting(server_);
  waiting.send("GET /stream HTTP/1.1\r\nHost: localhost\r\n\r\n");
  waiting.receive("x");
  const int next = ::dup(0);
  ::close(next);
  rlimit few = before;
  few.rlim_cur = static_cast<rlim_t>(next + 1);  // one for the client, none for the server
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  Client beyond(server_);
  beyond.send(kGet);
  server_.wake();
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_THAT(beyond.receive(), StartsWith("HTTP/1.1 200 "));
  expect_service();
}

}  // namespace
}  // namespace alidade
