#pragma once
// Record and others: the content of the edge executable's HTTP API as structs, in its own
// conventions: base forward-right-down, camera right-down-forward, pan positive right, tilt
// positive up, centre of the top-left pixel (0.5, 0.5); SI units. Field names and meanings are
// those of the API; null there is nullopt here. No side effects: text in, value or one line of
// error out. Unknown fields are ignored, so that an older node understands a newer edge.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "alidade_ros/clock_map.h"
#include "alidade_ros/record_fields.h"

namespace alidade_ros {

// The event `hello` of the stream.
struct Hello {
  std::string version;
  std::string start;
  ClockPair clock;
};

struct ImageSize {
  int width = 0;   // px
  int height = 0;  // px
};

// A sigma of 0: the parameter has none and is exact.
struct ZoomNodeValues {
  double reading = 0;
  double focal_length = 0;
  double focal_length_sigma = 0;
  double radial_distortion = 0;
  double radial_distortion_sigma = 0;
  std::array<double, 2> centre_offset{};
  std::array<double, 2> centre_offset_sigma{};
};

// The part of a calibration that the node interprets.
struct CalibrationValues {
  int width = 0;
  int height = 0;
  double focal_length = 0;
  double aspect = 1;
  double radial_distortion = 0;
  double line_delay = 0;
  std::array<double, 3> pan_axis{0, 0, 1};
  std::array<double, 3> tilt_axis{0, 1, 0};
  double pan_scale = 1;
  double tilt_scale = 1;
  double clock_offset = 0;
  std::array<double, 2> centre_offset{};
  std::optional<double> zoom;
  std::vector<ZoomNodeValues> zoom_nodes;  // empty: there is no zoom curve
  std::optional<double> zoom_repeatability;
  std::vector<std::string> names;
  std::vector<double> covariance;  // row-major over names; empty: not given
};

// The ground under the camera, from GET /api/v1/plane.
struct PlaneValues {
  double heading = 0;  // rad, of the base's forward direction, clockwise from y
  double pitch = 0;    // rad, positive: forward is lifted
  double roll = 0;     // rad, positive: the right side is lowered
  double x = 0;        // m, position of the camera over the plane
  double y = 0;
  double height = 0;
};

[[nodiscard]] bool parse_plane(const std::string& json, PlaneValues* plane, std::string* error);
[[nodiscard]] bool parse_record(const std::string& json, Record* record, std::string* error);
[[nodiscard]] bool parse_hello(const std::string& json, Hello* hello, std::string* error);
[[nodiscard]] bool parse_clock_pair(const std::string& json, ClockPair* pair, std::string* error);
// From the edge's status; nullopt before its first frame.
[[nodiscard]] bool parse_image_size(const std::string& json, std::optional<ImageSize>* size,
                                    std::string* error);
[[nodiscard]] bool parse_calibration(const std::string& json, CalibrationValues* values,
                                     std::string* error);

}  // namespace alidade_ros
