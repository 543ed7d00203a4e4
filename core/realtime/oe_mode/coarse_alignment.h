#pragma once
// Coarse alignment: the error of a prediction in pan and tilt, from all patches of the coarse
// octaves together (PTCEE 30, 31). Sparse, inverse compositional, coarse to fine.
// At each octave, from the coarsest on, the two angles d minimise
//   sum over patches of  | gain reference + offset - image(u + J_angle d) |^2
// by Gauss-Newton, with a gain and offset for each patch. Patches whose own step disagrees with the
// common one get less weight: they move by themselves or are hidden. Converges from within 1.5 px
// of the coarsest octave. If search_px is larger, the best of a grid of shifts is taken first.
// Pure functions; no allocation.

#include "core/model/angle.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"

namespace alidade {

// Patches of one octave; more are ignored.
inline constexpr int kMaxCoarsePatches = 256;

struct CoarsePatch {
  const ReferencePatch* reference = nullptr;  // never null; must stay during align_coarsely()
  int octave = 0;                             // < Pyramid::octaves()
  Vector2<double> u;                          // px of the image, predicted
  Matrix2<double> J_angle;                    // px/rad, d u / d (pan, tilt)
};

struct CoarseOptions {
  // px of the image; radius of the first search, but at most 10 px of the octave that is searched,
  // the coarsest one with enough patches. 0: no search.
  double search_px = 0;
  int max_iterations = 5;
  double min_correlation = 0.6;  // of a patch that counts as found
  double min_found = 0.4;        // required share of found patches at the finest octave
  int min_patches = 5;           // octaves with fewer in the image are skipped
};

struct CoarseAlignment {
  Vector2<double> angle = Vector2<double>::Zero();  // rad (pan, tilt), to add to the prediction
  double found = 0;                                 // share of the finest octave's patches
  int patches = 0;                                  // in the image, at the finest octave
};

// patches: in descending order of octave. False if no octave could be aligned, or too few patches
// were found; *out then has the numbers, but its angle must not be used.
[[nodiscard]] bool align_coarsely(const Pyramid& pyramid, const CoarsePatch* patches, int count,
                                  const CoarseOptions& options, CoarseAlignment* out);

}  // namespace alidade
