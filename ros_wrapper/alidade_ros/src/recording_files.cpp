#include "alidade_ros/recording_files.h"

#include <yaml-cpp/yaml.h>

extern "C" {
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace alidade_ros {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

struct PictureFormat {
  PictureType type;
  const char* extension;
  std::array<std::uint8_t, 2> first_bytes;
};
constexpr std::array<PictureFormat, 3> kFormats = {{{PictureType::kJpeg, ".jpg", {0xFF, 0xD8}},
                                                    {PictureType::kPng, ".png", {0x89, 'P'}},
                                                    {PictureType::kPgm, ".pgm", {'P', '5'}}}};

[[noreturn]] void fail(const std::string& where, const std::string& what) {
  throw std::runtime_error(where + ": " + what);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',') {
      cells.emplace_back();
    } else if (c != ' ' && c != '\t' && c != '\r') {
      cells.back() += c;
    }
  }
  return cells;
}

// Reads named columns of a CSV file of numbers, row by row: the required ones, then the optional
// ones. These are NaN if the cell is empty or the column is missing.
std::vector<std::vector<double>> read_table(const std::string& path,
                                            const std::vector<std::string>& required,
                                            const std::vector<std::string>& optional) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) fail(path, "cannot be read, or is empty");
  const std::vector<std::string> names = cells_of(line);
  std::vector<std::string> wanted = required;
  wanted.insert(wanted.end(), optional.begin(), optional.end());
  std::vector<std::size_t> places;
  for (const std::string& name : wanted) {
    const auto place = std::find(names.begin(), names.end(), name);
    places.push_back(static_cast<std::size_t>(place - names.begin()));
    if (place == names.end() && places.size() <= required.size()) {
      fail(path + ":1", "there is no column " + name);
    }
  }
  std::vector<std::vector<double>> rows;
  for (int number = 2; std::getline(file, line); ++number) {
    const std::string where = path + ":" + std::to_string(number);
    // The last line may be cut off in the middle of a number.
    if (file.eof()) fail(where, "does not end with a line feed");
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() == 1 && cells[0].empty()) continue;
    if (cells.size() != names.size()) {
      fail(where, "has " + std::to_string(cells.size()) + " cells, the first line " +
                      std::to_string(names.size()));
    }
    std::vector<double> values;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const std::string cell = places[i] < cells.size() ? cells[places[i]] : "";
      const bool missing = cell.empty() && i >= required.size();
      char* end = nullptr;
      const double value = std::strtod(cell.c_str(), &end);
      if (!missing && (cell.empty() || *end != '\0' || !std::isfinite(value))) {
        fail(where, wanted[i] + " is \"" + cell + "\", no finite number");
      }
      values.push_back(missing ? std::numeric_limits<double>::quiet_NaN() : value);
    }
    rows.push_back(values);
  }
  return rows;
}

std::optional<double> value_or_none(double value) {
  return std::isnan(value) ? std::nullopt : std::optional<double>(value);
}

std::string text(double number) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.17g", number);
  return buffer;
}

std::string text(const std::optional<double>& number) { return number ? text(*number) : ""; }

std::string number_of(std::int64_t frame) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%06lld", static_cast<long long>(frame));
  return buffer;
}

Bytes read_bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), {});
}

void write_file(const fs::path& path, const void* bytes, std::size_t size) {
  std::ofstream file(path, std::ios::binary);
  file.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  if (!file.flush()) fail(path.string(), "cannot be written");
}

void write_file(const fs::path& path, const std::string& content) {
  write_file(path, content.data(), content.size());
}

// The JPEG pictures of a video, in order.
class JpegVideo {
 public:
  explicit JpegVideo(const std::string& path) {
    av_log_set_level(AV_LOG_QUIET);
    AVFormatContext* context = nullptr;
    if (avformat_open_input(&context, path.c_str(), nullptr, nullptr) < 0) {
      fail(path, "cannot be read as a video");
    }
    context_.reset(context);
    stream_ = av_find_best_stream(context, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
    if (stream_ < 0) fail(path, "there is no video in it");
    const AVCodecID codec = context->streams[stream_]->codecpar->codec_id;
    if (codec != AV_CODEC_ID_MJPEG) {
      fail(path,
           std::string("holds ") + avcodec_get_name(codec) +
               ", of which a bag takes no frames; make pictures of it first: ffmpeg -i video.mkv "
               "-start_number 0 frames/%06d.png");
    }
  }

  // Empty at the end.
  [[nodiscard]] Bytes next() {
    for (;;) {
      av_packet_unref(packet_.get());
      if (av_read_frame(context_.get(), packet_.get()) < 0) return {};
      if (packet_->stream_index != stream_) continue;
      return Bytes(packet_->data, packet_->data + packet_->size);
    }
  }

 private:
  struct Deleter {
    void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
    void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  };
  std::unique_ptr<AVFormatContext, Deleter> context_;
  std::unique_ptr<AVPacket, Deleter> packet_{av_packet_alloc()};
  int stream_ = -1;
};

}  // namespace

