#include "platform/system/byte_link.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <condition_variable>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "test/support/temporary_directory.h"

namespace {

int pulled_at_next_look =
    -1;  // the other end of the line, closed just before its settings are read

// A name server that is silent until it is told to answer.
class NameServer {
 public:
  void fall_silent() {
    const std::lock_guard<std::mutex> lock(mutex_);
    silent_ = true;
    queries_ = 0;
  }
  void answer() {
    const std::lock_guard<std::mutex> lock(mutex_);
    silent_ = false;
    changed_.notify_all();
  }
  void query() {
    std::unique_lock<std::mutex> lock(mutex_);
    ++queries_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !silent_; });
  }
  void await_query() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return queries_ > 0; });
  }
  int queries() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return queries_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool silent_ = false;
  int queries_ = 0;
};

// Of all tests: a look-up may outlive the test that began it.
NameServer name_server;

}  // namespace

extern "C" int getaddrinfo(const char* host, const char* port, const addrinfo* hints,
                           addrinfo** list) {
  const bool is_query = hints != nullptr && (hints->ai_flags & AI_NUMERICHOST) == 0;
  if (is_query) name_server.query();
  static const auto next =
      reinterpret_cast<decltype(&::getaddrinfo)>(::dlsym(RTLD_NEXT, "getaddrinfo"));
  return next(is_query ? "127.0.0.1" : host, port, hints, list);
}

extern "C" int tcgetattr(int fd, termios* line) noexcept {
  if (pulled_at_next_look >= 0) {
    ::close(pulled_at_next_look);
    pulled_at_next_look = -1;
  }
  static const auto next =
      reinterpret_cast<int (*)(int, termios*)>(::dlsym(RTLD_NEXT, "tcgetattr"));
  return next(fd, line);
}

namespace alidade {
namespace {

TEST(ByteLink, TakesALineThatGoesWhileItIsOpenedForOneThatMayComeBack) {
  const int other_end = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(other_end, 0);
  ASSERT_EQ(::grantpt(other_end), 0);
  ASSERT_EQ(::unlockpt(other_end), 0);
  ByteLink link({::ptsname(other_end), 9600});
  pulled_at_next_look = other_end;
  EXPECT_EQ(link.open(), LinkStatus::kLost);
  EXPECT_EQ(pulled_at_next_look, -1);
  EXPECT_EQ(link.error(), "the line is gone: unplugged?");
}

TEST(ByteLink, FindsWhatIsNoSerialLineUnusable) {
  const TemporaryDirectory directory;
  for (const std::string& path : {directory.write("file", "text"), std::string("/dev/null")}) {
    ByteLink link({path, 9600});
    EXPECT_EQ(link.open(), LinkStatus::kUnusable) << path;
    EXPECT_EQ(link.error(), "is not a serial line; expected one such as /dev/ttyUSB0");
  }
}

// TCP and UDP: a name is looked up for both.
class ByteLinkByName : public ::testing::TestWithParam<const char*> {
 protected:
  ByteLinkByName() { name_server.fall_silent(); }
  ~ByteLinkByName() override { name_server.answer(); }

  [[nodiscard]] static ByteLinkOptions options(int port) {
    return {std::string(GetParam()) + "://head.example:" + std::to_string(port), 0};
  }
};

INSTANTIATE_TEST_SUITE_P(, ByteLinkByName, ::testing::Values("tcp", "udp"),
                         [](const auto& which) { return std::string(which.param); });

TEST_P(ByteLinkByName, SaysThatTheNameServerIsSilent) {
  ByteLink link(options(9));
  ASSERT_EQ(link.open(), LinkStatus::kOk) << link.error();
  EXPECT_EQ(link.finish_open(0), LinkStatus::kTimeout);
  EXPECT_EQ(link.error(), "the host's name is not looked up in time; does the name server answer?");
  name_server.await_query();  // later ones would count it as theirs
}

TEST_P(ByteLinkByName, IsStoppedWhileTheNameIsLookedUp) {
  ByteLink link(options(9));
  ASSERT_EQ(link.open(), LinkStatus::kOk) << link.error();
  std::thread stopper([&] {
    name_server.await_query();
    link.stop();
  });
  EXPECT_EQ(link.finish_open(1e6), LinkStatus::kStopped);
  stopper.join();
}

TEST_P(ByteLinkByName, MayGoAwayWhileTheNameIsLookedUp) {
  auto link = std::make_unique<ByteLink>(options(9));
  ASSERT_EQ(link->open(), LinkStatus::kOk) << link->error();
  name_server.await_query();
  link.reset();
  name_server.answer();
}

TEST_P(ByteLinkByName, LooksUpOnceHoweverOftenItTries) {
  const int type = std::string(GetParam()) == "tcp" ? SOCK_STREAM : SOCK_DGRAM;
  const FileDescriptor device(::socket(AF_INET, type, 0));
  sockaddr_in address{};
  socklen_t size = sizeof address;
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  ASSERT_EQ(::bind(device.get(), generic, size), 0);
  ASSERT_TRUE(type == SOCK_DGRAM || ::listen(device.get(), 1) == 0);
  ASSERT_EQ(::getsockname(device.get(), generic, &size), 0);
  ByteLink link(options(ntohs(address.sin_port)));
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(link.open(), LinkStatus::kOk) << link.error();
    EXPECT_EQ(link.finish_open(0), LinkStatus::kTimeout);
    link.close();
  }
  name_server.answer();
  ASSERT_EQ(link.open(), LinkStatus::kOk) << link.error();
  EXPECT_EQ(link.finish_open(1e6), LinkStatus::kOk) << link.error();
  EXPECT_EQ(name_server.queries(), 1);
  EXPECT_EQ(link.send("x"), LinkStatus::kOk) << link.error();
}

}  // namespace
}  // namespace alidade
