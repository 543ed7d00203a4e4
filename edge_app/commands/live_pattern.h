#pragma once
// The pattern in a live video, for `alidade calibrate-shutter -c`: films until all was shown that a calibration needs
// (core/pattern/pattern_progress.h), or for duration_s from the first image on, or up to SIGINT or SIGTERM, and says on stderr what
// is still to be shown. A camera that is lost is waited for, as `record` does.
//
// Threads: one reads and stamps, one looks for the pattern in the latest image when it is done with the one before, so that looking
// neither delays stamps nor makes a source drop frames. At most two images are kept.

#include <string>

#include "core/pattern/known_pattern.h"
#include "edge_app/commands/pattern_search.h"
#include "edge_app/config/config.h"

namespace alidade {

// Beyond it the calibration would take minutes, and memory by the gigabyte.
inline constexpr double kLongestFilm_s = 300;

// config: live. Throws CommandError: no image came, images of another size than configured, a link that failed for good.
[[nodiscard]] PatternVideo film_pattern(const VideoConfig& config, const KnownPattern& pattern,
                                        double duration_s);

}  // namespace alidade
