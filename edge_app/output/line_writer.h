#pragma once
// LineWriter: lines to a file descriptor (stdout or a file), one write(2) a line, so that a reader sees each line at once.
//
// A pipe whose reader is slow makes write() wait until interrupt(), or not at all, as is chosen: what cannot be written at once is
// then dropped and counted, whole lines only, so that neither what others read nor the end of the program wait for a reader.
// SIGPIPE must be ignored by the program.

#include <atomic>
#include <cstddef>
#include <string>

namespace alidade {

class LineWriter {
 public:
  // What a reader that takes nothing gets.
  enum class Stalled {
    kWait,  // every line, until interrupt()
    kDrop   // those that there is room for
  };

  // Borrows `descriptor`; `name` is for messages, `what` is what a line is in them.
  LineWriter(int descriptor, std::string name, std::string what, Stalled stalled);
  ~LineWriter();
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  // Each ends with a line feed. False: no more can be written, see error().
  [[nodiscard]] bool write(std::string line);
  // Thread-safe. From now on write() does not wait.
  void interrupt();
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] std::size_t dropped() const { return dropped_; }
  // Whether the last line that write() was given was written, as a whole or its beginning.
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
  std::string rest_;  // of a line that was begun
  bool taken_ = false;
  std::atomic<std::size_t> dropped_{0};
  std::string error_;
};

}  // namespace alidade
