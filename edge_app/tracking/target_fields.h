#pragma once
// Generated from edge_app/tracking/target_fields.yaml by scripts/generate-fields: change the list instead.
//
// add_fields(): passes all fields that a target of this space has, in their order, to a line:
// add(name, value), add_if(name, value), which is left out without a value, or
// add_object(name, keys, values).

#include <array>
#include <optional>

#include "edge_app/tracking/target_values.h"

namespace alidade {

inline constexpr TargetKeys<4> k_target_box = {"u", "v", "width", "height"};

template <class Line>
void add_fields(const TargetReport& target, TargetSpace space, Line* line) {
  const bool on_plane = space == TargetSpace::kPlane;
  line->add("identity", target.identity);
  line->add("class", class_of(target));
  line->add("score", target.score);
  line->add("born_s", target.born_s);
  line->add("seen_s", target.seen_s);
  line->add("in_view", target.in_view);
  line->add("direction", target.d_b);
  if (on_plane) line->add("position_m", place_of(target));
  if (on_plane) line->add("velocity_m_s", velocity_of(target));
  if (on_plane) line->add_if("latitude_deg", latitude_deg_of(target));
  if (on_plane) line->add_if("longitude_deg", longitude_deg_of(target));
  if (!on_plane) line->add("azimuth_rad", state_of(target, 0));
  if (!on_plane) line->add("elevation_rad", state_of(target, 1));
  if (!on_plane) line->add("azimuth_rate_rad_s", state_of(target, 2));
  if (!on_plane) line->add("elevation_rate_rad_s", state_of(target, 3));
  line->add("covariance", covariance_of(target));
  line->add("pixel", target.pixel);
  line->add("covariance_px2", pixel_covariance_of(target));
  std::optional<std::array<double, 4>> box;
  if (target.box) box = {{target.box->u, target.box->v, target.box->width, target.box->height}};
  line->add_object("box", k_target_box, box);
}

}  // namespace alidade
