#include "platform/system/whole_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <iterator>
#include <string>

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
  EXPECT_THAT(error, HasSubstr("cannot be read: Is a directory"));
  EXPECT_EQ(content, "kept");
  EXPECT_FALSE(write_file_atomically(folder.path() + "/no/file", "x", &error));
  EXPECT_THAT(error, HasSubstr("cannot be written: No such file or directory"));
  EXPECT_FALSE(write_file_atomically(folder.path(), "x", &error)) << "a folder";
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 0);
}

}  // namespace
}  // namespace alidade
