#pragma once
// The AprilTag test of the PTCEE paper (its Table VI): a tag far away, found in each frame, is carried into
// one common frame by what a mode of operation says of the two; how far the places scatter there is how
// well that mode knows where its pixels look.
//
//   d_b = direction in base of the tag's centre in frame i, by the row's own record of that frame
//   u   = pixel of d_b in the common frame, by the reference row's record of it
//
// The paper goes into the common frame by each mode's own model, too. That adds one constant vector, and the
// factor by which the mode's focal length is wrong: scatter is told here in true pixels of one camera.
// The centre is where the diagonals cross, of the directions of the four corners, each at the time of its
// own row: neither distortion nor rolling shutter shifts it. The common frame is the one that sees the tag nearest to
// the middle of the image. Every row is judged on the same frames: those where all have an orientation.
// A row made from the truth shows the detector's own noise.
// Records of other processes on the same stream are matched by time_s, which frame clocks
// on one host give alike to about a millisecond. Pixels, frames, units: CONVENTIONS.md.

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "test/accuracy/table.h"
#include "test/accuracy/tag_detector.h"

namespace alidade::test {

struct TagSighting {
  std::int64_t frame = 0;
  TagCorners corners;
};

// What one record says: how the camera looked while one frame was exposed.
struct RecordedOrientation {
  std::int64_t frame = 0;  // counts of different sources have nothing in common
  double time_s = 0;       // capture of row 0, image clock
  Camera<double> camera;
  Mechanics<double> mechanics;
  double line_delay = 0;
  FrameMotion<double> motion;                           // row 0
  Eigen::Vector2d sigma_rad = Eigen::Vector2d::Zero();  // told, about the camera's x and y axes
};

struct TagRow {
  std::string name;
  std::vector<RecordedOrientation> orientations;  // in order of time
};

struct TagRowResult {
  std::string name;
  std::vector<Eigen::Vector2d> places;                  // px, in the common frame
  Eigen::Vector2d deviation = Eigen::Vector2d::Zero();  // standard deviation of u and v, px
  double total = 0;                                     // root of the sum of their squares
  double median_distance = 0;                           // from the median place, px
  Eigen::Vector2d told = Eigen::Vector2d::Zero();  // deviation as the records' sigmas tell it, px
};

struct TagScatter {
  std::int64_t common_frame = 0;
  std::vector<std::int64_t> frames;
  std::vector<TagRowResult> rows;

  // total of a row without the detector's noise, both as variances; 0 if it is not above it.
  [[nodiscard]] static double beyond(const TagRowResult& row, const TagRowResult& noise);
};

// The frames of the reference row are those of the sightings. False, and why, if too few frames are common to all.
[[nodiscard]] bool scatter_of(const std::vector<TagSighting>& sightings,
                              const std::vector<TagRow>& rows, std::size_t reference,
                              TagScatter* scatter, std::string* error);

// Records (JSON Lines of `alidade run` or `replay --json`) of one mode, "PT" or "OE"; the axes are the calibration's.
[[nodiscard]] bool read_orientations(const std::string& file, const std::string& mode,
                                     const Calibration& calibration,
                                     std::vector<RecordedOrientation>* orientations,
                                     std::string* error);

// What the virtual camera did, from its folder's truth.yaml and truth.csv, on the image clock. Rates and accelerations are
// differences of fourth order.
[[nodiscard]] bool read_true_orientations(const std::string& directory,
                                          std::vector<RecordedOrientation>* orientations,
                                          std::string* error);

// noise: index of the row made from the truth; none if there is none.
[[nodiscard]] Table tag_table(const TagScatter& scatter, const TagRowResult* noise);
[[nodiscard]] nlohmann::json to_json(const TagScatter& scatter, const TagRowResult* noise);

}  // namespace alidade::test
