#include "core/realtime/oe_mode/oe_mode.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>
#include <vector>

#include "core/model/direction.h"
#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/image_noise.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/coarse_alignment.h"
#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/oe_mode/view_projection.h"
#include "core/realtime/pt_mode.h"

namespace alidade {
namespace {

// Octaves below align landmarks one by one, those from here on together, coarsely.
constexpr int kFirstCoarseOctave = 2;
constexpr int kLeastCoarseHeight = 32;  // px, of the coarsest octave
constexpr double kLargestCells = 3;     // the cells of coarse octaves, in cells of octave 0
constexpr int kCoarsePatches = 40;      // of each octave
constexpr double kLeastCell = 16;       // px
constexpr int kLeastCornerCell = 8;     // px, of FastGrid
constexpr int kCornerBorder = 3;        // px, where FastGrid finds nothing
constexpr double kExpectedNoise = 2;    // grey levels, until a picture tells
constexpr std::size_t kNoiseSamples = 2048;

// Accelerations to expect, in fields of view per s^2: weak knowledge, for frames with few landmarks.
constexpr double kAcceleration = 10;
constexpr double kNever = -std::numeric_limits<double>::infinity();
constexpr double kLongestPrediction = 0.5;  // s, without telemetry
// The offset of map and telemetry drifts: heat, gears. rad / sqrt(s)
constexpr double kOffsetDrift = 1e-6;
// What the landmarks in view have in common stays with them; so long they are taken to be the same. s
constexpr double kSharedRenewal = 10;

constexpr int kFew = 10;        // landmarks; with fewer a view is one that the map does not know
constexpr int kEmptyView = 50;  // landmarks; with fewer a view needs all that can be made
constexpr int kMaxMisses = 15;  // in a row
constexpr std::uint32_t kProbation = 20;
constexpr double kLeastMatched = 0.3;
// A map that fits no more for so many frames in a row is of no use.
constexpr int kContradictionsToReset = 50;
constexpr int kLostToReset = 1000;
// ... and one that was handed over and never fitted, sooner.
constexpr int kLostToDoubt = 50;

// As the reference was seen; a patch is prepared again when its warp has changed by this.
constexpr float kFineWarpTolerance = 0.02F;
constexpr float kCoarseWarpTolerance = 0.04F;

struct Prepared {
  ReferencePatch patch;
  Matrix2<float> A;
  std::uint32_t id = 0;  // of the landmark it belongs to
  PrepareStatus status = PrepareStatus::kTooFlat;
};

struct Visible {
  int slot;
  int octave;
  Vector2<double> u;  // px of the image, predicted
};

// Of (rate, acceleration) of one axis.
Matrix2<double> rate_covariance(const Matrix6& motion, int axis) {
  Matrix2<double> out;
  out << motion(2 + axis, 2 + axis), motion(2 + axis, 4 + axis), motion(4 + axis, 2 + axis),
      motion(4 + axis, 4 + axis);
  return out;
}

// By how much a variance grows if an error that is another after renewal_s was met elapsed_s ago already.
double diluted(double renewal_s, double elapsed_s) {
  constexpr double kLeastElapsed = 1e-3;  // s
  return std::max(1.0, renewal_s / std::max(std::abs(elapsed_s), kLeastElapsed));
}

// At a constant acceleration; what it is later, nobody knows.
FrameMotion<double> carried_on(const FrameMotion<double>& from, double t) {
  FrameMotion<double> to = from;
  to.angle = {from.angle.pan + t * from.rate.pan + t * t / 2 * from.acceleration.pan,
              from.angle.tilt + t * from.rate.tilt + t * t / 2 * from.acceleration.tilt};
  to.rate = {from.rate.pan + t * from.acceleration.pan,
             from.rate.tilt + t * from.acceleration.tilt};
  to.acceleration = {};
  return to;
}

template <int kSize>
bool is_covariance(const Matrix<double, kSize, kSize>& m) {
  constexpr double kRounding = 1e-9;
  // Principal minors of order 2 do: what they let pass of a 3x3 harms nothing.
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) {
      const double bound = m(i, i) * m(j, j) * (1 + kRounding);
      if (!(m(i, i) >= 0) || !(m(i, j) * m(i, j) <= bound)) return false;
    }
  }
  return all_finite(m);
}

bool makes_sense(const Landmark& landmark) {
  return is_covariance(landmark.covariance) && is_covariance(landmark.shared_covariance) &&
         all_finite(landmark.sensitivity) && std::isnormal(landmark.J_pixel_tangent.determinant());
}

}  // namespace

struct OeMode::State {
  explicit State(const OeOptions& options);

  void reset(const Calibration& new_calibration);
  void take(const MapState& from);
  [[nodiscard]] MapState map_state() const;
  OeStatus process(const ImageView& image, double frame_time_s,
                   const InterpolatedPanTilt* telemetry, FrameOrientation* out);
  void maintain();

  [[nodiscard]] std::size_t memory_bytes() const;
  [[nodiscard]] int top_octave() const;
  [[nodiscard]] int corner_cell(int octave) const;
  [[nodiscard]] int cells(int size_px, int octave) const;
  [[nodiscard]] double cell_px(int octave) const;
  [[nodiscard]] double noise(int octave) const;
  [[nodiscard]] double least_contrast(int octave) const;
  [[nodiscard]] bool inside(const Vector2<double>& u, int octave) const;

  void find_visible(const ViewProjection& view);
  const ReferencePatch* reference(int slot, const SeenDirection& seen);
  void take_coarse_patches(const ViewProjection& view);
  bool align_coarse(double sigma_px);
  void choose_fine();
  void align_fine(const ViewProjection& view);
  void finish_observations(const SolvedMotion& solved);
  void learn_noise();

  [[nodiscard]] double time_per_angle() const;
  void move_bend(double tilt);
  void add_bend(Matrix6* covariance) const;
  [[nodiscard]] Matrix2<double> bend_of_angles() const;
  [[nodiscard]] bool learn_offset(double frame_time_s, const Vector2<double>& innovation,
                                  const Matrix2<double>& covariance, const Matrix2<double>& shared,
                                  const Sensitivity<2>& sensitivity);
  void add_late_telemetry(double frame_time_s, const InterpolatedPanTilt& telemetry);
  void remember_untold(const Vector2<double>& angle, const Sensitivity<2>& sensitivity,
                       const Matrix2<double>& covariance, const Matrix2<double>& shared);
  void remember_motion();
  [[nodiscard]] bool straighten_map();
  void bend_map(const Vector2<double>& rate, const Vector2<double>& acceleration,
                double origin_tilt);
  void judge_coarse(const ViewProjection& view);
  void refine_landmarks();
  void mark(int slot, bool matched, double residual_square);
  void make_landmarks(const ViewProjection& view);
  bool make_landmark(const FastCorner& corner, int octave);
  void clear_landmarks();
  void forget_map();
  void doubt_map();

  OeOptions options;
  Calibration calibration;
  bool ready = false;
  double cone = 0;           // rad, from the optical axis to the farthest corner
  double field_of_view = 0;  // rad, horizontal

  Pyramid pyramid;
  LandmarkMap map;
  std::vector<Prepared> prepared;                       // by slot
  std::vector<std::unique_ptr<FastGrid>> corner_grids;  // by octave
  std::vector<int> slots;
  std::vector<Visible> visible;  // of the last projection
  int visible_count = 0;
  std::vector<CoarsePatch> coarse;
  std::vector<int> coarse_slots;
  int coarse_count = 0;
  std::vector<Visible> chosen;
  int chosen_count = 0;
  std::vector<FoundLandmark> found;
  std::vector<Matrix2<double>> J_tangent;  // d u / d landmark's tangent coordinates, of found
  std::vector<Matrix2<double>> alignment_covariance;
  std::vector<float> noise_samples;
  std::vector<OeObservation> observations;
  std::vector<std::uint8_t> cell_taken;  // of the image, at one octave
  std::vector<FastCorner> corners;

