#pragma once
// The paper's way to orientations and focal lengths (Lisanti et al.), a baseline: from a picture that is known, along the
// neighbours with most in common, by H = K_a R_a^T R_b K_b^-1, which OpenCV fits to their matches (RANSAC, 3 px). K_a^-1 H = R_a^T R_b K_b^-1
// then gives f_b by the lengths of its columns, and the nearest rotation. The optical centre is in the middle, and there is no distortion.
// Telemetry and zoom readings are not used. Free of shared state but OpenCV's random numbers, which begin anew.

#include <vector>

#include "core/mapping/map_adjustment.h"

namespace alidade::test {

// All that can be reached from `root`, which is as `known` says; others keep f 1. Cameras are of known's size. False in `reached`: not.
[[nodiscard]] std::vector<AdjustedPicture> chain_homographies(const MapEvidence& evidence, int root,
                                                              const AdjustedPicture& known,
                                                              std::vector<char>* reached);

}  // namespace alidade::test
