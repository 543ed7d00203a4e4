#include "core/calibration/landmark_file.h"

#include <zlib.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>

#include "core/calibration/atomic_file.h"

namespace alidade {

namespace {

static_assert(std::numeric_limits<double>::is_iec559 && sizeof(double) == sizeof(std::uint64_t),
              "the file holds IEEE doubles");

constexpr char kMagic[] = "ALIDMAP\n";
constexpr std::size_t kMagicSize = sizeof kMagic - 1;
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderSize = 24;
constexpr std::size_t kLandmarkSize = 60;
constexpr std::size_t kChecksumSize = 4;

class Writer {
 public:
  void text(const char* characters, std::size_t size) { bytes_.append(characters, size); }
  void u32(std::uint32_t value) { integer(value, 4); }
  void u64(std::uint64_t value) { integer(value, 8); }
  void f64(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    u64(bits);
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  void integer(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes_.push_back(static_cast<char>((value >> (8 * i)) & 0xff));
  }

  std::string bytes_;
};

// The caller has checked that the bytes are there.
class Cursor {
 public:
  Cursor(const std::string& bytes, std::size_t offset) : bytes_(bytes), offset_(offset) {}
  std::uint32_t u32() { return static_cast<std::uint32_t>(integer(4)); }
  std::uint64_t u64() { return integer(8); }
  double f64() {
    const std::uint64_t bits = u64();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
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

// "" or what is wrong with a landmark.
const char* flaw_of(const CalibrationLandmark& landmark) {
  const Matrix2<double>& cov = landmark.covariance;
  if (!landmark.d_b.allFinite() || !cov.allFinite()) return "has a number that is not finite";
  if (std::abs(landmark.d_b.norm() - 1) > 1e-9) return "has a direction that is no unit vector";
  // Rounding may leave the determinant of a singular covariance slightly negative.
  if (cov(0, 0) < 0 || cov(1, 1) < 0 ||
      cov(0, 1) * cov(0, 1) > cov(0, 0) * cov(1, 1) * (1 + 1e-9)) {
    return "has a covariance that is not positive";
  }
  if (landmark.observations < 0) return "has a negative number of observations";
  return "";
}

}  // namespace

std::uint32_t calibration_check(const Calibration& c) {
  Writer values;
  values.u32(static_cast<std::uint32_t>(c.camera.width));
  values.u32(static_cast<std::uint32_t>(c.camera.height));
  for (const double value :
       {c.camera.focal_length, c.camera.aspect, c.camera.radial_distortion, c.line_delay,
        c.mechanics.pan_scale, c.mechanics.tilt_scale, c.clock_offset}) {
    values.f64(value);
  }
  for (const Vector3<double>& axis : {c.mechanics.pan_axis, c.mechanics.tilt_axis}) {
    for (int i = 0; i < 3; ++i) values.f64(axis[i]);
  }
  return checksum(values.bytes(), values.bytes().size());
}

std::string format_landmarks(const std::vector<CalibrationLandmark>& landmarks,
                             const Calibration& calibration) {
  Writer out;
  out.text(kMagic, kMagicSize);
  out.u32(kVersion);
  out.u32(calibration_check(calibration));
  out.u64(landmarks.size());
  for (const CalibrationLandmark& landmark : landmarks) {
    out.u64(static_cast<std::uint64_t>(landmark.landmark));
    for (int i = 0; i < 3; ++i) out.f64(landmark.d_b[i]);
    out.f64(landmark.covariance(0, 0));
    out.f64(landmark.covariance(0, 1));
    out.f64(landmark.covariance(1, 1));
    out.u32(static_cast<std::uint32_t>(landmark.observations));
  }
  out.u32(checksum(out.bytes(), out.bytes().size()));
  return out.bytes();
}

bool parse_landmarks(const std::string& bytes, const std::string& name,
                     const Calibration& calibration, std::vector<CalibrationLandmark>* landmarks,
                     std::string* error) {
  const auto refuse = [&](const std::string& what) {
    *error = name + ": " + what + "; calibrate again";
    return false;
  };
  if (bytes.size() < kHeaderSize + kChecksumSize) {
    return refuse("too short for a landmark map (" + std::to_string(bytes.size()) + " bytes)");
  }
  if (bytes.compare(0, kMagicSize, kMagic, kMagicSize) != 0) return refuse("not a landmark map");
  Cursor header(bytes, kMagicSize);
  const std::uint32_t version = header.u32();
  if (version != kVersion) {
    return refuse("landmark map of version " + std::to_string(version) +
                  ", this program reads version " + std::to_string(kVersion));
  }
  const std::uint32_t check = header.u32();
  const std::uint64_t count = header.u64();
  const std::size_t content = bytes.size() - kChecksumSize;
  if (count > content / kLandmarkSize || kHeaderSize + count * kLandmarkSize != content) {
    return refuse("its size does not fit its " + std::to_string(count) +
                  " landmarks: cut off, or damaged");
  }
  if (Cursor(bytes, content).u32() != checksum(bytes, content)) {
    return refuse("its checksum does not fit: damaged");
  }
  if (check != calibration_check(calibration)) {
    return refuse("belongs to another calibration than the one it stands beside");
  }
  std::vector<CalibrationLandmark> read(static_cast<std::size_t>(count));
  Cursor at(bytes, kHeaderSize);
  for (CalibrationLandmark& landmark : read) {
    landmark.landmark = static_cast<std::int64_t>(at.u64());
    for (int i = 0; i < 3; ++i) landmark.d_b[i] = at.f64();
    landmark.covariance(0, 0) = at.f64();
    landmark.covariance(0, 1) = landmark.covariance(1, 0) = at.f64();
    landmark.covariance(1, 1) = at.f64();
    landmark.observations = static_cast<int>(at.u32());
    const std::string flaw = flaw_of(landmark);
    if (!flaw.empty()) {
      return refuse("landmark " + std::to_string(landmark.landmark) + " " + flaw);
    }
  }
  *landmarks = std::move(read);
  return true;
}

bool load_landmarks(const std::string& path, const Calibration& calibration,
                    std::vector<CalibrationLandmark>* landmarks, std::string* error) {
  std::ifstream file(path, std::ios::binary);
  file.peek();  // a folder opens, but cannot be read
  if (!file.is_open() || file.bad()) {
    *error = path + ": cannot be read: " + std::strerror(errno);
    return false;
  }
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return parse_landmarks(bytes.str(), path, calibration, landmarks, error);
}

bool save_landmarks(const std::string& path, const std::vector<CalibrationLandmark>& landmarks,
                    const Calibration& calibration, std::string* error) {
  const std::string bytes = format_landmarks(landmarks, calibration);
  std::vector<CalibrationLandmark> as_read;
  if (!parse_landmarks(bytes, "refused to write " + path, calibration, &as_read, error)) {
    return false;
  }
  return write_file_atomically(path, bytes, error);
}

}  // namespace alidade
