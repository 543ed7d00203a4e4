#pragma once
// Generated from edge_app/record/record_fields.yaml by scripts/generate-fields: change the list instead.
//
// add_fields(): passes all fields of a record, in their order, to a line: add(name, value),
// add(name, columns, values) or add_object(name, keys, values).

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "edge_app/record/record_values.h"

namespace alidade {

inline constexpr Columns<4> k_q_base_from_camera = {"q_x", "q_y", "q_z", "q_w"};
inline constexpr Columns<3> k_orientation_sigma_rad = {
    "orientation_sigma_rad_0", "orientation_sigma_rad_1", "orientation_sigma_rad_2"};
inline constexpr Columns<9> k_orientation_covariance_rad2 = {
    "orientation_covariance_rad2_0", "orientation_covariance_rad2_1",
    "orientation_covariance_rad2_2", "orientation_covariance_rad2_3",
    "orientation_covariance_rad2_4", "orientation_covariance_rad2_5",
    "orientation_covariance_rad2_6", "orientation_covariance_rad2_7",
    "orientation_covariance_rad2_8"};
inline constexpr Columns<2> k_centre_offset_px = {"centre_offset_u_px", "centre_offset_v_px"};
inline constexpr Columns<2> k_localized = {"age_s", "sigma_rad"};

template <class Line>
void add_fields(const OrientationRecord& record, Line* line) {
  // A member of the orientation, if there is one.
  const auto of_orientation = [&record](auto member) {
    using Member = std::decay_t<decltype(std::declval<OrientationRecord::Orientation>().*member)>;
    return record.orientation ? std::optional<Member>((*record.orientation).*member) : std::nullopt;
  };
  line->add("frame", record.frame);
  line->add("time_s", record.time_s);
  line->add("receive_time_s", record.receive_time_s);
  line->add("mode", std::string_view(to_string(record.mode)));
  line->add("status", std::string_view(to_string(record.status)));
  line->add("calibrated", record.calibrated);
  line->add("calibration", std::string_view(to_string(record.calibration.activity)));
  line->add("needs", need_of(record));
  line->add("pan_rad", of_orientation(&OrientationRecord::Orientation::pan_rad));
  line->add("tilt_rad", of_orientation(&OrientationRecord::Orientation::tilt_rad));
  line->add("pan_rate_rad_s", of_orientation(&OrientationRecord::Orientation::pan_rate_rad_s));
  line->add("tilt_rate_rad_s", of_orientation(&OrientationRecord::Orientation::tilt_rate_rad_s));
  line->add("pan_acceleration_rad_s2",
            of_orientation(&OrientationRecord::Orientation::pan_acceleration_rad_s2));
  line->add("tilt_acceleration_rad_s2",
            of_orientation(&OrientationRecord::Orientation::tilt_acceleration_rad_s2));
  line->add("q_base_from_camera", k_q_base_from_camera,
            of_orientation(&OrientationRecord::Orientation::q_base_from_camera));
  line->add("orientation_sigma_rad", k_orientation_sigma_rad,
            of_orientation(&OrientationRecord::Orientation::sigma_rad));
  line->add("orientation_covariance_rad2", k_orientation_covariance_rad2,
            of_orientation(&OrientationRecord::Orientation::covariance_rad2));
  line->add("reference_row", kReferenceRow);
  line->add("landmarks", std::int64_t{record.landmarks});
  line->add("residual_px", record.residual_px);
  line->add("line_delay_s", record.camera.line_delay);
  line->add("focal_length_px", record.camera.focal_length);
  line->add("focal_length_sigma_px", std::sqrt(record.camera.covariance[0]));
  line->add("aspect", record.camera.aspect);
  line->add("radial_distortion", record.camera.radial_distortion);
  line->add("centre_offset_px", k_centre_offset_px,
            std::optional(std::array<double, 2>{record.camera.centre_u, record.camera.centre_v}));
  line->add("latency_s", record.latency_s);
  line->add("telemetry_age_s", record.telemetry_age_s);
  line->add("zoom", record.zoom);
  line->add("zoom_rate_per_s", zoom_rate_of(record));
  line->add("zoom_rate_sigma_per_s", zoom_rate_sigma_of(record));
  std::optional<std::array<double, 2>> localized;
  if (record.localized) localized = {{record.localized->age_s, record.localized->sigma_rad}};
  line->add_object("localized", k_localized, localized);
  line->add("time_sigma_s", record.time_s ? std::optional(record.time_sigma_s) : std::nullopt);
}

}  // namespace alidade
