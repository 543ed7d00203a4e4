#pragma once
// LineWriter: writes lines to a file descriptor (stdout or a file), one write(2) for each line, so
// that a reader sees each line at once.
//
// If the reader of a pipe is slow, write() either waits until interrupt(), or drops and counts
// whole lines that cannot be written at once. With dropping, neither other readers nor the end of
// the program wait for this reader. The program must ignore SIGPIPE.

#include <atomic>
#include <cstddef>
#include <string>

namespace alidade {

class LineWriter {
 public:
  // What happens if the reader takes nothing.
  enum class Stalled {
    kWait,  // write() waits, until interrupt()
    kDrop   // lines for which there is no room are dropped
  };

  // Does not own `descriptor`. name: of the file; what: of the lines, both for messages. Throws
  // std::system_error if the system gives no eventfd.
  LineWriter(int descriptor, std::string name, std::string what, Stalled stalled);
  ~LineWriter();
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  // One thread. The line must end with a line feed. False: no more can be written, see error(),
  // which is empty if the reader of a pipe went away.
  [[nodiscard]] bool write(std::string line);
  // Any thread. From now on write() does not wait.
  void interrupt();
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] std::size_t dropped() const { return dropped_; }
  // Whether the last line given to write() was written, at least its beginning.
  [[nodiscard]] bool taken() const { return taken_; }

 private:
  enum class Ready { kYes, kNo, kFailed };
  Ready wait_until_writable();
  bool write_rest();

  int descriptor_;
  Stalled stalled_;
  int wake_;  // eventfd, readable after interrupt()
  std::string name_;
  std::string what_;
  std::string rest_;  // unwritten rest of a line
  bool taken_ = false;
  std::atomic<std::size_t> dropped_{0};
  std::string error_;
};

}  // namespace alidade
