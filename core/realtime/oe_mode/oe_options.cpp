#include "core/realtime/oe_mode/oe_options.h"

namespace alidade {

bool LookOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(shown_lens_px > 0)) problem = "shown_lens_px must be positive";
  if (!(other_lens_px > 0)) problem = "other_lens_px must be positive";
  if (!(better >= 0 && better <= 1)) problem = "better must be 0 to 1";
  if (!(misfit > 1)) problem = "misfit must be more than 1";
  if (few < 0 || few_coarse < 0) problem = "few and few_coarse must not be negative";
  if (least_held_again < 0) problem = "least_held_again must not be negative";
  if (!(least_held >= 0 && least_held <= 1)) problem = "least_held must be 0 to 1";
  if (!(nearby_px >= 0)) problem = "nearby_px must not be negative";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

bool OeOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (max_landmarks < 1) problem = "max_landmarks must be at least 1";
  if (max_width < 1 || max_height < 1) problem = "max_width and max_height must be positive";
  if (error != nullptr && problem != nullptr) *error = problem;
  const bool each_is_valid = problem == nullptr && octaves.validate(error) &&
                             noise.validate(error) && prediction.validate(error) &&
                             search.validate(error) && look.validate(error) &&
                             solve.validate(error) && offset.validate(error) &&
                             tie.validate(error) && lens.validate(error) && shear.validate(error) &&
                             upkeep.validate(error) && maker.validate(error);
  if (!each_is_valid || search.choice.max_chosen >= solve.min_inliers) return each_is_valid;
  if (error != nullptr) *error = "max_chosen must not be less than min_inliers";
  return false;
}

}  // namespace alidade
