// The VAPIX server seen by libcurl, which polls as a camera's user would.
#include "test/simulator/servers/vapix_server.h"

#include <curl/curl.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "test/simulator/servers/av_client.h"

namespace alidade {
namespace {

struct Answer {
  CURLcode code = CURLE_OK;
  long status = 0;
  long new_connections = 0;
  std::string type;
  std::string body;
  double sent_s = 0;
  double received_s = 0;
};

// One easy handle, kept: connection and digest nonce live as long as the object.
class Poller {
 public:
  explicit Poller(int port, const std::string& login = "")
      : base_("http://127.0.0.1:" + std::to_string(port)), curl_(curl_easy_init()) {
    curl_easy_setopt(curl_.get(), CURLOPT_WRITEFUNCTION, &Poller::append);
    curl_easy_setopt(curl_.get(), CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl_.get(), CURLOPT_NOPROXY, "*");
    set_timeout_ms(30000);
    if (!login.empty()) {
      curl_easy_setopt(curl_.get(), CURLOPT_HTTPAUTH, CURLAUTH_DIGEST);
      curl_easy_setopt(curl_.get(), CURLOPT_USERPWD, login.c_str());
    }
  }

  void set_timeout_ms(long timeout) { curl_easy_setopt(curl_.get(), CURLOPT_TIMEOUT_MS, timeout); }

  Answer get(const std::string& target) {
    Answer answer;
    curl_easy_setopt(curl_.get(), CURLOPT_URL, (base_ + target).c_str());
    curl_easy_setopt(curl_.get(), CURLOPT_WRITEDATA, &answer.body);
    answer.sent_s = monotonic_s();
    answer.code = curl_easy_perform(curl_.get());
    answer.received_s = monotonic_s();
    curl_easy_getinfo(curl_.get(), CURLINFO_RESPONSE_CODE, &answer.status);
    curl_easy_getinfo(curl_.get(), CURLINFO_NUM_CONNECTS, &answer.new_connections);
    const char* type = nullptr;
    curl_easy_getinfo(curl_.get(), CURLINFO_CONTENT_TYPE, &type);
    if (type != nullptr) answer.type = type;
    return answer;
  }

  Answer query(const std::string& what) { return get("/axis-cgi/com/ptz.cgi?query=" + what); }

 private:
  static std::size_t append(char* data, std::size_t size, std::size_t count, void* body) {
    static_cast<std::string*>(body)->append(data, size * count);
    return size * count;
  }

  struct Cleanup {
    void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
  };
  const std::string base_;
  std::unique_ptr<CURL, Cleanup> curl_;
};

VapixPosition somewhere(double) { return {51.2891, -46.19144, 1234}; }

constexpr const char* kSomewhere =
    "pan=51.2891\r\ntilt=-46.1914\r\nzoom=1234\r\niris=5000\r\nfocus=5000\r\n"
    "autofocus=on\r\nautoiris=on\r\n";

VapixServerOptions protected_options() {
  VapixServerOptions options;
  options.user = "root";
  options.password = "pass";
  return options;
}

VapixBehaviour with(VapixFault fault) {
  VapixBehaviour behaviour;
  behaviour.fault = fault;
  return behaviour;
}

class VapixServerTest : public testing::Test {
 protected:
  void start(const VapixServerOptions& options, VapixServer::PositionAt position = somewhere) {
    server_ = std::make_unique<VapixServer>(options, std::move(position));
    std::string error;
    ASSERT_TRUE(server_->start(&error)) << error;
  }

