// The server against clients that behave, and against those that do not: over real sockets.

#include "edge_app/output/http/http_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "platform/system/clock.h"
#include "test/edge_app/output/http_client.h"

namespace alidade {
namespace {

using test::Client;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

ServerResponse plain(const std::string& body) {
  ServerResponse response;
  response.type = "text/plain";
  response.body = body;
  return response;
}

ServerResponse endless(std::unique_ptr<HttpStream> stream) {
  ServerResponse response;
  response.type = "text/event-stream";
  response.stream = std::move(stream);
  return response;
}

class Flood final : public HttpStream {
 public:
  void next(std::string* piece) override { piece->append(4096, 'x'); }
};

// "begun", and then what has been said since.
class Words final : public HttpStream {
 public:
  explicit Words(std::atomic<int>* said) : said_(*said) {}
  void next(std::string* piece) override {
    if (told_ < 0) *piece += "begun\n";
    for (told_ = std::max(told_, 0); told_ < said_; ++told_) *piece += "word\n";
  }

 private:
  std::atomic<int>& said_;
  int told_ = -1;
};

class HttpServerTest : public ::testing::Test {
 protected:
  void start() {
    server_ = std::make_unique<HttpServer>(options_);
    server_->get("/open", HttpAccess::kOpen, [](const ServerRequest&) { return plain("open"); });
    server_->get("/closed", HttpAccess::kToken, [](const ServerRequest& request) {
      return plain("closed " + request.parameter("name").value_or("-"));
    });
    server_->post("/echo", HttpAccess::kToken, 100,
                  [](const ServerRequest& request) { return plain("echo " + request.body); });
    server_->get("/scheduling", HttpAccess::kOpen, [](const ServerRequest&) {
      return plain("policy " + std::to_string(::sched_getscheduler(0)) + ", nice " +
                   std::to_string(::getpriority(PRIO_PROCESS, 0)));
    });
    server_->get("/throw", HttpAccess::kOpen, [](const ServerRequest&) -> ServerResponse {
      throw std::runtime_error("secret");
    });
    server_->get("/flood", HttpAccess::kOpen,
                 [](const ServerRequest&) { return endless(std::make_unique<Flood>()); });
    server_->get("/wait", HttpAccess::kOpen, [this](const ServerRequest&) {
      return endless(std::make_unique<Words>(&words_));
    });
    server_->get("/stream", HttpAccess::kStream, [this](const ServerRequest&) {
      return endless(std::make_unique<Words>(&words_));
    });
    server_->get("/late", HttpAccess::kOpen,
                 [this](const ServerRequest& request) -> std::optional<ServerResponse> {
                   ++asked_;
                   if (request.waited_s < late_s_) return std::nullopt;
                   return plain("late");
                 });
    std::string error;
    ASSERT_TRUE(server_->start(&error)) << error;
  }

  std::string ask(const std::string& request) {
    Client client(*server_);
    client.send(request);
    return client.receive();
  }

