#pragma once
// MapBuilder: builds a scene map from pictures' features and what is known of the pictures. In
// order: links between pairs of pictures (picture_links.h), a first adjustment with some features
// and the prior lens (map_adjustment.h), a second one with all features, landmarks (map_making.h).
// Details: docs/derivations.md.
// Pictures without telemetry are tied to the others by common features. If no picture has
// telemetry, one picture defines the base: it looks forward. Parts of the map without connection to
// the rest are named in the result: small parts are left out, a larger one refuses the map. Batch
// work: allocates much. Equal input gives equal maps. No threads of its own.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/mapping/map_adjustment.h"
#include "core/mapping/picture_links.h"
#include "core/mapping/scene_map.h"

namespace alidade {

// Knowledge of a picture besides its features.
struct MapView {
  std::string recording;       // name
  std::int64_t frame = 0;      // of the recording
  double time_utc_s = 0;       // 0: not known
  std::optional<double> zoom;  // reading, device units
  // f in px, from zoom reading and data sheet or calibration; all pictures have it, or none has.
  std::optional<double> log_f;
  // Sigma of log_f's own error, as of a reading between those that were calibrated. What is below
  // MapBuildOptions::repeatability counts as that.
  double log_f_sigma = 0;
  std::optional<PanTilt<double>> telemetry;  // measured angles, rad
  // Sigma of the orientation by telemetry, rad: noise, backlash, uncertainty of the axes.
  double angle_sigma = 1e-3;
  Vector3<double> angular_velocity = Vector3<double>::Zero();  // camera frame, rad/s
  double zoom_rate = 0;                                        // d log f / dt, 1/s
  // Sigma of both: rad/s three times, 1/s. All 0: exact.
  Vector4<double> motion_sigma = Vector4<double>::Zero();
};

struct MapBuildOptions {
  int width = 0;                               // px, of all pictures
  int height = 0;                              // px, of all pictures
  double line_delay = 0;                       // s/row
  std::optional<Mechanics<double>> mechanics;  // empty: not known; telemetry is not used
  // Of an earlier calibration (lens_prior.h); its range must contain all log_f.
  std::optional<LensCurve> lens;
  // Sigma of log_f before the adjustment: error of the data sheet.
  double log_f_sigma = 0.02;
  double repeatability = 1e-3;  // sigma of log f after a movement of the zoom
  double lens_spacing = 0.4;    // of log f, between knots of the lens's curve
  // Sigma of the optical centre about the image's middle, as a share of the width.
  double centre_share = 0.01;
  LinkOptions links;
  // The builder sets its lens, its start and the level sigmas of the centre. If it searches a focal
  // length, the level sigma of delta is at least 0.15.
  MapOptions adjustment;
  int first_features = 150;  // of each picture, for the first adjustment
  // Second adjustment: matches must agree within gate_px or gate_sigmas, whichever is larger.
  double gate_px = 1.5;
  double gate_sigmas = 6;
  int least_features = 30;  // of a usable picture
  // The map is refused if an unconnected part has this many pictures or more.
  int least_group = 3;
  bool largest_part = false;  // the largest part is used even then

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class MapBuildStatus {
  kOk,
  kBadInput,   // options that validate() refuses, or fewer than two pictures
  kNoTexture,  // fewer than two pictures with enough features
  // Only some pictures have log_f; none has it and no focal length fits; or one lies outside the
  // range of options.lens.
  kNoFocalLength,
  kNotConnected,   // see MapBuild::groups
  kNotDetermined,  // the adjustment found no minimum
};

[[nodiscard]] const char* to_string(MapBuildStatus status);

// Pictures are indices in the order of add().
struct MapBuild {
  MapBuildStatus status = MapBuildStatus::kBadInput;
  SceneMap map;                           // with kOk
  std::vector<int> of_keyframe;           // picture of each keyframe; with kOk
  std::vector<int> without_texture;       // pictures that were left out
  std::vector<int> not_connected;         // likewise
  std::vector<std::vector<int>> groups;   // with kNotConnected: of pictures, the largest first
  MapStatus adjustment = MapStatus::kOk;  // of the adjustment that failed
  int compared = 0;                       // pairs of pictures
  int linked = 0;                         // pairs that a rotation and a change of f explain
  int tracks = 0;
  int observations = 0;    // used by the map
  double residual_px = 0;  // rms of an observation's error
  double noise_scale = 0;  // rms of the residuals in their sigmas
  double hold_sigma = 0;   // of the map's lens
  int steps = 0;           // of the adjustment
};

// done: 0 to 1. what: the current step, in words.
using MapProgress = std::function<void(double done, const char* what)>;

class MapBuilder {
 public:
  explicit MapBuilder(const MapBuildOptions& options) : options_(options) {}

  // picture: coded, to be kept in the map; may be empty.
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
