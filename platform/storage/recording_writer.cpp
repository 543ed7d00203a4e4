#include "platform/storage/recording_writer.h"

#include <fcntl.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "platform/system/whole_file.h"

namespace alidade {
namespace {

std::string text(double number) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.17g", number);
  return buffer;
}

std::string text(const std::optional<double>& number) { return number ? text(*number) : ""; }

std::string text(const std::optional<std::int64_t>& number) {
  return number ? std::to_string(*number) : "";
}

std::string failure(const std::string& path, int code) {
  return "cannot write " + path + ": " + std::strerror(code);
}

std::string description(int width, int height, const std::string& notes) {
  YAML::Emitter yaml;
  yaml << YAML::BeginMap << YAML::Key << "format" << YAML::Value << 1 << YAML::Key << "width"
       << YAML::Value << width << YAML::Key << "height" << YAML::Value << height;
  if (!notes.empty()) {
    yaml << YAML::Key << "notes" << YAML::Value << YAML::DoubleQuoted << notes;
  }
  yaml << YAML::EndMap;
  return std::string(yaml.c_str()) + "\n";
}

}  // namespace

bool RecordingWriter::create(Table* table, const std::string& first_line, std::string* error) {
  table->file.reset(::open(table->path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (!table->file.is_open()) {
    *error = errno == EEXIST ? table->path + " exists already; record into another directory"
                             : failure(table->path, errno);
    return false;
  }
  return append(*table, first_line, error);
}

bool RecordingWriter::append(const Table& table, const std::string& line, std::string* error) {
  const off_t before = ::lseek(table.file.get(), 0, SEEK_CUR);
  if (before >= 0 && write_all(table.file.get(), line)) {
    return true;
  }
  *error = failure(table.path, errno);
  // Removes a partial row.
  if (before >= 0 && ::ftruncate(table.file.get(), before) == 0) {
    ::lseek(table.file.get(), before, SEEK_SET);
  }
  return false;
}

bool RecordingWriter::open(const std::string& directory, int width, int height,
                           const std::string& notes, std::string* error) {
  std::error_code code;
  std::filesystem::create_directories(directory, code);
  if (code) {
    *error = "cannot make " + directory + ": " + code.message();
    return false;
  }
  frames_.path = directory + "/frames.csv";
  telemetry_.path = directory + "/telemetry.csv";
  Table info{directory + "/recording.yaml", {}};
  const std::array<std::pair<Table*, std::string>, 3> files = {
      {{&frames_, "frame,receive_time_s,sender_time_s,sender_utc_s,sequence,restarted\n"},
       {&telemetry_,
        "receive_time_s,pan_rad,tilt_rad,zoom,device_time_s,sequence,earliest_time_s,restarted\n"},
       {&info, description(width, height, notes)}}};
  for (const auto& [table, text] : files) {
    if (create(table, text, error)) continue;
    // Else the next attempt would be refused because of these.
    for (const auto& [made, unused] : files) {
      if (made->file.is_open()) ::unlink(made->path.c_str());
      made->file.reset();
    }
    return false;
  }
  return true;
}

bool RecordingWriter::add_frame(const FrameStamp& stamp, std::string* error) {
  return append(frames_,
                std::to_string(stamp.frame) + "," + text(stamp.receive_time_s) + "," +
                    text(stamp.sender_time_s) + "," + text(stamp.sender_utc_s) + "," +
                    text(stamp.sequence) + "," + (stamp.restarted ? "1" : "0") + "\n",
                error);
}

bool RecordingWriter::add_telemetry(const PanTiltSample& sample, std::string* error) {
  return append(telemetry_,
                text(sample.latest_time_s) + "," + text(sample.pan_rad) + "," +
                    text(sample.tilt_rad) + "," + text(sample.zoom) + "," +
                    text(sample.device_time_s) + "," + text(sample.sequence) + "," +
                    text(sample.earliest_time_s) + "," + (sample.restarted ? "1" : "0") + "\n",
                error);
}

bool RecordingWriter::flush(std::string* error) {
  for (const Table* table : {&frames_, &telemetry_}) {
    if (::fsync(table->file.get()) != 0) {
      *error = failure(table->path, errno);
      return false;
    }
  }
  return true;
}

}  // namespace alidade