  // base angle = map angle + offset
  MapOffset offset;
  // The frame whose telemetry it learnt from last; before the first, no time.
  double told_time_s = kNever;
  double answered_time_s = kNever;  // the frame that telemetry, extrapolated or not, answered last
  // Frames whose telemetry was extrapolated, the latest in a ring.
  struct Untold {
    double time_s = kNever;
    // rad, map, at the middle row
    Vector2<double> angle = Vector2<double>::Zero();
    Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
    // Of it, by noise and the map's bend ...
    Matrix2<double> covariance = Matrix2<double>::Zero();
    // ... and by what the landmarks share.
    Matrix2<double> shared = Matrix2<double>::Zero();
  };
  std::array<Untold, kRemembered> untold;
  std::size_t next_untold = 0;
  // Of (angle, rate, acceleration) of pan, of tilt, by the map's bend: angle against the first frame's ...
  std::array<Matrix3<double>, 2> bend_covariance{};
  double bend_tilt = 0;  // ... for a frame that looks at this tilt
  struct Past {
    double time_s;  // middle row
    Vector2<double> angle, rate, acceleration;
    Matrix6 covariance;
    Vector2<double> surprise;  // rad, by which it missed the curve through those before
  };
  static constexpr std::size_t kCurve = 5;  // angles in a row that give a polynomial of degree 4
  std::array<Past, kCurve + 1> past;        // of the latest frames, newest first
  int past_count = 0;
  double noise_sigma = kExpectedNoise;
  std::uint32_t frames = 0;
  int contradictions = 0;
  bool late_contradiction = false;
  int lost = 0;
  int unfound = 0;  // frames in a row that lacked the landmarks they should show

  // The frame last processed.
  OeStatistics statistics;
  ImageView image;
  FrameMotion<double> motion;                                   // map's frame
  Matrix6 motion_covariance = Matrix6::Zero();                  // by the frame's own noise
  Matrix2<double> shared_covariance = Matrix2<double>::Zero();  // of its angles, by the map's
  Sensitivity<6> motion_sensitivity = Sensitivity<6>::Zero();
  double now_s = 0;         // its frame_time_s
  bool told = false;        // by telemetry that was not extrapolated
  bool may_make = false;    // motion is sure enough for new landmarks
  double share_of_new = 0;  // of the landmarks in view, made by the maintain() before
  double inflation = 1;

  // The last frame with an orientation.
  bool has_last = false;
  double last_time_s = 0;
  FrameMotion<double> last_motion;
  Matrix6 last_covariance = Matrix6::Zero();
  Sensitivity<6> last_sensitivity = Sensitivity<6>::Zero();
};

OeMode::State::State(const OeOptions& o)
    : options(o),
      pyramid(o.max_width, o.max_height, Pyramid::kMaxOctaves),
      map(o.max_landmarks, LandmarkMap::kMaxCellSize) {
  options.max_used = std::clamp(options.max_used, 1, kMaxUsed);
  options.cell_size_px = std::max(options.cell_size_px, kLeastCell);
  const auto capacity = static_cast<std::size_t>(map.capacity());
  prepared.resize(capacity);
  slots.resize(capacity);
  visible.resize(capacity);
  coarse.resize(static_cast<std::size_t>(kCoarsePatches) * Pyramid::kMaxOctaves);
  coarse_slots.resize(coarse.size());
  const auto used = static_cast<std::size_t>(options.max_used);
  chosen.resize(used);
  found.resize(used);
  J_tangent.resize(used);
  alignment_covariance.resize(used);
  noise_samples.resize(kNoiseSamples);
  observations.resize(used);
  cell_taken.resize(static_cast<std::size_t>(cells(o.max_width, 0) * cells(o.max_height, 0)));
  int most_corners = 0;
  for (int octave = 0; octave < Pyramid::kMaxOctaves; ++octave) {
    const int cell = corner_cell(octave);
    // Fine octaves are searched cell by cell, where landmarks are missing; coarse ones at once.
    const bool fine = octave < kFirstCoarseOctave;
    corner_grids.push_back(
        std::make_unique<FastGrid>(fine ? cell + 2 * kCornerBorder : o.max_width >> octave,
                                   fine ? cell + 2 * kCornerBorder : o.max_height >> octave, cell));
    most_corners = std::max(most_corners, corner_grids.back()->max_cells());
  }
  corners.resize(static_cast<std::size_t>(most_corners));
}

std::size_t OeMode::State::memory_bytes() const {
  const auto of = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return sizeof(*this) - sizeof(map) + map.memory_bytes() + pyramid.memory_bytes() + of(prepared) +
         of(slots) + of(visible) + of(coarse) + of(coarse_slots) + of(chosen) + of(found) +
         of(J_tangent) + of(alignment_covariance) + of(noise_samples) + of(observations) +
         of(cell_taken) + of(corners);
}

double OeMode::State::cell_px(int octave) const {
  return options.cell_size_px * std::min(std::ldexp(1.0, octave), kLargestCells);
}

int OeMode::State::corner_cell(int octave) const {
  return std::max(kLeastCornerCell, static_cast<int>(std::ldexp(cell_px(octave), -octave)));
}

int OeMode::State::cells(int size_px, int octave) const {
  return static_cast<int>(size_px / cell_px(octave)) + 1;
}

// The coarsest octave that is still large enough for several patches.
int OeMode::State::top_octave() const {
  int octave = 0;
  while (octave + 1 < Pyramid::kMaxOctaves &&
         calibration.camera.height >> (octave + 1) >= kLeastCoarseHeight) {
    ++octave;
  }
  return octave;
}

// Grey levels, of one octave's pixels: averaging takes it down, rounding remains.
double OeMode::State::noise(int octave) const {
  constexpr double kRounding = 0.3;
  return std::max(std::ldexp(noise_sigma, -octave), kRounding);
}

// Three times what noise alone would show; below that a patch's covariance is too small.
double OeMode::State::least_contrast(int octave) const { return 1.5 * noise(octave); }

// Whether all of a patch is in the image.
bool OeMode::State::inside(const Vector2<double>& u, int octave) const {
  const double border = std::ldexp(0.5 * kPatchSize + 2.5, octave);
  return u.x() >= border && u.y() >= border && u.x() <= calibration.camera.width - border &&
         u.y() <= calibration.camera.height - border;
}

void OeMode::State::reset(const Calibration& new_calibration) {
  calibration = new_calibration;
  const Camera<double>& camera = calibration.camera;
  ready = camera.width > 0 && camera.height > 0 && camera.width <= options.max_width &&
          camera.height <= options.max_height && camera.focal_length > 0;
  if (!ready) return;
  const double w = camera.width;
  const double h = camera.height;
  field_of_view = 2 * std::atan(0.5 * w / camera.focal_length);
  cone = 0;
  for (const Vector2<double>& corner : {Vector2<double>(0, 0), Vector2<double>(w, 0),
                                        Vector2<double>(0, h), Vector2<double>(w, h)}) {
    Vector3<double> d_c;
    // A corner beyond the distortion's limit sees nothing: the cone to it may be anything.
    const bool seen = unproject(camera, corner, &d_c) == ProjectionStatus::kOk;
    cone = std::max(cone, seen ? std::acos(std::min(1.0, d_c.z())) : kPi / 2);
  }
  // Room for what the camera turns while it reads out, and for a wrong prediction.
  cone = std::min(kPi, 1.3 * cone);
  forget_map();
  frames = 0;
}

void OeMode::State::clear_landmarks() {
  const double f = calibration.camera.focal_length;
  map.clear(options.cell_size_px / f, kLargestCells * options.cell_size_px / f);
  chosen_count = 0;
  coarse_count = 0;
}

void OeMode::State::forget_map() {
  clear_landmarks();
  offset = {};
  told_time_s = kNever;
  answered_time_s = kNever;
  untold.fill({});
  late_contradiction = false;
  noise_sigma = kExpectedNoise;
  for (Matrix3<double>& covariance : bend_covariance) covariance.setZero();
  past_count = 0;
  contradictions = 0;
  lost = 0;
  unfound = 0;
  may_make = false;
  has_last = false;
  statistics = {};
}

