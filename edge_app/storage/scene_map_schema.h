#pragma once
// The tables of scene.map. A file's whole schema must be exactly this text: anything else in a
// database (triggers, views) is refused. Columns have no type, as a type may change bits: a REAL
// column turns -0.0 into 0.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace alidade {

inline constexpr std::int64_t kSceneMapApplication = 0x414C534D;  // "ALSM"
inline constexpr std::int64_t kSceneMapFormat = 2;
// The older format, which can still be read. Its lens keeps the distortion of the corner
// (LensCurve::hold() = 1).
inline constexpr std::int64_t kSceneMapFormatWithoutRest = 1;

// For a file whose content makes no sense.
inline constexpr const char* kSceneMapDamaged =
    "damaged, or cut off; build it again, or put back a copy";

// In the order of sqlite_schema, by name, which is also the order in which they are made.
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

// The tables of kSceneMapFormatWithoutRest. A file of that format keeps this text, whatever becomes
// of the tables above.
inline const std::array<std::string, 7> kSceneMapTablesWithoutRest = {
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
    "CREATE TABLE picture(keyframe INTEGER PRIMARY KEY REFERENCES keyframe(id), luma, crc)",
    "CREATE TABLE scene(id INTEGER PRIMARY KEY, revision, width, height, aspect, line_delay_s, "
    "reference_row_px, "
    "has_mechanics, pan_axis_x, pan_axis_y, pan_axis_z, tilt_axis_x, tilt_axis_y, tilt_axis_z, "
    "pan_scale, tilt_scale, "
    "next_landmark, lens_points, lens_crc, keyframes, landmarks, sightings, row_sum, crc)",
    "CREATE TABLE sighting(landmark REFERENCES landmark(id), keyframe REFERENCES keyframe(id), "
    "u_px, v_px, scale_px, "
    "PRIMARY KEY(landmark, keyframe)) WITHOUT ROWID"};

}  // namespace alidade