  std::unique_ptr<VapixServer> server_;
};

TEST_F(VapixServerTest, AnswersThePositionInDegrees) {
  start({});
  Poller poller(server_->port());
  const Answer answer = poller.query("position");
  EXPECT_EQ(answer.code, CURLE_OK);
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.type, "text/plain");
  EXPECT_EQ(answer.body, kSomewhere);
  EXPECT_EQ(poller.query("position&camera=1").body, kSomewhere);
}

TEST_F(VapixServerTest, AnswersTheLimits) {
  start({});
  const std::string body = Poller(server_->port()).query("limits").body;
  for (const char* line : {"MinPan=-180\r\n", "MaxPan=180\r\n", "MinTilt=-90\r\n", "MaxTilt=90\r\n",
                           "MinZoom=1\r\n", "MaxZoom=9999\r\n"}) {
    EXPECT_NE(body.find(line), std::string::npos) << line;
  }
}

TEST_F(VapixServerTest, ReportsABadQueryUnderStatus200) {
  start({});
  Poller poller(server_->port());
  for (const char* query : {"weather", "", "position&camera=2"}) {
    const Answer answer = poller.query(query);
    EXPECT_EQ(answer.status, 200);
    EXPECT_EQ(answer.body.rfind("Error:", 0), 0U) << answer.body;
  }
  EXPECT_EQ(poller.get("/axis-cgi/other.cgi").status, 404);
}

TEST_F(VapixServerTest, KeepsTheConnection) {
  start({});
  Poller poller(server_->port());
  EXPECT_EQ(poller.query("position").new_connections, 1);
  for (int i = 0; i < 200; ++i) ASSERT_EQ(poller.query("position").new_connections, 0);
  EXPECT_EQ(server_->requests(), 201);
}

TEST_F(VapixServerTest, ChallengesAClientOnce) {
  start(protected_options());
  Poller poller(server_->port(), "root:pass");
  for (int i = 0; i < 20; ++i) {
    const Answer answer = poller.query("position");
    ASSERT_EQ(answer.status, 200);
    ASSERT_EQ(answer.body, kSomewhere);
  }
  EXPECT_EQ(server_->requests(), 21);
  EXPECT_EQ(server_->unauthorized(), 1);
}

TEST_F(VapixServerTest, RefusesAWrongPassword) {
  start(protected_options());
  EXPECT_EQ(Poller(server_->port()).query("position").status, 401);
  EXPECT_EQ(Poller(server_->port(), "root:wrong").query("position").status, 401);
  EXPECT_EQ(Poller(server_->port(), "who:pass").query("position").status, 401);
  EXPECT_EQ(server_->unauthorized(), server_->requests());
}

TEST_F(VapixServerTest, TellsAClientOfItsFormerLifeToAuthenticateAgain) {
  start(protected_options());
  VapixServerOptions options = protected_options();
  options.port = server_->port();
  Poller poller(options.port, "root:pass");
  ASSERT_EQ(poller.query("position").status, 200);
  server_.reset();
  EXPECT_EQ(poller.query("position").code, CURLE_COULDNT_CONNECT);
  start(options);
  EXPECT_EQ(poller.query("position").status, 200);
  EXPECT_EQ(server_->unauthorized(), 1);
}

TEST_F(VapixServerTest, StartsAgainAfterStop) {
  start({});
  VapixServerOptions options;
  options.port = server_->port();
  start(options);
  for (int life = 0; life < 3; ++life) {
    EXPECT_EQ(Poller(server_->port()).query("position").body, kSomewhere);
    server_->stop();
    std::string error;
    ASSERT_TRUE(server_->start(&error)) << error;
    EXPECT_EQ(server_->port(), options.port);
  }
}

TEST_F(VapixServerTest, SaysThatThePortIsTaken) {
  start({});
  VapixServerOptions options;
  options.port = server_->port();
  VapixServer second(options, somewhere);
  std::string error;
  EXPECT_FALSE(second.start(&error));
  EXPECT_NE(error.find("127.0.0.1:" + std::to_string(options.port)), std::string::npos) << error;
}

TEST_F(VapixServerTest, AsksForThePositionWhileTheClientWaits) {
  VapixServerOptions options;
  options.behaviour.delay_s = 0.02;
  options.behaviour.random_delay_s = 0.01;
  std::atomic<double> asked_s{0};
  start(options, [&](double now_s) {
    asked_s = now_s;
    return VapixPosition{};
  });
  Poller poller(server_->port());
  for (int i = 0; i < 10; ++i) {
    const Answer answer = poller.query("position");
    EXPECT_GT(asked_s, answer.sent_s);
    EXPECT_LT(asked_s, answer.received_s);
    EXPECT_GE(answer.received_s - answer.sent_s, 0.02);
  }
}

TEST_F(VapixServerTest, ShowsEachFaultAndRecovers) {
  start(protected_options());
  Poller poller(server_->port(), "root:pass");
  server_->set_behaviour(with(VapixFault::kServerError));
  EXPECT_EQ(poller.query("position").status, 500);
  server_->set_behaviour(with(VapixFault::kErrorBody));
  Answer answer = poller.query("position");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body.rfind("Error:", 0), 0U) << answer.body;
  server_->set_behaviour(with(VapixFault::kWrongContent));
  answer = poller.query("position");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.type, "text/html");
  server_->set_behaviour(with(VapixFault::kDropConnection));
  EXPECT_EQ(poller.query("position").code, CURLE_PARTIAL_FILE);
  server_->set_behaviour(with(VapixFault::kSilence));
  poller.set_timeout_ms(100);
  EXPECT_EQ(poller.query("position").code, CURLE_OPERATION_TIMEDOUT);
  server_->set_behaviour({});
  poller.set_timeout_ms(30000);
  EXPECT_EQ(poller.query("position").body, kSomewhere);
}

TEST_F(VapixServerTest, StopsWhileAClientWaitsForASilentAnswer) {
  VapixServerOptions options;
  options.behaviour.fault = VapixFault::kSilence;
  start(options);
  Answer answer;
  std::thread client([&] { answer = Poller(server_->port()).query("position"); });
  while (server_->requests() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  server_->stop();
  client.join();
  EXPECT_EQ(answer.code, CURLE_PARTIAL_FILE);
}

}  // namespace
}  // namespace alidade