void OeMode::State::take(const MapState& from) {
  const bool bend_known =
      is_covariance(from.bend_covariance[0]) && is_covariance(from.bend_covariance[1]);
  if (!ready || !bend_known || !std::isfinite(from.bend_tilt) ||
      !all_finite(from.offset.vector()) || !is_covariance(from.offset_covariance) ||
      !all_finite(from.offset_sensitivity)) {
    return;
  }
  for (const Landmark& landmark : from.landmarks) {
    int slot = 0;
    if (map.size() == map.capacity()) break;
    if (landmark.octave > top_octave() || !makes_sense(landmark) ||
        map.insert(landmark, frames, &slot) != InsertStatus::kOk) {
      continue;
    }
    LandmarkStatistics& known = map.statistics(slot);
    known.matched = std::min(landmark.statistics.matched, landmark.statistics.seen);
    known.seen = landmark.statistics.seen;
  }
  if (map.size() == 0) return;
  offset = {from.offset.vector(), symmetric(from.offset_covariance), from.offset_sensitivity};
  bend_covariance = from.bend_covariance;
  bend_tilt = from.bend_tilt;
}

MapState OeMode::State::map_state() const {
  MapState out;
  out.landmarks.reserve(static_cast<std::size_t>(map.size()));
  for (int slot = 0; slot < map.capacity(); ++slot) {
    if (map.occupied(slot)) out.landmarks.push_back(map.at(slot));
  }
  out.offset = {offset.value.x(), offset.value.y()};
  out.offset_covariance = offset.covariance;
  out.offset_sensitivity = offset.sensitivity;
  out.bend_covariance = bend_covariance;
  out.bend_tilt = bend_tilt;
  return out;
}

void OeMode::State::find_visible(const ViewProjection& view) {
  visible_count = 0;
  const int near = map.find(view.optical_axis(), std::cos(cone), slots.data(), map.capacity());
  for (int i = 0; i < near; ++i) {
    const int slot = slots[static_cast<std::size_t>(i)];
    const Landmark& landmark = map.at(slot);
    Vector2<double> u;
    if (!view.project_roughly(landmark.d, &u) || !inside(u, landmark.octave)) continue;
    visible[static_cast<std::size_t>(visible_count++)] = {slot, landmark.octave, u};
  }
}

// The landmark's picture as this frame should show it; null if it cannot.
const ReferencePatch* OeMode::State::reference(int slot, const SeenDirection& seen) {
  const Landmark& landmark = map.at(slot);
  const Matrix2<double> J_image =
      std::ldexp(1.0, -landmark.octave) * seen.J_d * tangent_basis(landmark.d);
  const Matrix2<double> A = landmark.J_pixel_tangent * J_image.inverse();
  Prepared& ready_patch = prepared[static_cast<std::size_t>(slot)];
  const float tolerance =
      landmark.octave < kFirstCoarseOctave ? kFineWarpTolerance : kCoarseWarpTolerance;
  const Matrix2<float> wanted = A.cast<float>();
  if (ready_patch.id != landmark.id ||
      !((ready_patch.A - wanted).cwiseAbs().maxCoeff() <= tolerance)) {
    // Seen as it was, it needs no resampling.
    const bool alike =
        (wanted - Matrix2<float>::Identity()).cwiseAbs().maxCoeff() <= 0.5F * tolerance;
    ready_patch.A = alike ? Matrix2<float>::Identity() : wanted;
    ready_patch.id = landmark.id;
    ready_patch.status =
        prepare(landmark.picture(), Vector2<double>::Constant(kReferenceCentre),
                ready_patch.A.cast<double>(), least_contrast(landmark.octave), &ready_patch.patch);
  }
  return is_usable(ready_patch.status) ? &ready_patch.patch : nullptr;
}

void OeMode::State::take_coarse_patches(const ViewProjection& view) {
  coarse_count = 0;
  for (int octave = pyramid.octaves() - 1; octave >= kFirstCoarseOctave; --octave) {
    int taken = 0;
    for (int i = 0; i < visible_count && taken < kCoarsePatches; ++i) {
      const Visible& candidate = visible[static_cast<std::size_t>(i)];
      if (candidate.octave != octave) continue;
      SeenDirection seen;
      if (!view.project(map.at(candidate.slot).d, &seen)) continue;
      const ReferencePatch* patch = reference(candidate.slot, seen);
      if (patch == nullptr) continue;
      const auto at = static_cast<std::size_t>(coarse_count++);
      coarse[at] = {patch, octave, seen.u, seen.J_angle};
      coarse_slots[at] = candidate.slot;
      ++taken;
    }
  }
}

// Moves `motion` to where the coarse octaves fit. False where they do not.
bool OeMode::State::align_coarse(double sigma_px) {
  constexpr double kSurely = 3;
  constexpr double kFar = 96;  // px
  CoarseOptions coarse_options;
  // Within half the reach of the coarsest octave nothing needs a search.
  const double reach = std::ldexp(0.75, pyramid.octaves() - 1);
  coarse_options.search_px = kSurely * sigma_px > reach ? kSurely * sigma_px : 0;
  CoarseAlignment aligned;
  bool ok = align_coarsely(pyramid, coarse.data(), coarse_count, coarse_options, &aligned);
  if (!ok && coarse_count > 0 && coarse_options.search_px < kFar) {
    coarse_options.search_px = kFar;
    ok = align_coarsely(pyramid, coarse.data(), coarse_count, coarse_options, &aligned);
  }
  if (!ok) return false;
  motion.angle.pan += aligned.angle.x();
  motion.angle.tilt += aligned.angle.y();
  statistics.coarse_shift_px = aligned.angle.norm() * calibration.camera.focal_length;
  return true;
}

// Up to max_used fine landmarks: the most reliable of each part of the image first.
void OeMode::State::choose_fine() {
  chosen_count = 0;
  constexpr int kColumns = 20;
  constexpr int kRows = 12;
  std::array<int, kColumns * kRows> best;
  best.fill(-1);
  const auto reliability = [&](const Visible& v) {
    const LandmarkStatistics& s = map.at(v.slot).statistics;
    // An octave further up sees half as sharply.
    return std::ldexp((s.matched + 1.0) / (s.seen + 2.0), -v.octave);
  };
  int fine = 0;
  for (int i = 0; i < visible_count; ++i) {
    const Visible& candidate = visible[static_cast<std::size_t>(i)];
    if (candidate.octave >= kFirstCoarseOctave) continue;
    ++fine;
    const int column = std::min(
        kColumns - 1, static_cast<int>(candidate.u.x() / calibration.camera.width * kColumns));
    const int row =
        std::min(kRows - 1, static_cast<int>(candidate.u.y() / calibration.camera.height * kRows));
    int& incumbent = best[static_cast<std::size_t>(row * kColumns + column)];
    if (incumbent < 0 ||
        reliability(candidate) > reliability(visible[static_cast<std::size_t>(incumbent)])) {
      incumbent = i;
    }
  }
  statistics.visible = fine;
  const auto choose = [&](int i) {
    Visible& candidate = visible[static_cast<std::size_t>(i)];
    if (candidate.slot < 0 || chosen_count == options.max_used) return;
    chosen[static_cast<std::size_t>(chosen_count++)] = candidate;
    candidate.slot = -1;
  };
  if (fine > options.max_used) {
    // In strides, so that a small number is spread too; 97 divides no number of parts.
    for (std::size_t j = 0; j < best.size(); ++j) {
      const int i = best[j * 97 % best.size()];
      if (i >= 0) choose(i);
    }
  }
  for (int i = 0; i < visible_count; ++i) {
    if (visible[static_cast<std::size_t>(i)].octave < kFirstCoarseOctave) choose(i);
  }
  statistics.looked_for = chosen_count;
}

