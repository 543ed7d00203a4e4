// Options that are valid, and one line for each that is not.

#include "core/realtime/oe_mode/oe_options.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace alidade::test {
namespace {

TEST(OeOptions, AreValidAsTheyAre) {
  const char* error = nullptr;
  EXPECT_TRUE(OeOptions{}.validate(&error));
  EXPECT_EQ(error, nullptr);
}

TEST(OeOptions, NameWhatIsNotValid) {
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::function<void(OeOptions*)>> damages = {
      [](OeOptions* o) { o->max_width = 0; },
      [](OeOptions* o) { o->max_landmarks = 0; },
      [](OeOptions* o) { o->octaves.first_coarse = 0; },
      [](OeOptions* o) { o->octaves.least_height_px = 4; },
      [](OeOptions* o) { o->octaves.least_noise = 0; },
      [](OeOptions* o) { o->octaves.least_contrast = 0.5; },
      [&](OeOptions* o) { o->noise.expected = kNaN; },
      [](OeOptions* o) { o->noise.samples = 0; },
      [](OeOptions* o) { o->noise.memory = 1.1; },
      [](OeOptions* o) { o->prediction.acceleration_fields = 0; },
      [](OeOptions* o) { o->prediction.longest_s = 0; },
      [](OeOptions* o) { o->search.choice.max_chosen = 1025; },
      [](OeOptions* o) { o->search.choice.max_chosen = 7; },
      [](OeOptions* o) { o->search.choice.columns = 97; },
      [](OeOptions* o) { o->search.choice.rows = 0; },
      [](OeOptions* o) { o->search.choice.columns = 0; },
      [](OeOptions* o) { o->search.coarse_patches = 0; },
      [](OeOptions* o) { o->search.coarse_patches = 257; },
      [](OeOptions* o) { o->search.fine_warp_tolerance = 0; },
      [](OeOptions* o) { o->search.cone_margin = 0.9; },
      [&](OeOptions* o) { o->search.search_sigmas = kNaN; },
      [](OeOptions* o) { o->search.coarse_reach_px = 0; },
      [](OeOptions* o) { o->search.wide_search_px = -1; },
      [](OeOptions* o) { o->look.nearby_px = -1; },
      [](OeOptions* o) { o->look.least_held = 1.5; },
      [](OeOptions* o) { o->look.least_held_again = -1; },
      [](OeOptions* o) { o->look.few = -1; },
      [](OeOptions* o) { o->look.misfit = 1; },
      [&](OeOptions* o) { o->look.better = kNaN; },
      [](OeOptions* o) { o->look.other_lens_px = 0; },
      [](OeOptions* o) { o->look.shown_lens_px = 0; },
      [](OeOptions* o) { o->solve.min_inliers = 0; },
      [](OeOptions* o) { o->solve.min_inliers = o->search.choice.max_chosen + 1; },
      [](OeOptions* o) { o->solve.min_inlier_share = 2; },
      [&](OeOptions* o) { o->solve.max_contradiction = kNaN; },
      [](OeOptions* o) { o->solve.max_scale = 0.5; },
      [](OeOptions* o) { o->solve.min_half_readout_s = 0; },
      [](OeOptions* o) { o->offset.drift = -1; },
      [](OeOptions* o) { o->offset.shared_correlation_time_s = -1; },
      [](OeOptions* o) { o->offset.max_contradiction = 0; },
      [](OeOptions* o) { o->lens.frames_at_rest = 0; },
      [](OeOptions* o) { o->lens.resting_sigmas = 0; },
      [&](OeOptions* o) { o->lens.belief.excluded_sigmas = kNaN; },
      [](OeOptions* o) { o->lens.frames_lost_for_good = 0; },
      [](OeOptions* o) { o->lens.distortion_change = -1; },
      [&](OeOptions* o) { o->lens.centre_change_px = kNaN; },
      [](OeOptions* o) { o->lens.track.acceleration = 0; },
      [](OeOptions* o) { o->lens.track.drift = -1; },
      [](OeOptions* o) { o->lens.belief.longest_s = 0; },
      [&](OeOptions* o) { o->lens.track.least_sigma = kNaN; },
      [](OeOptions* o) { o->tie.drift = -1; },
      [](OeOptions* o) { o->shear.longest_s = 0; },
      [](OeOptions* o) { o->shear.of_surprise = 0; },
      [](OeOptions* o) { o->shear.max_surprise = 0; },
      [](OeOptions* o) { o->shear.doubt = 0.5; },
      [](OeOptions* o) { o->shear.crooked_px = 0; },
      [](OeOptions* o) { o->upkeep.max_misses = 0; },
      [](OeOptions* o) { o->upkeep.probation = 0; },
      [](OeOptions* o) { o->upkeep.least_matched = 2; },
      [](OeOptions* o) { o->upkeep.memory = -1; },
      [](OeOptions* o) { o->upkeep.alike = 2; },
      [](OeOptions* o) { o->upkeep.least_covariance = -1; },
      [](OeOptions* o) { o->upkeep.lost_to_forget = 0; },
      [](OeOptions* o) { o->maker.cell_size_px = 15; },
      [](OeOptions* o) { o->maker.largest_cells = 0.5; },
      [](OeOptions* o) { o->maker.max_new = -1; },
      [](OeOptions* o) { o->maker.empty_view = -1; },
      [](OeOptions* o) { o->maker.textured = 2; }};
  for (std::size_t i = 0; i < damages.size(); ++i) {
    OeOptions options;
    damages[i](&options);
    const char* error = nullptr;
    EXPECT_FALSE(options.validate(&error)) << i;
    EXPECT_FALSE(options.validate()) << i;
    ASSERT_NE(error, nullptr) << i;
    EXPECT_NE(std::string(error).find("must"), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace alidade::test
