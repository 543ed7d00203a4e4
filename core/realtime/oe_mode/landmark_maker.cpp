#include "core/realtime/oe_mode/landmark_maker.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/model/direction.h"
#include "core/model/rolling_shutter.h"

namespace alidade {
namespace {

constexpr int kLeastCornerCell_px = 8;  // of FastGrid
constexpr int kCornerBorder_px = 3;     // FastGrid finds no corners there
constexpr int kNoLimit = std::numeric_limits<int>::max();
// Step from a frame's first searched cell to the next frame's.
constexpr std::uint32_t kCellStride = 97;

}  // namespace

struct LandmarkMaker::View {
  const Calibration& calibration;
  const Pyramid& pyramid;
  const Octaves& octaves;
  const ProcessedFrame& frame;
  LandmarkMap* map;
  const LensColumns* lens;
};

bool LandmarkMakerOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(textured >= 0 && textured <= 1)) problem = "textured must be 0 to 1";
  if (empty_view < 0) problem = "empty_view must not be negative";
  if (max_new < 0) problem = "max_new must not be negative";
  if (!(largest_cells >= 1)) problem = "largest_cells must be at least 1";
  static_assert(kLeastCellSize_px == 16, "as the message says");
  if (!(cell_size_px >= kLeastCellSize_px)) problem = "cell_size_px must be at least 16";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

LandmarkMaker::LandmarkMaker(const LandmarkMakerOptions& options, const OctaveOptions& octaves,
                             int max_width, int max_height)
    : options_(options) {
  cell_taken_.resize(static_cast<std::size_t>(cells(max_width, 0) * cells(max_height, 0)));
  int most_corners = 0;
  for (int octave = 0; octave < Pyramid::kMaxOctaves; ++octave) {
    const int cell = corner_cell(octave);
    // Fine octaves are searched only in cells without landmarks; coarse ones completely.
    const bool fine = octave < octaves.first_coarse;
    grids_.push_back(std::make_unique<FastGrid>(
        fine ? cell + 2 * kCornerBorder_px : max_width >> octave,
        fine ? cell + 2 * kCornerBorder_px : max_height >> octave, cell));
    most_corners = std::max(most_corners, grids_.back()->max_cells());
  }
  corners_.resize(static_cast<std::size_t>(most_corners));
}

double LandmarkMaker::cell_px(int octave) const {
  return options_.cell_size_px * std::min(std::ldexp(1.0, octave), options_.largest_cells);
}

int LandmarkMaker::corner_cell(int octave) const {
  return std::max(kLeastCornerCell_px, static_cast<int>(std::ldexp(cell_px(octave), -octave)));
}

int LandmarkMaker::cells(int size_px, int octave) const {
  return static_cast<int>(size_px / cell_px(octave)) + 1;
}

std::uint8_t& LandmarkMaker::cell_at(const View& view, int octave, const Vector2<double>& u) {
  const double cell = cell_px(octave);
  const int columns = cells(view.calibration.camera.width, octave);
  return cell_taken_[static_cast<std::size_t>(static_cast<int>(u.y() / cell) * columns +
                                              static_cast<int>(u.x() / cell))];
}

double LandmarkMaker::make(const Calibration& calibration, const Pyramid& pyramid,
                           const Octaves& octaves, const ProcessedFrame& frame,
                           const std::vector<VisibleLandmark>& visible, LandmarkMap* map,
                           const LensColumns* lens) {
  const View view{calibration, pyramid, octaves, frame, map, lens};
  const auto in_view = static_cast<int>(visible.size());
  const bool empty = in_view < options_.empty_view;
  int budget = empty ? kNoLimit : options_.max_new;
  int made = 0;
  for (int octave = pyramid.octaves() - 1; octave >= 0; --octave) {
    const bool coarse = octaves.is_coarse(octave);
    if (coarse && !empty) {
      const auto turn =
          static_cast<int>(frame.frame) % (pyramid.octaves() - octaves.first_coarse());
      if (octave != octaves.first_coarse() + turn) continue;
    }
    const int count =
        cells(calibration.camera.width, octave) * cells(calibration.camera.height, octave);
    std::fill_n(cell_taken_.begin(), count, std::uint8_t{0});
    for (const VisibleLandmark& v : visible) {
      if (v.octave == octave) cell_at(view, octave, v.u) = 1;
    }
    const int made_here =
        coarse ? make_coarse(view, octave, budget) : make_fine(view, octave, budget);
    budget -= made_here;
    made += made_here;
  }
  return static_cast<double>(made) / std::max(1, in_view + made);
}

int LandmarkMaker::make_coarse(const View& view, int octave, int budget) {
  FastGrid& grid = *grids_[static_cast<std::size_t>(octave)];
  const double to_image = std::ldexp(1.0, octave);
  const FastResult result = grid.detect(view.pyramid.octave(octave), options_.corner_threshold,
                                        corners_.data(), static_cast<int>(corners_.size()));
  int made = 0;
  for (int i = 0; i < result.count && made < budget; ++i) {
    const FastCorner& corner = corners_[static_cast<std::size_t>(i)];
    std::uint8_t& taken = cell_at(view, octave, {to_image * corner.u, to_image * corner.v});
    if (taken != 0 || !make_one(view, corner, octave)) continue;
    taken = 1;
    ++made;
  }
  return made;
}