  std::string get(const std::string& path, const std::string& headers = "") {
    return ask("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
  }

  std::string post(const std::string& body, const std::string& headers = "") {
    return ask("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
               std::to_string(body.size()) + "\r\n" + headers + "\r\n" + body);
  }

  // Each by itself: when the server has answered somebody who came later, it has taken the byte.
  void send_bytes(Client* client, const std::string& text) {
    for (const char byte : text) {
      client->send(std::string(1, byte));
      EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
    }
  }

  // Waits for an event; the test's own time-out is the deadline.
  template <typename Condition>
  static void wait_until(const Condition& condition) {
    while (!condition()) std::this_thread::yield();
  }

  HttpServerOptions options_;
  std::atomic<int> words_{0};
  std::atomic<int> asked_{0};
  double late_s_ = 0;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpServerTest, AnswersTheRoutesThatThereAreAndSaysWhichThereAreNot) {
  start();
  EXPECT_THAT(get("/open"), AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("\r\n\r\nopen")));
  EXPECT_THAT(get("/closed?name=a%20b"), EndsWith("\r\n\r\nclosed a b"));
  EXPECT_THAT(post("hello"), AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("\r\n\r\necho hello")));
  EXPECT_THAT(get("/nothing"), AllOf(StartsWith("HTTP/1.1 404 "), HasSubstr("application/json"),
                                     HasSubstr("{\"error\":\"no such path")));
  EXPECT_THAT(get("/echo"), AllOf(StartsWith("HTTP/1.1 405 "), HasSubstr("Allow: POST")));
  const std::string head = ask("HEAD /open HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_THAT(head, AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("\r\n\r\n")));
  EXPECT_EQ(server_->counters().requests, 6);
  EXPECT_EQ(server_->counters().refused, 0);
}

TEST_F(HttpServerTest, WantsTheTokenWhereARouteIsNotOpen) {
  options_.token = "right-horse";
  start();
  EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(get("/closed"),
              AllOf(StartsWith("HTTP/1.1 401 "), HasSubstr("WWW-Authenticate: Bearer"),
                    Not(HasSubstr("right-horse"))));
  for (const char* wrong : {"Bearer right-hors", "Bearer right-horse2", "Bearer wrong-horse",
                            "Bearer ", "Bearer", "bearer right-horse", "Basic right-horse",
                            "right-horse", "Bearer right-horseright-horse"}) {
    EXPECT_THAT(get("/closed", std::string("Authorization: ") + wrong + "\r\n"),
                StartsWith("HTTP/1.1 401 "))
        << wrong;
  }
  EXPECT_THAT(post("x"), StartsWith("HTTP/1.1 401 "));
  EXPECT_EQ(server_->counters().unauthorized, 11);
  EXPECT_THAT(get("/closed", "Authorization: Bearer right-horse\r\n"), StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpServerTest, RefusesABodyBeforeItReadsIt) {
  start();
  EXPECT_THAT(post(std::string(100, 'x')), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(post(std::string(101, 'x')), StartsWith("HTTP/1.1 413 "));
  const std::string begin = "POST /echo HTTP/1.1\r\nHost: localhost\r\n";
  for (const char* huge : {"1000000000", "99999999999999999999999999"}) {
    EXPECT_THAT(ask(begin + "Content-Length: " + huge + "\r\n\r\n"), StartsWith("HTTP/1.1 413 "));
  }
  for (const char* wrong : {"-1", "+5", "0x10", "5 5"}) {
    EXPECT_THAT(ask(begin + "Content-Length: " + wrong + "\r\n\r\n"), StartsWith("HTTP/1.1 400 "))
        << wrong;
  }
  EXPECT_THAT(ask(begin + "Transfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n"),
              StartsWith("HTTP/1.1 411 "));
  EXPECT_THAT(ask(begin + "Content-Length: 5\r\nContent-Length: 6\r\n\r\nhello"),
              StartsWith("HTTP/1.1 411 "));
  EXPECT_THAT(post("hello", "Content-Encoding: gzip\r\n"), StartsWith("HTTP/1.1 415 "));
  EXPECT_THAT(ask(begin + "\r\n"), EndsWith("\r\n\r\necho "));  // no length: no body
}

TEST_F(HttpServerTest, DropsAHeadThatIsLateOrTooLarge) {
  options_.limits.head_timeout_s = 0.1;
  start();
  Client silent(*server_);
  EXPECT_EQ(silent.receive(), "");
  Client late(*server_);
  late.send("GET /open HTTP/1.1\r\nHost:");
  EXPECT_THAT(late.receive(), StartsWith("HTTP/1.1 408 "));
  options_.limits.head_timeout_s = 60;
  start();
  EXPECT_THAT(get("/open", "X: " + std::string(8192, 'x') + "\r\n"), StartsWith("HTTP/1.1 431 "));
  EXPECT_THAT(get("/" + std::string(8192, 'x')), StartsWith("HTTP/1.1 431 "));
}

TEST_F(HttpServerTest, DropsABodyThatIsLate) {
  options_.limits.body_timeout_s = 0.1;
  start();
  EXPECT_THAT(ask("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 50\r\n\r\nshort"),
              StartsWith("HTTP/1.1 400 "));
}

// Wherever a head is cut, its end is found.
TEST_F(HttpServerTest, TakesAHeadByteByByte) {
  start();
  for (const std::string headers : {"Host: localhost\r\n", ""}) {
    Client client(*server_);
    send_bytes(&client, "GET /closed?name=slow HTTP/1.1\r\n" + headers + "\r\n");
    EXPECT_THAT(client.receive(), AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("closed slow")));
  }
}

TEST_F(HttpServerTest, AHeadThatDripsIsLateAllTheSame) {
  options_.limits.head_timeout_s = 0.1;
  start();
  Client client(*server_);
  std::atomic<bool> answered{false};
  std::thread dripping([&] {
    client.send("GET /open HTTP/1.1\r\nX: ");
    while (!answered) {
      client.send("x");
      std::this_thread::yield();
    }
  });
  // It may be that the limit of its size is met first.
  EXPECT_THAT(client.receive("\r\n\r\n"), ::testing::ContainsRegex("^HTTP/1.1 4(08|31) "));
  answered = true;
  dripping.join();
}

TEST_F(HttpServerTest, TakesABodyByteByByte) {
  start();
  Client client(*server_);
  client.send("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 20\r\n\r\n01234");
  send_bytes(&client, "56789abcdefghij");
  EXPECT_THAT(client.receive(), EndsWith("\r\n\r\necho 0123456789abcdefghij"));
}

TEST_F(HttpServerTest, SaysThatABodyMayComeOnlyWhereItIsWanted) {
  start();
  const std::string head = "POST /echo HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\n";
  Client client(*server_);
  client.send(head + "Content-Length: 5\r\n\r\n");
  EXPECT_EQ(client.receive("\r\n\r\n"), "HTTP/1.1 100 Continue\r\n\r\n");
  client.send("hello");
  EXPECT_THAT(client.receive(), AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("echo hello")));
  EXPECT_THAT(ask(head + "Content-Length: 101\r\n\r\n"), StartsWith("HTTP/1.1 413 "));
  // Who does not wait for it is not told.
  EXPECT_THAT(ask(head + "Content-Length: 5\r\n\r\nhello"), StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpServerTest, AClientThatHasSaidAllMayCloseItsHalf) {
  start();
  Client client(*server_);
  client.send("GET /open HTTP/1.1\r\nHost: localhost\r\n\r\n");
  client.end();
  EXPECT_THAT(client.receive(), EndsWith("\r\n\r\nopen"));
  Client follower(*server_);
  follower.send("GET /wait HTTP/1.1\r\nHost: localhost\r\n\r\n");
  follower.end();
  follower.receive("begun\n");
  ++words_;
  server_->wake();
  EXPECT_EQ(follower.receive("word\n"), "word\n");
  Client cut(*server_);
  cut.send("GET /open HTTP/1.1\r\nHost:");
  cut.end();
  EXPECT_EQ(cut.receive(), "");
  Client short_of(*server_);
  short_of.send("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 50\r\n\r\nshort");
  short_of.end();
  EXPECT_THAT(short_of.receive(), StartsWith("HTTP/1.1 400 "));
}

TEST_F(HttpServerTest, HeadHasTheHeadersOfGetAndNoBody) {
  start();
  EXPECT_THAT(ask("HEAD /open HTTP/1.1\r\nHost: localhost\r\n\r\n"),
              AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), HasSubstr("Content-Length: 4\r\n"),
                    HasSubstr("Content-Type: text/plain\r\n"), EndsWith("\r\n\r\n")));
  EXPECT_THAT(ask("HEAD /flood HTTP/1.1\r\nHost: localhost\r\n\r\n"),
              AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), EndsWith("\r\n\r\n")));
  EXPECT_THAT(ask("HEAD /nothing HTTP/1.1\r\nHost: localhost\r\n\r\n"),
              AllOf(StartsWith("HTTP/1.1 404 "), EndsWith("\r\n\r\n")));
  EXPECT_EQ(server_->counters().streams, 0);
}

