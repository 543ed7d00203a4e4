// Many clients at once, most of them hostile: who is served, and who has to leave.

#include "edge_app/output/http/http_fairness.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "test/edge_app/output/http_client.h"

namespace alidade {
namespace {

using test::Client;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr char kWithToken[] = "Authorization: Bearer right-horse\r\n";

HttpAddress address_of(const std::string& text) {
  return http_address(boost::asio::ip::make_address(text));
}

class Silence final : public HttpStream {
 public:
  void next(std::string* piece) override {
    if (!begun_) *piece += "begun\n";
    begun_ = true;
  }

 private:
  bool begun_ = false;
};

class HttpCrowdTest : public ::testing::Test {
 protected:
  HttpCrowdTest() {
    options_.limits.head_timeout_s = options_.limits.body_timeout_s = 1e4;
    options_.limits.max_strangers = options_.limits.max_with_token = 8;
  }
  ~HttpCrowdTest() override { released_ = 1000; }

  void start() {
    server_ = std::make_unique<HttpServer>(options_);
    server_->get("/closed", HttpAccess::kToken,
                 [](const ServerRequest&) { return text("closed"); });
    server_->post("/echo", HttpAccess::kToken, 1000,
                  [](const ServerRequest& request) { return text(request.body); });
    server_->get("/wait", HttpAccess::kToken, [](const ServerRequest&) {
      ServerResponse response;
      response.stream = std::make_unique<Silence>();
      return response;
    });
    server_->get("/busy", HttpAccess::kOpen, [this](const ServerRequest& request) {
      const std::string name = request.parameter("name").value_or("");
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        begun_.push_back(name);
      }
      const int needs = name == "first" ? 1 : name == "second" ? 2 : 0;
      while (released_ < needs) std::this_thread::yield();
      return text(name);
    });
    std::string error;
    ASSERT_TRUE(server_->start(&error)) << error;
  }

  static ServerResponse text(const std::string& body) {
    ServerResponse response;
    response.body = body;
    return response;
  }

  // It stays connected, whatever the server does.
  Client* connect(const std::string& from, const std::string& request) {
    clients_.push_back(std::make_unique<Client>(*server_, from));
    clients_.back()->send(request);
    return clients_.back().get();
  }
  static std::string get(const std::string& path, const std::string& headers = "") {
    return "GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n";
  }
  std::string ask(const std::string& from, const std::string& request) {
    Client client(*server_, from);
    client.send(request);
    return client.receive();
  }

