#pragma once
// RecordWriter: records as lines to a file descriptor (stdout or a file), one write(2) a record, so
// that a reader sees each record at once.
//
// A pipe whose reader is slow makes write() wait until interrupt(), or not at all, as is chosen: what cannot be written at once is
// then dropped and counted, whole records only, so that neither the records of others nor the end of the program wait for a reader.
// SIGPIPE must be ignored by the program.

#include <atomic>
#include <cstddef>
#include <string>

#include "edge_app/output/record_format.h"
#include "edge_app/pipeline/orientation_record.h"

namespace alidade {

class RecordWriter final : public RecordSink {
 public:
  // What a reader that takes nothing gets.
  enum class Stalled {
    kWait,  // every record, until interrupt()
    kDrop   // those that there is room for
  };

  // Borrows `descriptor`; `name` is for messages. CSV starts with its header line.
  RecordWriter(int descriptor, OutputFormat format, std::string name, Stalled stalled);
  ~RecordWriter() override;
  RecordWriter(const RecordWriter&) = delete;
  RecordWriter& operator=(const RecordWriter&) = delete;

  [[nodiscard]] bool write(const OrientationRecord& record) override;
  void interrupt() override;
  [[nodiscard]] std::string error() const override { return error_; }
  [[nodiscard]] std::size_t dropped() const { return dropped_; }

 private:
  enum class Ready { kYes, kNo, kFailed };
  Ready wait_until_writable();
  bool write_rest();

  int descriptor_;
  Stalled stalled_;
  int wake_;  // eventfd, readable after interrupt()
  OutputFormat format_;
  std::string name_;
  bool header_pending_;
  std::string rest_;  // of a record that was begun
  std::atomic<std::size_t> dropped_{0};
  std::string error_;
};

}  // namespace alidade
