#include "platform/storage/recording.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <istream>
#include <vector>

#include "platform/storage/csv_reader.h"
#include "platform/streams/picture_size.h"
#include "platform/system/shown.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

std::optional<std::int64_t> whole(const std::optional<double>& cell) {
  return cell ? std::optional<std::int64_t>(static_cast<std::int64_t>(*cell)) : std::nullopt;
}

const std::vector<CsvColumn> kFrameColumns = {
    {"frame", true, true},           {"receive_time_s", true, false},
    {"sender_time_s", false, false}, {"sender_utc_s", false, false},
    {"sequence", false, true},       {"restarted", false, true}};

const std::vector<CsvColumn> kTelemetryColumns = {
    {"receive_time_s", true, false},   {"pan_rad", true, false},
    {"tilt_rad", true, false},         {"zoom", false, false},
    {"device_time_s", false, false},   {"sequence", false, true},
    {"earliest_time_s", false, false}, {"restarted", false, true}};

const std::vector<CsvColumn> kTrackColumns = {{"frame", true, true},
                                              {"landmark", true, true},
                                              {"u_px", true, false},
                                              {"v_px", true, false},
                                              {"sigma_px", true, false}};

AddCsvRow add_to(std::vector<FrameStamp>* frames) {
  return [frames](const CsvCells& cells) -> std::string {
    if (*cells[0] < 0) {
      return "a negative frame number";
    }
    FrameStamp stamp;
    stamp.frame = *whole(cells[0]);
    stamp.receive_time_s = *cells[1];
    stamp.sender_time_s = cells[2];
    stamp.sender_utc_s = cells[3];
    stamp.sequence = whole(cells[4]);
    stamp.restarted = cells[5].value_or(0) != 0;
    frames->push_back(stamp);
    return {};
  };
}

AddCsvRow add_to(std::vector<PanTiltSample>* samples) {
  return [samples](const CsvCells& cells) -> std::string {
    PanTiltSample sample;
    sample.latest_time_s = *cells[0];
    sample.pan_rad = *cells[1];
    sample.tilt_rad = *cells[2];
    sample.zoom = cells[3];
    sample.device_time_s = cells[4];
    sample.sequence = whole(cells[5]);
    sample.earliest_time_s = cells[6].value_or(sample.latest_time_s);
    sample.restarted = cells[7].value_or(0) != 0;
    if (sample.earliest_time_s > sample.latest_time_s) {
      return "earliest_time_s lies after receive_time_s";
    }
    samples->push_back(sample);
    return {};
  };
}

AddCsvRow add_to(std::vector<TrackPoint>* points) {
  return [points](const CsvCells& cells) -> std::string {
    points->push_back({*whole(cells[0]), *whole(cells[1]), *cells[2], *cells[3], *cells[4]});
    return {};
  };
}

}  // namespace

bool parse_recording_info(const std::string& text, const std::string& name, RecordingInfo* info,
                          std::string* error) {
  const auto flaw = [&](const YAML::Mark& mark, const std::string& what) {
    *error = name + ":" + std::to_string(std::max(mark.line, 0) + 1) + ": " + shown(what) +
             "; needed are format: 1, width and height in px";
    return false;
  };
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap() || !root["format"] || root["format"].as<int>() != 1) {
      return flaw(root.Mark(), "not a recording of format 1");
    }
    RecordingInfo read;
    for (const auto& [key, value] :
         {std::pair("width", &read.width), std::pair("height", &read.height)}) {
      if (!root[key]) {
        return flaw(root.Mark(), std::string("no ") + key);
      }
      *value = root[key].as<int>();
      if (*value < 1) {
        return flaw(root[key].Mark(), std::string(key) + " must be positive");
      }
      if (*value > kMostPictureSide) {
        return flaw(root[key].Mark(), std::string(key) + " is larger than " +
                                          std::to_string(kMostPictureSide) + " px");
      }
    }
    if (root["notes"] && root["notes"].IsScalar()) {
      read.notes = root["notes"].Scalar();
    }
    *info = read;
    return true;
  } catch (const YAML::Exception& exception) {
    return flaw(exception.mark, exception.msg);
  }
}

bool read_recording_info(const std::string& directory, RecordingInfo* info, std::string* error) {
  const std::string path = directory + "/recording.yaml";
  std::string text;
  if (!read_file(path, &text, error)) {
    error->append("; a recording is a directory with this file");
    return false;
  }
  return parse_recording_info(text, path, info, error);
}

bool parse_frames_csv(std::istream& text, const std::string& name, std::vector<FrameStamp>* frames,
                      std::string* error) {
  frames->clear();
  return parse_csv(text, name, kFrameColumns, add_to(frames), error);
}

bool read_frames_csv(const std::string& directory, std::vector<FrameStamp>* frames,
                     std::string* error) {
  frames->clear();
  return read_csv(directory + "/frames.csv", kFrameColumns, add_to(frames), error);
}

bool parse_telemetry_csv(std::istream& text, const std::string& name,
                         std::vector<PanTiltSample>* samples, std::string* error) {
  samples->clear();
  return parse_csv(text, name, kTelemetryColumns, add_to(samples), error);
}

bool read_telemetry_csv(const std::string& directory, std::vector<PanTiltSample>* samples,
                        std::string* error) {
  samples->clear();
  return read_csv(directory + "/telemetry.csv", kTelemetryColumns, add_to(samples), error);
}

bool parse_tracks_csv(std::istream& text, const std::string& name, std::vector<TrackPoint>* points,
                      std::string* error) {
  points->clear();
  return parse_csv(text, name, kTrackColumns, add_to(points), error);
}

std::string tracks_csv_columns() {
  std::string columns;
  for (const CsvColumn& column : kTrackColumns)
    columns.append(columns.empty() ? "" : ",").append(column.name);
  return columns;
}

bool read_tracks_csv(const std::string& directory, std::vector<TrackPoint>* points,
                     std::string* error) {
  points->clear();
  return read_csv(directory + "/tracks.csv", kTrackColumns, add_to(points), error);
}

}  // namespace alidade