void OeMode::State::align_fine(const ViewProjection& view) {
  int count = 0;
  for (int i = 0; i < chosen_count; ++i) {
    const Visible& wanted = chosen[static_cast<std::size_t>(i)];
    const Landmark& landmark = map.at(wanted.slot);
    SeenDirection seen;
    Sensitivity<2> J_parameters;
    if (!view.project(landmark.d, &seen, &J_parameters)) continue;
    const ReferencePatch* patch = reference(wanted.slot, seen);
    if (patch == nullptr) continue;
    const double to_octave = std::ldexp(1.0, -wanted.octave);
    Alignment alignment;
    if (align(*patch, pyramid.octave(wanted.octave), to_octave * seen.u, AlignmentLimits{},
              &alignment) != AlignmentStatus::kConverged) {
      continue;
    }
    const auto at = static_cast<std::size_t>(count++);
    const Matrix2<double> J = seen.J_d * tangent_basis(landmark.d);
    FoundLandmark& f = found[at];
    f.u = alignment.position / to_octave;
    f.residual = f.u - seen.u;
    f.J_angle = seen.J_angle;
    f.time_s = seen.time_s;
    alignment_covariance[at] = alignment.covariance / (to_octave * to_octave);
    f.covariance = alignment_covariance[at] + J * landmark.covariance * J.transpose();
    f.shared_covariance = landmark.shared_covariance;
    f.sensitivity = -J_parameters - J * landmark.sensitivity.cast<double>();
    J_tangent[at] = J;
    OeObservation& observation = observations[at];
    observation.slot = wanted.slot;
    observation.id = landmark.id;
    observation.octave = wanted.octave;
    observation.u = f.u;
    observation.covariance = alignment_covariance[at];
  }
  statistics.aligned = count;
}

void OeMode::State::finish_observations(const SolvedMotion& solved) {
  for (int i = 0; i < statistics.aligned; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const FoundLandmark& f = found[at];
    observations[at].residual = f.residual - f.J_angle * angle_at(solved.correction, f.time_s);
    observations[at].inlier = f.inlier;
  }
}

OeStatus OeMode::State::process(const ImageView& new_image, double frame_time_s,
                                const InterpolatedPanTilt* telemetry, FrameOrientation* out) {
  image = new_image;
  ++frames;
  statistics = {};
  statistics.map_offset = {offset.value.x(), offset.value.y()};
  statistics.map_offset_covariance = offset.covariance;
  may_make = false;
  told = false;
  now_s = frame_time_s;
  chosen_count = 0;
  coarse_count = 0;
  const auto finish = [&](OeStatus status) { return statistics.status = status; };
  if (!std::isfinite(frame_time_s)) return finish(OeStatus::kNotFinite);
  if (!ready) return finish(OeStatus::kNoPrediction);

  const Mechanics<double>& mechanics = calibration.mechanics;
  const double since_last_s = has_last ? std::abs(frame_time_s - last_time_s) : 0;
  const bool follows = has_last && since_last_s < kLongestPrediction;
  if (telemetry != nullptr) {
    if (!pt_orientation(calibration, frame_time_s, *telemetry, out)) {
      return finish(OeStatus::kNotFinite);
    }
  } else if (!follows) {
    return finish(OeStatus::kNoPrediction);
  }
  const bool fits = image.valid() && image.width == calibration.camera.width &&
                    image.height == calibration.camera.height;
  if (!fits || pyramid.build(image, top_octave() + 1) != PyramidStatus::kOk) {
    return finish(telemetry != nullptr ? OeStatus::kBadImage : OeStatus::kNoPrediction);
  }

  // 1. Prediction.
  double acceleration_sigma = kAcceleration * field_of_view;
  const bool acceleration_known =
      telemetry != nullptr && telemetry->acceleration_sigma < acceleration_sigma;
  if (acceleration_known) acceleration_sigma = telemetry->acceleration_sigma;
  MotionPrior prior;
  prior.motion_information.diagonal().tail<2>().setConstant(
      1 / (acceleration_sigma * acceleration_sigma));
  Matrix2<double> angle_covariance;
  const double middle_row = 0.5 * calibration.camera.height;
  if (telemetry != nullptr) {
    const PanTilt<double> angle = true_from_measured(mechanics, telemetry->angle);
    motion = {{angle.pan - offset.value.x(), angle.tilt - offset.value.y()},
              true_from_measured(mechanics, telemetry->rate),
              middle_row};
    if (acceleration_known) {
      motion.acceleration = true_from_measured(mechanics, telemetry->acceleration);
    }
    const Vector2<double> to_true(1 / mechanics.pan_scale, 1 / mechanics.tilt_scale);
    Vector4<double> scale;
    scale << to_true, to_true;
    prior.has_telemetry = true;
    motion_sensitivity = telemetry_sensitivity(mechanics, motion);
    motion_sensitivity.topRows<2>() -= offset.sensitivity;
    prior.telemetry_sensitivity = motion_sensitivity.topRows<4>();
    prior.telemetry_covariance = scale.asDiagonal() * telemetry->covariance * scale.asDiagonal();
    angle_covariance = prior.telemetry_covariance.topLeftCorner<2, 2>() + offset.covariance;
    motion_covariance.setZero();
    motion_covariance.topLeftCorner<4, 4>() = prior.telemetry_covariance;
    motion_covariance.diagonal().tail<2>().setConstant(acceleration_sigma * acceleration_sigma);
    shared_covariance = offset.covariance;
    told = !telemetry->extrapolated;
    // Of an answer that the same samples gave before, only a part is news.
    const double before_s = told ? told_time_s : answered_time_s;
    const double dilution = std::sqrt(diluted(telemetry->renewal_s, frame_time_s - before_s));
    const Vector4<double> dilute(dilution, dilution, 1, 1);
    prior.telemetry_covariance =
        dilute.asDiagonal() * prior.telemetry_covariance * dilute.asDiagonal();
  } else {
    FrameMotion<double> steady = last_motion;
    steady.acceleration = {};
    motion = carried_on(steady, since_last_s);
    motion_sensitivity << last_sensitivity.topRows<2>() +
                              since_last_s * last_sensitivity.middleRows<2>(2),
        last_sensitivity.middleRows<2>(2), Sensitivity<2>::Zero();
    prior.motion_sensitivity = motion_sensitivity;
    Matrix4<double> carry = Matrix4<double>::Identity();
    carry.topRightCorner<2, 2>().diagonal().setConstant(since_last_s);
    Matrix<double, 4, 2> push;
    push << since_last_s * since_last_s / 2 * Matrix2<double>::Identity(),
        since_last_s * Matrix2<double>::Identity();
    const Matrix4<double> covariance =
        carry * last_covariance.topLeftCorner<4, 4>() * carry.transpose() +
        acceleration_sigma * acceleration_sigma * push * push.transpose();
    angle_covariance = covariance.topLeftCorner<2, 2>();
    prior.motion_information.topLeftCorner<4, 4>() = covariance.inverse();
  }
  const FrameMotion<double> predicted = motion;

  // 2. Coarse alignment.
  const double sigma_px =
      calibration.camera.focal_length * std::sqrt(angle_covariance.diagonal().maxCoeff());
  {
    const ViewProjection view(calibration, motion);
    find_visible(view);
    take_coarse_patches(view);
  }
  const bool coarse_aligned = align_coarse(sigma_px);

  // 3. Landmarks, and 4. the solution, about where the residuals were taken.
  offset.covariance.diagonal().array() += kOffsetDrift * kOffsetDrift * since_last_s;
  prior.offset_covariance = offset.covariance;
  SolvedMotion solved;
  const auto solve_from = [&](const FrameMotion<double>& start) {
    motion = start;
    const ViewProjection view(calibration, motion);
    find_visible(view);
    choose_fine();
    align_fine(view);
    prior.motion.tail<2>() = predicted.acceleration.vector() - motion.acceleration.vector();
    const Vector2<double> moved = predicted.angle.vector() - motion.angle.vector();
    if (prior.has_telemetry) {
      prior.telemetry.head<2>() = moved;
    } else {
      prior.motion.head<2>() = moved;
    }
    solved = {};
    return solve_orientation(found.data(), statistics.aligned, prior, SolveLimits{},
                             calibration.camera.width, calibration.camera.height,
                             calibration.line_delay * middle_row, &solved);
  };
  SolveStatus status = SolveStatus::kTooFew;
  // Where the coarse octaves found nothing, landmarks are worth a look only nearby.
  constexpr double kNearby = 2;  // px
  const FrameMotion<double> first = motion;
  if (coarse_aligned || sigma_px < kNearby) status = solve_from(first);
  // Texture that repeats can hold the coarse octaves elsewhere: most landmarks are then not found, and how
  // the camera moved before is another place to look.
  constexpr double kMost = 0.6;
  constexpr int kMany = 40;
  const bool doubtful =
      status == SolveStatus::kTooFew ||
      (status == SolveStatus::kOk && solved.inliers < kMost * statistics.looked_for);
  if (follows && doubtful) {
    const SolveStatus before = status;
    const int looked_for = statistics.looked_for;
    status = solve_from(carried_on(last_motion, frame_time_s - last_time_s));
    if (status != SolveStatus::kOk || solved.inliers < kMany ||
        solved.inliers < kMost * statistics.looked_for) {
      // No better, or by a few only, which agree by chance too.
      status = before == SolveStatus::kOk ? solve_from(first) : before;
      statistics.looked_for = looked_for;
    }
  }
  if (status == SolveStatus::kOk && telemetry != nullptr && telemetry->extrapolated) {
    move_bend(motion.angle.tilt + solved.correction[1]);
    remember_untold(
        motion.angle.vector() + solved.correction.head<2>(), solved.sensitivity.topRows<2>(),
        solved.frame_covariance.topLeftCorner<2, 2>() + bend_of_angles(), solved.shared_covariance);
  }
  // Until telemetry that belongs to a frame says otherwise.
  if (status == SolveStatus::kOk && late_contradiction && !told) {
    status = SolveStatus::kContradiction;
  }
  if (status != SolveStatus::kOk) {
    finish_observations(SolvedMotion{});
    motion = predicted;
    // Where no landmark was to be expected, telemetry may found new ones.
    constexpr int kFewCoarse = 5;
    may_make = telemetry != nullptr && statistics.looked_for < kFew && coarse_count < kFewCoarse;
    contradictions = status == SolveStatus::kContradiction ? contradictions + 1 : 0;
    ++lost;
    if (status == SolveStatus::kTooFew && telemetry != nullptr && !may_make) ++unfound;
    if (telemetry == nullptr) return finish(OeStatus::kNoPrediction);
    if (status != SolveStatus::kContradiction) return finish(OeStatus::kTooFew);
    // One of the two is wrong, and nobody here can tell which: the answer has to cover both.
    MotionCovariance covering = out->motion_covariance;
    covering.topLeftCorner<2, 2>() += solved.innovation * solved.innovation.transpose();
    return finish(make_frame_orientation(calibration, frame_time_s, OrientationMode::kPt, 0,
                                         out->motion(), covering, out->motion_sensitivity, out)
                      ? OeStatus::kContradiction
                      : OeStatus::kNotFinite);
  }
  finish_observations(solved);
  contradictions = 0;
  late_contradiction = false;
  lost = 0;
  unfound = 0;
  motion.angle = {motion.angle.pan + solved.correction[0],
                  motion.angle.tilt + solved.correction[1]};
  motion.rate = {motion.rate.pan + solved.correction[2], motion.rate.tilt + solved.correction[3]};
  motion.acceleration = {motion.acceleration.pan + solved.correction[4],
                         motion.acceleration.tilt + solved.correction[5]};
  motion_covariance = solved.frame_covariance;
  motion_sensitivity = solved.sensitivity;
  shared_covariance = solved.shared_covariance;
  inflation = solved.inflation;
  Matrix6 covariance = solved.covariance;
  move_bend(motion.angle.tilt);
  add_bend(&covariance);
  FrameMotion<double> in_base = motion;
  const Vector2<double> total = offset.value + solved.offset_correction;
  in_base.angle = {motion.angle.pan + total.x(), motion.angle.tilt + total.y()};
  Sensitivity<6> sensitivity = motion_sensitivity;
  sensitivity.topRows<2>() += offset.sensitivity + solved.offset_correction_sensitivity;
  if (!make_frame_orientation(calibration, frame_time_s, OrientationMode::kOe, solved.inliers,
                              in_base, covariance, sensitivity, out)) {
    return finish(telemetry != nullptr ? OeStatus::kTooFew : OeStatus::kNoPrediction);
  }
  if (told) {
    // What contradicts is not here any more: see solve_orientation().
    static_cast<void>(learn_offset(
        frame_time_s, solved.innovation, solved.innovation_covariance, shared_covariance,
        prior.telemetry_sensitivity.topRows<2>() - motion_sensitivity.topRows<2>()));
  }
  answered_time_s = frame_time_s;
  statistics.map_offset = {offset.value.x(), offset.value.y()};
  statistics.map_offset_covariance = offset.covariance;
  statistics.inliers = solved.inliers;
  may_make = true;
  has_last = true;
  last_time_s = frame_time_s;
  last_motion = motion;
  last_covariance = motion_covariance;
  last_sensitivity = motion_sensitivity;
  last_covariance.topLeftCorner<2, 2>() += shared_covariance;
  return finish(OeStatus::kOk);
}

