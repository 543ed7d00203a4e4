#include "platform/system/file_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(FileLock, TheNextIsToldWhoHasIt) {
  const TemporaryDirectory folder;
  const std::string path = folder.path() + "/calibration.yaml";
  FileLock first, second;
  std::string why;
  ASSERT_EQ(first.take(path, &why), FileLock::Result::kTaken) << why;
  EXPECT_EQ(second.take(path, &why), FileLock::Result::kInUse);
  EXPECT_THAT(why,
              AllOf(StartsWith(path + ": in use by process " + std::to_string(::getpid()) + " ("),
                    HasSubstr("platform_system_test")));
  first.release();
  EXPECT_EQ(second.take(path, &why), FileLock::Result::kTaken) << why;
}

TEST(FileLock, IsTakenAwayByWhoMadeItAndOnlyByThem) {
  const TemporaryDirectory folder;
  const std::string path = folder.path() + "/scene.map";
  FileLock first, second, third;
  std::string why;
  ASSERT_EQ(first.take(path, &why), FileLock::Result::kTaken) << why;
  first.release();
  ASSERT_EQ(second.take(path, &why), FileLock::Result::kTaken) << why;
  second.release_and_remove();
  EXPECT_TRUE(std::filesystem::exists(path + ".lock"));
  std::filesystem::remove(path + ".lock");
  ASSERT_EQ(first.take(path, &why), FileLock::Result::kTaken) << why;
  EXPECT_EQ(second.take(path, &why), FileLock::Result::kInUse);
  first.release_and_remove();
  EXPECT_FALSE(std::filesystem::exists(path + ".lock"));
  EXPECT_EQ(second.take(path, &why), FileLock::Result::kTaken) << why;
  EXPECT_EQ(third.take(path, &why), FileLock::Result::kInUse);
}

TEST(FileLock, EndsWithItsProcessHoweverThatEnds) {
  const TemporaryDirectory folder;
  const std::string path = folder.path() + "/calibration.yaml";
  int ends[2] = {-1, -1};
  ASSERT_EQ(::pipe(ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    FileLock lock;
    std::string why;
    const char taken = lock.take(path, &why) == FileLock::Result::kTaken ? 'y' : 'n';
    if (::write(ends[1], &taken, 1) != 1) ::_exit(1);
    for (;;) ::pause();
  }
  char taken = 0;
  ASSERT_EQ(::read(ends[0], &taken, 1), 1);
  EXPECT_EQ(taken, 'y');
  FileLock lock;
  std::string why;
  EXPECT_EQ(lock.take(path, &why), FileLock::Result::kInUse);
  EXPECT_THAT(why, HasSubstr("process " + std::to_string(child) + " ("));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(lock.take(path, &why), FileLock::Result::kTaken) << why;
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST(FileLock, SaysWhereThereCanBeNone) {
  const TemporaryDirectory folder;
  FileLock lock;
  std::string why;
  EXPECT_EQ(lock.take(folder.path() + "/no/calibration.yaml", &why), FileLock::Result::kImpossible);
  EXPECT_THAT(why, HasSubstr("calibration.yaml.lock: cannot be locked: No such file"));
  const std::string path = folder.path() + "/calibration.yaml";
  ASSERT_EQ(::mkfifo((path + ".lock").c_str(), 0600), 0);
  EXPECT_EQ(lock.take(path, &why), FileLock::Result::kImpossible);
  EXPECT_THAT(why, HasSubstr("it is not a file"));
  std::filesystem::remove(path + ".lock");
  // Another file is neither locked nor written through a link.
  std::filesystem::create_symlink(folder.write("victim", "kept"), path + ".lock");
  EXPECT_EQ(lock.take(path, &why), FileLock::Result::kImpossible);
  EXPECT_EQ(folder.read("victim"), "kept");
}

}  // namespace
}  // namespace alidade
