#pragma once
// Patch alignment: position of a small reference image in an image, to a few hundredths of a pixel,
// with covariance (PTCEE 33; inverse compositional, Baker and Matthews, with gain and offset).
//   image(u + x) = gain * reference(centre + A x) + offset + slope . x + noise
// x are kPatchSize^2 points 1 px apart around 0. A = d(reference pixel) / d(image pixel): the
// caller's knowledge of scale, rotation and rolling-shutter shear. Estimated: u, gain, offset and
// slope (of the light: vignetting would otherwise move patches).
// Pixels are those of the octave: the caller scales by 2^l and 4^l. Valid within 2 px of the start.
// Pure functions: no allocation, no state, no waiting. Derivation: docs/derivations.md.

#include <Eigen/Core>
#include <type_traits>

#include "core/model/linear_algebra.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

inline constexpr int kPatchSize = 8;                  // points in each direction
inline constexpr double kUnobservedVariance = 100.0;  // px^2
// tr(MR)^2 / tr(MRMR), M the projection on the residuals, R the correlation of the points' noise
// (they are blurred): 29 to 31 for any texture of 8x8 points.
inline constexpr double kNoiseFreedom = 30;

struct ReferencePatch {
  using Points = Eigen::Array<float, kPatchSize, kPatchSize, Eigen::RowMajor>;
  Points value;                    // grey levels; blurred reference without level and slope
  Points to_u, to_v;               // px per grey level; H^-1 G': image to gain times displacement
  float energy = 0;                // sum of squares of value
  Vector2<float> value_gradient;   // sums of value times gradient
  float mean = 0;                  // grey levels
  float residual_trace = 0;        // sum of squared residuals for noise of 1 grey level
  Matrix2<float> unit_covariance;  // px^2 for noise of 1 grey level; H^-1 G' R G H^-1
  Matrix2<float> unobserved;       // projection on directions without contrast
  // px; sums of to_u (to_v) times gradient (row) times point (column).
  Matrix2<float> warp_moments_u, warp_moments_v;
};
static_assert(std::is_trivially_destructible_v<ReferencePatch>);

enum class PrepareStatus {
  kOk,
  kEdge,        // contrast in one direction only
  kTooFlat,     // no contrast
  kOutOfImage,  // no reference image, or the patch needs pixels outside it
  kNotFinite    // A is not finite
};

[[nodiscard]] constexpr bool is_usable(PrepareStatus status) {
  return status == PrepareStatus::kOk || status == PrepareStatus::kEdge;
}

// *out is written if is_usable(status). min_contrast: root mean square of the gradient along a
// direction over the patch, grey levels per pixel. Below it noise would count as contrast: noise of
// sigma grey levels alone shows 0.5 sigma.
[[nodiscard]] PrepareStatus prepare(const ImageView& reference, const Vector2<double>& centre,
                                    const Matrix2<double>& A, double min_contrast,
                                    ReferencePatch* out);

// Correction (px) to add to align()'s position for a patch prepared with A but seen as A (I + B),
// to first order in B. Without the correction, a patch whose contrast lies away from its middle
// seems displaced by the shift that B gives the contrast.
[[nodiscard]] inline Vector2<double> warp_displacement(const ReferencePatch& patch,
                                                       const Matrix2<float>& B) {
  return {patch.warp_moments_u.cwiseProduct(B).sum(), patch.warp_moments_v.cwiseProduct(B).sum()};
}

struct AlignmentLimits {
  int max_iterations = 12;       // >= 1
  double converged_step = 2e-3;  // px
  double max_move = 4;           // px from the start
  double min_gain = 0.2;         // of contrast
  double max_gain = 5;
  double min_correlation = 0.85;  // of image and reference, after the fit
};

enum class AlignmentStatus {
  kConverged,
  kOutOfImage,    // no image, or the patch started or moved out of it
  kMovedTooFar,   // more than max_move
  kNotConverged,  // still moving after max_iterations
  kUnlike,        // gain or correlation outside the limits
  kNotFinite      // the start is not finite
};

struct Alignment {
  Vector2<double> position = Vector2<double>::Zero();    // px; the reference's centre in the image
  Matrix2<double> covariance = Matrix2<double>::Zero();  // px^2
  double gain = 0;
  double offset = 0;       // grey levels
  double noise_sigma = 0;  // grey levels, of a pixel, from residuals; at least rounding's
  double correlation = 0;  // 1: the patch fits without residual
  int iterations = 0;
};

// start: px. reference: from prepare(). *out is written on kConverged and, for statistics, on
// kUnlike and kNotConverged. If the gain is outside its limits, only position, gain and iterations
// mean something. A negative gain, as of an inverted contrast, is kUnlike.
[[nodiscard]] AlignmentStatus align(const ReferencePatch& reference, const ImageView& image,
                                    const Vector2<double>& start, const AlignmentLimits& limits,
                                    Alignment* out);

// Prefetches the pixels around `at` (px) for an align() or measure_step() that starts there soon
// (ask_ahead.h).
void ask_for_patch(const ImageView& image, const Vector2<double>& at);

// One step of align(), for callers that move many patches together.
struct PatchStep {
  Vector2<double> step;  // px, towards the patch; as in align(), but not shortened
  double gain;           // of contrast; the step is valid only if positive
  double correlation;    // -1 to 1, at the present position
};

// False if there is no image, if the patch would leave it, if `at` (px) is not finite, or if the
// image has no contrast there besides an even slope; *out is then unchanged.
[[nodiscard]] bool measure_step(const ReferencePatch& reference, const ImageView& image,
                                const Vector2<double>& at, PatchStep* out);

}  // namespace alidade
