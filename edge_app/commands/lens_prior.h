#pragma once
// What a lens.yaml (`alidade calibrate-shutter`) says of the camera of a recording or a live video: priors for calibrate_knowing(). Of
// images of another size but the same shape they are scaled: as many rows take as long together. The base camera has one k and
// its centre in the middle (core/pattern/lens_camera.h). Priors are taken one by one, without their correlations: all variances
// are multiplied by the largest eigenvalue of the correlation matrix, beyond which no combination of them is wronged.

#include <string>
#include <vector>

#include "core/calibration/known_camera.h"

namespace alidade {

// All values wanted. remarks: what to tell of it. Throws CommandError: a file that cannot be read or is none, images of another shape,
// a lens that the base camera cannot stand for.
[[nodiscard]] KnownCamera load_lens_prior(const std::string& path, int width, int height,
                                          std::vector<std::string>* remarks);

}  // namespace alidade
