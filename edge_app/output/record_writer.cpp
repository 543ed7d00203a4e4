#include "edge_app/output/record_writer.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>
namespace alidade {

RecordWriter::RecordWriter(int descriptor, OutputFormat format, std::string name)
    : descriptor_(descriptor),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      format_(format),
      name_(std::move(name)),
      header_pending_(format == OutputFormat::kCsv) {
  if (wake_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

RecordWriter::~RecordWriter() { ::close(wake_); }

void RecordWriter::interrupt() {
  // Fails only if the counter is full, and then the descriptor is readable already.
  static_cast<void>(::eventfd_write(wake_, 1));
}

bool RecordWriter::write(const OrientationRecord& record) {
  const std::string line = format_ == OutputFormat::kCsv ? csv_line(record) : json_line(record);
  if (!header_pending_) return write_text(line);
  header_pending_ = false;
  return write_text(csv_header() + line);
}

RecordWriter::Ready RecordWriter::wait_until_writable() {
  pollfd descriptors[] = {{descriptor_, POLLOUT, 0}, {wake_, POLLIN, 0}};
  int ready = 0;
  do {
    ready = ::poll(descriptors, 2, -1);
  } while (ready < 0 && errno == EINTR);
  if (ready < 0) return Ready::kFailed;
  // POLLERR or POLLHUP: let write(2) say what is wrong.
  return descriptors[0].revents != 0 ? Ready::kYes : Ready::kNo;
}

bool RecordWriter::write_text(const std::string& text) {
  std::size_t written = 0;
  while (written < text.size()) {
    const Ready ready = wait_until_writable();
    if (ready == Ready::kNo) {
      ++dropped_;
      return true;
    }
    // A pipe that polls writable takes PIPE_BUF (4096) bytes, more than any record, without waiting.
    const ssize_t count = ready == Ready::kFailed
                              ? -1
                              : ::write(descriptor_, text.data() + written, text.size() - written);
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count < 0) {
      if (errno != EPIPE) {
        error_ = name_ + ": cannot write a record: " + std::generic_category().message(errno);
      }
      return false;
    }
    written += static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace alidade
