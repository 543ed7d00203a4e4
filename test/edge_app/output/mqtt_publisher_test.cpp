// MqttPublisher against a real mosquitto broker on a port of this machine: what it retains, its last will, its death and return.
#include "edge_app/output/mqtt_publisher.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mosquitto.h>
#include <poll.h>
#include <sys/socket.h>

#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "platform/system/clock.h"
#include "platform/system/file_descriptor.h"
#include "test/platform/support/raw_server.h"
#include "test/platform/support/test_certificate.h"
#include "test/support/process.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kPatience_s = 60;  // only what hangs meets it

int free_port() {
  const FileDescriptor probe(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* any = reinterpret_cast<sockaddr*>(&address);
  if (::bind(probe.get(), any, size) != 0 || ::getsockname(probe.get(), any, &size) != 0)
    throw std::runtime_error("no free port");
  return ntohs(address.sin_port);
}

class Broker {
 public:
  explicit Broker(std::string settings = "allow_anonymous true\n") : port_(free_port()) {
    file_ = directory_.path() + "/mosquitto.conf";
    write("mosquitto.conf",
          "user root\nlistener " + std::to_string(port_) + " 127.0.0.1\n" + std::move(settings));
  }
  // A file for its settings; its path.
  std::string write(const std::string& name, const std::string& text) const {
    const std::string path = directory_.path() + "/" + name;
    std::ofstream(path) << text;
    return path;
  }
  [[nodiscard]] MqttOptions options() const {
    MqttOptions options;
    options.host = "127.0.0.1";
    options.port = port_;
    options.prefix = "site/mast";
    options.max_backoff_s = 0.25;
    return options;
  }
  void start(const MqttOptions& client) {
    process_ = std::make_unique<Process>(std::vector<std::string>{ALIDADE_MOSQUITTO, "-c", file_});
    const double end_s = monotonic_now_s() + kPatience_s;
    std::string error;
    while (!(error = MqttConnection::try_once(client)).empty()) {
      if (monotonic_now_s() > end_s) throw std::runtime_error("no broker: " + error);
      ::poll(nullptr, 0, 10);
    }
  }
  void start() { start(options()); }
  void kill() { process_.reset(); }

 private:
  TemporaryDirectory directory_;
  const int port_;
  std::string file_;
  std::unique_ptr<Process> process_;
};

// A client that has subscribed to all; keeps the last message of each topic.
class Subscriber {
 public:
  struct Message {
    std::string payload;
    bool retained = false;
  };

  explicit Subscriber(const MqttOptions& broker) : client_(mosquitto_new(nullptr, true, this)) {
    mosquitto_message_callback_set(client_, [](mosquitto*, void* self, const auto* message) {
      auto& all = static_cast<Subscriber*>(self)->messages_;
      all[message->topic].push_back({{static_cast<const char*>(message->payload),
                                      static_cast<std::size_t>(message->payloadlen)},
                                     message->retain});
    });
    if (!broker.ca_file.empty())
      mosquitto_tls_set(client_, broker.ca_file.c_str(), nullptr, nullptr, nullptr, nullptr);
    if (!broker.user.empty())
      mosquitto_username_pw_set(client_, broker.user.c_str(), broker.password.c_str());
    const int connected = mosquitto_connect(client_, broker.host.c_str(), broker.port, 60);
    if (connected != MOSQ_ERR_SUCCESS) throw std::runtime_error(mosquitto_strerror(connected));
    mosquitto_subscribe(client_, nullptr, "#", 1);
  }
  ~Subscriber() { mosquitto_destroy(client_); }
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;

  // Until a message with this payload has come; all of the topic up to it.
  std::vector<Message> wait_for(const std::string& topic, const std::string& payload) {
    const auto is_it = [&](const Message& one) { return one.payload == payload; };
    return wait_until(topic, is_it);
  }
  std::vector<Message> wait_until(const std::string& topic,
                                  const std::function<bool(const Message&)>& is_it) {
    const double end_s = monotonic_now_s() + kPatience_s;
    while (messages_[topic].empty() || !is_it(messages_[topic].back())) {
      if (mosquitto_loop(client_, 10, 1) != MOSQ_ERR_SUCCESS || monotonic_now_s() > end_s) {
        ADD_FAILURE() << topic << " did not come";
        return {{}};
      }
    }
    return messages_[topic];
  }

 private:
  mosquitto* client_;
  std::map<std::string, std::vector<Message>> messages_;
};

std::shared_ptr<const std::string> targets(int number) {
  return std::make_shared<const std::string>("{\"frame\": " + std::to_string(number) + "}");
}

template <class Condition>
void wait_until(const Condition& condition) {
  const double end_s = monotonic_now_s() + kPatience_s;
  while (!condition() && monotonic_now_s() < end_s) ::poll(nullptr, 0, 5);
  ASSERT_TRUE(condition());
}

TEST(MqttPublisher, WhoComesLaterHasStatusTargetsAndClock) {
  Broker broker;
  broker.start();
  MqttPublisher publisher(broker.options());
  ASSERT_TRUE(publisher.start());
  wait_until([&] { return publisher.counters().connected; });
  publisher.take_targets(targets(1));
  publisher.take_targets(targets(2));
  wait_until([&] { return publisher.counters().published >= 4; });  // of an earlier run: none
  Subscriber subscriber(broker.options());
  EXPECT_TRUE(subscriber.wait_for("site/mast/targets", "{\"frame\": 2}").back().retained);
  EXPECT_TRUE(subscriber.wait_for("site/mast/status", "online").back().retained);
  const auto any = [](const Subscriber::Message&) { return true; };
  EXPECT_THAT(subscriber.wait_until("site/mast/clock", any).back().payload,
              HasSubstr("\"wall_s\""));
  publisher.stop();
  EXPECT_FALSE(subscriber.wait_for("site/mast/status", "offline").back().retained);
}

TEST(MqttPublisher, TheBrokerSaysOfflineWhenThePublisherDies) {
  Broker broker;
  broker.start();
  Subscriber subscriber(broker.options());
  {
    // As a process that is killed: its socket is closed, and no farewell was said.
    const MqttConnection::Message will{"site/mast/status", "offline", true};
    Errand errand;
    MqttConnection connection(broker.options(), &will, &errand);
    ASSERT_TRUE(connection.begin());
    while (!connection.is_connected()) ASSERT_TRUE(connection.step()) << connection.error();
    int id = 0;
    ASSERT_TRUE(connection.publish("site/mast/status", "online", true, &id));
    bool there = false;
    connection.set_on_published([&](int published) { there = published == id; });
    while (!there) ASSERT_TRUE(connection.step()) << connection.error();
  }
  static_cast<void>(subscriber.wait_for("site/mast/status", "offline"));
  Subscriber later(broker.options());
  EXPECT_TRUE(later.wait_for("site/mast/status", "offline").back().retained);
}

TEST(MqttPublisher, ABrokerThatComesBackHasTheNewestOnly) {
  Broker broker;
  broker.start();
  MqttPublisher publisher(broker.options());
  ASSERT_TRUE(publisher.start());
  wait_until([&] { return publisher.counters().connected; });
  publisher.take_targets(targets(0));
  wait_until([&] { return publisher.counters().published >= 3; });
  broker.kill();
  wait_until([&] { return !publisher.counters().connected; });
  // An hour at 25 frames a second: nobody waits, and nothing is kept but one.
  constexpr int kFrames = 90'000;
  const double begin_s = monotonic_now_s();
  for (int i = 1; i <= kFrames; ++i) publisher.take_targets(targets(i));
  EXPECT_LT(monotonic_now_s() - begin_s, kPatience_s);
  EXPECT_GE(publisher.counters().replaced, kFrames - 2);
  // It has forgotten what it retained.
  broker.start();
  Subscriber subscriber(broker.options());
  const auto seen = subscriber.wait_for("site/mast/targets", *targets(kFrames));
  EXPECT_EQ(seen.size(), 1U);
  static_cast<void>(subscriber.wait_for("site/mast/status", "online"));
  EXPECT_EQ(publisher.counters().connections, 2);
}

TEST(MqttPublisher, TargetsOfAnEarlierRunAreTakenAway) {
  Broker broker;
  broker.start();
  const auto run = [&](const std::shared_ptr<const std::string>& seen, std::int64_t messages) {
    MqttPublisher publisher(broker.options());
    if (seen) publisher.take_targets(seen);
    ASSERT_TRUE(publisher.start());
    wait_until([&] { return publisher.counters().published >= messages; });
    publisher.stop();
  };
  run(targets(7), 3);
  run(nullptr, 3);
  Subscriber subscriber(broker.options());
  static_cast<void>(subscriber.wait_for("site/mast/status", "offline"));
  MqttPublisher publisher(broker.options());
  publisher.take_targets(targets(8));
  ASSERT_TRUE(publisher.start());
  EXPECT_EQ(subscriber.wait_for("site/mast/targets", *targets(8)).size(), 1U);
}

TEST(MqttPublisher, OrientationComesAtItsRateAndIsNotRetained) {
  Broker broker;
  broker.start();
  Subscriber subscriber(broker.options());
  MqttOptions options = broker.options();
  options.orientation_rate_hz = 20;
  MqttPublisher publisher(options);
  ASSERT_TRUE(publisher.start());
  OrientationRecord record;
  const double begin_s = monotonic_now_s();
  std::size_t seen = 0;
  for (std::int64_t frame = 0; seen < 5; ++frame) {
    record.frame = frame;
    ASSERT_TRUE(publisher.write(record));
    ::poll(nullptr, 0, 1);
    seen = static_cast<std::size_t>(std::max<std::int64_t>(publisher.counters().published - 3, 0));
  }
  const double duration_s = monotonic_now_s() - begin_s;
  EXPECT_GE(duration_s, 4 / options.orientation_rate_hz);
  const auto any = [](const Subscriber::Message& one) { return !one.payload.empty(); };
  const auto last = subscriber.wait_until("site/mast/orientation", any).back();
  EXPECT_FALSE(last.retained);
  EXPECT_THAT(last.payload, HasSubstr("\"frame\":"));
}

TEST(MqttPublisher, WrongPasswordAndNoPasswordAreRefusedInWords) {
  Broker broker;
  const std::string passwords = broker.write("passwords", "eve:open-sesame\n");
  ASSERT_EQ(Process({ALIDADE_MOSQUITTO_PASSWD, "-U", passwords}).wait(), 0);
  Broker closed("allow_anonymous false\npassword_file " + passwords + "\n");
  MqttOptions right = closed.options();
  right.user = "eve";
  right.password = "open-sesame";
  closed.start(right);
  MqttOptions wrong = right;
  wrong.password = "open-barley";
  const std::string error = MqttConnection::try_once(wrong);
  EXPECT_THAT(error, HasSubstr(wrong.name() + ": the broker refuses the login of 'eve'"));
  EXPECT_THAT(error, Not(HasSubstr("barley")));
  EXPECT_THAT(MqttConnection::try_once(closed.options()), HasSubstr("wants a login"));
}

TEST(MqttPublisher, TlsTakesTheBrokerOfItsAuthorityOnly) {
  Broker files;
  const TestCertificate own = make_certificate("127.0.0.1", 2);
  const std::string certificate = files.write("own.pem", own.certificate);
  const std::string key = files.write("own.key", own.key);
  const std::string other = files.write("other.pem", make_certificate("127.0.0.1", 2).certificate);
  // The client shows a certificate of its own, too.
  const TestCertificate client = make_certificate("mast", 2);
  const std::string client_certificate = files.write("client.pem", client.certificate);
  const std::string client_key = files.write("client.key", client.key);
  Broker broker("allow_anonymous true\ncafile " + client_certificate + "\ncertfile " + certificate +
                "\nkeyfile " + key + "\nrequire_certificate true\n");
  MqttOptions options = broker.options();
  options.tls = true;
  options.ca_file = certificate;
  options.certificate_file = client_certificate;
  options.key_file = client_key;
  broker.start(options);
  MqttOptions stranger = options;
  stranger.ca_file = other;
  EXPECT_THAT(MqttConnection::try_once(stranger), HasSubstr("TLS failed"));
  MqttOptions plain = options;
  plain.tls = false;
  EXPECT_THAT(MqttConnection::try_once(plain), HasSubstr("mqtts://"));
  MqttOptions unnamed = options;
  unnamed.certificate_file = unnamed.key_file = "";
  EXPECT_NE(MqttConnection::try_once(unnamed), "");
  MqttOptions missing = options;
  missing.ca_file = files.write("empty.pem", "");
  EXPECT_THAT(MqttConnection::files_error(missing), HasSubstr("empty.pem cannot be read"));
}

TEST(MqttPublisher, WhereNobodyListensItSaysSoAndEndsAtOnce) {
  MqttOptions options;
  options.host = "127.0.0.1";
  options.port = free_port();
  EXPECT_THAT(MqttConnection::try_once(options), HasSubstr("onnection refused"));
  MqttOptions by_tls = options;
  by_tls.tls = true;
  EXPECT_THAT(MqttConnection::try_once(by_tls), HasSubstr("is a broker there"));
  MqttPublisher publisher(options);
  ASSERT_TRUE(publisher.start());
  publisher.take_targets(targets(1));
  publisher.stop();
  EXPECT_EQ(publisher.counters().connections, 0);
}

// A broker that accepts and says nothing.
TEST(MqttPublisher, ASilentBrokerIsGivenUp) {
  const FileDescriptor silent(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* any = reinterpret_cast<sockaddr*>(&address);
  ASSERT_EQ(::bind(silent.get(), any, size), 0);
  ASSERT_EQ(::listen(silent.get(), 1), 0);
  ASSERT_EQ(::getsockname(silent.get(), any, &size), 0);
  MqttOptions options;
  options.host = "127.0.0.1";
  options.port = ntohs(address.sin_port);
  options.timeout_s = 0.2;
  EXPECT_THAT(MqttConnection::try_once(options), HasSubstr("no answer within 0.2 s"));
}

constexpr const char* kTaken = "\x20\x02\0\0";  // CONNACK

// What a broker sends behind its CONNACK, or in place of it, and what is said of that.
struct BadBroker {
  std::string name;
  std::string sends;
  const char* says;
};

class MqttConnectionTo : public ::testing::TestWithParam<BadBroker> {};
INSTANTIATE_TEST_SUITE_P(
    , MqttConnectionTo,
    ::testing::Values(BadBroker{"APublisher",
                                std::string(kTaken, 4) +
                                    std::string("\x30\xff\xff\xff\x7f\0\1x", 8),
                                "the answer is not one that a broker gives"},
                      BadBroker{"ALongAnswer", std::string(kTaken, 4) + "\x40\xff\xff\xff\x7f",
                                "the answer is not one that a broker gives"},
                      BadBroker{"AWebServer", "HTTP/1.1 400 Bad Request\r\n\r\n",
                                "the answer is not one that a broker gives"},
                      BadBroker{"HalfAnAnswer", "\x20\x02", "only half of an answer has come"}),
    [](const auto& which) { return which.param.name; });

TEST_P(MqttConnectionTo, IsEnded) {
  const RawServer server([&](int fd) {
    char byte = 0;
    if (::recv(fd, &byte, 1, MSG_PEEK) != 1 || !RawServer::send(fd, GetParam().sends)) return;
    ::shutdown(fd, SHUT_WR);
    while (::recv(fd, &byte, 1, 0) > 0) {
    }
  });
  MqttOptions options;
  options.host = "127.0.0.1";
  options.port = server.port();
  Errand errand;
  MqttConnection connection(options, nullptr, &errand);
  ASSERT_TRUE(connection.begin());
  const double end_s = monotonic_now_s() + kPatience_s;
  while (connection.step() && monotonic_now_s() < end_s) ::poll(nullptr, 0, 5);
  EXPECT_THAT(connection.error(), HasSubstr(GetParam().says));
}

}  // namespace
}  // namespace alidade
