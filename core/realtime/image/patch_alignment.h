#pragma once
// Patch alignment: where a small reference image lies in an image, to a few hundredths of a pixel, with
// covariance (PTCEE 33; inverse compositional after Baker and Matthews, with gain and offset).
//
//   image(u + x) = gain * reference(centre + A x) + offset + slope . x + noise   for the kPatchSize^2 points x,
//
// a grid 1 px apart around 0. A, d(reference pixel)/d(image pixel), holds what the caller knows of scale,
// rotation and the rolling shutter's shear; u, gain, offset and slope are estimated. (The slope is the light's:
// vignetting puts one across every patch, which would pull it by hundredths of a pixel, everywhere alike.) Both sides are sampled by
// CubicSpline (sampling.h): alike, so that fractions of a pixel do not bend the answer. The linearisation
// stands on the reference side, so that everything but 3 sums over the patch is done once, by
// prepare(); gain, offset and slope are solved for exactly in every step.
//
// Covariance of u: the noise is what remains after the fit, so it holds the image's noise, the
// reference's, and whatever does not fit. With G the gradients free of gain and light, H = G'G and R the
// correlation that the blur gives to the noise of neighbouring points,
//   cov = noise_sigma^2 / gain^2 * H^-1 G' R G H^-1 * n / (n - 2),
// the last factor because noise_sigma comes from only n = kNoiseFreedom independent values (Student's t).
// Along a direction in which the reference has no contrast (an edge) u stays where it was, and the
// variance there is kUnobservedVariance: the answer is then one of one dimension.
//
// Positions and covariance are in pixels of the octave at hand: the caller multiplies by 2^l and 4^l.
// Valid for starts within 2 px (98 % found again, none wrong; two thirds at 3 px; waves of 6 to 40 px).
// Pure functions: no allocation, no state, no waiting.

#include <Eigen/Core>
#include <type_traits>

#include "core/model/linear_algebra.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

inline constexpr int kPatchSize = 8;                  // points in each direction
inline constexpr double kUnobservedVariance = 100.0;  // px^2
// tr(MR)^2 / tr(MRMR), M the projection to the residuals: 29 to 31 for any texture, 8x8 points.
inline constexpr double kNoiseFreedom = 30;

struct ReferencePatch {
  using Points = Eigen::Array<float, kPatchSize, kPatchSize, Eigen::RowMajor>;
  Points value;                    // blurred reference, level and slope removed, grey levels
  Points to_u, to_v;               // H^-1 G': image to gain times displacement, px per grey level
  float energy = 0;                // sum of squares of value
  Vector2<float> value_gradient;   // sums of value times gradient
  float mean = 0;                  // grey levels
  float residual_trace = 0;        // sum of squared residuals for noise of 1 grey level
  Matrix2<float> unit_covariance;  // H^-1 G' R G H^-1
  Matrix2<float> unobserved;       // projection on directions without contrast
  // Of u and of v: sums of to_u (to_v) times gradient (row) times point (column), px.
  Matrix2<float> warp_moments_u, warp_moments_v;
};
static_assert(std::is_trivially_destructible_v<ReferencePatch>);

enum class PrepareStatus {
  kOk,
  kEdge,        // contrast in one direction only
  kTooFlat,     // contrast in none
  kOutOfImage,  // needs pixels that the reference image does not have
  kNotFinite    // A
};

[[nodiscard]] constexpr bool is_usable(PrepareStatus status) {
  return status == PrepareStatus::kOk || status == PrepareStatus::kEdge;
}

// *out is written if is_usable(status). min_contrast: root mean square, over the patch, of the gradient
// along a direction, grey levels per pixel; below it noise would be taken for contrast. Noise of sigma grey
// levels alone shows 0.5 sigma.
[[nodiscard]] PrepareStatus prepare(const ImageView& reference, const Vector2<double>& centre,
                                    const Matrix2<double>& A, double min_contrast,
                                    ReferencePatch* out);

// Where a patch lies that was prepared with A and is seen as A (I + B): the position that align() finds plus this,
// px, to first order in B. Without it a patch whose contrast lies to one side of its middle seems displaced by as
// much as B moves that side.
[[nodiscard]] inline Vector2<double> warp_displacement(const ReferencePatch& patch,
                                                       const Matrix2<float>& B) {
  return {patch.warp_moments_u.cwiseProduct(B).sum(), patch.warp_moments_v.cwiseProduct(B).sum()};
}

struct AlignmentLimits {
  int max_iterations = 12;
  double converged_step = 2e-3;  // px
  double max_move = 4;           // px from the start
  double min_gain = 0.2;         // of contrast
  double max_gain = 5;
  double min_correlation = 0.85;  // of image and reference after the fit
};

enum class AlignmentStatus {
  kConverged,
  kOutOfImage,    // started or walked out of it
  kMovedTooFar,   // more than max_move
  kNotConverged,  // still moving after max_iterations
  kUnlike,        // residual too large: gain or correlation outside the limits
  kNotFinite      // start
};

struct Alignment {
  Vector2<double> position = Vector2<double>::Zero();  // px, of the reference's centre in the image
  Matrix2<double> covariance = Matrix2<double>::Zero();  // px^2
  double gain = 0;
  double offset = 0;       // grey levels
  double noise_sigma = 0;  // of a pixel, grey levels, from the residuals; never below rounding's
  double correlation = 0;  // 1: the patch fits without residual
  int iterations = 0;
};

// *out is written on kConverged; on kUnlike and kNotConverged too, for statistics.
[[nodiscard]] AlignmentStatus align(const ReferencePatch& reference, const ImageView& image,
                                    const Vector2<double>& start, const AlignmentLimits& limits,
                                    Alignment* out);

// Asks memory for the pixels about `at`, px, for an align() or measure_step() that starts there soon (ask_ahead.h).
void ask_for_patch(const ImageView& image, const Vector2<double>& at);

// One step of align(), for those who move many patches together.
struct PatchStep {
  Vector2<double>
      step;            // px, towards where the patch lies; as align() would take it, not shortened
  double gain;         // of contrast; the step means nothing if it is not positive
  double correlation;  // -1 to 1, of image and reference where the patch is now
};

// False if the patch would leave the image, `at` is not finite, or the image is of one grey level there.
[[nodiscard]] bool measure_step(const ReferencePatch& reference, const ImageView& image,
                                const Vector2<double>& at, PatchStep* out);

}  // namespace alidade
