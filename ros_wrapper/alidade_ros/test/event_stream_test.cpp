// EventStream and HttpClient against a server that does what the test says.

#include "alidade_ros/event_stream.h"

#include <gtest/gtest.h>
#include <httplib.h>

#include <condition_variable>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace alidade_ros {
namespace {

std::string hello(const std::string& start) {
  return "event: hello\ndata: {\"alidade\":\"0.1.0\",\"start\":\"" + start +
         "\",\"monotonic_s\":1,\"wall_s\":2,\"bracket_s\":0}\n\n";
}

std::string record(int number) {
  return "id: " + std::to_string(number) +
         "\nevent: orientation\ndata: {\"receive_time_s\":1,\"mode\":\"none\",\"status\":\"video "
         "lost\",\"calibrated\":false,\"calibration\":\"off\",\"landmarks\":0,\"line_delay_s\":0,"
         "\"focal_length_px\":1,\"aspect\":1,\"radial_distortion\":0}\n\n";
}

// Serves one text for each connection to the stream, then ends that connection; holds the last open.
class FakeEdge {
 public:
  explicit FakeEdge(std::vector<std::string> texts) : texts_(std::move(texts)) {
    server_.Get(
        "/api/v1/stream", [this](const httplib::Request& request, httplib::Response& response) {
          const std::lock_guard<std::mutex> lock(mutex_);
          authorization_ = request.get_header_value("Authorization");
          const std::size_t connection = connections_++;
          if (connection < refusals_) {
            response.status = 503;
            response.set_content("{\"error\":\"too many streams\"}", "application/json");
            return;
          }
          const std::size_t index = connection - refusals_;
          const bool last = index + 1 >= texts_.size();
          const std::string text = texts_[std::min(index, texts_.size() - 1)];
          response.set_chunked_content_provider(
              "text/event-stream", [this, text, last](std::size_t sent, httplib::DataSink& sink) {
                if (sent < text.size()) return sink.write(text.data() + sent, text.size() - sent);
                if (last) {
                  wait_for_end();
                } else {
                  sink.done();
                }
                return !last;
              });
        });
    server_.Post("/api/v1/direction", [](const httplib::Request& request,
                                         httplib::Response& response) {
      response.status = request.body == "{}" ? 200 : 400;
      response.set_content(request.body == "{}" ? "{\"ok\":1}" : "{\"error\":\"pixels: missing\"}",
                           "application/json");
    });
    port_ = server_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running()) std::this_thread::yield();  // stop() would not reach it before
  }

  ~FakeEdge() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ending_ = true;
    }
    changed_.notify_all();
    server_.stop();
    thread_.join();
  }

  void refuse_first(std::size_t count) { refusals_ = count; }

  [[nodiscard]] EdgeAddress address() const {
    EdgeAddress address;
    address.url = "http://127.0.0.1:" + std::to_string(port_) + "/";
    return address;
  }

  [[nodiscard]] std::string authorization() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return authorization_;
  }

 private:
  void wait_for_end() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return ending_; });
  }

  std::vector<std::string> texts_;
  std::size_t refusals_ = 0;
  httplib::Server server_;
  int port_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t connections_ = 0;
  std::string authorization_;
  bool ending_ = false;
  std::thread thread_;
};

// What came, as words: "hello A", "3", "disconnected", "misunderstood".
class Follower {
 public:
  explicit Follower(const EdgeAddress& address)
      : client_(address),
        stream_(&client_,
                {[this](const Hello& h) { add("hello " + h.start); },
                 [this](const ClockPair&) { add("clock"); },
                 [this](const Record&, std::uint64_t number) { add(std::to_string(number)); },
                 [this](const std::string& json, std::string* error) {
                   *error = json;
                   const bool understood = json != "unclear";
                   if (understood) add("targets " + json);
                   return understood;
                 },
                 [this](const std::string& error) { add("disconnected", error); },
                 [this](const std::string& error) { add("misunderstood", error); }}) {
    stream_.start();
  }
  ~Follower() { stream_.stop(); }

  // Waits until this many words came; empty if they do not within a generous time.
  std::vector<std::string> words(std::size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    const bool came =
        changed_.wait_for(lock, std::chrono::seconds(60), [&] { return words_.size() >= count; });
    EXPECT_TRUE(came);
    return words_;
  }
  std::string last_error() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return last_error_;
  }
  EventStream::Counters counters() { return stream_.counters(); }

 private:
  void add(const std::string& word, const std::string& error = "") {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      words_.push_back(word);
      if (!error.empty()) last_error_ = error;
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> words_;
  std::string last_error_;
  HttpClient client_;
  EventStream stream_;
};

using Words = std::vector<std::string>;

TEST(EventStream, GivesEachRecordOnceOverReconnectsAndRestarts) {
  FakeEdge edge({hello("A") + record(1) + record(2), hello("A") + record(2) + record(3),
                 hello("B") + record(1)});
  Follower follower(edge.address());
  EXPECT_EQ(follower.words(9), (Words{"hello A", "1", "2", "disconnected", "hello A", "3",
                                      "disconnected", "hello B", "1"}));
  EXPECT_EQ(follower.counters().records, 4U);
  EXPECT_EQ(follower.counters().repeated, 1U);
  EXPECT_EQ(follower.counters().lost, 0U);
  EXPECT_EQ(follower.counters().connections, 3U);
}