TEST_F(HttpServerTest, OtherMethodsAreNotAllowedAndThoseThatAreAreNamed) {
  start();
  for (const char* method : {"PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT", "POST"}) {
    EXPECT_THAT(ask(std::string(method) + " /open HTTP/1.1\r\nHost: localhost\r\n\r\n"),
                AllOf(StartsWith("HTTP/1.1 405 "), HasSubstr("Allow: GET, HEAD\r\n")))
        << method;
  }
  for (const char* method : {"QUERY", "BREW", "get"}) {
    EXPECT_THAT(ask(std::string(method) + " /echo HTTP/1.1\r\nHost: localhost\r\n\r\n"),
                AllOf(StartsWith("HTTP/1.1 405 "), HasSubstr("Allow: POST\r\n")))
        << method;
  }
  for (const char* method : {"G@T", ""}) {
    EXPECT_THAT(ask(std::string(method) + " /open HTTP/1.1\r\nHost: localhost\r\n\r\n"),
                StartsWith("HTTP/1.1 400 "))
        << method;
  }
}

TEST_F(HttpServerTest, AHandlerWithoutAnAnswerIsAskedAgainUntilItHasOne) {
  late_s_ = 0.05;
  start();
  Client client(*server_);
  client.send("GET /late HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_THAT(client.receive(), EndsWith("\r\n\r\nlate"));
  EXPECT_GT(asked_, 1);
}

// Whether for an answer, for news or for their own request.
TEST_F(HttpServerTest, ThoseWhoWaitTakeNoThread) {
  late_s_ = 1e4;
  constexpr int kEach = 100;
  options_.limits.max_strangers = 1000;
  options_.limits.max_streams = kEach;
  start();
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < kEach; ++i) {
    for (const char* path : {"/late", "/wait"}) {
      clients.push_back(std::make_unique<Client>(*server_));
      clients.back()->send(std::string("GET ") + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    }
    clients.push_back(std::make_unique<Client>(*server_));
  }
  wait_until([this] { return server_->counters().connections == 3 * kEach; });
  wait_until([this] { return server_->counters().streams == kEach; });
  wait_until([this] { return asked_ >= kEach; });
  EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
  const auto threads = std::distance(std::filesystem::directory_iterator("/proc/self/task"), {});
  EXPECT_LT(threads, 10);
  server_->stop();
  EXPECT_EQ(server_->counters().connections, 0);
}

TEST_F(HttpServerTest, AnEndlessAnswerGoesOnWhenItIsWoken) {
  start();
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < 5; ++i) {
    clients.push_back(std::make_unique<Client>(*server_));
    clients.back()->send("GET /wait HTTP/1.1\r\nHost: localhost\r\n\r\n");
    clients.back()->receive("begun\n");
  }
  for (int i = 0; i < 100; ++i) {
    ++words_;
    server_->wake();
    for (const auto& client : clients) EXPECT_EQ(client->receive("word\n"), "word\n");
  }
  server_->stop();
  server_->wake();  // nobody is left, and nothing happens
  EXPECT_EQ(clients[0]->receive(), "");
}

