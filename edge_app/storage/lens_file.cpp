#include "edge_app/storage/lens_file.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "core/calibration/number_text.h"
#include "edge_app/storage/named_values.h"

namespace alidade {

std::string format_lens(const PatternCalibration& calibration, const LensNotes& notes) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "format" << YAML::Value << 1;
  out << YAML::Key << "image" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "width"
      << YAML::Value << notes.width << YAML::Key << "height" << YAML::Value << notes.height
      << YAML::EndMap;
  for (int i = 0; i < kLensParameterCount; ++i) {
    const auto parameter = static_cast<LensParameter>(i);
    out << YAML::Key << kLensParameterNames[static_cast<std::size_t>(i)] << YAML::Value
        << YAML::Flow << YAML::BeginMap << YAML::Key << "value" << YAML::Value
        << exact_text(calibration.lens[i]) << YAML::Key << "sigma" << YAML::Value
        << exact_text(calibration.sigma(parameter)) << YAML::EndMap;
    if (parameter == LensParameter::kLineDelay) out << YAML::Comment("s/row");
  }
  write_covariance(kLensParameterNames, calibration.covariance, &out);
  out << YAML::Key << "quality" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "pattern" << YAML::Value << YAML::DoubleQuoted << notes.pattern;
  out << YAML::Key << "frames" << YAML::Value << calibration.frames;
  out << YAML::Key << "observations" << YAML::Value << calibration.observations;
  out << YAML::Key << "left_out" << YAML::Value << calibration.left_out;
  out << YAML::Key << "detection_sigma_px" << YAML::Value << short_text(calibration.sigma_px);
  out << YAML::Key << "residual_rms_px" << YAML::Value << short_text(calibration.residual_rms_px);
  out << YAML::Key << "frame_interval_s" << YAML::Value << exact_text(calibration.frame_interval_s);
  out << YAML::Key << "segments" << YAML::Value << calibration.curve.segments();
  out << YAML::EndMap << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string format_camera_info(const PatternCalibration& calibration, const LensNotes& notes) {
  const LensVector& lens = calibration.lens;
  const auto value = [&](LensParameter parameter) { return lens[index(parameter)]; };
  const std::string f_u = exact_text(value(LensParameter::kFocalLengthU));
  const std::string f_v = exact_text(value(LensParameter::kFocalLengthV));
  const std::string c_u = exact_text(value(LensParameter::kCentreU) - 0.5);
  const std::string c_v = exact_text(value(LensParameter::kCentreV) - 0.5);
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: alidade\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{}, {}, {}, {}, 0]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}, 0, {}, 0, 0, {}, {}, 0, 0, 0, 1, "
      "0]\n",
      notes.width, notes.height, f_u, c_u, f_v, c_v, exact_text(value(LensParameter::kK1)),
      exact_text(value(LensParameter::kK2)), exact_text(value(LensParameter::kP1)),
      exact_text(value(LensParameter::kP2)), f_u, c_u, f_v, c_v);
}

std::string format_trajectory(const PatternCalibration& calibration, const PatternData& data) {
  std::string text = "time_s,x_m,y_m,z_m,q_x,q_y,q_z,q_w\n";
  int segment = 0;
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    const auto& used = calibration.used[f];
    if (std::count(used.begin(), used.end(), char{1}) == 0) continue;
    const SplineBasis basis = calibration.curve.basis(data.frames[f].time_s, segment);
    segment = basis.segment;
    const PoseVector x = calibration.curve.value(basis);
    Eigen::Quaterniond q(calibration.curve.R_pattern_from_camera(x));
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    text += fmt::format("{:.6f},{:.6f},{:.6f},{:.6f},{:.8f},{:.8f},{:.8f},{:.8f}\n",
                        data.frames[f].time_s, x[0], x[1], x[2], q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

}  // namespace alidade
