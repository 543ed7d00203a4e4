#pragma once
// RecordingWriter: writes the tables that recording.h reads. Each row is written to the file at
// once and as a whole: after a kill or a full disk, the files hold every row that was reported as
// written and no partial row. Numbers keep all their digits. add_frame() and add_telemetry() may be
// called from two different threads, but each from one thread only.

#include <string>

#include "platform/streams/frame.h"
#include "platform/streams/pan_tilt_sample.h"
#include "platform/system/file_descriptor.h"

namespace alidade {

class RecordingWriter {
 public:
  // Creates the directory if needed. width, height: px. False with one line in *error, also for a
  // directory that already holds a file of a recording; the files made until then are removed.
  [[nodiscard]] bool open(const std::string& directory, int width, int height,
                          const std::string& notes, std::string* error);

  // False: nothing is added, and *error is one line.
  [[nodiscard]] bool add_frame(const FrameStamp& stamp, std::string* error);
  [[nodiscard]] bool add_telemetry(const PanTiltSample& sample, std::string* error);

  // Waits until the rows are on the disk (fsync), against a power cut. Without a flush() rows still
  // survive a kill of the process.
  [[nodiscard]] bool flush(std::string* error);

 private:
  struct Table {
    std::string path;
    FileDescriptor file;
  };
  [[nodiscard]] static bool create(Table* table, const std::string& first_line, std::string* error);
  [[nodiscard]] static bool append(const Table& table, const std::string& text, std::string* error);

  Table frames_;
  Table telemetry_;
};

}  // namespace alidade
