#include "platform/system/whole_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <iterator>
#include <string>
#include <utility>

#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

TEST(WholeFile, IsReadAsItWasWritten) {
  const TemporaryDirectory folder;
  const std::string path = folder.path() + "/file";
  std::string error;
  std::string read;
  for (const std::string& content : {std::string(), std::string("a\0b\r\n", 5)}) {
    ASSERT_TRUE(write_file_atomically(path, content, &error)) << error;
    ASSERT_TRUE(read_file(path, &read, &error)) << error;
    EXPECT_EQ(read, content);
  }
}

TEST(WholeFile, ReplacesTheOldOneForAllReadersAndLeavesNothingElse) {
  const TemporaryDirectory folder;
  const std::string path = folder.write("file", "old");
  std::string error;
  ASSERT_TRUE(write_file_atomically(path, "new", &error)) << error;
  EXPECT_EQ(folder.read("file"), "new");
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0644u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(WholeFile, SaysWhyItCannotBeReadOrWritten) {
  const TemporaryDirectory folder;
  std::string error;
  std::string content = "kept";
  EXPECT_FALSE(read_file(folder.path() + "/none", &content, &error));
  EXPECT_EQ(error, folder.path() + "/none: cannot be read: No such file or directory");
  EXPECT_FALSE(read_file(folder.path(), &content, &error));
  EXPECT_THAT(error, HasSubstr("cannot be read: not a file, but a folder"));
  EXPECT_EQ(content, "kept");
  EXPECT_FALSE(write_file_atomically(folder.path() + "/no/file", "x", &error));
  EXPECT_THAT(error, HasSubstr("cannot be written: No such file or directory"));
  EXPECT_FALSE(write_file_atomically(folder.path(), "x", &error)) << "a folder";
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 0);
}

// As it is killed: the name is another one each time, as mkostemp makes it.
TEST(WholeFile, WhatAKilledProcessLeftUnfinishedGoesAtTheNextWrite) {
  const TemporaryDirectory folder;
  const std::string path = folder.path() + "/file";
  folder.write("file.unfinished-a1B2c3", "hal");
  folder.write("file.unfinished-ZZZZZZ", "");
  for (const char* other : {"file.backup", "file.a1B2c3", "file.unfinished-long-one",
                            "file.unfinished-", "other.unfinished-a1B2c3"})
    folder.write(other, "somebody's");
  std::string error;
  ASSERT_TRUE(write_file_atomically(path, "whole", &error)) << error;
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 6);
  EXPECT_EQ(folder.read("file"), "whole");
}

TEST(WholeFile, WhatIsBeingWrittenStays) {
  const TemporaryDirectory folder;
  const std::string path = folder.write("file.unfinished-a1B2c3", "half");
  const int writing = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  ASSERT_EQ(::flock(writing, LOCK_EX), 0);
  const auto ours = [](const std::string& name) { return name == "file"; };
  EXPECT_EQ(remove_unfinished(folder.path(), ours), 0);
  ::close(writing);
  EXPECT_EQ(remove_unfinished(folder.path(), ours), 1);
  EXPECT_EQ(remove_unfinished(folder.path() + "/none", ours), 0);
}

TEST(WholeFile, NoLinkOrFolderOrPipeIsTakenForAnUnfinishedOne) {
  const TemporaryDirectory folder;
  const std::string begin = folder.path() + "/file.unfinished-";
  folder.write("precious", "kept");
  std::filesystem::create_symlink(folder.path() + "/precious", begin + "aaaaaa");
  std::filesystem::create_directory(begin + "bbbbbb");
  ASSERT_EQ(::mkfifo((begin + "cccccc").c_str(), 0600), 0);
  EXPECT_EQ(remove_unfinished(folder.path(), [](const std::string&) { return true; }), 0);
  EXPECT_EQ(folder.read("precious"), "kept");
}

// Each would be waited for, or has no end.
TEST(WholeFile, PipesAndDevicesAreRefusedAtOnce) {
  const TemporaryDirectory folder;
  const std::string pipe = folder.path() + "/pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string link = folder.path() + "/link";
  std::filesystem::create_symlink(pipe, link);
  for (const auto& [path, why] : {std::pair(pipe, "a pipe"), std::pair(link, "a pipe"),
                                  std::pair(std::string("/dev/zero"), "a device"),
                                  std::pair(std::string("/dev/null"), "a device")}) {
    std::string content = "kept";
    std::string error;
    EXPECT_FALSE(read_file(path, &content, &error));
    EXPECT_EQ(error, path + ": cannot be read: not a file, but " + why);
    EXPECT_EQ(content, "kept");
  }
}

TEST(WholeFile, ALargerOneThanAllowedIsRefusedUnread) {
  const TemporaryDirectory folder;
  const std::string path = folder.write("file", std::string(2 << 20, 'x'));
  std::string content;
  std::string error;
  EXPECT_TRUE(read_file(path, &content, &error, 2 << 20)) << error;
  EXPECT_EQ(content.size(), std::size_t{2} << 20);
  std::filesystem::resize_file(path, std::uintmax_t{1} << 40);  // a hole
  EXPECT_FALSE(read_file(path, &content, &error));
  EXPECT_EQ(error, path + ": cannot be read: larger than 4 MB");
  EXPECT_EQ(content.size(), std::size_t{2} << 20);
}

// What the kernel makes while it is read says that it has no bytes.
TEST(WholeFile, OneWithoutASizeIsReadToItsEnd) {
  std::string content;
  std::string error;
  EXPECT_TRUE(read_file("/proc/self/maps", &content, &error)) << error;
  EXPECT_THAT(content, HasSubstr("stack"));
}

}  // namespace
}  // namespace alidade
