#pragma once
// RecordingWriter: writes the tables that recording.h reads. Each row goes to the file at once and
// whole: after a kill, or when the disk is full, the files hold every row that was reported as
// written and no half row. Numbers keep all their digits.
// add_frame() and add_telemetry() may be called by two different threads; neither by several.

#include <string>

#include "platform/streams/frame.h"
#include "platform/streams/pan_tilt_sample.h"
#include "platform/system/file_descriptor.h"

namespace alidade {

class RecordingWriter {
 public:
  // Makes the directory if need be; refuses one that already holds a recording's tables.
  [[nodiscard]] bool open(const std::string& directory, int width, int height,
                          const std::string& notes, std::string* error);

  [[nodiscard]] bool add_frame(const FrameStamp& stamp, std::string* error);
  [[nodiscard]] bool add_telemetry(const PanTiltSample& sample, std::string* error);

  // Asks the system to bring everything to the disk itself (rows already survive a kill without
  // it).
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
