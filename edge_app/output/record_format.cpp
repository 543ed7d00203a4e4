#include "edge_app/output/record_format.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "edge_app/output/or_null.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kReferenceRow = 0;  // at which angles, rates and q hold

struct Field {
  const char* name;
  Json value;
  std::vector<const char*> columns;  // CSV columns of an array; empty: one column, of the same name
};

std::vector<Field> fields(const OrientationRecord& record) {
  // A member of the orientation, null where there is none.
  const auto of_orientation = [&record](auto member) {
    return record.orientation ? Json((*record.orientation).*member) : Json();
  };
  using Orientation = OrientationRecord::Orientation;
  return {
      {"frame", or_null(record.frame), {}},
      {"time_s", or_null(record.time_s), {}},
      {"receive_time_s", record.receive_time_s, {}},
      {"mode", to_string(record.mode), {}},
      {"status", to_string(record.status), {}},
      {"calibrated", record.calibrated, {}},
      {"calibration", to_string(record.calibration.activity), {}},
      {"needs",
       record.calibration.need == CalibrationNeed::kNothing
           ? Json()
           : Json(to_string(record.calibration.need)),
       {}},
      {"pan_rad", of_orientation(&Orientation::pan_rad), {}},
      {"tilt_rad", of_orientation(&Orientation::tilt_rad), {}},
      {"pan_rate_rad_s", of_orientation(&Orientation::pan_rate_rad_s), {}},
      {"tilt_rate_rad_s", of_orientation(&Orientation::tilt_rate_rad_s), {}},
      {"pan_acceleration_rad_s2", of_orientation(&Orientation::pan_acceleration_rad_s2), {}},
      {"tilt_acceleration_rad_s2", of_orientation(&Orientation::tilt_acceleration_rad_s2), {}},
      {"q_base_from_camera",
       of_orientation(&Orientation::q_base_from_camera),
       {"q_x", "q_y", "q_z", "q_w"}},
      {"orientation_sigma_rad",
       of_orientation(&Orientation::sigma_rad),
       {"orientation_sigma_rad_0", "orientation_sigma_rad_1", "orientation_sigma_rad_2"}},
      {"orientation_covariance_rad2",
       of_orientation(&Orientation::covariance_rad2),
       {"orientation_covariance_rad2_0", "orientation_covariance_rad2_1",
        "orientation_covariance_rad2_2", "orientation_covariance_rad2_3",
        "orientation_covariance_rad2_4", "orientation_covariance_rad2_5",
        "orientation_covariance_rad2_6", "orientation_covariance_rad2_7",
        "orientation_covariance_rad2_8"}},
      {"reference_row", kReferenceRow, {}},
      {"landmarks", record.landmarks, {}},
      {"residual_px", or_null(record.residual_px), {}},
      {"line_delay_s", record.camera.line_delay, {}},
      {"focal_length_px", record.camera.focal_length, {}},
      {"aspect", record.camera.aspect, {}},
      {"radial_distortion", record.camera.radial_distortion, {}},
      {"latency_s", or_null(record.latency_s), {}},
      {"telemetry_age_s", or_null(record.telemetry_age_s), {}},
  };
}

std::string csv_cell(const Json& value) {
  // What is not finite has no value, as in JSON.
  const bool not_finite = value.is_number_float() && !std::isfinite(value.get<double>());
  if (value.is_null() || not_finite) return "";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

// Replaces the comma after the last cell.
void end_line(std::string& line) { line.back() = '\n'; }

}  // namespace

std::string json_line(const OrientationRecord& record) {
  Json object;
  for (Field& field : fields(record)) object[field.name] = std::move(field.value);
  return object.dump() + "\n";
}

std::string csv_header() {
  std::string line;
  for (const Field& field : fields(OrientationRecord())) {
    if (field.columns.empty()) line.append(field.name).append(",");
    for (const char* column : field.columns) line.append(column).append(",");
  }
  end_line(line);
  return line;
}

std::string csv_line(const OrientationRecord& record) {
  std::string line;
  for (const Field& field : fields(record)) {
    if (field.columns.empty()) line.append(csv_cell(field.value)).append(",");
    for (std::size_t i = 0; i < field.columns.size(); ++i) {
      line.append(field.value.is_null() ? "" : csv_cell(field.value[i])).append(",");
    }
  }
  end_line(line);
  return line;
}

}  // namespace alidade
