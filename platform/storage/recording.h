#pragma once
// Reads the tables of a recording, a directory:
//   recording.yaml   format: 1, width, height (px), free-form notes
//   frames.csv       frame,receive_time_s[,sender_time_s][,sender_utc_s][,sequence][,restarted]
//   telemetry.csv    receive_time_s,pan_rad,tilt_rad[,zoom][,device_time_s][,sequence]
//                    [,earliest_time_s][,restarted]
//   tracks.csv       frame,landmark,u_px,v_px,sigma_px   (in place of the video, or with it)
// Times are seconds of one clock (the recording host's), angles are radians. A cell of an optional
// column may be empty: the value is unknown. Unknown columns are ignored. Every line ends with a
// newline, so that a file cut off in the middle of a number is not taken for a complete one. An
// error is a negative `frame` of frames.csv, or an interval of telemetry that begins after its end.
// Otherwise stamps are unchecked: the clock filter handles equal or jumping ones. On failure the
// functions return false and *error is one line: what is wrong, file:line, what would be right; a
// vector then holds the rows before the fault. parse_...() take the text itself; name stands for
// the file in errors.

#include <cstdint>
#include <istream>
#include <string>
#include <vector>

#include "platform/streams/frame.h"
#include "platform/streams/pan_tilt_sample.h"

namespace alidade {

struct RecordingInfo {
  int width = 0;      // px, 1 to kMostPictureSide
  int height = 0;     // px, likewise
  std::string notes;  // empty: none
};

// A landmark as seen in one frame: pixel (u right, v down, centre of the top-left pixel (0.5, 0.5))
// and sigma of each coordinate.
struct TrackPoint {
  std::int64_t frame = 0;
  std::int64_t landmark = 0;
  double u_px = 0;
  double v_px = 0;
  double sigma_px = 0;
};

[[nodiscard]] bool parse_recording_info(const std::string& text, const std::string& name,
                                        RecordingInfo* info, std::string* error);
[[nodiscard]] bool read_recording_info(const std::string& directory, RecordingInfo* info,
                                       std::string* error);

[[nodiscard]] bool parse_frames_csv(std::istream& text, const std::string& name,
                                    std::vector<FrameStamp>* frames, std::string* error);
[[nodiscard]] bool read_frames_csv(const std::string& directory, std::vector<FrameStamp>* frames,
                                   std::string* error);

[[nodiscard]] bool parse_telemetry_csv(std::istream& text, const std::string& name,
                                       std::vector<PanTiltSample>* samples, std::string* error);
[[nodiscard]] bool read_telemetry_csv(const std::string& directory,
                                      std::vector<PanTiltSample>* samples, std::string* error);

// Points are passed on unchecked: the calibration handles duplicates and contradictions.
[[nodiscard]] bool parse_tracks_csv(std::istream& text, const std::string& name,
                                    std::vector<TrackPoint>* points, std::string* error);
// The columns of tracks.csv, separated by commas: the first line of such a file.
[[nodiscard]] std::string tracks_csv_columns();
[[nodiscard]] bool read_tracks_csv(const std::string& directory, std::vector<TrackPoint>* points,
                                   std::string* error);

}  // namespace alidade
