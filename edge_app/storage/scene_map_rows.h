#pragma once
// The rows of scene.map: which number is in which column, defined once for reading and writing.
// Each row ends with the CRC-32 of its fields (little-endian; a null is one byte), because SQLite
// does not notice a bit that changes inside a number.

#include <zlib.h>

#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/mapping/scene_map.h"
#include "edge_app/storage/sqlite.h"

namespace alidade {

class FieldSum {
 public:
  void add(const void* bytes, std::size_t size) {
    sum_ = crc32_z(sum_, static_cast<const unsigned char*>(bytes), size);
  }
  void add(std::int64_t value) {
    unsigned char bytes[8];
    for (unsigned i = 0; i < 8; ++i) {
      bytes[i] = static_cast<unsigned char>(static_cast<std::uint64_t>(value) >> (8 * i));
    }
    add(bytes, sizeof bytes);
  }
  void add(double value) {
    std::int64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    add(bits);
  }
  void add_null() { add("", 1); }
  [[nodiscard]] std::int64_t value() const { return static_cast<std::int64_t>(sum_); }

 private:
  unsigned long sum_ = crc32_z(0, nullptr, 0);
};

// Binds one field after the other, beginning with the first parameter.
class WrittenRow {
 public:
  explicit WrittenRow(SqliteStatement* statement) : statement_(statement) {}

  void field(double value) {
    sum_.add(value);
    statement_->bind(++at_, value);
  }
  void field(std::int64_t value) {
    sum_.add(value);
    statement_->bind(++at_, value);
  }
  void field(std::uint32_t value) { field(std::int64_t{value}); }
  void field(const std::optional<double>& value) {
    if (value) return field(*value);
    sum_.add_null();
    statement_->bind_null(++at_);
  }
  void field(const std::string& text) {
    sum_.add(text.data(), text.size());
    statement_->bind_text(++at_, text);
  }
  void field(const std::vector<std::uint8_t>& bytes) { blob(bytes.data(), bytes.size()); }
  void field(const Descriptor& bytes) { blob(bytes.data(), bytes.size()); }
  template <int kSize>
  void symmetric(const Matrix<double, kSize, kSize>& m) {
    for (int i = 0; i < kSize; ++i) {
      for (int j = i; j < kSize; ++j) field(m(i, j));
    }
  }
  // Binds the sum and returns it.
  std::int64_t end() {
    statement_->bind(++at_, sum_.value());
    return sum_.value();
  }

 private:
  void blob(const std::uint8_t* bytes, std::size_t size) {
    sum_.add(bytes, size);
    statement_->bind_blob(++at_, bytes, size);
  }

  SqliteStatement* statement_;
  FieldSum sum_;
  int at_ = 0;
};

// Reads one column after the other.
class ReadRow {
 public:
  explicit ReadRow(const SqliteStatement* statement, int first = 0)
      : statement_(statement), at_(first) {}

  void field(double& value) {
    fits_ = fits_ && statement_->get(at_++, &value);
    sum_.add(value);
  }
  void field(std::int64_t& value) {
    fits_ = fits_ && statement_->get(at_++, &value);
    sum_.add(value);
  }
  void field(std::uint32_t& value) {
    std::int64_t wide = 0;
    field(wide);
    value = static_cast<std::uint32_t>(wide);
    fits_ = fits_ && wide == std::int64_t{value};
  }
  void field(std::optional<double>& value) {
    if (fits_ && statement_->is_null(at_)) {
      ++at_;
      value.reset();
      sum_.add_null();
      return;
    }
    value = 0;
    field(*value);
  }
  void field(std::string& text) {
    fits_ = fits_ && statement_->get_text(at_++, &text);
    sum_.add(text.data(), text.size());
  }
  void field(std::vector<std::uint8_t>& bytes) {
    fits_ = fits_ && statement_->get_blob(at_++, &bytes);
    sum_.add(bytes.data(), bytes.size());
  }
  void field(Descriptor& bytes) {
    std::vector<std::uint8_t> found;
    field(found);
    fits_ = fits_ && found.size() == bytes.size();
    if (fits_) std::copy(found.begin(), found.end(), bytes.begin());
  }
  template <int kSize>
  void symmetric(Matrix<double, kSize, kSize>& m) {
    for (int i = 0; i < kSize; ++i) {
      for (int j = i; j < kSize; ++j) {
        field(m(i, j));
        m(j, i) = m(i, j);
      }
    }
  }
  // False: a field has another type, or the sum differs.
  [[nodiscard]] bool end(std::int64_t* sum) {
    std::int64_t stored = 0;
    *sum = sum_.value();
    return fits_ && statement_->get(at_, &stored) && stored == *sum;
  }