int LandmarkMaker::make_fine(const View& view, int octave, int budget) {
  FastGrid& grid = *grids_[static_cast<std::size_t>(octave)];
  const ImageView& image = view.pyramid.octave(octave);
  const int columns = cells(view.calibration.camera.width, octave);
  const int count = columns * cells(view.calibration.camera.height, octave);
  const int first =
      static_cast<int>(view.frame.frame * kCellStride % static_cast<std::uint32_t>(count));
  const int size = grid.cell_size();
  int searches = budget == kNoLimit ? count : options_.max_new;
  int made = 0;
  for (int i = 0; i < count && made < budget && searches > 0; ++i) {
    const int index = (first + i) % count;
    if (cell_taken_[static_cast<std::size_t>(index)] != 0) continue;
    const int u0 = index % columns * size - kCornerBorder_px;
    const int v0 = index / columns * size - kCornerBorder_px;
    const int u1 = std::min(u0 + size + 2 * kCornerBorder_px, image.width);
    const int v1 = std::min(v0 + size + 2 * kCornerBorder_px, image.height);
    const int left = std::max(u0, 0);
    const int top = std::max(v0, 0);
    const ImageView part{image.row(top) + left, u1 - left, v1 - top, image.stride};
    if (part.width <= 0 || part.height <= 0) continue;
    --searches;
    const FastResult result = grid.detect(part, options_.corner_threshold, corners_.data(), 1);
    if (result.count == 0) continue;
    FastCorner corner = corners_[0];
    corner.u = static_cast<std::uint16_t>(corner.u + left);
    corner.v = static_cast<std::uint16_t>(corner.v + top);
    if (make_one(view, corner, octave)) ++made;
  }
  return made;
}

bool LandmarkMaker::make_one(const View& view, const FastCorner& corner, int octave) const {
  const ImageView& image = view.pyramid.octave(octave);
  constexpr int kBefore = kReferencePixels / 2;
  const int left = corner.u - kBefore;
  const int top = corner.v - kBefore;
  if (left < 0 || top < 0 || left + kReferencePixels > image.width ||
      top + kReferencePixels > image.height) {
    return false;
  }
  const double to_image = std::ldexp(1.0, octave);
  const Vector2<double> u(to_image * (corner.u + 0.5), to_image * (corner.v + 0.5));
  const Calibration& calibration = view.calibration;
  Landmark landmark;
  Matrix<double, 3, 2> J_d_u;
  Matrix<double, 3, 4> J_d_motion;
  Sensitivity<3> J_d_parameters;
  if (rolling_shutter_unproject(calibration.camera, calibration.mechanics, calibration.line_delay,
                                view.frame.motion, u, &landmark.d, &J_d_u, &J_d_motion,
                                &J_d_parameters) != ProjectionStatus::kOk ||
      view.map->cell_taken(landmark.d, octave, view.frame.lens.zoom) ||
      (view.frame.moving != nullptr &&
       view.frame.moving->contains(landmark.d, view.frame.time_s))) {
    return false;
  }
  for (int row = 0; row < kReferencePixels; ++row) {
    std::copy_n(image.row(top + row) + left, kReferencePixels,
                landmark.pixels.data() + row * kReferencePixels);
  }
  ReferencePatch patch;
  if (prepare(landmark.image(), Vector2<double>::Constant(kReferenceCentre),
              Matrix2<double>::Identity(), view.octaves.least_contrast(octave),
              &patch) != PrepareStatus::kOk) {
    return false;
  }
  landmark.octave = static_cast<std::uint8_t>(octave);
  const Matrix<double, 2, 3> to_tangent = tangent_basis(landmark.d).transpose();
  const Matrix2<double> J_tangent_u = to_tangent * J_d_u;
  if (view.lens != nullptr) view.lens->to_map(&J_d_parameters);
  Sensitivity<2> sensitivity =
      to_tangent * (J_d_parameters + J_d_motion * view.frame.sensitivity.topRows<4>());
  landmark.J_pixel_tangent = J_tangent_u.inverse() / to_image;
  // The reference point is exact by definition. The image's noise makes it find itself elsewhere,
  // and so does what made this frame's residuals larger than their covariances.
  const Matrix2<double> J_tangent_pixel = to_image * J_tangent_u;
  const double noise = std::sqrt(view.frame.inflation) * view.octaves.noise(octave);
  landmark.covariance = noise * noise * J_tangent_pixel * patch.unit_covariance.cast<double>() *
                        J_tangent_pixel.transpose();
  if (view.lens != nullptr) {
    // The error of the frame's own lens is not the map's scale.
    const OwnLens& own = view.frame.lens;
    const double time_s = time_of_row(view.frame.motion, calibration.line_delay, u.y());
    const Vector2<double> by_zoom = to_tangent * view.lens->by_map_zoom(J_d_parameters);
    sensitivity += by_zoom * own.sensitivity_at(time_s);
    landmark.covariance += own.variance(time_s) * by_zoom * by_zoom.transpose();
  }
  landmark.sensitivity = sensitivity.cast<float>();
  landmark.shared_covariance =
      view.frame.shared_covariance + view.frame.covariance.topLeftCorner<2, 2>();
  int slot = 0;
  return view.map->insert(landmark, view.frame.frame, &slot, view.frame.lens.zoom) ==
         InsertStatus::kOk;
}

bool LandmarkMaker::is_textured(const Pyramid& pyramid, const Octaves& octaves) {
  if (pyramid.octaves() <= octaves.first_coarse()) return false;
  const ImageView& image = pyramid.octave(octaves.first_coarse());
  FastGrid& grid = *grids_[static_cast<std::size_t>(octaves.first_coarse())];
  const FastResult result = grid.detect(image, options_.corner_threshold, corners_.data(),
                                        static_cast<int>(corners_.size()));
  const double cells_of_image =
      static_cast<double>(image.width) * image.height / (grid.cell_size() * grid.cell_size());
  return !(result.count < options_.textured * cells_of_image);
}

std::size_t LandmarkMaker::memory_bytes() const {
  return cell_taken_.size() + corners_.size() * sizeof(FastCorner);
}

}  // namespace alidade
