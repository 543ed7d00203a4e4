#pragma once
// Priors for calibrate_knowing() from a lens.yaml of `alidade calibrate-shutter`. For images of
// another size but the same shape the values are scaled; the read-out time of the whole image stays
// the same. The base camera has one k and its centre in the middle (core/pattern/lens_camera.h).
// The priors are used without their correlations. Therefore all variances are multiplied by the
// largest eigenvalue of the correlation matrix. So no linear combination of the values has a
// smaller variance than before.

#include <string>
#include <vector>

#include "core/calibration/known_camera.h"

namespace alidade {

// Returns all values with `wanted` set. width, height: px, of the recording's images. remarks: gets
// lines about the file for the user. Throws CommandError if the file cannot be read or is not a
// lens.yaml, if the shape of the images differs, or if the base camera cannot represent the lens.
[[nodiscard]] KnownCamera load_lens_prior(const std::string& path, int width, int height,
                                          std::vector<std::string>* remarks);

}  // namespace alidade
