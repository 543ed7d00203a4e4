#pragma once
// LandmarkMaker: makes landmarks from a frame with known motion: FAST corners in cells of the image
// that show none yet (PTCEE 36).
// Cells of octave l are cell_size_px * min(2^l, largest_cells) wide (px of the image). Fine octaves
// are searched cell by cell, each time from another cell on, so that the budget reaches all cells
// in turn. One coarse octave is searched completely each time. In an empty view the budget
// (max_new) does not limit.
// The constructor takes all memory; nothing else allocates, waits or throws. One thread.

#include <cstdint>
#include <memory>
#include <vector>

#include "core/model/calibration.h"
#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/lens_scale.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/processed_frame.h"
#include "core/realtime/oe_mode/visible_landmarks.h"

namespace alidade {

struct LandmarkMakerOptions {
  static constexpr double kLeastCellSize_px = 16;

  double cell_size_px = 80;  // px, of octave 0, at the image's centre; >= kLeastCellSize_px
  double largest_cells = 3;  // times cell_size_px, >= 1; largest cells of coarse octaves
  int max_new = 100;         // landmarks per call, if the view is not empty
  int empty_view = 50;       // landmarks; a view with fewer is empty
  std::uint8_t corner_threshold = 10;  // grey levels, of FAST
  double textured = 0.25;  // in [0, 1]; share of the first coarse octave's cells with a corner

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

class LandmarkMaker {
 public:
  // options: valid. max_width, max_height: px.
  LandmarkMaker(const LandmarkMakerOptions& options, const OctaveOptions& octaves, int max_width,
                int max_height);
  LandmarkMaker(const LandmarkMaker&) = delete;
  LandmarkMaker& operator=(const LandmarkMaker&) = delete;

  // frame.motion belongs to the image in the pyramid. visible: landmarks of the map in the image.
  // lens: the frame's own, if it has one, as in SearchedFrame. Returns the share of new landmarks
  // in view, 0 to 1.
  double make(const Calibration& calibration, const Pyramid& pyramid, const Octaves& octaves,
              const ProcessedFrame& frame, const std::vector<VisibleLandmark>& visible,
              LandmarkMap* map, const LensColumns* lens = nullptr);

  // True if the image has enough texture to show landmarks. False if the pyramid has no coarse
  // octave.
  [[nodiscard]] bool is_textured(const Pyramid& pyramid, const Octaves& octaves);

  // rad, for LandmarkMap::clear().
  [[nodiscard]] double cell_size(const Camera<double>& camera) const {
    return options_.cell_size_px / camera.focal_length;
  }
  [[nodiscard]] double largest_cell_size(const Camera<double>& camera) const {
    return options_.largest_cells * options_.cell_size_px / camera.focal_length;
  }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct View;

  [[nodiscard]] double cell_px(int octave) const;
  [[nodiscard]] int corner_cell(int octave) const;
  [[nodiscard]] int cells(int size_px, int octave) const;
  // Makes at most `budget` landmarks in one octave. Returns their number.
  int make_coarse(const View& view, int octave, int budget);
  int make_fine(const View& view, int octave, int budget);
  [[nodiscard]] std::uint8_t& cell_at(const View& view, int octave, const Vector2<double>& u);
  [[nodiscard]] bool make_one(const View& view, const FastCorner& corner, int octave) const;

  LandmarkMakerOptions options_;
  std::vector<std::unique_ptr<FastGrid>> grids_;  // by octave
  std::vector<std::uint8_t> cell_taken_;          // of the image, for one octave
  std::vector<FastCorner> corners_;
};

}  // namespace alidade
