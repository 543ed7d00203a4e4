#pragma once
// Generated from edge_app/record/record_fields.yaml by scripts/generate-fields: change the list instead.
//
// Record: what the edge executable says about one frame, in its own conventions (record.h).

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace alidade_ros {

struct Record {
  struct Orientation {
    double pan_rad = 0;                                    // rad
    double tilt_rad = 0;                                   // rad
    double pan_rate_rad_s = 0;                             // rad/s
    double tilt_rate_rad_s = 0;                            // rad/s
    double pan_acceleration_rad_s2 = 0;                    // rad/s^2
    double tilt_acceleration_rad_s2 = 0;                   // rad/s^2
    std::array<double, 4> q_base_from_camera{0, 0, 0, 1};  // x, y, z, w
    std::array<double, 9> orientation_covariance_rad2{};   // rad^2
  };
  struct Localized {
    double age_s = 0;      // s
    double sigma_rad = 0;  // rad
  };

  std::optional<std::int64_t> frame;
  std::optional<double> time_s;  // s
  double receive_time_s = 0;     // s
  std::string mode;
  std::string status;
  bool calibrated = false;
  std::string calibration;
  std::string needs;         // empty: none
  double reference_row = 0;  // px
  std::int64_t landmarks = 0;
  std::optional<double> residual_px;            // px
  double line_delay_s = 0;                      // s/row
  double focal_length_px = 0;                   // px
  std::optional<double> focal_length_sigma_px;  // px
  double aspect = 1;
  double radial_distortion = 0;
  std::array<double, 2> centre_offset_px{};     // px
  std::optional<double> latency_s;              // s
  std::optional<double> telemetry_age_s;        // s
  std::optional<double> zoom;                   // the device's
  std::optional<double> zoom_rate_per_s;        // 1/s
  std::optional<double> zoom_rate_sigma_per_s;  // 1/s
  std::optional<Localized> localized;
  std::optional<double> time_sigma_s;      // s
  std::optional<Orientation> orientation;  // none in mode none
};

}  // namespace alidade_ros
