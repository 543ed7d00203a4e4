#pragma once
// RecordWriter: writes records as lines to a file descriptor. `run` uses it for stdout alone. Only
// `replay` also writes a file with it, as a write to a disk may wait, and a failure ends the
// program. Slow readers: see line_writer.h.

#include <cstddef>
#include <string>

#include "edge_app/output/line_writer.h"
#include "edge_app/record/orientation_record.h"
#include "edge_app/record/record_format.h"

namespace alidade {

class RecordWriter final : public RecordSink {
 public:
  using Stalled = LineWriter::Stalled;

  // Does not own `descriptor`. name: for messages. CSV begins with a header line.
  RecordWriter(int descriptor, OutputFormat format, std::string name, Stalled stalled);

  [[nodiscard]] bool write(const OrientationRecord& record) override;
  void interrupt() override { lines_.interrupt(); }
  [[nodiscard]] std::string error() const override { return lines_.error(); }
  [[nodiscard]] std::size_t dropped() const { return lines_.dropped(); }

 private:
  LineWriter lines_;
  OutputFormat format_;
  bool header_pending_;
};

}  // namespace alidade
