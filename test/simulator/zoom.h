#pragma once
// The zoom of the virtual camera: its lens at any time, and what is told of it.
//
//   f(t) = f(z(t)) exp(eps(t)),   k and optical centre those of z(t),   z the true reading (zoom_path.h, zoom_curve.h)
//
// A lens does not come back exactly: each movement n leaves eps_n = N(0, sigma_rep^2) +- backlash / 2, + where it went to longer
// focal lengths. During a movement eps goes from the one to the other in step with log f; the motor's limits are those of
// f(z) alone. What is told is z in whole steps, `late` behind, and stands still in the intervals given.
// Draws depend on seed and movement alone, or on the movement's place in the round if the path states how long one is. Thread-safe, no allocation after construction.

#include <cstdint>
#include <memory>
#include <optional>

#include "test/simulator/config.h"
#include "test/simulator/lens.h"
#include "test/simulator/zoom_curve.h"
#include "test/simulator/zoom_path.h"

namespace alidade::simulator {

class Zoom {
 public:
  // config.zoom must be set. Throws as make_zoom_path().
  explicit Zoom(const Config& config);

  [[nodiscard]] Lens lens(double time_s) const;
  // As if it came back exactly.
  [[nodiscard]] Lens nominal_lens(double reading) const;
  // True, between steps too.
  [[nodiscard]] double reading(double time_s) const;
  // What is told when the truth is that of time_s.
  [[nodiscard]] double reported(double time_s) const;
  // Of a reading: 0 at the wide end, 1 at the tele end.
  [[nodiscard]] double part(double reading) const { return curve_.part(reading); }

  // eps after a movement.
  [[nodiscard]] double slip(std::int64_t movement) const;
  [[nodiscard]] const ZoomPath& path() const { return *path_; }
  // Of the path, without eps, px.
  [[nodiscard]] ZoomConfig::Ends focal_lengths() const;
  // After how many seconds the lens does the same again; 0: never. Without a movement it is always the same.
  [[nodiscard]] double period_s() const {
    return config_.sigma_rep > 0 && !each_round_the_same() ? 0 : path_->period_s();
  }

 private:
  // A path that states its round is to repeat, eps too.
  [[nodiscard]] bool each_round_the_same() const { return config_.path.round > 0; }
  [[nodiscard]] Lens lens_at(double part, double log_focal_length) const;

  ZoomConfig config_;
  double aspect_, half_width_;  // half_width: px
  Eigen::Vector2d middle_;      // of the image, px
  std::uint64_t seed_;
  ZoomCurve curve_;
  std::shared_ptr<const ZoomPath> path_;
};

// Nothing without a zoom section.
[[nodiscard]] std::optional<Zoom> make_zoom(const Config& config);

}  // namespace alidade::simulator