std::optional<PictureType> picture_type(const Bytes& bytes) {
  for (const PictureFormat& format : kFormats) {
    if (bytes.size() > 2 &&
        std::equal(format.first_bytes.begin(), format.first_bytes.end(), bytes.begin())) {
      return format.type;
    }
  }
  return std::nullopt;
}

RecordingTables read_tables(const std::string& directory) {
  RecordingTables tables;
  const std::string info = directory + "/recording.yaml";
  try {
    const YAML::Node yaml = YAML::LoadFile(info);
    if (yaml["format"].as<int>() != 1) fail(info, "format: must be 1");
    tables.width = yaml["width"].as<int>();
    tables.height = yaml["height"].as<int>();
  } catch (const YAML::Exception& error) {
    fail(info, std::string("is not that of a recording: ") + error.what());
  }
  for (const auto& row :
       read_table(directory + "/frames.csv", {"frame", "receive_time_s"}, {"sender_time_s"})) {
    tables.frames.push_back({std::llround(row[0]), row[1], value_or_none(row[2])});
  }
  for (const auto& row :
       read_table(directory + "/telemetry.csv", {"receive_time_s", "pan_rad", "tilt_rad"},
                  {"zoom", "device_time_s", "earliest_time_s"})) {
    tables.samples.push_back({row[0], row[1], row[2], value_or_none(row[3]), value_or_none(row[4]),
                              value_or_none(row[5])});
  }
  return tables;
}

void read_pictures(const std::string& directory, const RecordingTables& tables,
                   const std::function<void(const RecordedFrame&, const Bytes&)>& take) {
  if (fs::exists(directory + "/video.mkv")) {
    JpegVideo video(directory + "/video.mkv");
    for (const RecordedFrame& frame : tables.frames) {
      const Bytes bytes = video.next();
      if (bytes.empty()) return;
      take(frame, bytes);
    }
    return;
  }
  for (const RecordedFrame& frame : tables.frames) {
    const std::string stem = directory + "/frames/" + number_of(frame.frame);
    const auto format =
        std::find_if(kFormats.begin(), kFormats.end(),
                     [&stem](const PictureFormat& f) { return fs::exists(stem + f.extension); });
    if (format == kFormats.end()) {
      fail(stem, "no such picture with .png, .jpg or .pgm, but a row in frames.csv");
    }
    take(frame, read_bytes(stem + format->extension));
  }
}

void make_recording_directory(const std::string& directory) {
  std::error_code error;
  if (fs::exists(directory, error) && !fs::is_empty(directory, error)) {
    fail(directory, "is not empty; name a new directory");
  }
  fs::create_directories(directory + "/frames", error);
  if (error) fail(directory, error.message());
}

void write_picture(const std::string& directory, std::int64_t frame, PictureType type,
                   const Bytes& bytes) {
  const auto format = std::find_if(kFormats.begin(), kFormats.end(),
                                   [type](const PictureFormat& f) { return f.type == type; });
  write_file(directory + "/frames/" + number_of(frame) + format->extension, bytes.data(),
             bytes.size());
}

void write_tables(const std::string& directory, const RecordingTables& tables,
                  const std::string& notes) {
  YAML::Emitter yaml;
  yaml << YAML::BeginMap << YAML::Key << "format" << YAML::Value << 1 << YAML::Key << "width"
       << YAML::Value << tables.width << YAML::Key << "height" << YAML::Value << tables.height
       << YAML::Key << "notes" << YAML::Value << YAML::DoubleQuoted << notes << YAML::EndMap;
  write_file(directory + "/recording.yaml", std::string(yaml.c_str()) + "\n");
  std::ostringstream frames;
  frames << "frame,receive_time_s,sender_time_s\n";
  for (const RecordedFrame& frame : tables.frames) {
    frames << frame.frame << ',' << text(frame.receive_time_s) << ',' << text(frame.sender_time_s)
           << '\n';
  }
  write_file(directory + "/frames.csv", frames.str());
  std::ostringstream samples;
  samples << "receive_time_s,pan_rad,tilt_rad,zoom,device_time_s,earliest_time_s\n";
  for (const RecordedSample& sample : tables.samples) {
    samples << text(sample.receive_time_s) << ',' << text(sample.pan_rad) << ','
            << text(sample.tilt_rad) << ',' << text(sample.zoom) << ','
            << text(sample.device_time_s) << ',' << text(sample.earliest_time_s) << '\n';
  }
  write_file(directory + "/telemetry.csv", samples.str());
}

}  // namespace alidade_ros