// Of the picture and not of what alignment leaves over, which motion blur makes larger.
void OeMode::State::learn_noise() {
  const double now =
      image_noise(image, noise_samples.data(), static_cast<int>(noise_samples.size()));
  constexpr double kMemory = 0.1;
  noise_sigma += (map.size() == 0 ? 1 : kMemory) * (now - noise_sigma);
}

void OeMode::State::mark(int slot, bool matched, double residual_square) {
  LandmarkStatistics& s = map.statistics(slot);
  ++s.seen;
  s.last_frame = frames;
  if (matched) {
    ++s.matched;
    s.missed_in_a_row = 0;
    constexpr float kMemory = 0.1F;
    s.residual_square += kMemory * (static_cast<float>(residual_square) - s.residual_square);
  } else {
    ++s.missed_in_a_row;
  }
  const bool unreliable = s.seen >= kProbation && s.matched < kLeastMatched * s.seen;
  if (s.missed_in_a_row >= kMaxMisses || unreliable) map.retire(slot);
}

// Of the rows' times by what a landmark is seen lower.
double OeMode::State::time_per_angle() const {
  return -calibration.line_delay * calibration.camera.focal_length * calibration.camera.aspect;
}

// A frame that looks elsewhere sees the landmarks at other times: a wrong acceleration is another wrong
// rate there.
void OeMode::State::move_bend(double tilt) {
  const double t = time_per_angle() * (tilt - bend_tilt);
  Matrix3<double> carry = Matrix3<double>::Identity();
  carry(0, 1) = t;
  carry(0, 2) = t * t / 2;
  carry(1, 2) = t;
  for (Matrix3<double>& covariance : bend_covariance) {
    covariance = carry * covariance * carry.transpose();
    covariance = symmetric(covariance);
  }
  bend_tilt = tilt;
}

void OeMode::State::add_bend(Matrix6* covariance) const {
  for (int axis = 0; axis < 2; ++axis) {
    const Matrix3<double>& bend = bend_covariance[static_cast<std::size_t>(axis)];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*covariance)(2 * i + axis, 2 * j + axis) += bend(i, j);
    }
  }
}

Matrix2<double> OeMode::State::bend_of_angles() const {
  return Vector2<double>(bend_covariance[0](0, 0), bend_covariance[1](0, 0)).asDiagonal();
}

