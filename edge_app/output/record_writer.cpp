#include "edge_app/output/record_writer.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>
namespace alidade {

RecordWriter::RecordWriter(int descriptor, OutputFormat format, std::string name, Stalled stalled)
    : descriptor_(descriptor),
      stalled_(stalled),
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
  // A record that was begun is ended before the next one.
  if (!write_rest()) return false;
  bool taken = false;
  if (rest_.empty()) {
    rest_ = format_ == OutputFormat::kCsv ? csv_line(record) : json_line(record);
    if (header_pending_) rest_.insert(0, csv_header());
    const std::size_t size = rest_.size();
    if (!write_rest()) return false;
    taken = rest_.size() < size;
    if (!taken) rest_.clear();
  }
  if (taken) {
    header_pending_ = false;
  } else {
    ++dropped_;
  }
  return true;
}

RecordWriter::Ready RecordWriter::wait_until_writable() {
  pollfd descriptors[] = {{descriptor_, POLLOUT, 0}, {wake_, POLLIN, 0}};
  const int patience_ms = stalled_ == Stalled::kWait ? -1 : 0;
  int ready = 0;
  do {
    ready = ::poll(descriptors, 2, patience_ms);
  } while (ready < 0 && errno == EINTR);
  if (ready < 0) return Ready::kFailed;
  // POLLERR or POLLHUP: let write(2) say what is wrong.
  return descriptors[0].revents != 0 ? Ready::kYes : Ready::kNo;
}

// As much of it as is to be written now.
bool RecordWriter::write_rest() {
  std::size_t written = 0;
  while (written < rest_.size()) {
    const Ready ready = wait_until_writable();
    if (ready == Ready::kNo) break;
    // A pipe that polls writable takes PIPE_BUF (4096) bytes, more than any record, without waiting.
    const ssize_t count = ready == Ready::kFailed ? -1
                                                  : ::write(descriptor_, rest_.data() + written,
                                                            rest_.size() - written);
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count < 0) {
      if (errno != EPIPE) {
        error_ = name_ + ": cannot write a record: " + std::generic_category().message(errno);
      }
      return false;
    }
    written += static_cast<std::size_t>(count);
  }
  rest_.erase(0, written);
  return true;
}

}  // namespace alidade
