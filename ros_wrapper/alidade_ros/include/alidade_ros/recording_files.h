#pragma once
// Tables and pictures of a recording on disk, as the edge executable reads and writes them:
//   recording.yaml   format: 1, width, height (px), free-form notes
//   frames.csv       frame,receive_time_s[,sender_time_s]...
//   telemetry.csv    receive_time_s,pan_rad,tilt_rad[,zoom][,device_time_s][,earliest_time_s]...
//   frames/000000.png|jpg|pgm ... or video.mkv
// Times are seconds of one clock. Angles are Alidade's (pan positive right, tilt positive up).
// Errors are thrown as std::runtime_error with one line that names file and line. Unknown columns
// are ignored.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace alidade_ros {

struct RecordedFrame {
  std::int64_t frame = 0;
  double receive_time_s = 0;
  std::optional<double> sender_time_s;
};

struct RecordedSample {
  double receive_time_s = 0;
  double pan_rad = 0;
  double tilt_rad = 0;
  std::optional<double> zoom;
  std::optional<double> device_time_s;
  std::optional<double> earliest_time_s;
};

struct RecordingTables {
  int width = 0;   // px
  int height = 0;  // px
  std::vector<RecordedFrame> frames;
  std::vector<RecordedSample> samples;
};

enum class PictureType { kJpeg, kPng, kPgm };

// Type by the first bytes; nullopt: another type.
[[nodiscard]] std::optional<PictureType> picture_type(const std::vector<std::uint8_t>& bytes);

[[nodiscard]] RecordingTables read_tables(const std::string& directory);

// Calls take for each frame that has a picture, with the bytes of the picture file or of the JPEG
// in the video. Frames after the end of the video are left out.
void read_pictures(
    const std::string& directory, const RecordingTables& tables,
    const std::function<void(const RecordedFrame&, const std::vector<std::uint8_t>&)>& take);

// Creates directory/frames; refuses a directory that is not empty.
void make_recording_directory(const std::string& directory);
void write_picture(const std::string& directory, std::int64_t frame, PictureType type,
                   const std::vector<std::uint8_t>& bytes);
void write_tables(const std::string& directory, const RecordingTables& tables,
                  const std::string& notes);

}  // namespace alidade_ros
