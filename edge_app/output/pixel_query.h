#pragma once
// Requests and answers of POST /api/v1/direction and /api/v1/pixel as JSON: the directions of a
// frame's pixels, each at the time of its own row, and the pixels that see given directions.
//
//   {"frame": N | "time_s": t, "pixels": [[u, v], ...], "pixel_sigma_px": s, "distance_m": r}
//   {"frame": N | "time_s": t, "directions": [[x, y, z], ...]}
//
// Frames, units, directions, pixels and covariances are those of frame_orientation.h. A covariance
// holds the errors of motion and of calibration, and their correlation, each once. For the noise of
// the pixel s^2 J_u J_u^T is added. With a distance (m, from where the axes meet) a direction is
// that of a thing there (pupil.h), and the covariance holds what the pupil's place leaves open. The
// parsers are pure and strict (json_query.h); more than kMaxQueryItems are an error, too.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/ground/plane_estimate.h"
#include "core/model/linear_algebra.h"
#include "core/model/pupil.h"
#include "edge_app/output/json_query.h"
#include "edge_app/record/orientation_record.h"

namespace alidade {

inline constexpr std::size_t kMaxQueryItems = 1000;
inline constexpr std::size_t kMaxQueryBytes = std::size_t{64} << 10;

struct DirectionQuery {
  FrameChoice which;
  std::vector<Vector2<double>> pixels;  // px
  double pixel_sigma_px = 0;            // of each coordinate, to 1000; 0: pixels are exact
  std::optional<double> distance_m;     // of what is seen, kNearestScene_m to 1e9; empty: far
};

struct PixelQuery {
  FrameChoice which;
  std::vector<Vector3<double>> directions;  // unit vectors, base frame
};

// *query must be empty before. False with one line in *error; *query is then undefined.
[[nodiscard]] bool parse_direction_query(const std::string& body, DirectionQuery* query,
                                         std::string* error);
[[nodiscard]] bool parse_pixel_query(const std::string& body, PixelQuery* query,
                                     std::string* error);

// The answer as one line of JSON with a line feed. The record must have a frame, a time and an
// orientation. A pixel or direction without an answer gets `error` in place of it.
// With a plane, each direction also has its place on the plane. scene_nearness: of the scene for
// which the calibration was made (pupil.h), for directions at a distance.
[[nodiscard]] std::string direction_answer(const OrientationRecord& record,
                                           const DirectionQuery& query,
                                           const PlaneEstimate* plane = nullptr,
                                           const Pupil& pupil = {}, double scene_nearness = 0);
[[nodiscard]] std::string pixel_answer(const OrientationRecord& record, const PixelQuery& query);

}  // namespace alidade
