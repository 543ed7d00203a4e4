#include "core/realtime/oe_mode/landmark_map.h"

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"

namespace alidade {
namespace {

constexpr double kMinCellSize = 1e-6;  // rad
constexpr double kUnitTolerance = 1e-6;
constexpr int kNone = -1;
constexpr std::size_t kBlock = 16;   // slots that find() tests together
constexpr float kFarAway = 4;        // a coordinate of a free slot: no direction is near it
constexpr double kWorthOfNew = 0.5;  // the worth() of a new landmark

bool is_unit(const Vector3<double>& d) {
  return std::abs(d.squaredNorm() - 1) <= 2 * kUnitTolerance;  // false if not finite
}

// Share found when looked for (rule of succession), times a memory of some seconds of frames.
double worth_of(const LandmarkStatistics& statistics, std::uint32_t now) {
  constexpr double kMemory = 30;  // frames
  constexpr double kLongest = 4;  // times kMemory, for landmarks found often
  constexpr double kOften = 30;   // frames
  const double matched = statistics.matched;
  const double rate = (matched + 1) / (std::max<double>(statistics.looked_for, matched) + 2);
  const double memory = kMemory * (1 + (kLongest - 1) * matched / (matched + kOften));
  // Counts of frames may wrap.
  const auto unseen = static_cast<double>(static_cast<std::int32_t>(now - statistics.last_frame));
  return rate * memory / std::max(memory, unseen);
}

}  // namespace

LandmarkMap::LandmarkMap(int capacity, double cell_size, double largest_cell_size) {
  const auto count = static_cast<std::size_t>(std::max(capacity, 1));
  landmarks_.resize(count);
  cells_.resize(count);
  free_.resize(count);
  const std::size_t padded = (count + kBlock - 1) / kBlock * kBlock;
  for (auto* coordinate : {&x_, &y_, &z_}) coordinate->resize(padded);
  std::size_t places = 2;
  while (places < 2 * count) places *= 2;
  table_.resize(places);
  clear(cell_size, largest_cell_size);
}

void LandmarkMap::clear(double cell_size, double largest_cell_size) {
  cell_size_ = cell_size >= kMinCellSize ? std::min(cell_size, kMaxCellSize) : kMinCellSize;
  for (int octave = 0; octave < kMaxOctaves; ++octave) {
    const double size =
        std::max(cell_size_, std::min(std::ldexp(cell_size_, octave), largest_cell_size));
    for (int zoom = -kMaxZoom; zoom <= kMaxZoom; ++zoom) {
      const double finer = std::exp2(static_cast<double>(zoom) / kZoomsPerOctave);
      const double rings = std::round(kPi / std::max(size / finer, kMinCellSize));
      rings_[static_cast<std::size_t>(zoom + kMaxZoom)][static_cast<std::size_t>(octave)] =
          std::max(1, static_cast<int>(rings));
    }
  }
  for (std::size_t i = 0; i < free_.size(); ++i) free_[i] = static_cast<int>(free_.size() - 1 - i);
  for (auto* coordinate : {&x_, &y_, &z_}) {
    std::fill(coordinate->begin(), coordinate->end(), kFarAway);
  }
  std::fill(table_.begin(), table_.end(), kNone);
  size_ = 0;
  end_ = 0;
  replaced_ = 0;
}

int LandmarkMap::capacity() const { return static_cast<int>(landmarks_.size()); }
int LandmarkMap::size() const { return size_; }
double LandmarkMap::cell_size() const { return cell_size_; }
std::int64_t LandmarkMap::replaced() const { return replaced_; }

std::size_t LandmarkMap::memory_bytes() const {
  return sizeof(*this) + landmarks_.size() * sizeof(Landmark) + cells_.size() * sizeof(Key) +
         3 * x_.size() * sizeof(float) + (free_.size() + table_.size()) * sizeof(int);
}

bool LandmarkMap::occupied(int slot) const {
  return slot >= 0 && slot < end_ && x_[static_cast<std::size_t>(slot)] != kFarAway;
}

const Landmark& LandmarkMap::at(int slot) const {
  return landmarks_[static_cast<std::size_t>(slot)];
}

LandmarkStatistics& LandmarkMap::statistics(int slot) {
  return landmarks_[static_cast<std::size_t>(slot)].statistics;
}

LandmarkSensitivity& LandmarkMap::sensitivity(int slot) {
  return landmarks_[static_cast<std::size_t>(slot)].sensitivity;
}

// All rings have the same height. A ring's cells are about as wide as it is high, at its middle.
LandmarkMap::Key LandmarkMap::cell_of(const Vector3<double>& d, int octave, int zoom) const {
  zoom = std::clamp(zoom, -kMaxZoom, kMaxZoom);
  const int rings =
      rings_[static_cast<std::size_t>(zoom + kMaxZoom)][static_cast<std::size_t>(octave)];
  const double height = kPi / rings;
  const double from_pole = std::atan2(std::hypot(d.x(), d.y()), d.z());
  const int ring = std::min(rings - 1, static_cast<int>(from_pole / height));
  const double around = 2 * kPi * std::sin((ring + 0.5) * height);
  const int columns = std::max(1, static_cast<int>(std::round(around / height)));
  const double turn = std::atan2(d.y(), d.x()) / (2 * kPi) + 0.5;
  int column = static_cast<int>(turn * columns);
  if (column >= columns) column = 0;  // pi and -pi are the same column
  // Fewer than 2^23 of either, by kMinCellSize.
  return static_cast<Key>(zoom & 0xff) << 56 | static_cast<Key>(octave) << 48 |
         static_cast<Key>(ring) << 24 | static_cast<Key>(column);
}

std::size_t LandmarkMap::home(Key key) const {
  key *= 0x9e3779b97f4a7c15U;  // 2^64 / golden ratio: spreads neighbours
  return static_cast<std::size_t>(key ^ key >> 32) & (table_.size() - 1);
}

std::size_t LandmarkMap::position(Key key) const {
  std::size_t at = home(key);
  while (table_[at] != kNone && cells_[static_cast<std::size_t>(table_[at])] != key) {
    at = (at + 1) & (table_.size() - 1);
  }
  return at;
}

void LandmarkMap::place(int slot, const Vector3<double>& d) {
  const auto i = static_cast<std::size_t>(slot);
  landmarks_[i].d = d.normalized();
  x_[i] = static_cast<float>(landmarks_[i].d.x());
  y_[i] = static_cast<float>(landmarks_[i].d.y());
  z_[i] = static_cast<float>(landmarks_[i].d.z());
}

int LandmarkMap::slot_of_least_worth(std::uint32_t now) const {
  int least = kNone;
  double worth_of_least = kWorthOfNew;
  for (int slot = 0; slot < end_; ++slot) {
    const double w = worth(slot, now);
    if (w >= worth_of_least) continue;
    worth_of_least = w;
    least = slot;
  }
  return least;
}

InsertStatus LandmarkMap::insert(const Landmark& landmark, std::uint32_t now, int* slot, int zoom) {
  if (landmark.octave >= kMaxOctaves || !is_unit(landmark.d)) return InsertStatus::kBad;
  if (cell_taken(landmark.d, landmark.octave, zoom)) return InsertStatus::kCellTaken;
  if (size_ == capacity()) {
    const int least = slot_of_least_worth(now);
    if (least == kNone) return InsertStatus::kFull;
    retire(least);
    ++replaced_;
  }
  *slot = free_[free_.size() - 1 - static_cast<std::size_t>(size_)];
  const auto i = static_cast<std::size_t>(*slot);
  ++size_;
  end_ = std::max(end_, *slot + 1);
  landmarks_[i] = landmark;
  landmarks_[i].id = ++last_id_;
  landmarks_[i].statistics = {};
  landmarks_[i].statistics.last_frame = now;
  place(*slot, landmark.d);
  cells_[i] = cell_of(landmark.d, landmark.octave, zoom);
  table_[position(cells_[i])] = *slot;
  return InsertStatus::kOk;
}

void LandmarkMap::retire(int slot) {
  if (!occupied(slot)) return;
  const auto i = static_cast<std::size_t>(slot);
  // Entries displaced by the removed one move back, so that no search ends at the gap.
  const std::size_t mask = table_.size() - 1;
  std::size_t gap = position(cells_[i]);
  for (std::size_t next = (gap + 1) & mask; table_[next] != kNone; next = (next + 1) & mask) {
    const std::size_t wanted = home(cells_[static_cast<std::size_t>(table_[next])]);
    if (((next - wanted) & mask) < ((next - gap) & mask)) continue;
    table_[gap] = table_[next];
    gap = next;
  }
  table_[gap] = kNone;
  x_[i] = y_[i] = z_[i] = kFarAway;
  --size_;
  free_[free_.size() - 1 - static_cast<std::size_t>(size_)] = slot;
  while (end_ > 0 && !occupied(end_ - 1)) --end_;
}

void LandmarkMap::refine(int slot, const Vector3<double>& d, const Matrix2<double>& covariance) {
  if (!occupied(slot) || !is_unit(d)) return;
  place(slot, d);
  landmarks_[static_cast<std::size_t>(slot)].covariance = covariance;
}

bool LandmarkMap::cell_taken(const Vector3<double>& d, int octave, int zoom) const {
  if (octave < 0 || octave >= kMaxOctaves || !is_unit(d)) return false;
  return table_[position(cell_of(d, octave, zoom))] != kNone;
}

// Compares squares of chords, which floats resolve to 2e-7 rad at any angle; cosines near 1 would
// be coarse. Only what is too close to the limit for floats is tested in double.
int LandmarkMap::find(const Vector3<double>& centre, double cosine_of_angle, int* slots,
                      int capacity) const {
  constexpr double kRounding = 2e-7;  // rad, of both directions as floats: below 1.3e-7
  constexpr double kRelative = 1e-6;  // of the arithmetic: below 3e-7
  if (!is_unit(centre) || !(std::abs(cosine_of_angle) <= 1)) return 0;
  const Vector3<double> d = centre.normalized();
  if (cosine_of_angle <= -1)
    cosine_of_angle = -2;  // all, including the antipode in spite of rounding
  const double chord = std::sqrt(2 - 2 * cosine_of_angle);
  const double inner = std::max(0.0, chord - kRounding);
  const double outer = chord + kRounding;
  const auto surely = static_cast<float>(inner * inner * (1 - kRelative));
  const auto perhaps = static_cast<float>(outer * outer * (1 + kRelative));
  const auto x = static_cast<float>(d.x());
  const auto y = static_cast<float>(d.y());
  const auto z = static_cast<float>(d.z());
  int count = 0;
  for (std::size_t begin = 0; begin < static_cast<std::size_t>(end_); begin += kBlock) {
    std::array<float, kBlock> squares;
    int any = 0;
    for (std::size_t i = 0; i < kBlock; ++i) {
      const float dx = x_[begin + i] - x;
      const float dy = y_[begin + i] - y;
      const float dz = z_[begin + i] - z;
      squares[i] = dx * dx + dy * dy + dz * dz;
      any |= static_cast<int>(squares[i] <= perhaps);
    }
    if (any == 0) continue;
    std::array<int, kBlock> candidates;
    std::size_t n = 0;
    for (std::size_t i = 0; i < kBlock; ++i) {  // without an unpredictable branch
      candidates[n] = static_cast<int>(begin + i);
      n += static_cast<std::size_t>(squares[i] <= perhaps);
    }
    for (std::size_t i = 0; i < n; ++i) {
      const int slot = candidates[i];
      if (squares[static_cast<std::size_t>(slot) - begin] >= surely &&
          at(slot).d.dot(d) < cosine_of_angle) {
        continue;
      }
      if (count < capacity) slots[count] = slot;
      ++count;
    }
  }
  return count;
}

double LandmarkMap::worth(int slot, std::uint32_t now) const {
  return worth_of(at(slot).statistics, now);
}

}  // namespace alidade