 private:
  const SqliteStatement* statement_;
  FieldSum sum_;
  int at_;
  bool fits_ = true;
};

// The row of table `scene`: what concerns the whole map.
struct SceneRow {
  std::int64_t revision = 0;  // increases by one with each transaction
  std::int64_t width = 0, height = 0;
  double aspect = 1;
  double line_delay = 0, reference_row = 0;
  std::int64_t has_mechanics = 0;
  Mechanics<double> mechanics;
  std::int64_t next_landmark = 1;
  std::int64_t lens_points = 0;
  std::int64_t lens_sum = 0;
  std::int64_t keyframes = 0, landmarks = 0, sightings = 0;
  // Sum of the checksums of all rows of keyframes, pictures and landmarks, modulo 2^63.
  std::int64_t row_sum = 0;
};

// Adds (sign > 0) or subtracts, modulo 2^63.
inline void add_sum(std::int64_t sum, std::int64_t sign, std::int64_t* total) {
  constexpr std::uint64_t kLow = ~std::uint64_t{0} >> 1U;
  const auto a = static_cast<std::uint64_t>(*total);
  const auto b = static_cast<std::uint64_t>(sum);
  *total = static_cast<std::int64_t>((sign > 0 ? a + b : a - b) & kLow);
}

// V is const when writing.
template <class Row, class V>
void each(Row* row, V& vector) {
  for (int i = 0; i < vector.size(); ++i) row->field(vector[i]);
}

template <class Row, class Scene>
void scene_fields(Row* row, Scene& s) {
  row->field(s.revision);
  row->field(s.width);
  row->field(s.height);
  row->field(s.aspect);
  row->field(s.line_delay);
  row->field(s.reference_row);
  row->field(s.has_mechanics);
  each(row, s.mechanics.pan_axis);
  each(row, s.mechanics.tilt_axis);
  row->field(s.mechanics.pan_scale);
  row->field(s.mechanics.tilt_scale);
  row->field(s.next_landmark);
  row->field(s.lens_points);
  row->field(s.lens_sum);
  row->field(s.keyframes);
  row->field(s.landmarks);
  row->field(s.sightings);
  row->field(s.row_sum);
}

template <class Row, class Keyframe>
void keyframe_fields(Row* row, Keyframe& k) {
  row->field(k.id);
  row->field(k.recording);
  row->field(k.frame);
  row->field(k.time_utc_s);
  row->field(k.zoom);
  row->field(k.position);
  // Both or neither, as two columns.
  std::optional<double> pan, tilt;
  if (k.telemetry) {
    pan = k.telemetry->pan;
    tilt = k.telemetry->tilt;
  }
  row->field(pan);
  row->field(tilt);
  if constexpr (!std::is_const_v<Keyframe>) {
    k.telemetry.reset();
    if (pan && tilt) k.telemetry = PanTilt<double>{*pan, *tilt};
  }
  each(row, k.R_base_from_camera.coeffs());
  row->field(k.eps);
  row->symmetric(k.covariance);
  each(row, k.angular_velocity);
  row->field(k.zoom_rate);
  row->field(k.residual_px);
}

template <class Row, class Landmark, class Sum>
void landmark_fields(Row* row, Landmark& l, Sum& sightings, Sum& sighting_sum) {
  row->field(l.id);
  each(row, l.d_b);
  row->symmetric(l.covariance);
  row->symmetric(l.shared_covariance);
  row->field(l.scale_rad);
  row->field(l.focal_length_px);
  row->field(l.descriptor);
  row->field(l.life.born_utc_s);
  row->field(l.life.last_seen_utc_s);
  row->field(l.life.looked_for);
  row->field(l.life.matched);
  row->field(l.life.missed);
  row->field(sightings);
  row->field(sighting_sum);
}

inline std::int64_t sum_of(const std::vector<SceneSighting>& sightings) {
  FieldSum sum;
  for (const SceneSighting& s : sightings) {
    sum.add(s.keyframe);
    sum.add(s.u.x());
    sum.add(s.u.y());
    sum.add(s.scale_px);
  }
  return sum.value();
}

}  // namespace alidade