bool OeMode::State::learn_offset(double frame_time_s, const Vector2<double>& innovation,
                                 const Matrix2<double>& covariance, const Matrix2<double>& shared,
                                 const Sensitivity<2>& sensitivity) {
  const double dilution = diluted(kSharedRenewal, frame_time_s - told_time_s);
  if (!offset.learn(innovation, covariance + dilution * shared, sensitivity,
                    SolveLimits{}.max_contradiction)) {
    return false;
  }
  told_time_s = frame_time_s;
  return true;
}

void OeMode::State::remember_untold(const Vector2<double>& angle, const Sensitivity<2>& sensitivity,
                                    const Matrix2<double>& covariance,
                                    const Matrix2<double>& shared) {
  untold[next_untold] = {now_s, angle, sensitivity, covariance, shared};
  next_untold = (next_untold + 1) % untold.size();
}

void OeMode::State::add_late_telemetry(double frame_time_s, const InterpolatedPanTilt& telemetry) {
  const auto frame = std::find_if(untold.begin(), untold.end(), [&](const Untold& candidate) {
    return candidate.time_s == frame_time_s;
  });
  if (!std::isfinite(frame_time_s) || frame == untold.end() || telemetry.extrapolated) return;
  const Mechanics<double>& mechanics = calibration.mechanics;
  const Vector2<double> to_true(1 / mechanics.pan_scale, 1 / mechanics.tilt_scale);
  const Matrix2<double> covariance =
      to_true.asDiagonal() * telemetry.covariance.topLeftCorner<2, 2>() * to_true.asDiagonal();
  const FrameMotion<double> told_motion{true_from_measured(mechanics, telemetry.angle),
                                        true_from_measured(mechanics, telemetry.rate),
                                        0.5 * calibration.camera.height};
  const Vector2<double> innovation = minus(
      told_motion.angle,
      PanTilt<double>{frame->angle.x() + offset.value.x(), frame->angle.y() + offset.value.y()});
  const Sensitivity<2> sensitivity = telemetry_sensitivity(mechanics, told_motion).topRows<2>() -
                                     frame->sensitivity - offset.sensitivity;
  const double dilution = diluted(telemetry.renewal_s, frame_time_s - told_time_s);
  if (all_finite(innovation) && all_finite(covariance)) {
    late_contradiction =
        !learn_offset(frame_time_s, innovation, frame->covariance + dilution * covariance,
                      frame->shared, sensitivity);
  }
  frame->time_s = kNever;
}

// The curve through the earlier angles tells what was to be expected now; a jerk surprises it.
void OeMode::State::remember_motion() {
  constexpr double kLongest = 0.5;  // s
  const double time_s = last_time_s + calibration.line_delay * motion.reference_row;
  if (past_count > 0 && !(time_s > past[0].time_s && time_s - past[0].time_s < kLongest)) {
    past_count = 0;
  }
  Past now{time_s,
           motion.angle.vector(),
           motion.rate.vector(),
           motion.acceleration.vector(),
           motion_covariance,
           Vector2<double>::Constant(field_of_view)};
  if (past_count >= static_cast<int>(kCurve)) {
    now.surprise = now.angle;
    for (std::size_t i = 0; i < kCurve; ++i) {
      double weight = 1;
      for (std::size_t j = 0; j < kCurve; ++j) {
        if (j != i) weight *= (time_s - past[j].time_s) / (past[i].time_s - past[j].time_s);
      }
      now.surprise -= weight * past[i].angle;
    }
  }
  std::copy_backward(past.begin(), past.end() - 1, past.end());
  past[0] = now;
  past_count = std::min(past_count + 1, static_cast<int>(past.size()));
}

// All landmarks together may be bent: those of the first frame were placed by telemetry's rate, so that
// its error times the row's time stands in their directions, and as every later frame then shows
// the wrong rate, in the directions of all made since. The angles of neighbouring frames know
// better: the derivatives of the curve through five of them, in its middle, are held against the rate
// and acceleration that the map showed there, and the map is bent back, as far as that is sure
// (Kalman). True if it was bent by so much that the small corrections this can make leave it crooked.
bool OeMode::State::straighten_map() {
  // New landmarks take over the errors of the frame they are made in.
  const double inherited = share_of_new * share_of_new;
  for (int axis = 0; axis < 2; ++axis) {
    bend_covariance[static_cast<std::size_t>(axis)].bottomRightCorner<2, 2>() +=
        inherited * rate_covariance(motion_covariance, axis);
  }
  if (past_count < static_cast<int>(past.size()) || calibration.line_delay == 0) return false;
  const Past& middle = past[kCurve / 2];
  const double h = (past[0].time_s - past[kCurve - 1].time_s) / (kCurve - 1);
  Matrix<double, kCurve, kCurve> powers;
  for (std::size_t i = 0; i < kCurve; ++i) {
    const double t = (past[i].time_s - middle.time_s) / h;
    powers.row(static_cast<int>(i)) << 1, t, t * t, t * t * t, t * t * t * t;
  }
  const Matrix<double, kCurve, kCurve> to_coefficients = powers.inverse();
  const Matrix<double, 1, kCurve> to_rate = to_coefficients.row(1) / h;
  const Matrix<double, 1, kCurve> to_acceleration = 2 * to_coefficients.row(2) / (h * h);
  Vector2<double> rate = Vector2<double>::Zero();
  Vector2<double> acceleration = Vector2<double>::Zero();
  for (std::size_t i = 0; i < kCurve; ++i) {
    rate += to_rate[static_cast<int>(i)] * past[i].angle;
    acceleration += to_acceleration[static_cast<int>(i)] * past[i].angle;
  }
  // Derivatives that the polynomial lacks do a thirtieth of what they surprise by; a jerk between two
  // frames up to several times as much.
  constexpr double kOfSurprise = 1.0 / 6;
  const Vector2<double> surprise = kOfSurprise * past[0]
                                                     .surprise.cwiseAbs()
                                                     .cwiseMax(past[1].surprise.cwiseAbs())
                                                     .cwiseMax(past[2].surprise.cwiseAbs());
  move_bend(middle.angle.y());
  Vector2<double> too_fast = Vector2<double>::Zero();
  Vector2<double> too_much = Vector2<double>::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    Matrix3<double>& bend = bend_covariance[static_cast<std::size_t>(axis)];
    const Vector2<double> wrong(middle.rate[axis] - rate[axis],
                                middle.acceleration[axis] - acceleration[axis]);
    Matrix2<double> noise = rate_covariance(middle.covariance, axis);
    const double angle_variance = middle.covariance(axis, axis);
    const double rate_surprise = surprise[axis] / h;
    const double acceleration_surprise = surprise[axis] / (h * h);
    noise(0, 0) += to_rate.squaredNorm() * angle_variance + rate_surprise * rate_surprise;
    noise(1, 1) += to_acceleration.squaredNorm() * angle_variance +
                   acceleration_surprise * acceleration_surprise;
    const Matrix2<double> to_information = (bend.bottomRightCorner<2, 2>() + noise).inverse();
    constexpr double kGate = 25;  // chi-square, 2 degrees of freedom
    if (!(wrong.dot(to_information * wrong) < kGate)) {
      // A jerk, or a bend beyond what was thought: if it stays, it will be believed.
      // What it has done to the angle is told by move_bend() alone: nothing here could ever take that back.
      const Vector3<double> doubt(1, std::sqrt(2.0), std::sqrt(2.0));
      bend = (doubt.asDiagonal() * bend * doubt.asDiagonal()).eval();
      continue;
    }
    const Matrix<double, 3, 2> gain = bend.rightCols<2>() * to_information;
    const Vector3<double> error = gain * wrong;
    // The angle has gone wrong with the way from where the map began, by the rate that was.
    offset.value[axis] -= error[0];
    too_fast[axis] = error[1];
    too_much[axis] = error[2];
    bend -= gain * bend.bottomRows<2>();
    bend = symmetric(bend);
  }
  bend_map(too_fast, too_much, middle.angle.y());
  constexpr double kCrooked = 0.2;  // px, at the first and the last row
  const double half_readout_s = calibration.line_delay * motion.reference_row;
  return too_fast.norm() * std::abs(half_readout_s) * calibration.camera.focal_length > kCrooked;
}

