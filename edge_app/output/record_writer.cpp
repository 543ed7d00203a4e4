#include "edge_app/output/record_writer.h"

#include <utility>

namespace alidade {

RecordWriter::RecordWriter(int descriptor, OutputFormat format, std::string name, Stalled stalled)
    : lines_(descriptor, std::move(name), "a record", stalled),
      format_(format),
      header_pending_(format == OutputFormat::kCsv) {}

bool RecordWriter::write(const OrientationRecord& record) {
  std::string line = format_ == OutputFormat::kCsv ? csv_line(record) : json_line(record);
  if (header_pending_) line.insert(0, csv_header());
  if (!lines_.write(std::move(line))) return false;
  if (lines_.taken()) header_pending_ = false;
  return true;
}

}  // namespace alidade
