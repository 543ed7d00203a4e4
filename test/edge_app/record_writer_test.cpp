#include "edge_app/output/record_writer.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <string>
#include <thread>

namespace alidade {
namespace {

using ::testing::HasSubstr;

class Pipe {
 public:
  Pipe() {
    int ends[2] = {-1, -1};
    EXPECT_EQ(::pipe2(ends, O_CLOEXEC), 0);
    read_end_ = ends[0];
    write_end_ = ends[1];
  }
  ~Pipe() {
    close_read_end();
    ::close(write_end_);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  [[nodiscard]] int write_end() const { return write_end_; }
  void close_read_end() {
    if (read_end_ >= 0) ::close(read_end_);
    read_end_ = -1;
  }
  // What is in the pipe now, at most one buffer.
  std::string take() {
    std::string text(65536, '\0');
    const ssize_t count = ::read(read_end_, text.data(), text.size());
    text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return text;
  }

 private:
  int read_end_;
  int write_end_;
};

class RecordWriterTest : public ::testing::Test {
 protected:
  void SetUp() override { ::signal(SIGPIPE, SIG_IGN); }
  Pipe pipe_;
  OrientationRecord record_;
};

TEST_F(RecordWriterTest, GivesEachRecordToTheReaderAtOnce) {
  RecordWriter writer(pipe_.write_end(), OutputFormat::kJson, "pipe");
  ASSERT_TRUE(writer.write(record_));
  EXPECT_EQ(pipe_.take(), json_line(record_));
  ASSERT_TRUE(writer.write(record_));
  EXPECT_EQ(pipe_.take(), json_line(record_));
}

TEST_F(RecordWriterTest, BeginsCsvWithTheHeader) {
  RecordWriter writer(pipe_.write_end(), OutputFormat::kCsv, "pipe");
  ASSERT_TRUE(writer.write(record_));
  ASSERT_TRUE(writer.write(record_));
  EXPECT_EQ(pipe_.take(), csv_header() + csv_line(record_) + csv_line(record_));
}

TEST_F(RecordWriterTest, EndsWithoutAnErrorWhenTheReaderGoes) {
  RecordWriter writer(pipe_.write_end(), OutputFormat::kJson, "pipe");
  pipe_.close_read_end();
  EXPECT_FALSE(writer.write(record_));
  EXPECT_EQ(writer.error(), "");
}

TEST_F(RecordWriterTest, NamesAFullDisk) {
  const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(full, 0);
  RecordWriter writer(full, OutputFormat::kJson, "/dev/full");
  EXPECT_FALSE(writer.write(record_));
  EXPECT_THAT(writer.error(), HasSubstr("/dev/full: cannot write a record: No space left"));
  ::close(full);
}

TEST_F(RecordWriterTest, InterruptFreesAWriteThatWaitsForAStalledReader) {
  RecordWriter writer(pipe_.write_end(), OutputFormat::kJson, "pipe");
  // Far more than a pipe holds; without the interrupt this thread would never end.
  std::thread producer([&] {
    for (int i = 0; i < 1000; ++i) EXPECT_TRUE(writer.write(record_));
  });
  writer.interrupt();
  producer.join();
  EXPECT_GT(writer.dropped(), 0U);
  EXPECT_EQ(pipe_.take().rfind(json_line(record_), 0), 0U);
}

}  // namespace
}  // namespace alidade
