#pragma once
// The tables of scene.map. The whole schema of a file must be this text: what else a database can hold (triggers, views) is refused.
// Columns have no type of their own, as one would change bits: -0.0 becomes 0 in a column of REAL.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace alidade {

inline constexpr std::int64_t kSceneMapApplication = 0x414C534D;  // "ALSM"
inline constexpr std::int64_t kSceneMapFormat = 2;
// Still read: it lacks kLensRestTable, and its lens keeps the distortion in the corner (LensCurve::hold() = 1).
inline constexpr std::int64_t kSceneMapFormatWithoutRest = 1;

// Of a file whose bytes nothing can be made of.
inline constexpr const char* kSceneMapDamaged =
    "damaged, or cut off; build it again, or put back a copy";

// As they are made, and as sqlite_schema lists them by name.
inline const std::array<std::string, 8> kSceneMapTables = {
    "CREATE TABLE keyframe(id INTEGER PRIMARY KEY, recording, frame, time_utc_s, zoom, position, "
    "telemetry_pan, telemetry_tilt, "
    "q_x, q_y, q_z, q_w, eps, "
    "cov_xx, cov_xy, cov_xz, cov_xf, cov_yy, cov_yz, cov_yf, cov_zz, cov_zf, cov_ff, "
    "w_x, w_y, w_z, zoom_rate, residual_px, crc)",
    "CREATE TABLE landmark(id INTEGER PRIMARY KEY, d_x, d_y, d_z, cov_xx, cov_xy, cov_yy, "
    "shared_xx, shared_xy, shared_yy, "
    "scale_rad, focal_length_px, descriptor, born_utc_s, last_seen_utc_s, looked_for, matched, "
    "missed, "
    "sightings, sightings_crc, crc)",
    "CREATE TABLE lens_knot(number INTEGER PRIMARY KEY, log_f)",
    "CREATE TABLE lens_point(number INTEGER PRIMARY KEY, delta, kappa, centre_u, centre_v)",
    "CREATE TABLE lens_rest(number INTEGER PRIMARY KEY, hold)",
    "CREATE TABLE picture(keyframe INTEGER PRIMARY KEY REFERENCES keyframe(id), luma, crc)",
    "CREATE TABLE scene(id INTEGER PRIMARY KEY, revision, width, height, aspect, line_delay_s, "
    "reference_row_px, "
    "has_mechanics, pan_axis_x, pan_axis_y, pan_axis_z, tilt_axis_x, tilt_axis_y, tilt_axis_z, "
    "pan_scale, tilt_scale, "
    "next_landmark, lens_points, lens_crc, keyframes, landmarks, sightings, row_sum, crc)",
    "CREATE TABLE sighting(landmark REFERENCES landmark(id), keyframe REFERENCES keyframe(id), "
    "u_px, v_px, scale_px, "
    "PRIMARY KEY(landmark, keyframe)) WITHOUT ROWID"};
inline constexpr std::size_t kLensRestTable = 4;

}  // namespace alidade