TEST_F(HttpServerTest, BeyondTheLimitTheOldestConnectionGivesWay) {
  options_.limits.max_strangers = 2;
  options_.limits.head_timeout_s = 60;
  start();
  {
    Client first(*server_);
    Client second(*server_);
    wait_until([this] { return server_->counters().connections == 2; });
    EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
    EXPECT_THAT(first.receive(), StartsWith("HTTP/1.1 503 "));
    EXPECT_EQ(server_->counters().refused, 1);
  }
  wait_until([this] { return server_->counters().connections == 0; });
  EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpServerTest, RefusesStreamsBeyondTheLimit) {
  options_.limits.max_streams = 1;
  start();
  Client first(*server_);
  first.send("GET /wait HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_THAT(first.receive("begun\n"), StartsWith("HTTP/1.1 200 "));
  EXPECT_EQ(server_->counters().streams, 1);
  EXPECT_THAT(get("/wait"), StartsWith("HTTP/1.1 503 "));
  EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpServerTest, RefusesRequestsThatComeTooFast) {
  options_.limits.requests_per_s = 1e-6;  // the first, and none for days
  start();
  EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 429 "));
  EXPECT_THAT(get("/closed"), StartsWith("HTTP/1.1 429 "));
  EXPECT_EQ(server_->counters().refused, 2);
}

TEST_F(HttpServerTest, DropsAReaderOfAStreamThatTakesNothing) {
  options_.limits.write_timeout_s = 0.1;
  start();
  Client stalled(*server_);
  stalled.send("GET /flood HTTP/1.1\r\nHost: localhost\r\n\r\n");
  wait_until([this] { return server_->counters().stalled == 1; });
  EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
  wait_until([this] { return server_->counters().streams == 0; });
}

TEST_F(HttpServerTest, AReaderThatGoesAwayEndsItsStream) {
  start();
  {
    Client client(*server_);
    client.send("GET /flood HTTP/1.1\r\nHost: localhost\r\n\r\n");
    client.receive("xxxx");
  }
  wait_until([this] { return server_->counters().connections == 0; });
  EXPECT_EQ(server_->counters().streams, 0);
  EXPECT_EQ(server_->counters().stalled, 0);
}

TEST_F(HttpServerTest, StoppingEndsStreamsAndSilentAndStalledConnections) {
  options_.limits.head_timeout_s = 1e4;
  options_.limits.write_timeout_s = 1e4;
  start();
  Client waiting(*server_);
  waiting.send("GET /wait HTTP/1.1\r\nHost: localhost\r\n\r\n");
  waiting.receive("begun\n");
  Client stalled(*server_);
  stalled.send("GET /flood HTTP/1.1\r\nHost: localhost\r\n\r\n");
  Client silent(*server_);
  Client sending(*server_);
  sending.send("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 50\r\n\r\nshort");
  wait_until([this] { return server_->counters().streams == 2; });
  server_->stop();
  EXPECT_EQ(waiting.receive(), "");
  EXPECT_EQ(silent.receive(), "");
}

// Whatever the thread that starts it runs as.
TEST_F(HttpServerTest, ItsThreadsRunAtTheNormalPolicyAndNiced) {
  std::thread starter([this] {
    sched_param parameters{};
    parameters.sched_priority = 1;
    // Where that is not permitted there is less to inherit.
    static_cast<void>(::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters));
    start();
  });
  starter.join();
  EXPECT_THAT(get("/scheduling"), EndsWith("\r\n\r\npolicy 0, nice 10"));
}

