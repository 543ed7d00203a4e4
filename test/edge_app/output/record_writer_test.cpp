#include "edge_app/output/record_writer.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
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
  RecordWriter writer(pipe_.write_end(), OutputFormat::kJson, "pipe", RecordWriter::Stalled::kWait);
  ASSERT_TRUE(writer.write(record_));
  EXPECT_EQ(pipe_.take(), json_line(record_));
  ASSERT_TRUE(writer.write(record_));
  EXPECT_EQ(pipe_.take(), json_line(record_));
}

TEST_F(RecordWriterTest, BeginsCsvWithTheHeader) {
  RecordWriter writer(pipe_.write_end(), OutputFormat::kCsv, "pipe", RecordWriter::Stalled::kWait);
  ASSERT_TRUE(writer.write(record_));
  ASSERT_TRUE(writer.write(record_));
  EXPECT_EQ(pipe_.take(), csv_header() + csv_line(record_) + csv_line(record_));
}

TEST_F(RecordWriterTest, EndsWithoutAnErrorWhenTheReaderGoes) {
  RecordWriter writer(pipe_.write_end(), OutputFormat::kJson, "pipe", RecordWriter::Stalled::kWait);
  pipe_.close_read_end();
  EXPECT_FALSE(writer.write(record_));
  EXPECT_EQ(writer.error(), "");
}

TEST_F(RecordWriterTest, NamesAFullDisk) {
  const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(full, 0);
  RecordWriter writer(full, OutputFormat::kJson, "/dev/full", RecordWriter::Stalled::kWait);
  EXPECT_FALSE(writer.write(record_));
  EXPECT_THAT(writer.error(), HasSubstr("/dev/full: cannot write a record: No space left"));
  ::close(full);
}

TEST_F(RecordWriterTest, InterruptFreesAWriteThatWaitsForAStalledReader) {
  RecordWriter writer(pipe_.write_end(), OutputFormat::kJson, "pipe", RecordWriter::Stalled::kWait);
  // Far more than a pipe holds; without the interrupt this thread would never end.
  std::thread producer([&] {
    for (int i = 0; i < 1000; ++i) EXPECT_TRUE(writer.write(record_));
  });
  writer.interrupt();
  producer.join();
  EXPECT_GT(writer.dropped(), 0U);
  EXPECT_EQ(pipe_.take().rfind(json_line(record_), 0), 0U);
}

// Were it to wait, nobody would end it.
TEST_F(RecordWriterTest, DropsWholeRecordsThatAReaderDoesNotTakeAndGoesOnBehindThem) {
  RecordWriter writer(pipe_.write_end(), OutputFormat::kCsv, "pipe", RecordWriter::Stalled::kDrop);
  constexpr std::size_t kRecords = 1000;  // far more than a pipe holds
  for (std::size_t i = 0; i < kRecords; ++i) {
    record_.frame = static_cast<std::int64_t>(i);
    ASSERT_TRUE(writer.write(record_));
  }
  EXPECT_GT(writer.dropped(), 0U);
  const std::string taken = pipe_.take();
  std::string expected = csv_header();
  for (std::size_t i = 0; i < kRecords - writer.dropped(); ++i) {
    record_.frame = static_cast<std::int64_t>(i);
    expected += csv_line(record_);
  }
  EXPECT_EQ(taken, expected);
  const std::size_t dropped = writer.dropped();
  ASSERT_TRUE(writer.write(record_));
  EXPECT_EQ(pipe_.take(), csv_line(record_));
  EXPECT_EQ(writer.dropped(), dropped);
}

// A connection, unlike a pipe, may take a part of what it is given.
TEST_F(RecordWriterTest, EndsARecordThatWasBegunBeforeTheNext) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  ASSERT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length), 0);
  const int out = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::connect(out, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  const int in = ::accept(listener, nullptr, nullptr);
  ASSERT_EQ(::fcntl(out, F_SETFL, O_NONBLOCK), 0);
  std::size_t lines = 0;
  std::size_t written = 0;
  {
    RecordWriter writer(out, OutputFormat::kJson, "connection", RecordWriter::Stalled::kDrop);
    // Until nothing more fits, again and again: the record at the border is another each time.
    std::string text;
    for (int round = 0; round < 20; ++round) {
      for (const std::size_t before = writer.dropped(); writer.dropped() < before + 5; ++written)
        ASSERT_TRUE(writer.write(record_));
      std::string part(100'000, ' ');
      const ssize_t count = ::read(in, part.data(), part.size());
      ASSERT_GT(count, 0);
      text.append(part, 0, static_cast<std::size_t>(count));
    }
    written -= writer.dropped();
    ASSERT_EQ(::shutdown(out, SHUT_WR), 0);
    for (std::string part(100'000, ' ');;) {
      const ssize_t count = ::read(in, part.data(), part.size());
      ASSERT_GE(count, 0);
      if (count == 0) break;
      text.append(part, 0, static_cast<std::size_t>(count));
    }
    const std::string line = json_line(record_);
    std::size_t at = 0;
    for (; text.compare(at, line.size(), line) == 0; at += line.size()) ++lines;
    // The last one may have been begun and no more.
    EXPECT_EQ(text.substr(at), line.substr(0, text.size() - at));
    lines += at < text.size() ? 1 : 0;
  }
  EXPECT_EQ(lines, written);
  for (const int descriptor : {listener, out, in}) ::close(descriptor);
}

}  // namespace
}  // namespace alidade
