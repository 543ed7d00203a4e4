#include "platform/system/byte_link.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <termios.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "test/support/temporary_directory.h"

namespace {

int pulled_at_next_look =
    -1;  // the other end of the line, closed just before its settings are read

}  // namespace

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

}  // namespace
}  // namespace alidade