// Takes from all landmarks what so much too high a rate and acceleration, shown by a frame that looked
// at origin_tilt, have put into them: the angle at the time of the row in which that frame would have seen
// their elevation.
void OeMode::State::bend_map(const Vector2<double>& rate, const Vector2<double>& acceleration,
                             double origin_tilt) {
  const Vector3<double>& a_pan = calibration.mechanics.pan_axis;
  // Small errors of the acceleration are many, and far from the row they were seen in they would be large:
  // beyond the frame it is taken to go on as it is at the border.
  const double border = std::abs(calibration.line_delay * calibration.camera.height / 2);
  const auto angle_error = [&](double t) -> Vector2<double> {
    const double within = std::clamp(t, -border, border);
    return t * rate + (0.5 * within * within) * acceleration;
  };
  const auto straighten = [&](Vector2<double>* angle, Vector2<double>* shown_rate,
                              Vector2<double>* shown_acceleration) {
    const double t = time_per_angle() * (angle->y() - origin_tilt);
    *angle -= angle_error(t);
    *shown_rate -= rate + t * acceleration;
    *shown_acceleration -= acceleration;
  };
  const auto elevation_of = [&](const Vector3<double>& d) {
    return -std::asin(std::clamp(a_pan.dot(d), -1.0, 1.0));
  };
  const double origin = elevation_of(ViewProjection(calibration, motion).optical_axis()) -
                        (motion.angle.tilt - origin_tilt);
  for (int slot = 0; slot < map.capacity(); ++slot) {
    if (!map.occupied(slot)) continue;
    const Landmark& landmark = map.at(slot);
    const Vector3<double>& d = landmark.d;
    const Vector2<double> error = angle_error(time_per_angle() * (elevation_of(d) - origin));
    const Vector3<double> right = a_pan.cross(d);
    const Vector3<double> turned = d - error.x() * right - error.y() * right.normalized().cross(d);
    map.refine(slot, turned.normalized(), landmark.covariance);
  }
  for (Untold& frame : untold) {
    if (frame.time_s != kNever) {
      frame.angle -= angle_error(time_per_angle() * (frame.angle.y() - origin_tilt));
    }
  }
  for (int i = 0; i < past_count; ++i) {
    Past& p = past[static_cast<std::size_t>(i)];
    straighten(&p.angle, &p.rate, &p.acceleration);
  }
  Vector2<double> angle = motion.angle.vector();
  Vector2<double> now_rate = motion.rate.vector();
  Vector2<double> now_acceleration = motion.acceleration.vector();
  straighten(&angle, &now_rate, &now_acceleration);
  motion.angle = {angle.x(), angle.y()};
  motion.rate = {now_rate.x(), now_rate.y()};
  motion.acceleration = {now_acceleration.x(), now_acceleration.y()};
  last_motion = motion;
}

void OeMode::State::judge_coarse(const ViewProjection& view) {
  constexpr double kAlike = 0.6;
  for (int i = 0; i < coarse_count; ++i) {
    const int slot = coarse_slots[static_cast<std::size_t>(i)];
    const CoarsePatch& patch = coarse[static_cast<std::size_t>(i)];
    Vector2<double> u;
    PatchStep step;
    // One that has left the image was not missed.
    if (!view.project(map.at(slot).d, &u) ||
        !measure_step(*patch.reference, pyramid.octave(patch.octave),
                      std::ldexp(1.0, -patch.octave) * u, &step)) {
      continue;
    }
    mark(slot, step.correlation >= kAlike, 1);
  }
}

void OeMode::State::refine_landmarks() {
  int next = 0;  // of the observations, which are a part of the chosen in their order
  for (int i = 0; i < chosen_count; ++i) {
    const int slot = chosen[static_cast<std::size_t>(i)].slot;
    if (next == statistics.aligned || observations[static_cast<std::size_t>(next)].slot != slot) {
      mark(slot, false, 0);
      continue;
    }
    const auto at = static_cast<std::size_t>(next++);
    const OeObservation& observation = observations[at];
    const FoundLandmark& f = found[at];
    if (observation.inlier) {
      const Landmark& landmark = map.at(slot);
      const Matrix2<double> to_tangent = J_tangent[at].inverse();
      const Matrix2<double> measured =
          to_tangent *
          (inflation * alignment_covariance[at] +
           f.J_angle * motion_covariance.topLeftCorner<2, 2>() * f.J_angle.transpose()) *
          to_tangent.transpose();
      const Matrix2<double> gain = landmark.covariance * (landmark.covariance + measured).inverse();
      const Vector2<double> change = gain * (to_tangent * observation.residual);
      // So much is left to be learnt always: textures alias, and the light changes.
      constexpr double kLeast = 0.01;
      const Matrix2<double> covariance =
          symmetric<2>((Matrix2<double>::Identity() - gain) * landmark.covariance) +
          kLeast * measured;
      if (all_finite(change) && all_finite(covariance)) {
        const Sensitivity<2> left =
            f.sensitivity - f.J_angle * angle_at(motion_sensitivity, f.time_s);
        map.sensitivity(slot) += (gain * (to_tangent * left)).cast<float>();
        map.refine(slot, direction_plus<double>(landmark.d, change), covariance);
      }
    }
    mark(slot, observation.inlier, f.normalised_square);
  }
}

bool OeMode::State::make_landmark(const FastCorner& corner, int octave) {
  const ImageView& picture = pyramid.octave(octave);
  constexpr int kBefore = kReferencePixels / 2;
  const int left = corner.u - kBefore;
  const int top = corner.v - kBefore;
  if (left < 0 || top < 0 || left + kReferencePixels > picture.width ||
      top + kReferencePixels > picture.height) {
    return false;
  }
  const double to_image = std::ldexp(1.0, octave);
  const Vector2<double> u(to_image * (corner.u + 0.5), to_image * (corner.v + 0.5));
  Landmark landmark;
  Matrix<double, 3, 2> J_d_u;
  Matrix<double, 3, 4> J_d_motion;
  Sensitivity<3> J_d_parameters;
  if (rolling_shutter_unproject(calibration.camera, calibration.mechanics, calibration.line_delay,
                                motion, u, &landmark.d, &J_d_u, &J_d_motion,
                                &J_d_parameters) != ProjectionStatus::kOk ||
      map.cell_taken(landmark.d, octave)) {
    return false;
  }
  for (int row = 0; row < kReferencePixels; ++row) {
    std::copy_n(picture.row(top + row) + left, kReferencePixels,
                landmark.pixels.data() + row * kReferencePixels);
  }
  ReferencePatch patch;
  if (prepare(landmark.picture(), Vector2<double>::Constant(kReferenceCentre),
              Matrix2<double>::Identity(), least_contrast(octave), &patch) != PrepareStatus::kOk) {
    return false;
  }
  landmark.octave = static_cast<std::uint8_t>(octave);
  const Matrix<double, 2, 3> to_tangent = tangent_basis(landmark.d).transpose();
  const Matrix2<double> J_tangent_u = to_tangent * J_d_u;
  landmark.sensitivity =
      (to_tangent * (J_d_parameters + J_d_motion * motion_sensitivity.topRows<4>())).cast<float>();
  landmark.J_pixel_tangent = J_tangent_u.inverse() / to_image;
  // Where its point lies is exact; what makes it find itself elsewhere is the picture's noise.
  const Matrix2<double> J_tangent_pixel = to_image * J_tangent_u;
  landmark.covariance = noise(octave) * noise(octave) * J_tangent_pixel *
                        patch.unit_covariance.cast<double>() * J_tangent_pixel.transpose();
  landmark.shared_covariance = shared_covariance + motion_covariance.topLeftCorner<2, 2>();
  int slot = 0;
  return map.insert(landmark, frames, &slot) == InsertStatus::kOk;
}

