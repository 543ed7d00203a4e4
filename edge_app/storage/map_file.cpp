#include "edge_app/storage/map_file.h"

#include <zlib.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/calibration/calibration_text.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "platform/system/whole_file.h"

namespace alidade {

namespace {

static_assert(std::numeric_limits<double>::is_iec559 && sizeof(double) == sizeof(std::uint64_t) &&
                  std::numeric_limits<float>::is_iec559 && sizeof(float) == sizeof(std::uint32_t),
              "the file holds IEEE numbers");

constexpr char kMagic[] = "ALIDMAP\n";
constexpr std::size_t kMagicSize = sizeof kMagic - 1;
constexpr std::uint32_t kVersion = 3;
constexpr std::size_t kVersionEnd = 12;
constexpr std::size_t kHeaderSizeWithout = 176;  // of one without sensitivities (two rows)
constexpr std::size_t kPointSize = 60;
constexpr std::size_t kLandmarkSizeWithout = 376;
constexpr std::size_t kChecksumSize = 4;

class Writer {
 public:
  void text(const char* characters, std::size_t size) { bytes_.append(characters, size); }
  void u32(std::uint32_t value) { integer(value, 4); }
  void u64(std::uint64_t value) { integer(value, 8); }
  void f32(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    u32(bits);
  }
  void f64(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    u64(bits);
  }
  void vector(const Vector3<double>& v) {
    for (int i = 0; i < 3; ++i) f64(v[i]);
  }
  template <int kSize>
  void symmetric(const Matrix<double, kSize, kSize>& m) {
    for (int i = 0; i < kSize; ++i) {
      for (int j = i; j < kSize; ++j) f64(m(i, j));
    }
  }
  void sensitivity(const Sensitivity<2>& m, const std::vector<Parameter>& parameters) {
    for (int i = 0; i < 2; ++i) {
      for (const Parameter p : parameters) f64(m(i, index(p)));
    }
  }
  void sensitivity(const LandmarkSensitivity& m, const std::vector<Parameter>& parameters) {
    for (int i = 0; i < 2; ++i) {
      for (const Parameter p : parameters) f32(m(i, index(p)));
    }
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  void integer(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes_.push_back(static_cast<char>((value >> (8 * i)) & 0xff));
  }

  std::string bytes_;
};

// The caller has checked that there are enough bytes.
class Cursor {
 public:
  Cursor(const std::string& bytes, std::size_t offset) : bytes_(bytes), offset_(offset) {}
  std::uint8_t u8() { return static_cast<std::uint8_t>(integer(1)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(integer(4)); }
  std::uint64_t u64() { return integer(8); }
  float f32() {
    const std::uint32_t bits = u32();
    float value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  double f64() {
    const std::uint64_t bits = u64();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  void vector(Vector3<double>* v) {
    for (int i = 0; i < 3; ++i) (*v)[i] = f64();
  }
  template <int kSize>
  void symmetric(Matrix<double, kSize, kSize>* m) {
    for (int i = 0; i < kSize; ++i) {
      for (int j = i; j < kSize; ++j) (*m)(i, j) = (*m)(j, i) = f64();
    }
  }
  void sensitivity(Sensitivity<2>* m, const std::vector<Parameter>& parameters) {
    m->setZero();
    for (int i = 0; i < 2; ++i) {
      for (const Parameter p : parameters) (*m)(i, index(p)) = f64();
    }
  }
  void sensitivity(LandmarkSensitivity* m, const std::vector<Parameter>& parameters) {
    m->setZero();
    for (int i = 0; i < 2; ++i) {
      for (const Parameter p : parameters) (*m)(i, index(p)) = f32();
    }
  }

 private:
  std::uint64_t integer(int size) {
    std::uint64_t value = 0;
    for (int i = 0; i < size; ++i) {
      value |= std::uint64_t{static_cast<unsigned char>(bytes_[offset_++])} << (8 * i);
    }
    return value;
  }

  const std::string& bytes_;
  std::size_t offset_;
};

std::uint32_t checksum(const std::string& bytes, std::size_t size) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), size));
}

// Whether a covariance is positive semidefinite: all principal minors of the correlations. Rounding
// may make those of a singular matrix slightly negative.
template <int kSize>
bool is_positive(const Matrix<double, kSize, kSize>& covariance) {
  constexpr double kRounding = 1e-9;
  Matrix<double, kSize, kSize> correlation = covariance;
  for (int i = 0; i < kSize; ++i) {
    if (!(covariance(i, i) >= 0)) return false;
    for (int j = 0; j < kSize; ++j) {
      const double scale = std::sqrt(covariance(i, i)) * std::sqrt(covariance(j, j));
      if (scale > 0) {
        correlation(i, j) /= scale;
      } else if (covariance(i, j) != 0) {
        return false;
      }
      if (std::abs(correlation(i, j)) > 1 + kRounding) return false;
    }
  }
  return correlation.determinant() >= -kRounding;
}

bool is_unit(const Vector3<double>& d) { return std::abs(d.norm() - 1) <= 1e-9; }

constexpr const char* kNotFinite = "has a number that is not finite";
constexpr const char* kNoUnit = "has a direction that is not a unit vector";
constexpr const char* kNotPositive = "has a covariance that is not positive";

// "" if nothing is wrong.
const char* flaw_of(const CalibrationLandmark& point) {
  if (!point.d_b.allFinite() || !point.covariance.allFinite()) return kNotFinite;
  if (!is_unit(point.d_b)) return kNoUnit;
  if (!is_positive(point.covariance)) return kNotPositive;
  if (point.observations < 0) return "has a negative number of observations";
  return "";
}

const char* flaw_of(const Landmark& landmark) {
  const LandmarkStatistics& statistics = landmark.statistics;
  if (!landmark.d.allFinite() || !landmark.covariance.allFinite() ||
      !landmark.shared_covariance.allFinite() || !landmark.sensitivity.allFinite() ||
      !landmark.J_pixel_tangent.allFinite() || !std::isfinite(statistics.residual_square)) {
    return kNotFinite;
  }
  if (landmark.octave >= LandmarkMap::kMaxOctaves) return "has an octave that there is not";
  if (!is_unit(landmark.d)) return kNoUnit;
  if (!is_positive(landmark.covariance) || !is_positive(landmark.shared_covariance)) {
    return kNotPositive;
  }
  if (!std::isnormal(landmark.J_pixel_tangent.determinant())) {
    return "has a picture of no extent";
  }
  if (statistics.matched > statistics.looked_for) return "was found more often than looked for";
  if (statistics.residual_square < 0) return "has a negative square";
  return "";
}

const char* flaw_of(const MapState& map) {
  const bool finite = map.offset.vector().allFinite() && map.offset_covariance.allFinite() &&
                      map.offset_sensitivity.allFinite() && map.shear_covariance[0].allFinite() &&
                      map.shear_covariance[1].allFinite() && std::isfinite(map.shear_tilt);
  if (!finite) return kNotFinite;
  if (!is_positive(map.offset_covariance) || !is_positive(map.shear_covariance[0]) ||
      !is_positive(map.shear_covariance[1])) {
    return kNotPositive;
  }
  return "";
}

void write(const CalibrationLandmark& point, Writer* out) {
  out->u64(static_cast<std::uint64_t>(point.landmark));
  out->vector(point.d_b);
  out->symmetric(point.covariance);
  out->u32(static_cast<std::uint32_t>(point.observations));
}

void read(Cursor* in, CalibrationLandmark* point) {
  point->landmark = static_cast<std::int64_t>(in->u64());
  in->vector(&point->d_b);
  in->symmetric(&point->covariance);
  point->observations = static_cast<int>(in->u32());
}

void write(const Landmark& landmark, const std::vector<Parameter>& parameters, Writer* out) {
  out->u32(landmark.octave);
  out->vector(landmark.d);
  out->symmetric(landmark.covariance);
  out->symmetric(landmark.shared_covariance);
  out->sensitivity(landmark.sensitivity, parameters);
  for (int i = 0; i < 4; ++i) out->f64(landmark.J_pixel_tangent(i / 2, i % 2));
  for (const std::uint8_t pixel : landmark.pixels) {
    const char byte = static_cast<char>(pixel);
    out->text(&byte, 1);
  }
  out->u32(landmark.statistics.looked_for);
  out->u32(landmark.statistics.matched);
  out->f32(landmark.statistics.residual_square);
}

void read(Cursor* in, const std::vector<Parameter>& parameters, Landmark* landmark) {
  // A value that does not fit is out of range as well.
  landmark->octave = static_cast<std::uint8_t>(std::min(in->u32(), std::uint32_t{0xff}));
  in->vector(&landmark->d);
  in->symmetric(&landmark->covariance);
  in->symmetric(&landmark->shared_covariance);
  in->sensitivity(&landmark->sensitivity, parameters);
  for (int i = 0; i < 4; ++i) landmark->J_pixel_tangent(i / 2, i % 2) = in->f64();
  for (std::uint8_t& pixel : landmark->pixels) pixel = in->u8();
  landmark->statistics.looked_for = in->u32();
  landmark->statistics.matched = in->u32();
  landmark->statistics.residual_square = in->f32();
}

}  // namespace

std::uint32_t calibration_check(const Calibration& c) {
  Writer values;
  values.u32(static_cast<std::uint32_t>(c.camera.width));
  values.u32(static_cast<std::uint32_t>(c.camera.height));
  for (const double value :
       {c.camera.focal_length, c.camera.aspect, c.camera.distortion.only_term(), c.line_delay,
        c.mechanics.pan_scale, c.mechanics.tilt_scale, c.clock_offset}) {
    values.f64(value);
  }
  values.vector(c.mechanics.pan_axis);
  values.vector(c.mechanics.tilt_axis);
  if (c.has_centre()) {
    values.f64(c.camera.centre_u);
    values.f64(c.camera.centre_v);
  }
  return checksum(values.bytes(), values.bytes().size());
}

std::string format_map(const MapContent& content, const Calibration& calibration) {
  const MapState& map = content.map;
  const std::vector<Parameter> parameters = parameters_of(calibration);
  Writer out;
  out.text(kMagic, kMagicSize);
  out.u32(kVersion);
  out.u32(calibration_check(calibration));
  out.u64(content.points.size());
  out.u64(map.landmarks.size());
  out.f64(map.offset.pan);
  out.f64(map.offset.tilt);
  out.symmetric(map.offset_covariance);
  for (const Matrix3<double>& shear : map.shear_covariance) out.symmetric(shear);
  out.f64(map.shear_tilt);
  out.sensitivity(map.offset_sensitivity, parameters);
  for (const CalibrationLandmark& point : content.points) write(point, &out);
  for (const Landmark& landmark : map.landmarks) write(landmark, parameters, &out);
  out.u32(checksum(out.bytes(), out.bytes().size()));
  return out.bytes();
}

bool parse_map(const std::string& bytes, const std::string& name, const Calibration& calibration,
               MapContent* content, std::string* error) {
  const auto refuse = [&](const std::string& what) {
    *error = name + ": " + what + "; calibrate again";
    return false;
  };
  if (bytes.size() < kVersionEnd) {
    return refuse("too short for a map (" + std::to_string(bytes.size()) + " bytes)");
  }
  if (bytes.compare(0, kMagicSize, kMagic, kMagicSize) != 0) return refuse("not a map");
  Cursor in(bytes, kMagicSize);
  const std::uint32_t version = in.u32();
  if (version != kVersion) {
    return refuse("map of version " + std::to_string(version) + ", this program reads version " +
                  std::to_string(kVersion));
  }
  const std::vector<Parameter> parameters = parameters_of(calibration);
  const std::size_t header_size = kHeaderSizeWithout + 2 * 8 * parameters.size();
  const std::size_t landmark_size = kLandmarkSizeWithout + 2 * 4 * parameters.size();
  if (bytes.size() < header_size + kChecksumSize) {
    return refuse("too short for a map (" + std::to_string(bytes.size()) + " bytes)");
  }
  const std::uint32_t check = in.u32();
  const std::uint64_t points = in.u64();
  const std::uint64_t landmarks = in.u64();
  const std::size_t end = bytes.size() - kChecksumSize;
  // Checked one by one, so that the sum cannot overflow.
  if (points > end / kPointSize || landmarks > end / landmark_size ||
      header_size + points * kPointSize + landmarks * landmark_size != end) {
    return refuse("its size does not fit its " + std::to_string(points) + " points and " +
                  std::to_string(landmarks) + " landmarks: cut off, or damaged");
  }
  if (Cursor(bytes, end).u32() != checksum(bytes, end)) {
    return refuse("its checksum does not fit: damaged");
  }
  if (check != calibration_check(calibration)) {
    return refuse("belongs to another calibration than the one it stands beside");
  }
  MapContent found;
  MapState& map = found.map;
  map.offset.pan = in.f64();
  map.offset.tilt = in.f64();
  in.symmetric(&map.offset_covariance);
  for (Matrix3<double>& shear : map.shear_covariance) in.symmetric(&shear);
  map.shear_tilt = in.f64();
  in.sensitivity(&map.offset_sensitivity, parameters);
  std::string flaw = flaw_of(map);
  if (!flaw.empty()) return refuse("its frame " + flaw);
  found.points.resize(static_cast<std::size_t>(points));
  for (CalibrationLandmark& point : found.points) {
    read(&in, &point);
    flaw = flaw_of(point);
    if (!flaw.empty()) return refuse("point " + std::to_string(point.landmark) + " " + flaw);
  }
  map.landmarks.resize(static_cast<std::size_t>(landmarks));
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    read(&in, parameters, &map.landmarks[i]);
    flaw = flaw_of(map.landmarks[i]);
    if (!flaw.empty()) return refuse("landmark " + std::to_string(i) + " " + flaw);
  }
  *content = std::move(found);
  return true;
}

bool load_map(const std::string& path, const Calibration& calibration, MapContent* content,
              std::string* error) {
  std::string bytes;
  constexpr std::size_t kMostBytes = std::size_t{256} << 20;
  return read_file(path, &bytes, error, kMostBytes) &&
         parse_map(bytes, path, calibration, content, error);
}

bool save_map(const std::string& path, const MapContent& content, const Calibration& calibration,
              std::string* error) {
  const std::string bytes = format_map(content, calibration);
  MapContent as_read;
  if (!parse_map(bytes, "refused to write " + path, calibration, &as_read, error)) return false;
  return write_file_atomically(path, bytes, error);
}

}  // namespace alidade
