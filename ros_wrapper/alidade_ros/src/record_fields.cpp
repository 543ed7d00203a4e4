// Generated from edge_app/record/record_fields.yaml by scripts/generate-fields: change the list instead.

#include "alidade_ros/record_fields.h"

#include <algorithm>
#include <limits>

#include "alidade_ros/conversions.h"
#include "alidade_ros/record_conversion.h"

namespace alidade_ros {

Record record_of(const Json& json) {
  Record r;
  r.frame = optional_of<std::int64_t>(json, "frame");
  r.time_s = optional_of<double>(json, "time_s");
  r.receive_time_s = json.at("receive_time_s").get<double>();
  r.mode = json.at("mode").get<std::string>();
  r.status = json.at("status").get<std::string>();
  r.calibrated = json.at("calibrated").get<bool>();
  r.calibration = json.at("calibration").get<std::string>();
  r.needs = optional_of<std::string>(json, "needs").value_or("");
  r.reference_row = optional_of<double>(json, "reference_row").value_or(double(0));
  r.landmarks = json.at("landmarks").get<std::int64_t>();
  r.residual_px = optional_of<double>(json, "residual_px");
  r.line_delay_s = json.at("line_delay_s").get<double>();
  r.focal_length_px = json.at("focal_length_px").get<double>();
  r.focal_length_sigma_px = optional_of<double>(json, "focal_length_sigma_px");
  r.aspect = json.at("aspect").get<double>();
  r.radial_distortion = json.at("radial_distortion").get<double>();
  r.centre_offset_px = optional_of<std::array<double, 2>>(json, "centre_offset_px")
                           .value_or(std::array<double, 2>{0, 0});
  r.latency_s = optional_of<double>(json, "latency_s");
  r.telemetry_age_s = optional_of<double>(json, "telemetry_age_s");
  r.zoom = optional_of<double>(json, "zoom");
  r.zoom_rate_per_s = optional_of<double>(json, "zoom_rate_per_s");
  r.zoom_rate_sigma_per_s = optional_of<double>(json, "zoom_rate_sigma_per_s");
  if (const auto object = optional_of<Json>(json, "localized"))
    r.localized =
        Record::Localized{object->at("age_s").get<double>(), object->at("sigma_rad").get<double>()};
  r.time_sigma_s = optional_of<double>(json, "time_sigma_s");
  if (r.mode == "none") return r;
  Record::Orientation& o = r.orientation.emplace();
  o.pan_rad = json.at("pan_rad").get<double>();
  o.tilt_rad = json.at("tilt_rad").get<double>();
  o.pan_rate_rad_s = json.at("pan_rate_rad_s").get<double>();
  o.tilt_rate_rad_s = json.at("tilt_rate_rad_s").get<double>();
  o.pan_acceleration_rad_s2 = json.at("pan_acceleration_rad_s2").get<double>();
  o.tilt_acceleration_rad_s2 = json.at("tilt_acceleration_rad_s2").get<double>();
  o.q_base_from_camera = json.at("q_base_from_camera").get<std::array<double, 4>>();
  o.orientation_covariance_rad2 =
      json.at("orientation_covariance_rad2").get<std::array<double, 9>>();
  return r;
}

void fill_fields(const Record& record, alidade_msgs::FrameOrientation* message) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::optional<Record::Orientation>& o = record.orientation;
  message->has_frame = record.frame.has_value();
  message->frame = record.frame.value_or(-1);
  message->time = record.time_s.value_or(kNan);
  message->receive_time = record.receive_time_s;
  message->mode = mode_number(record.mode);
  message->status = record.status;
  message->calibrated = record.calibrated;
  message->calibration = record.calibration;
  message->needs = record.needs;
  message->pan = o ? turned(o->pan_rad) : kNan;
  message->tilt = o ? turned(o->tilt_rad) : kNan;
  message->pan_rate = o ? turned(o->pan_rate_rad_s) : kNan;
  message->tilt_rate = o ? turned(o->tilt_rate_rad_s) : kNan;
  message->pan_acceleration = o ? turned(o->pan_acceleration_rad_s2) : kNan;
  message->tilt_acceleration = o ? turned(o->tilt_acceleration_rad_s2) : kNan;
  message->orientation = o ? ros_orientation(o->q_base_from_camera) : unknown_orientation();
  message->orientation_covariance.fill(kNan);
  if (o)
    std::copy(o->orientation_covariance_rad2.begin(), o->orientation_covariance_rad2.end(),
              message->orientation_covariance.begin());
  message->reference_row = record.reference_row;
  message->landmarks = static_cast<std::uint32_t>(record.landmarks);
  message->residual = record.residual_px.value_or(kNan);
  message->line_delay = record.line_delay_s;
  message->focal_length = record.focal_length_px;
  message->focal_length_sigma = record.focal_length_sigma_px.value_or(kNan);
  message->aspect = record.aspect;
  message->radial_distortion = record.radial_distortion;
  message->centre_offset_u = record.centre_offset_px[0];
  message->centre_offset_v = record.centre_offset_px[1];
  message->latency = record.latency_s.value_or(kNan);
  message->telemetry_age = record.telemetry_age_s.value_or(kNan);
  message->zoom = record.zoom.value_or(kNan);
  message->zoom_rate = record.zoom_rate_per_s.value_or(kNan);
  message->zoom_rate_sigma = record.zoom_rate_sigma_per_s.value_or(kNan);
  message->localized_age = record.localized ? record.localized->age_s : kNan;
  message->localized_sigma = record.localized ? record.localized->sigma_rad : kNan;
  message->time_sigma = record.time_sigma_s.value_or(kNan);
}

}  // namespace alidade_ros
