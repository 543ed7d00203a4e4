#pragma once
// What is known of the ground under the camera, for `alidade plane fit`. Meanings:
// plane_evidence.h.
//   format: 1
//   origin:    {latitude_deg: 48.1, longitude_deg: 11.5, height_m: 520}
//              x points east and y north; the plane passes through the origin
//   height:    {height_m: 12, sigma_m: 0.05}                of the camera above the plane
//   level:     {pitch_deg: 0, roll_deg: 0, sigma_deg: 0.2}  of the base against gravity
//   heading:   {heading_deg: 40, sigma_deg: 1}              of base forward, clockwise from y
//   place:     {PLACE, sigma_m: 1}                          of the camera
//   points:    [{name: kerb, SIGHT, PLACE, z_m: 0, sigma_m: 0.03}]
//   horizon:   [{name: sea, SIGHT}]
//   bearings:  [{name: street, SIGHT, heading_deg: 12, heading_sigma_deg: 0.5}]
//   verticals: [{name: facade, SIGHT}]
//   lengths:   [{name: goal line, from: {SIGHT}, to: {SIGHT}, length_m: 68, sigma_m: 0.1}]
//   uprights:  [{name: Anna, foot: {SIGHT}, head: {SIGHT}, height_m: 1.72, sigma_m: 0.02}]
//   PLACE      x_m: 3, y_m: 4
//              or latitude_deg: 48.1, longitude_deg: 11.5, for points also height_m: 521; these
//              need origin
//   SIGHT      direction: [0.9, 0.1, 0.3], sigma_rad: 1e-4  base: forward, right, down; any length
//              or picture: left, pixel: [812, 640], sigma_px: 0.5
//   image:     {width: 1920, height: 1080}                  px, of the pictures
//   pictures:  [{name: left, record: {...}}]                a record of `run` or `replay --json`
// Sights of one picture share the error of its orientation, which its record states. Each row is
// turned from row 0 by a mechanism with nominal axes. Focal length and distortion come from the
// record; the sigma of f is part of each sight's own error. The file is read as strictly as the
// configuration: every mistake is an error of one line with file and line number.

#include <optional>
#include <string>

#include "core/ground/local_frame.h"
#include "core/ground/plane_evidence.h"

namespace alidade {

struct PlaneData {
  PlaneEvidence evidence;
  std::optional<GeodeticPosition> origin;
};

// Pure. False with one line in *error. `name` names the file in errors.
[[nodiscard]] bool parse_plane_data(const std::string& text, const std::string& name,
                                    PlaneData* data, std::string* error);
[[nodiscard]] bool load_plane_data(const std::string& path, PlaneData* data, std::string* error);

}  // namespace alidade
