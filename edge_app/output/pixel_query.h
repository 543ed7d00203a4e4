#pragma once
// What POST /api/v1/direction and /api/v1/pixel ask, and their answers, as JSON: directions of a frame's pixels, each
// at its own row's time, and the pixels that see given directions.
//
//   {"frame": N | "time_s": t, "pixels": [[u, v], ...], "pixel_sigma_px": s}
//   {"frame": N | "time_s": t, "directions": [[x, y, z], ...]}
//
// Frames and units: frame_orientation.h, whose directions, pixels and covariances these are: of motion and
// calibration together, how the motion was found with the calibration included, nothing twice. Of the pixel's
// own noise, s^2 J_u J_u^T is added. Parsers are pure and strict (an unknown key, a wrong type, too many, what
// is not finite is an error that says so) and take memory in proportion to the body, which the caller bounds.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/ground/plane_estimate.h"
#include "core/model/linear_algebra.h"
#include "edge_app/output/json_query.h"
#include "edge_app/record/orientation_record.h"

namespace alidade {

inline constexpr std::size_t kMaxQueryItems = 1000;
inline constexpr std::size_t kMaxQueryBytes = std::size_t{64} << 10;

struct DirectionQuery {
  FrameChoice which;
  std::vector<Vector2<double>> pixels;
  double pixel_sigma_px = 0;  // of each coordinate; 0: pixels known exactly
};

struct PixelQuery {
  FrameChoice which;
  std::vector<Vector3<double>> directions;  // unit, base
};

// False with one line in *error.
[[nodiscard]] bool parse_direction_query(const std::string& body, DirectionQuery* query,
                                         std::string* error);
[[nodiscard]] bool parse_pixel_query(const std::string& body, PixelQuery* query,
                                     std::string* error);

// Of a record with a frame and an orientation. One line of JSON with a line feed. With a plane each direction has its place on it.
[[nodiscard]] std::string direction_answer(const OrientationRecord& record,
                                           const DirectionQuery& query,
                                           const PlaneEstimate* plane = nullptr);
[[nodiscard]] std::string pixel_answer(const OrientationRecord& record, const PixelQuery& query);

}  // namespace alidade