TEST(EventStream, CountsWhatTheEdgeDropped) {
  FakeEdge edge({hello("A") + record(5) + "event: lost\ndata: {\"records\":3}\n\n" + record(9)});
  Follower follower(edge.address());
  EXPECT_EQ(follower.words(3), (Words{"hello A", "5", "9"}));
  EXPECT_EQ(follower.counters().lost, 3U);
}

TEST(EventStream, DoesNotCountWhatItMissedWhileDisconnected) {
  FakeEdge edge({hello("A") + record(5), hello("A") + record(50)});
  Follower follower(edge.address());
  EXPECT_EQ(follower.words(5), (Words{"hello A", "5", "disconnected", "hello A", "50"}));
  EXPECT_EQ(follower.counters().lost, 0U);
}

TEST(EventStream, TriesAgainWhenRefused) {
  FakeEdge edge({hello("A") + record(1)});
  edge.refuse_first(2);
  Follower follower(edge.address());
  EXPECT_EQ(follower.words(4), (Words{"disconnected", "disconnected", "hello A", "1"}));
  EXPECT_NE(follower.last_error().find("503: too many streams"), std::string::npos);
}

TEST(EventStream, LeavesASilentConnection) {
  FakeEdge edge({hello("A") + record(1)});  // held open, every time
  EdgeAddress address = edge.address();
  address.silence_timeout_s = 1;
  Follower follower(address);
  EXPECT_EQ(follower.words(4), (Words{"hello A", "1", "disconnected", "hello A"}));
}

TEST(EventStream, SaysThatNobodyIsThere) {
  EdgeAddress address;
  {
    const FakeEdge gone({hello("A")});
    address = gone.address();
  }
  Follower follower(address);
  EXPECT_EQ(follower.words(1).front(), "disconnected");
  EXPECT_NE(follower.last_error().find("127.0.0.1"), std::string::npos);
}

TEST(EventStream, ReportsWhatItCannotUnderstandAndGoesOn) {
  FakeEdge edge({hello("A") + "id: 1\nevent: orientation\ndata: {}\n\n" +
                 "event: orientation\nid: x\ndata: {}\n\n" + "event: clock\ndata: 7\n\n" +
                 "event: of a newer edge\ndata: 7\n\n" + record(2)});
  Follower follower(edge.address());
  EXPECT_EQ(follower.words(5),
            (Words{"hello A", "misunderstood", "misunderstood", "misunderstood", "2"}));
  EXPECT_EQ(follower.counters().lost, 0U);
}

TEST(EventStream, SendsTheTokenAndNeverTellsIt) {
  const std::string file = testing::TempDir() + "alidade_ros_token";
  std::ofstream(file) << "right horse\r\n";
  ::setenv("ALIDADE_ROS_TEST_TOKEN", "right horse", 1);
  for (const bool from_file : {false, true}) {
    FakeEdge edge({hello("A")});
    edge.refuse_first(1);
    EdgeAddress address = edge.address();
    (from_file ? address.token_file : address.token_env) =
        from_file ? file : "ALIDADE_ROS_TEST_TOKEN";
    Follower follower(address);
    EXPECT_EQ(follower.words(2), (Words{"disconnected", "hello A"}));
    EXPECT_EQ(edge.authorization(), "Bearer right horse");
    EXPECT_EQ(follower.last_error().find("horse"), std::string::npos);
  }
  std::remove(file.c_str());
}

TEST(EventStream, SaysThatThereIsNoToken) {
  FakeEdge edge({hello("A")});
  EdgeAddress address = edge.address();
  address.token_file = testing::TempDir() + "alidade_ros_no_such_token";
  Follower follower(address);
  EXPECT_EQ(follower.words(1), Words{"disconnected"});
  EXPECT_NE(follower.last_error().find("no_such_token"), std::string::npos);
}

TEST(HttpClient, PassesOnWhatTheEdgeSays) {
  FakeEdge edge({""});
  HttpClient client(edge.address());
  EXPECT_EQ(client.post("/api/v1/direction", "{}").body, "{\"ok\":1}");
  const HttpClient::Answer wrong = client.post("/api/v1/direction", "[]");
  EXPECT_EQ(wrong.status, 400);
  EXPECT_NE(wrong.error.find("pixels: missing"), std::string::npos);
  EXPECT_EQ(client.get("/nothing").status, 404);
}

TEST(HttpClient, RefusesAddressesThatAreNoneOrHoldAPassword) {
  EdgeAddress address;
  EXPECT_EQ(wrong_with(address), "");
  for (const char* url : {"", "127.0.0.1:8080", "ftp://x", "http://me:secret@x", "me:secret@x"}) {
    address.url = url;
    EXPECT_NE(wrong_with(address), "") << url;
    EXPECT_EQ(wrong_with(address).find("secret"), std::string::npos);
  }
  address = {};
  address.token_env = "A";
  address.token_file = "b";
  EXPECT_NE(wrong_with(address), "");
}

TEST(EventStream, HandsTargetsOnOrSaysThatTheyAreNotUnderstood) {
  FakeEdge edge({hello("A") + "event: targets\ndata: some\n\nevent: targets\ndata: unclear\n\n"});
  Follower follower(edge.address());
  const Words words = follower.words(3);
  EXPECT_EQ(Words(words.begin(), words.begin() + 3),
            (Words{"hello A", "targets some", "misunderstood"}));
}

}  // namespace
}  // namespace alidade_ros
