// What systemd is told, read from a socket as systemd's own.

#include "platform/system/service_manager.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

class ServiceManagerTest : public ::testing::Test {
 protected:
  ServiceManagerTest() { forget(); }
  ~ServiceManagerTest() override {
    forget();
    if (socket_ >= 0) ::close(socket_);
  }
  ServiceManagerTest(const ServiceManagerTest&) = delete;
  ServiceManagerTest& operator=(const ServiceManagerTest&) = delete;

  static void forget() {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
  }

  void listen() {
    const std::string path = directory_.path() + "/notify";
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    ASSERT_LT(path.size(), sizeof address.sun_path);
    std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
    ASSERT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }

  // The next message; empty if there is none. They are there once they are sent.
  [[nodiscard]] std::string heard() const {
    std::array<char, 256> text{};
    const ssize_t size = ::recv(socket_, text.data(), text.size(), MSG_DONTWAIT);
    return size < 0 ? "" : std::string(text.data(), static_cast<std::size_t>(size));
  }

  TemporaryDirectory directory_;
  int socket_ = -1;
};

TEST_F(ServiceManagerTest, IsToldEachThingInItsOwnMessage) {
  listen();
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  const ServiceManager manager;
  EXPECT_TRUE(manager.is_there());
  manager.ready();
  manager.status("25.0 frames a second");
  manager.alive();
  manager.stopping();
  for (const char* expected :
       {"READY=1", "STATUS=25.0 frames a second", "WATCHDOG=1", "STOPPING=1", ""}) {
    EXPECT_EQ(heard(), expected);
  }
}

TEST_F(ServiceManagerTest, WantsASignOfLifeTwiceInTheTimeThatItGrants) {
  listen();
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  EXPECT_EQ(ServiceManager().alive_period_s(), 1.5);
}

TEST_F(ServiceManagerTest, WantsNoSignOfLifeWhereItDoesNotWatchOrWatchesAnother) {
  listen();
  EXPECT_EQ(ServiceManager().alive_period_s(), kNever);
  ServiceManager().alive();
  EXPECT_EQ(heard(), "");
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  ::setenv("WATCHDOG_PID", std::to_string(::getpid() + 1).c_str(), 1);
  EXPECT_EQ(ServiceManager().alive_period_s(), kNever);
}

TEST_F(ServiceManagerTest, IsNotThereWithoutASocket) {
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  const ServiceManager manager;
  EXPECT_FALSE(manager.is_there());
  EXPECT_EQ(manager.alive_period_s(), kNever);
  manager.ready();
}

TEST_F(ServiceManagerTest, ThatHasGoneLosesMessagesAndHearsTheNextOnesWhenItIsBack) {
  listen();
  ::setenv("WATCHDOG_USEC", "3000000", 1);
  const ServiceManager manager;
  ::close(socket_);
  manager.alive();
  manager.stopping();
  ASSERT_EQ(::unlink((directory_.path() + "/notify").c_str()), 0);
  manager.status("nobody listens");
  listen();
  EXPECT_EQ(heard(), "");
  manager.alive();
  EXPECT_EQ(heard(), "WATCHDOG=1");
  EXPECT_EQ(heard(), "");
}

}  // namespace
}  // namespace alidade
