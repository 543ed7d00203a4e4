#pragma once
// POST /api/v1/direction and /api/v1/pixel: requests and answers as JSON (schemas: openapi.yaml).
// The first asks where pixels of a frame look, each when its own row was exposed. The second asks
// which pixels see given directions.
//   {"frame": N | "time_s": t, "pixels": [[u, v], ...], "pixel_sigma_px": s, "distance_m": r}
//   {"frame": N | "time_s": t, "directions": [[x, y, z], ...]}
// Pixels, directions (base frame) and covariances are as in frame_orientation.h. The parsers are
// pure and strict (json_query.h). A request without items, or with more than kMaxQueryItems, is an
// error.

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
// The largest body of these and of other small requests; the HTTP server refuses a larger one.
inline constexpr std::size_t kMaxQueryBytes = std::size_t{64} << 10;

struct DirectionQuery {
  FrameChoice which;
  std::vector<Vector2<double>> pixels;  // px
  double pixel_sigma_px = 0;            // of each coordinate, 0 to 1000; 0: exact
  std::optional<double> distance_m;     // of what is seen, kNearestScene_m to 1e9; empty: far
};

struct PixelQuery {
  FrameChoice which;
  std::vector<Vector3<double>>
      directions;  // unit vectors, base frame; any length but 0 in the request
};

// *query must be empty before. False with one line in *error; *query is then undefined.
[[nodiscard]] bool parse_direction_query(const std::string& body, DirectionQuery* query,
                                         std::string* error);
[[nodiscard]] bool parse_pixel_query(const std::string& body, PixelQuery* query,
                                     std::string* error);

// One line of JSON with a line feed. The record must have a frame, a time and an orientation. An
// item without an answer has only its pixel or direction, and `error`.
// covariance: errors of motion and calibration, with their correlation; plus s^2 J J^T, J the
// derivative of the direction by the pixel (rad/px), in `basis`. With distance_m the direction is
// that from where the axes meet, and the covariance also has the error of the pupil's place.
// plane: if not null, each direction also has its place on it. scene_nearness: of the scene from
// which the calibration was made (pupil.h); used only with distance_m.
[[nodiscard]] std::string direction_answer(const OrientationRecord& record,
                                           const DirectionQuery& query,
                                           const PlaneEstimate* plane = nullptr,
                                           const Pupil& pupil = {}, double scene_nearness = 0);
[[nodiscard]] std::string pixel_answer(const OrientationRecord& record, const PixelQuery& query);

}  // namespace alidade
