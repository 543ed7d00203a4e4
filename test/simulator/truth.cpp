#include "test/simulator/truth.h"

#include <Eigen/Geometry>
#include <array>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "test/simulator/telemetry.h"

namespace alidade::simulator {

OutputFile::OutputFile(const std::filesystem::path& file) : file_(file), stream_(file) {
  stream_ << std::setprecision(15);
  if (!stream_) throw std::runtime_error(file_.string() + ": cannot be written");
}

void OutputFile::flush() {
  stream_.flush();
  if (!stream_) throw std::runtime_error(file_.string() + ": writing failed");
}

namespace {

void write_format(const Config& config, std::ofstream& out) {
  out << "format: 1\nimage: {width: " << config.image.width << ", height: " << config.image.height
      << "}\n";
}

void write_value(const char* name, double number, std::ofstream& out) {
  out << name << ": {value: " << number << ", sigma: 0}\n";
}

// px, from the image's centre.
void write_centre_offset(const ImageConfig& image, const Lens& lens, std::ofstream& out) {
  out << '[' << lens.centre.x() - image.width / 2.0 << ", " << lens.centre.y() - image.height / 2.0
      << ']';
}

void write_zoom(const Config& config, const Zoom& zoom, std::ofstream& out) {
  constexpr int kSamples = 129;
  out << "zoom: " << zoom.reading(0) << "\nzoom_samples:\n";
  const ZoomConfig::Ends& ends = config.zoom->reading;
  for (int i = 0; i < kSamples; ++i) {
    const double reading = ends.wide + (ends.tele - ends.wide) * i / (kSamples - 1);
    const Lens lens = zoom.nominal_lens(reading);
    out << "  - {zoom: " << reading << ", focal_length: " << lens.focal_length
        << ", radial_distortion: " << lens.radial_distortion << ", centre_offset: ";
    write_centre_offset(config.image, lens, out);
    out << "}\n";
  }
}

void write_gear(const std::vector<GearHarmonic>& gear, std::ostream& out) {
  out << '[';
  for (const GearHarmonic& harmonic : gear) {
    out << (&harmonic == &gear.front() ? "" : ", ") << "{amplitude: " << harmonic.amplitude
        << ", period: " << harmonic.period << ", phase: " << harmonic.phase << '}';
  }
  out << ']';
}

// What a calibration has no name for; nothing where the camera is as the model has it.
void write_departures(const Config& config, std::ofstream& out) {
  const TelemetryConfig& telemetry = config.telemetry;
  const CameraConfig& camera = config.camera;
  std::ostringstream lines;
  lines << std::setprecision(15);
  if (camera.radial_distortion_2 != 0) {
    lines << "  radial_distortion_2: " << camera.radial_distortion_2 << '\n';
  }
  if (!camera.tangential.isZero(0)) {
    lines << "  tangential_distortion: [" << camera.tangential.x() << ", " << camera.tangential.y()
          << "]\n";
  }
  if (!camera.sway.empty()) {
    constexpr std::array<const char*, 3> kAxes{"forward", "right", "down"};
    lines << "  sway:\n";
    for (const Swing& swing : camera.sway) {
      lines << "    - {axis: " << kAxes.at(static_cast<std::size_t>(swing.axis))
            << ", amplitude: " << swing.amplitude << ", frequency: " << swing.frequency
            << ", phase: " << swing.phase << "}\n";
    }
  }
  if (!camera.pupil.isZero(0)) {
    lines << "  pupil: [" << camera.pupil.x() << ", " << camera.pupil.y() << ", "
          << camera.pupil.z() << "]\n";
  }
  if (const Breathing& breathing = camera.breathing; breathing.part != 0) {
    lines << "  breathing: {type: "
          << (breathing.type == Breathing::Type::kLinear ? "linear" : "sine")
          << ", part: " << breathing.part << ", period: " << breathing.period << "}\n";
  }
  if (!telemetry.pan_gear.empty() || !telemetry.tilt_gear.empty()) {
    lines << "  gear: {pan: ";
    write_gear(telemetry.pan_gear, lines);
    lines << ", tilt: ";
    write_gear(telemetry.tilt_gear, lines);
    lines << "}\n";
  }
  if (const PlayConfig& play = telemetry.play; play.pan > 0 || play.tilt > 0) {
    lines << "  play: {pan: " << play.pan << ", tilt: " << play.tilt
          << ", encoder: " << (play.encoder == PlayConfig::Encoder::kMotor ? "motor" : "output")
          << "}\n";
  }
  if (!lines.str().empty()) out << "departures:\n" << lines.str();
}

}  // namespace

void write_truth_yaml(const std::filesystem::path& file, const Config& config,
                      const CameraModel& camera) {
  OutputFile output(file);
  const auto value = [&](const char* name, double number) {
    write_value(name, number, output.stream());
  };
  const auto axis = [&](const char* name, const Eigen::Vector3d& vector) {
    output.stream() << name << ": {value: [" << vector.x() << ", " << vector.y() << ", "
                    << vector.z() << "], sigma: [0, 0]}\n";
  };
  const Lens lens = camera.lens_at(0);
  write_format(config, output.stream());
  value("focal_length", lens.focal_length);
  value("aspect", lens.aspect);
  value("radial_distortion", lens.radial_distortion);
  value("line_delay", config.camera.line_delay);
  axis("pan_axis", camera.pan_axis());
  axis("tilt_axis", camera.tilt_axis());
  value("pan_scale", config.camera.pan_scale);
  value("tilt_scale", config.camera.tilt_scale);
  value("clock_offset", config.camera.clock_offset);
  if (camera.zoom() != nullptr || !config.camera.centre.isZero(0)) {
    output.stream() << "centre_offset: {value: ";
    write_centre_offset(config.image, lens, output.stream());
    output.stream() << ", sigma: [0, 0]}\n";
  }
  if (camera.zoom() != nullptr) write_zoom(config, *camera.zoom(), output.stream());
  write_departures(config, output.stream());
  output.flush();
}

void write_lens_yaml(const std::filesystem::path& file, const Config& config) {
  OutputFile output(file);
  const PatternConfig::Lens& lens = config.pattern->lens;
  write_format(config, output.stream());
  for (const auto& [name, number] : {std::pair{"line_delay", config.camera.line_delay},
                                     {"focal_length_u", lens.focal_length_u},
                                     {"focal_length_v", lens.focal_length_v},
                                     {"optical_centre_u", lens.centre_u},
                                     {"optical_centre_v", lens.centre_v},
                                     {"k1", lens.k1},
                                     {"k2", lens.k2},
                                     {"p1", lens.p1},
                                     {"p2", lens.p2}}) {
    write_value(name, number, output.stream());
  }
  output.flush();
}

TruthCsv::TruthCsv(const std::filesystem::path& file, const CameraModel& camera)
    : file_(file), camera_(&camera), tells_lens_(camera.zoom() != nullptr || camera.breathes()) {
  file_.stream() << "frame,time_s,pan_rad,tilt_rad,sequence,sender_time_s,stamp_time_s"
                 << (tells_lens_ ? ",focal_length_px,radial_distortion,centre_u_px,centre_v_px"
                                 : "")
                 << (camera.zoom() != nullptr ? ",zoom" : "")
                 << (camera.sways() ? ",q_x,q_y,q_z,q_w" : "") << '\n';
}

void TruthCsv::add(const FrameEvent& event, const Angles& angles, double origin_s) {
  std::ofstream& out = file_.stream();
  out << event.frame << ',' << origin_s + event.capture_s << ',' << wrapped(angles.pan) << ','
      << wrapped(angles.tilt) << ',' << event.sequence << ',' << origin_s + event.sender_s << ','
      << origin_s + event.stamp_s;
  if (tells_lens_) {
    const Lens lens = camera_->lens_at(event.capture_s);
    out << ',' << lens.focal_length << ',' << lens.radial_distortion << ',' << lens.centre.x()
        << ',' << lens.centre.y();
  }
  if (const Zoom* zoom = camera_->zoom()) out << ',' << zoom->reading(event.capture_s);
  if (camera_->sways()) {
    const Eigen::Quaterniond q(camera_->world_from_camera_at(event.capture_s));
    out << ',' << q.x() << ',' << q.y() << ',' << q.z() << ',' << q.w();
  }
  out << '\n';
}

PatternTruthCsv::PatternTruthCsv(const std::filesystem::path& file) : file_(file) {
  file_.stream() << "frame,time_s,x_m,y_m,z_m,q_x,q_y,q_z,q_w,sequence,stamp_time_s\n";
}

void PatternTruthCsv::add(const FrameEvent& event, const CameraPose& pose, double origin_s) {
  const Eigen::Matrix3d R = pose.R_camera_from_pattern.transpose();
  const Eigen::Vector3d centre = -R * pose.pattern_in_camera;
  const Eigen::Quaterniond q(R);
  std::ofstream& out = file_.stream();
  out << event.frame << ',' << origin_s + event.capture_s << ',' << centre.x() << ',' << centre.y()
      << ',' << centre.z() << ',' << q.x() << ',' << q.y() << ',' << q.z() << ',' << q.w() << ','
      << event.sequence << ',' << origin_s + event.stamp_s << '\n';
}

}  // namespace alidade::simulator
