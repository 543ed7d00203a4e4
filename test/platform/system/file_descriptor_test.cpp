#include "platform/system/file_descriptor.h"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <utility>

namespace alidade {
namespace {

int open_one() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }
bool is_open(int number) { return ::fcntl(number, F_GETFD) >= 0; }

TEST(FileDescriptor, ClosesWhatItOwnsAtItsEnd) {
  const int number = open_one();
  {
    const FileDescriptor owner(number);
    EXPECT_TRUE(owner.is_open());
    EXPECT_EQ(owner.get(), number);
  }
  EXPECT_FALSE(is_open(number));
}

TEST(FileDescriptor, OwnsNothingAtFirstAndAfterAFailure) {
  EXPECT_FALSE(FileDescriptor().is_open());
  EXPECT_FALSE(FileDescriptor(::open("/no such file", O_RDONLY | O_CLOEXEC)).is_open());
}

TEST(FileDescriptor, MovesWithoutClosing) {
  FileDescriptor first(open_one());
  const int number = first.get();
  FileDescriptor second(std::move(first));
  EXPECT_FALSE(first.is_open());  // NOLINT(bugprone-use-after-move): what is left is stated
  EXPECT_TRUE(is_open(number));
  FileDescriptor third(open_one());
  const int replaced = third.get();
  third = std::move(second);
  EXPECT_EQ(third.get(), number);
  EXPECT_TRUE(is_open(number));
  EXPECT_FALSE(is_open(replaced));
}

TEST(FileDescriptor, GivesAwayWithoutClosing) {
  FileDescriptor owner(open_one());
  const FileDescriptor heir(owner.release());
  EXPECT_FALSE(owner.is_open());
  EXPECT_TRUE(is_open(heir.get()));
}

TEST(FileDescriptor, LeavesTheReasonOfAFailureAlone) {
  FileDescriptor owner(open_one());
  errno = ENOSPC;
  owner.reset();
  EXPECT_EQ(errno, ENOSPC);
  EXPECT_FALSE(owner.is_open());
}

}  // namespace
}  // namespace alidade
