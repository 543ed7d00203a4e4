#pragma once
// Finds the pattern in a live video, for `alidade calibrate-shutter -c`. Films until everything
// that a calibration needs was shown (core/pattern/pattern_progress.h), for duration_s from the
// first image on, or until SIGINT or SIGTERM. Says on stderr what is still to be shown. Waits for a
// lost camera, as `record` does.
//
// Threads: one reads and stamps the frames, the other searches the latest image for the pattern. So
// the search neither delays time stamps nor makes a source drop frames. At most two images are in
// memory.

#include <string>

#include "core/pattern/known_pattern.h"
#include "edge_app/commands/pattern_search.h"
#include "edge_app/config/config.h"

namespace alidade {

// A longer film would take minutes and gigabytes of memory to calibrate.
inline constexpr double kLongestFilm_s = 300;

// config: of a live video. Throws CommandError if no image came, or fewer than three were searched.
// Before the pattern was found once, it is also thrown if the link fails for good, or an image has
// another size than the configured one or those before, or is too small for a pattern. Later such
// an event ends the film, and what was filmed before is used. The first image must come within
// config.timeout_s + kConnectSlack_s. This time does not run while the source says what it waits
// for.
[[nodiscard]] PatternVideo film_pattern(const VideoConfig& config, const KnownPattern& pattern,
                                        double duration_s);

}  // namespace alidade