TEST_F(HttpServerTest, APageOfAnotherSiteCanAskNothing) {
  start();
  for (const char* foreign : {"http://evil.example", "https://localhost", "http://localhost:1",
                              "http://localhost.evil.example", "null"}) {
    const std::string origin = std::string("Origin: ") + foreign + "\r\n";
    EXPECT_THAT(post("x", origin), StartsWith("HTTP/1.1 403 ")) << foreign;
    EXPECT_THAT(get("/closed", origin), StartsWith("HTTP/1.1 403 ")) << foreign;
    EXPECT_THAT(get("/open", origin), StartsWith("HTTP/1.1 403 ")) << foreign;
  }
  EXPECT_THAT(post("x", "Origin: http://localhost\r\n"), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(get("/closed", "Origin: http://localhost\r\n"), StartsWith("HTTP/1.1 200 "));
}

// What browsers send for <img>, <script> or a fetch without CORS in a page of another site: over HTTPS or to this machine,
// over plain HTTP, and with all that the page can leave out.
constexpr const char* kForeignRequests[] = {
    "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: no-cors\r\nSec-Fetch-Dest: image\r\n",
    "User-Agent: Mozilla/5.0 (X11; Linux x86_64)\r\nReferer: http://evil.example/\r\n",
    "user-agent: Mozilla/5.0\r\nAccept: */*\r\n",
    "Accept: image/avif,image/webp,*/*;q=0.8\r\n",
    "Accept: text/html\r\n",
    "Accept-Language: de\r\n",
    "Cookie: a=b\r\n",
    "Sec-CH-UA: \"x\"\r\n",
    "Upgrade-Insecure-Requests: 1\r\n"};

TEST_F(HttpServerTest, APageOfAnotherSiteOpensNoStream) {
  options_.limits.requests_per_s = 1e4;
  start();
  for (const char* headers : kForeignRequests) {
    for (const char* path : {"/stream", "/stream?ticket=", "/stream?ticket=0123456789abcdef"})
      EXPECT_THAT(get(path, headers), StartsWith("HTTP/1.1 403 ")) << path << ": " << headers;
  }
  EXPECT_EQ(server_->counters().streams, 0);
  for (const char* headers : {"User-Agent: curl/7.88.1\r\nAccept: */*\r\n", "",
                              "User-Agent: python-requests/2.28\r\nAccept-Encoding: gzip\r\n"}) {
    Client client(*server_);
    client.send(std::string("GET /stream HTTP/1.1\r\nHost: 192.0.2.1\r\n") + headers + "\r\n");
    EXPECT_THAT(client.receive("begun\n"), StartsWith("HTTP/1.1 200 ")) << headers;
  }
}

TEST_F(HttpServerTest, ATicketOpensOneStreamWithinSomeSeconds) {
  start();
  const double now_s = monotonic_now_s();
  const auto stream = [this](const std::string& ticket) {
    Client client(*server_);
    client.send("GET /stream?ticket=" + ticket + " HTTP/1.1\r\nHost: localhost\r\n" +
                kForeignRequests[1] + "\r\n");
    return client.receive("\n");
  };
  const std::string ticket = server_->tickets().issue(now_s);
  EXPECT_THAT(stream(ticket), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(stream(ticket), StartsWith("HTTP/1.1 403 ")) << "used";
  const std::string old = server_->tickets().issue(now_s - HttpTickets::kValidS - 1);
  EXPECT_THAT(stream(old), StartsWith("HTTP/1.1 403 "));
}

// A link on another site's page may lead to the status page; what that page embeds is refused.
TEST_F(HttpServerTest, WhatABrowserSaysIsOfAnotherSiteIsRefusedButForALink) {
  start();
  for (const char* site : {"cross-site", "same-site"}) {
    const std::string from = std::string("Sec-Fetch-Site: ") + site + "\r\n";
    for (const char* how : {"Sec-Fetch-Mode: no-cors\r\nSec-Fetch-Dest: image\r\n",
                            "Sec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: iframe\r\n", ""})
      EXPECT_THAT(get("/closed", from + how), StartsWith("HTTP/1.1 403 ")) << how;
    EXPECT_THAT(get("/open", from + "Sec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: document\r\n"),
                StartsWith("HTTP/1.1 200 "));
  }
  for (const char* site : {"same-origin", "none"})
    EXPECT_THAT(get("/closed", std::string("Sec-Fetch-Site: ") + site + "\r\n"),
                StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpServerTest, WithATokenABrowserNeedsNoTicket) {
  options_.token = "right-horse";
  start();
  EXPECT_THAT(get("/stream", kForeignRequests[1]), StartsWith("HTTP/1.1 401 "));
  Client client(*server_);
  client.send(std::string("GET /stream HTTP/1.1\r\nHost: localhost\r\n"
                          "Authorization: Bearer right-horse\r\n") +
              kForeignRequests[2] + "\r\n");
  EXPECT_THAT(client.receive("begun\n"), StartsWith("HTTP/1.1 200 "));
}

TEST(HttpTickets, AreNeverTheSameAndTheOldestGoFirst) {
  HttpTickets tickets;
  const std::string first = tickets.issue(0);
  const std::string second = tickets.issue(0);
  EXPECT_NE(first, second);
  EXPECT_EQ(first.size(), 32U);
  for (std::size_t i = 1; i < HttpTickets::kMost; ++i) static_cast<void>(tickets.issue(1));
  EXPECT_FALSE(tickets.take(first, 1));
  EXPECT_TRUE(tickets.take(second, 1));
  EXPECT_FALSE(tickets.take("", 1));
}

TEST_F(HttpServerTest, BehindAProxyWithTlsThePageWithTheTokenMayAsk) {
  options_.token = "right-horse";
  start();
  const auto post_from = [this](const std::string& origin) {
    return ask("POST /echo HTTP/1.1\r\nHost: camera.example\r\nOrigin: " + origin +
               "\r\nAuthorization: Bearer right-horse\r\nContent-Length: 1\r\n\r\nx");
  };
  EXPECT_THAT(post_from("https://camera.example"), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(post_from("https://evil.example"), StartsWith("HTTP/1.1 403 "));
}

TEST_F(HttpServerTest, WithoutATokenAHostThatIsAForeignNameIsRefused) {
  start();
  const auto ask_as = [this](const std::string& host, const std::string& headers = "") {
    return ask("GET /open HTTP/1.1\r\nHost: " + host + "\r\n" + headers + "\r\n");
  };
  for (const char* own : {"localhost", "localhost:8080", "127.0.0.1:8080", "[::1]:8080"}) {
    EXPECT_THAT(ask_as(own), StartsWith("HTTP/1.1 200 ")) << own;
  }
  for (const char* foreign : {"evil.example", "127.0.0.1.evil.example", "localhost.evil.example",
                              "[evil", "[evil]", "[]"}) {
    EXPECT_THAT(ask_as(foreign), StartsWith("HTTP/1.1 403 ")) << foreign;
  }
  options_.token = "right-horse";
  start();
  EXPECT_THAT(ask_as("camera.example"), StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpServerTest, PathTricksLeadNowhere) {
  start();
  for (const char* path :
       {"/../open", "/./open", "//open", "/%2e%2e/open", "/open/", "/open%00", "/open%00.html",
        "/OPEN", "/..%2f..%2fetc/passwd", "/open;x", "/*", "/.*", "/%", "/%zz", "/\xff\xfe"}) {
    EXPECT_THAT(get(path), StartsWith("HTTP/1.1 404 ")) << path;
  }
  EXPECT_THAT(get("http://localhost/open"), StartsWith("HTTP/1.1 4"));
}

TEST_F(HttpServerTest, AnswersOrDropsWhatIsNoHttp) {
  start();
  for (const std::string& garbage :
       {std::string("\r\n\r\n"), std::string("BREW /open HTTP/1.1\r\n\r\n"),
        std::string("GET /open\r\n\r\n"), std::string("GET /open HTTP/9.9\r\n\r\n"),
        std::string("GET  /open  HTTP/1.1\r\n\r\n"),
        std::string("\x16\x03\x01\x02\x00\x01\r\n\r\n", 10),
        std::string("GET /open HTTP/1.1\r\nno colon\r\n: empty\r\nHost\x00: x\r\n\r\n", 51),
        std::string(3000, '\r') + "\r\n\r\n", std::string(2000, '\n') + "\r\n\r\n"}) {
    const std::string answer = ask(garbage);
    if (!answer.empty()) {
      EXPECT_THAT(answer, StartsWith("HTTP/1.1 ")) << garbage;
    }
    EXPECT_THAT(get("/open"), StartsWith("HTTP/1.1 200 "));
  }
}

TEST_F(HttpServerTest, AnswersTheFirstOfPipelinedRequestsAndCloses) {
  start();
  const std::string one = "GET /open HTTP/1.1\r\nHost: localhost\r\n\r\n";
  const std::string answer = ask(one + one + "garbage" + one);
  EXPECT_THAT(answer, AllOf(StartsWith("HTTP/1.1 200 "), HasSubstr("Connection: close"),
                            EndsWith("\r\n\r\nopen")));
  EXPECT_EQ(answer.find("HTTP/1.1", 1), std::string::npos);
}

TEST_F(HttpServerTest, IgnoresALongRange) {
  start();
  std::string ranges = "Range: bytes=0-0";
  while (ranges.size() < 7900) ranges += ",0-0";
  EXPECT_THAT(get("/open", ranges + "\r\n"),
              AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("\r\n\r\nopen")));
}

TEST_F(HttpServerTest, AHandlerThatThrowsIsAnInternalErrorThatTellsNothing) {
  start();
  EXPECT_THAT(get("/throw"), AllOf(StartsWith("HTTP/1.1 500 "), HasSubstr("internal error"),
                                   Not(HasSubstr("secret"))));
}

TEST_F(HttpServerTest, SaysThatThePortIsTaken) {
  start();
  const std::string address = server_->address();
  HttpServerOptions same = options_;
  same.port = std::stoi(address.substr(address.rfind(':') + 1));
  HttpServer second(same);
  std::string error;
  EXPECT_FALSE(second.start(&error));
  EXPECT_EQ(error, "HTTP: cannot listen on " + address +
                       ": Address already in use; another program does, choose another port");
}

TEST_F(HttpServerTest, SaysThatTheAddressIsNotOfThisMachine) {
  options_.host = "192.0.2.1";
  HttpServer server(options_);
  std::string error;
  EXPECT_FALSE(server.start(&error));
  EXPECT_THAT(error, StartsWith("HTTP: cannot listen on 192.0.2.1:0: "));
}

TEST_F(HttpServerTest, SaysThatTheHostIsNotFound) {
  options_.host = "no name";
  HttpServer server(options_);
  std::string error;
  EXPECT_FALSE(server.start(&error));
  EXPECT_THAT(error, AllOf(StartsWith("HTTP: cannot listen on no name:0: the host is not found: "),
                           EndsWith("; give an address of this machine")));
}

TEST_F(HttpServerTest, DoesNotWaitForAnAddress) {
  HttpServer server(options_);
  std::string error;
  EXPECT_TRUE(server.start([](int, double) { return false; }, &error)) << error;
}

TEST(HttpError, IsOneLineOfJsonWhateverTheTextHolds) {
  const ServerResponse response = http_error(400, "a \"quote\"\nand \xff");
  EXPECT_EQ(response.status, 400);
  EXPECT_EQ(response.type, "application/json");
  EXPECT_EQ(response.body, "{\"error\":\"a \\\"quote\\\"\\nand \\ufffd\"}\n");
}

}  // namespace
}  // namespace alidade
