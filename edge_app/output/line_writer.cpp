#include "edge_app/output/line_writer.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>
namespace alidade {

LineWriter::LineWriter(int descriptor, std::string name, std::string what, Stalled stalled)
    : descriptor_(descriptor),
      stalled_(stalled),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      name_(std::move(name)),
      what_(std::move(what)) {
  if (wake_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

LineWriter::~LineWriter() { ::close(wake_); }

void LineWriter::interrupt() {
  // Fails only if the counter is full. Then the descriptor is readable already.
  static_cast<void>(::eventfd_write(wake_, 1));
}

bool LineWriter::write(std::string line) {
  taken_ = false;
  // First finish a line that was begun.
  if (!write_rest()) return false;
  if (rest_.empty()) {
    rest_ = std::move(line);
    const std::size_t size = rest_.size();
    if (!write_rest()) return false;
    taken_ = rest_.size() < size;
    if (!taken_) rest_.clear();
  }
  if (!taken_) ++dropped_;
  return true;
}

LineWriter::Ready LineWriter::wait_until_writable() {
  pollfd descriptors[] = {{descriptor_, POLLOUT, 0}, {wake_, POLLIN, 0}};
  const int patience_ms = stalled_ == Stalled::kWait ? -1 : 0;
  int ready = 0;
  do {
    ready = ::poll(descriptors, 2, patience_ms);
  } while (ready < 0 && errno == EINTR);
  if (ready < 0) return Ready::kFailed;
  // On POLLERR or POLLHUP write(2) will say what is wrong.
  return descriptors[0].revents != 0 ? Ready::kYes : Ready::kNo;
}

// Writes as much of rest_ as possible now.
bool LineWriter::write_rest() {
  std::size_t written = 0;
  while (written < rest_.size()) {
    const Ready ready = wait_until_writable();
    if (ready == Ready::kNo) break;
    // A pipe that is ready takes PIPE_BUF (4096) bytes without waiting. No record is longer.
    const ssize_t count = ready == Ready::kFailed ? -1
                                                  : ::write(descriptor_, rest_.data() + written,
                                                            rest_.size() - written);
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count < 0) {
      if (errno != EPIPE) {
        error_ = name_ + ": cannot write " + what_ + ": " + std::generic_category().message(errno);
      }
      return false;
    }
    written += static_cast<std::size_t>(count);
  }
  rest_.erase(0, written);
  return true;
}

}  // namespace alidade
