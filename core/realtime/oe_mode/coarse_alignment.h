#pragma once
// Coarse alignment: by which pan and tilt a prediction is wrong, from all patches of the coarse octaves
// together (PTCEE 30, 31): sparse, inverse compositional, coarse to fine.
//
// At each octave, from the coarsest to the finest given, the two angles d minimise
//   sum over patches of  | gain reference + offset - image(u + J_angle d) |^2
// by Gauss-Newton, gain and offset of each patch apart, with weights that fall for patches whose own
// step disagrees with the common one (what moves by itself, what is hidden). Within 1.5 px of the
// coarsest octave that finds its way; from further away the best of a grid of shifts is taken first.
// Pure functions; no allocation.

#include "core/model/angle.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"

namespace alidade {

// Of one octave; more are not looked at.
inline constexpr int kMaxCoarsePatches = 256;

struct CoarsePatch {
  const ReferencePatch* reference = nullptr;
  int octave = 0;           // < Pyramid::octaves()
  Vector2<double> u;        // px of the image, predicted
  Matrix2<double> J_angle;  // px/rad, d u / d (pan, tilt)
};

struct CoarseOptions {
  double search_px = 0;  // radius around the prediction that is searched first, px of the image
  int max_iterations = 5;
  double min_correlation = 0.6;  // of a patch that counts as found
  double min_found = 0.4;        // share of the finest octave's patches that must be
  int min_patches = 5;           // octaves with fewer in the image are left out
};

struct CoarseAlignment {
  Vector2<double> angle =
      Vector2<double>::Zero();  // rad (pan, tilt), to be added to the prediction
  double found = 0;             // share of the finest octave's patches
  int patches = 0;              // in the image, at the finest octave
};

// patches in descending order of octaves. False if too few patches were found: *out tells what
// there was, and its angle is not to be used.
[[nodiscard]] bool align_coarsely(const Pyramid& pyramid, const CoarsePatch* patches, int count,
                                  const CoarseOptions& options, CoarseAlignment* out);

}  // namespace alidade