  HttpServerOptions options_;
  std::mutex mutex_;
  std::vector<std::string> begun_;
  std::atomic<int> released_{0};
  std::unique_ptr<HttpServer> server_;
  std::vector<std::unique_ptr<Client>> clients_;
};

TEST_F(HttpCrowdTest, SlowHeadsHoldNobodyUp) {
  options_.token = "right-horse";
  start();
  for (int i = 0; i < 40; ++i) {
    const std::string from = "127.0.0." + std::to_string(1 + i % 20);
    connect(from, "GET /closed HTTP/1.1\r\nX: ");
    EXPECT_THAT(ask("127.0.0.1", get("/closed", kWithToken)), StartsWith("HTTP/1.1 200 "));
  }
  EXPECT_LE(server_->counters().connections, 8);
  EXPECT_THAT(
      clients_.front()->receive(),
      AllOf(StartsWith("HTTP/1.1 503 "), EndsWith("{\"error\":\"too many connections\"}\n")));
}

TEST_F(HttpCrowdTest, WithoutATokenSlowBodiesHoldNobodyUp) {
  start();
  for (int i = 0; i < 40; ++i) {
    connect("127.0.0.2",
            "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 50\r\n\r\nshort");
    EXPECT_THAT(ask("127.0.0.1", get("/closed")), StartsWith("HTTP/1.1 200 "));
  }
  EXPECT_LE(server_->counters().connections, 8);
}

// What is asked only once its body has come takes nothing of the others' rate until then.
TEST_F(HttpCrowdTest, ABodyThatNeverComesTakesNoShareOfTheRate) {
  options_.limits.max_strangers = 200;
  options_.limits.requests_per_s = 1e-6;  // one each, and none for days
  start();
  Client* const slow =
      connect("127.0.0.2", "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\n");
  while (server_->counters().requests < 1) std::this_thread::yield();
  EXPECT_THAT(ask("127.0.0.2", get("/closed")), StartsWith("HTTP/1.1 200 "));
  slow->send("whole");
  EXPECT_THAT(slow->receive(), StartsWith("HTTP/1.1 429 ")) << "now it is asked for";
  // What is refused by its head is asked for at once, whatever body it announces.
  const std::string nowhere =
      "POST /nowhere HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\n";
  EXPECT_THAT(ask("127.0.0.3", nowhere), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(ask("127.0.0.3", nowhere), StartsWith("HTTP/1.1 429 "));
  const std::string large =
      "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5000\r\n\r\n";
  EXPECT_THAT(ask("127.0.0.4", large), StartsWith("HTTP/1.1 413 "));
  EXPECT_THAT(ask("127.0.0.4", large), StartsWith("HTTP/1.1 429 "));
}

// Of the two addresses the one with one slow client keeps it.
TEST_F(HttpCrowdTest, TheAddressThatHoldsMostGivesWay) {
  start();
  const std::string head = "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n";
  Client* const slow = connect("127.0.0.1", head);
  for (int i = 0; i < 40; ++i) connect("127.0.0.2", head);
  EXPECT_THAT(ask("127.0.0.3", get("/closed")), StartsWith("HTTP/1.1 200 "));
  slow->send("here I am");
  EXPECT_THAT(slow->receive(), EndsWith("\r\n\r\nhere I am"));
}

TEST_F(HttpCrowdTest, AFloodOfStrangersTakesNoRequestOfTheTokensOrAnotherAddress) {
  options_.token = "right-horse";
  options_.limits.requests_per_s = 1e-6;  // one each, and none for days
  start();
  EXPECT_THAT(ask("127.0.0.2", get("/closed")), StartsWith("HTTP/1.1 401 "));
  for (int i = 0; i < 5; ++i) {
    EXPECT_THAT(ask("127.0.0.2", get("/closed")),
                AllOf(StartsWith("HTTP/1.1 429 "), HasSubstr("\r\nRetry-After: 1\r\n")));
  }
  EXPECT_THAT(ask("127.0.0.2", get("/closed", kWithToken)), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(ask("127.0.0.3", get("/closed")), StartsWith("HTTP/1.1 401 "));
}

TEST_F(HttpCrowdTest, AnAddressWithManyStreamsGivesSomeToThoseWithFewer) {
  options_.limits.max_streams = 4;
  start();
  for (int i = 0; i < 4; ++i) connect("127.0.0.2", get("/wait"))->receive("begun\n");
  EXPECT_THAT(ask("127.0.0.2", get("/wait")), StartsWith("HTTP/1.1 503 "));
  for (int i = 0; i < 2; ++i)
    EXPECT_THAT(connect("127.0.0.1", get("/wait"))->receive("begun\n"), EndsWith("begun\n"));
  EXPECT_THAT(ask("127.0.0.1", get("/wait")), StartsWith("HTTP/1.1 503 "));
  EXPECT_EQ(clients_[3]->receive(), "") << "its newest have left";
  EXPECT_EQ(clients_[2]->receive(), "");
  EXPECT_EQ(server_->counters().streams, 4);
}

TEST_F(HttpCrowdTest, TheTokenGoesFirstAndThenWhoHasFewestWaiting) {
  options_.token = "right-horse";
  options_.limits.max_strangers = 20;
  start();
  const auto busy = [](const std::string& name) { return get("/busy?name=" + name); };
  connect("127.0.0.2", busy("first"));
  connect("127.0.0.2", busy("second"));
  const auto begun = [this] {
    const std::lock_guard<std::mutex> lock(mutex_);
    return begun_.size();
  };
  while (begun() < 2) std::this_thread::yield();
  for (const char* name : {"a", "b", "c"}) connect("127.0.0.2", busy(name));
  connect("127.0.0.3", busy("another"));
  connect("127.0.0.2", get("/busy?name=token", kWithToken));
  while (server_->counters().requests < 7) std::this_thread::yield();
  EXPECT_THAT(ask("127.0.0.4", get("/nothing")), StartsWith("HTTP/1.1 404 "));  // all are in
  released_ = 1;
  for (const auto& client : clients_) {
    if (client != clients_[1]) {
      EXPECT_THAT(client->receive(), StartsWith("HTTP/1.1 200 "));
    }
  }
  std::vector<std::string> order(begun_.begin() + 2, begun_.end());
  EXPECT_THAT(order, ElementsAre("token", "another", "a", "b", "c"));
}

TEST(HttpAddress, IsAnIpv4AddressOrTheNetworkOfAnIpv6One) {
  EXPECT_EQ(address_of("192.0.2.1"), address_of("::ffff:192.0.2.1"));
  EXPECT_NE(address_of("192.0.2.1"), address_of("192.0.2.2"));
  EXPECT_EQ(address_of("2001:db8:0:1::1"), address_of("2001:db8:0:1:ffff::2"));
  EXPECT_NE(address_of("2001:db8:0:1::1"), address_of("2001:db8:0:2::1"));
}

// In 10 s at so many requests a second each: the share that is served.
double served(FairRate* rate, const std::string& address, int per_s, const std::string& flood,
              int addresses, int flood_per_s) {
  constexpr int kSteps = 100000;
  std::vector<HttpAddress> flooding;
  for (int i = 1; i <= addresses; ++i) flooding.push_back(address_of(flood + std::to_string(i)));
  const HttpAddress honest = address_of(address);
  int asked = 0;
  int taken = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double now_s = 100 + 1e-4 * i;
    for (int k = i * flood_per_s / 10000; k < (i + 1) * flood_per_s / 10000; ++k)
      static_cast<void>(rate->take(flooding[static_cast<std::size_t>(k % addresses)], now_s));
    if (i % (10000 / per_s) != 0) continue;
    ++asked;
    taken += rate->take(honest, now_s) ? 1 : 0;
  }
  return static_cast<double>(taken) / asked;
}

TEST(FairRate, OneThatFloodsTakesNothingFromAnother) {
  for (const int flood_per_s : {717, 10000}) {
    FairRate rate(500);
    EXPECT_EQ(served(&rate, "192.0.2.1", 100, "198.51.100.", 1, flood_per_s), 1) << flood_per_s;
  }
}

TEST(FairRate, ManyThatFloodTakeNothingOfAShare) {
  FairRate rate(500);
  EXPECT_EQ(served(&rate, "192.0.2.1", 8, "198.51.100.", 50, 5000), 1);
}

// 150 addresses that ask for little leave the rest to whoever asks for more than its share.
TEST(FairRate, WhatOthersLeaveIsThereForWhoeverAsks) {
  FairRate rate(500);
  EXPECT_EQ(served(&rate, "192.0.2.1", 100, "198.51.100.", 150, 150), 1);
}

TEST(FairRate, AllTogetherHaveNoMoreThanThereIs) {
  FairRate rate(500);
  int taken = 0;
  for (int i = 0; i < 200000; ++i) {
    const std::string from = "198.51.100." + std::to_string(1 + i % 7);
    taken += rate.take(address_of(from), 1e-4 * i) ? 1 : 0;
  }
  EXPECT_LT(taken, 500 * 21.5);
}

TEST(FairRate, AloneAnAddressHasAllAndNoMore) {
  FairRate rate(500);
  const HttpAddress alone = address_of("192.0.2.1");
  int taken = 0;
  for (int i = 0; i < 20000; ++i) taken += rate.take(alone, 1e-3 * i) ? 1 : 0;
  EXPECT_NEAR(taken, 500 * 21, 5);
}

TEST(FairRate, KeepsNoMoreAddressesApartThanItHasRoomForAndForgetsThem) {
  FairRate rate(500);
  for (int i = 0; i < 5000; ++i)
    static_cast<void>(rate.take(
        address_of("10.0." + std::to_string(i / 250) + "." + std::to_string(i % 250)), 10));
  EXPECT_LE(rate.addresses(), FairRate::kMaxAddresses + 1);
  EXPECT_TRUE(rate.take(address_of("10.0.0.1"), 12));
  EXPECT_EQ(rate.addresses(), 1U);
}

}  // namespace
}  // namespace alidade
