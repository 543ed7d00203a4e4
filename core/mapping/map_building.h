#pragma once
// From pictures to a scene map: what is one thing in many pictures, start values, adjustment, and all that can be recognised later.
//   links      twos of pictures, compared and checked (picture_links.h)
//   first      adjustment on some features of each, the lens from what is thought of it (map_adjustment.h)
//   second     with the lens found: matches checked again, each within some sigmas of where it should be; their noise by the size of a
//              feature, learnt; adjustment on all
//   landmarks  tracks of two features or more, and what one picture alone has seen, with covariance: its own part from its
//              observations, the common one from the keyframe that knows its direction best
// Pictures without telemetry are tied to the others by what they see; without any telemetry the base is that of one picture, which
// looks forward. What does not hang together with the rest is named: little of it is left out, more is refused.
// Batch work: allocates much. Equal input gives equal maps. No threads of its own.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/mapping/map_adjustment.h"
#include "core/mapping/picture_links.h"
#include "core/mapping/scene_map.h"

namespace alidade {

// What is known of a picture, besides its features.
struct MapView {
  std::string recording;
  std::int64_t frame = 0;
  double time_utc_s = 0;
  std::optional<double> zoom;
  std::optional<double>
      log_f;  // by zoom reading and data sheet or calibration; all pictures or none
  std::optional<PanTilt<double>> telemetry;  // measured angles
  double angle_sigma =
      1e-3;  // rad, of telemetry's orientation: noise, backlash, and what is not known of the axes
  Vector3<double> angular_velocity = Vector3<double>::Zero();  // camera frame, rad/s
  double zoom_rate = 0;                                        // d log f / dt, 1/s
};

struct MapBuildOptions {
  int width = 0;  // of all pictures, px
  int height = 0;
  double line_delay = 0;  // s/row
  std::optional<Mechanics<double>> mechanics;
  std::optional<LensCurve> lens;  // of an earlier calibration; its range has to hold all log_f
  double log_f_sigma =
      0.02;  // of log_f: what the data sheet may be wrong by at a picture, while nothing is known
  double repeatability = 1e-3;  // sigma of log f after a movement of the zoom
  double lens_spacing = 0.4;    // of log f: knots of the lens's curve
  double centre_share = 0.01;  // of the width: sigma of the optical centre about the image's middle
  LinkOptions links;
  MapOptions adjustment;     // its lens is set here
  int first_features = 150;  // of each picture, for the first adjustment
  double gate_px = 1.5;      // of the second, and
  double gate_sigmas = 6;
  int least_features = 30;  // of a picture that can be used
  int least_group =
      3;  // pictures of a part that does not hang together with the rest, at which the map is refused
  bool largest_part = false;  // take the largest part nevertheless

  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class MapBuildStatus {
  kOk,
  kBadInput,       // options, or nothing to begin with
  kNoTexture,      // no two pictures with enough features
  kNoFocalLength,  // some pictures have log_f and some not, or none fits
  kNotConnected,   // see groups
  kNotDetermined,  // the adjustment found no minimum
};

[[nodiscard]] const char* to_string(MapBuildStatus status);

struct MapBuild {
  MapBuildStatus status = MapBuildStatus::kBadInput;
  SceneMap map;                          // with kOk
  std::vector<int> of_keyframe;          // which picture, as added from 0, each keyframe was
  std::vector<int> without_texture;      // left out
  std::vector<int> not_connected;        // left out
  std::vector<std::vector<int>> groups;  // with kNotConnected: the largest first
  MapStatus adjustment = MapStatus::kOk;
  int compared = 0;  // twos of pictures
  int linked = 0;
  int tracks = 0;
  int observations = 0;    // that the map rests on
  double residual_px = 0;  // root mean square of an observation's error
  double noise_scale = 0;  // residuals over what was claimed
  double hold_sigma = 0;   // of the map's lens
  int steps = 0;
};

// part done, 0 to 1, and what is being done
using MapProgress = std::function<void(double done, const char* what)>;

class MapBuilder {
 public:
  explicit MapBuilder(const MapBuildOptions& options) : options_(options) {}

  // picture: coded, as it is to be kept; may be empty.
  void add(MapView view, FeatureSet features, std::vector<std::uint8_t> picture = {});
  [[nodiscard]] int size() const { return static_cast<int>(views_.size()); }
  [[nodiscard]] const MapView& view(int i) const { return views_[static_cast<std::size_t>(i)]; }

  [[nodiscard]] MapBuild build(const MapProgress& progress = {}) const;

 private:
  MapBuildOptions options_;
  std::vector<MapView> views_;
  std::vector<FeatureSet> features_;
  std::vector<std::vector<std::uint8_t>> pictures_;
};

}  // namespace alidade