void OeMode::State::make_landmarks(const ViewProjection& view) {
  find_visible(view);
  int made = 0;
  // An empty view takes all it can at once.
  int left = visible_count < kEmptyView ? std::numeric_limits<int>::max() : options.max_new;
  for (int octave = pyramid.octaves() - 1; octave >= 0; --octave) {
    const double cell = cell_px(octave);
    const int columns = cells(calibration.camera.width, octave);
    const int rows = cells(calibration.camera.height, octave);
    std::fill(cell_taken.begin(), cell_taken.begin() + columns * rows, std::uint8_t{0});
    const auto cell_at = [&](double u, double v) -> std::uint8_t& {
      return cell_taken[static_cast<std::size_t>(static_cast<int>(v / cell) * columns +
                                                 static_cast<int>(u / cell))];
    };
    for (int i = 0; i < visible_count; ++i) {
      const Visible& v = visible[static_cast<std::size_t>(i)];
      if (v.octave == octave) cell_at(v.u.x(), v.u.y()) = 1;
    }
    FastGrid& grid = *corner_grids[static_cast<std::size_t>(octave)];
    const ImageView& picture = pyramid.octave(octave);
    const double to_image = std::ldexp(1.0, octave);
    if (octave >= kFirstCoarseOctave) {
      // One of them each time, but for an empty view.
      const auto turn = static_cast<int>(frames) % (pyramid.octaves() - kFirstCoarseOctave);
      if (visible_count >= kEmptyView && octave != kFirstCoarseOctave + turn) continue;
      const FastResult result = grid.detect(picture, options.corner_threshold, corners.data(),
                                            static_cast<int>(corners.size()));
      for (int i = 0; i < result.count && left > 0; ++i) {
        const FastCorner& corner = corners[static_cast<std::size_t>(i)];
        std::uint8_t& taken = cell_at(to_image * corner.u, to_image * corner.v);
        if (taken != 0 || !make_landmark(corner, octave)) continue;
        taken = 1;
        --left;
        ++made;
      }
      continue;
    }
    // Cell by cell, each time from another one on, so that a budget reaches all in turn.
    const int count = columns * rows;
    const int first = static_cast<int>(frames * 97 % static_cast<std::uint32_t>(count));
    const int size = grid.cell_size();
    int searches = left == std::numeric_limits<int>::max() ? count : options.max_new;
    for (int i = 0; i < count && left > 0 && searches > 0; ++i) {
      const int index = (first + i) % count;
      if (cell_taken[static_cast<std::size_t>(index)] != 0) continue;
      const int u0 = index % columns * size - kCornerBorder;
      const int v0 = index / columns * size - kCornerBorder;
      const int u1 = std::min(u0 + size + 2 * kCornerBorder, picture.width);
      const int v1 = std::min(v0 + size + 2 * kCornerBorder, picture.height);
      const ImageView part{picture.row(std::max(v0, 0)) + std::max(u0, 0), u1 - std::max(u0, 0),
                           v1 - std::max(v0, 0), picture.stride};
      if (part.width <= 0 || part.height <= 0) continue;
      --searches;
      const FastResult result = grid.detect(part, options.corner_threshold, corners.data(), 1);
      if (result.count == 0) continue;
      FastCorner corner = corners[0];
      corner.u = static_cast<std::uint16_t>(corner.u + std::max(u0, 0));
      corner.v = static_cast<std::uint16_t>(corner.v + std::max(v0, 0));
      if (make_landmark(corner, octave)) {
        --left;
        ++made;
      }
    }
  }
  share_of_new = static_cast<double>(made) / std::max(1, visible_count + made);
}

// What was handed over and is not found where it should be has gone, or was never there, if the
// picture has something to show: that is taken in its place. Landmarks that were looked for in a frame
// that fitted are another matter: fog lifts.
void OeMode::State::doubt_map() {
  constexpr double kTextured = 0.25;  // of the cells
  if (pyramid.octaves() <= kFirstCoarseOctave) return;
  find_visible(ViewProjection(calibration, motion));
  const auto doubtful = [&](const Visible& v) { return map.at(v.slot).statistics.last_frame == 0; };
  const auto end = std::partition(visible.begin(), visible.begin() + visible_count, doubtful);
  if (end == visible.begin()) return;
  const ImageView& picture = pyramid.octave(kFirstCoarseOctave);
  FastGrid& grid = *corner_grids[kFirstCoarseOctave];
  const FastResult result = grid.detect(picture, options.corner_threshold, corners.data(),
                                        static_cast<int>(corners.size()));
  const double cells_of_picture =
      static_cast<double>(picture.width) * picture.height / (grid.cell_size() * grid.cell_size());
  if (result.count < kTextured * cells_of_picture) return;
  for (auto v = visible.begin(); v != end; ++v) map.retire(v->slot);
  may_make = visible.begin() + visible_count - end < kFew;
}

void OeMode::State::maintain() {
  if (contradictions > kContradictionsToReset || lost > kLostToReset) {
    forget_map();
    return;
  }
  if (unfound > kLostToDoubt) doubt_map();
  if (!may_make) return;
  may_make = false;
  learn_noise();
  if (map.size() == 0) {
    // The map's frame is what telemetry says now.
    motion.angle = {motion.angle.pan + offset.value.x(), motion.angle.tilt + offset.value.y()};
    motion_sensitivity.topRows<2>() += offset.sensitivity;
    offset = {Vector2<double>::Zero(), motion_covariance.topLeftCorner<2, 2>(),
              Sensitivity<2>::Zero()};
    answered_time_s = now_s;
    if (told) {
      told_time_s = now_s;
    } else {
      remember_untold(motion.angle.vector(), motion_sensitivity.topRows<2>(),
                      Matrix2<double>::Zero(), Matrix2<double>::Zero());
    }
    motion_covariance.topLeftCorner<2, 2>().setZero();
    shared_covariance.setZero();
  }
  if (statistics.status == OeStatus::kOk) {
    refine_landmarks();
    remember_motion();
    if (straighten_map()) {
      // This frame's motion is right now: better landmarks than those of the first can be had.
      clear_landmarks();
      for (int axis = 0; axis < 2; ++axis) {
        bend_covariance[static_cast<std::size_t>(axis)].bottomRightCorner<2, 2>() +=
            rate_covariance(motion_covariance, axis);
      }
    }
  } else {
    past_count = 0;
    bend_tilt = motion.angle.tilt;
    for (int axis = 0; axis < 2; ++axis) {
      Matrix3<double>& bend = bend_covariance[static_cast<std::size_t>(axis)];
      bend.setZero();
      bend.bottomRightCorner<2, 2>() = rate_covariance(motion_covariance, axis);
    }
  }
  const ViewProjection view(calibration, motion);
  if (statistics.status == OeStatus::kOk) judge_coarse(view);
  make_landmarks(view);
}

OeMode::OeMode(const OeOptions& options) : state_(std::make_unique<State>(options)) {}
OeMode::~OeMode() = default;

void OeMode::reset(const Calibration& calibration) { state_->reset(calibration); }
void OeMode::reset(const Calibration& calibration, const MapState& map) {
  state_->reset(calibration);
  state_->take(map);
}

OeStatus OeMode::process(const ImageView& image, double frame_time_s,
                         const InterpolatedPanTilt* at_middle_row, FrameOrientation* out) {
  return state_->process(image, frame_time_s, at_middle_row, out);
}

void OeMode::add_late_telemetry(double frame_time_s, const InterpolatedPanTilt& at_middle_row) {
  state_->add_late_telemetry(frame_time_s, at_middle_row);
}

void OeMode::maintain() { state_->maintain(); }

const OeStatistics& OeMode::statistics() const { return state_->statistics; }
const OeObservation* OeMode::observations() const { return state_->observations.data(); }
const LandmarkMap& OeMode::map() const { return state_->map; }
MapState OeMode::map_state() const { return state_->map_state(); }

std::size_t OeMode::memory_bytes() const { return state_->memory_bytes(); }

}  // namespace alidade
