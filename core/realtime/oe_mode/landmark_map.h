#pragma once
// LandmarkMap: the landmarks, by slot and by cell of the sphere (PTCEE section V-A, Fig. 6).
// Directions are unit vectors in the map's frame: the base frame, except for an offset that OeMode
// knows. Rings of constant latitude are divided into cells of about equal size. A cell holds at
// most one landmark of each octave. Cells of octave l are 2^l times as wide as those of octave 0,
// up to a largest size. If the lens zooms, a landmark made at 2^(zoom / 4) times the map's first
// focal length has a cell 2^(-zoom / 4) times as wide, among those of its octave and zoom. A full
// map replaces its least useful landmark by a new one: see worth().
// The constructor takes all memory; nothing else allocates, waits or throws. One thread.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/model/linear_algebra.h"
#include "core/realtime/oe_mode/landmark.h"

namespace alidade {

enum class InsertStatus {
  kOk,
  kCellTaken,  // by a landmark of this octave and zoom
  kFull,       // and none is worth less than a new one
  kBad         // direction is not a finite unit vector, or octave out of range
};

class LandmarkMap {
 public:
  static constexpr int kMaxOctaves = 8;
  static constexpr double kMaxCellSize = 0.5;  // rad
  static constexpr int kZoomsPerOctave = 4;
  static constexpr int kMaxZoom = 8 * kZoomsPerOctave;

  // capacity: >= 1. cell_size: rad, of octave 0, clamped to [1e-6, 0.5]. largest_cell_size: rad, of
  // coarser octaves; less than cell_size counts as cell_size. A landmark takes about 600 bytes.
  LandmarkMap(int capacity, double cell_size, double largest_cell_size = kMaxCellSize);
  LandmarkMap(const LandmarkMap&) = delete;
  LandmarkMap& operator=(const LandmarkMap&) = delete;

  // Forgets all landmarks and sets a new cell size. Ids are not reused.
  void clear(double cell_size, double largest_cell_size = kMaxCellSize);

  [[nodiscard]] int capacity() const;
  [[nodiscard]] int size() const;
  [[nodiscard]] double cell_size() const;
  [[nodiscard]] std::size_t memory_bytes() const;
  // Landmarks replaced by new ones since clear().
  [[nodiscard]] std::int64_t replaced() const;

  // Slots are 0 to capacity() - 1. A landmark keeps its slot until it is retired or replaced.
  [[nodiscard]] bool occupied(int slot) const;
  [[nodiscard]] const Landmark& at(int slot) const;          // occupied(slot)
  [[nodiscard]] LandmarkStatistics& statistics(int slot);    // occupied(slot)
  [[nodiscard]] LandmarkSensitivity& sensitivity(int slot);  // occupied(slot)

  // zoom: clamped to -kMaxZoom to kMaxZoom. On kOk the landmark has a new id, a slot, and fresh
  // statistics with last_frame = now (frame count).
  [[nodiscard]] InsertStatus insert(const Landmark& landmark, std::uint32_t now, int* slot,
                                    int zoom = 0);
  void retire(int slot);  // occupied(slot)

  // Sets a better direction, a few pixels from the old one, and its own covariance (rad^2). The
  // cell remains that of the first direction. Ignored unless the slot is occupied and d is a finite
  // unit vector.
  void refine(int slot, const Vector3<double>& d, const Matrix2<double>& covariance);

  // True if a landmark of this octave and zoom occupies the cell of d.
  [[nodiscard]] bool cell_taken(const Vector3<double>& d, int octave, int zoom = 0) const;

  // Slots of all landmarks within an angle of a direction, in ascending order; writes at most
  // `capacity`. Returns their total number: 0 unless the direction is a finite unit vector and the
  // cosine is -1 to 1.
  [[nodiscard]] int find(const Vector3<double>& centre, double cosine_of_angle, int* slots,
                         int capacity) const;

  // Usefulness, 0 to 1: high if the landmark is found when looked for. It falls with the time since
  // the last look, more slowly if the landmark was found often. A new landmark has 1/2 for 30
  // frames, so that other new ones do not replace it. occupied(slot).
  [[nodiscard]] double worth(int slot, std::uint32_t now) const;

 private:
  using Key = std::uint64_t;  // of a cell, with octave and zoom
  using Rings = std::array<int, kMaxOctaves>;

  [[nodiscard]] Key cell_of(const Vector3<double>& d, int octave, int zoom) const;
  [[nodiscard]] std::size_t home(Key key) const;      // where the search for it begins
  [[nodiscard]] std::size_t position(Key key) const;  // where it is, or the gap where it would be
  [[nodiscard]] int slot_of_least_worth(std::uint32_t now) const;
  void place(int slot, const Vector3<double>& d);  // writes the direction that find() uses

  std::vector<Landmark> landmarks_;  // by slot
  std::vector<Key> cells_;           // by slot
  std::vector<float> x_, y_, z_;     // by slot; free ones are far off the sphere
  std::vector<int> free_;            // slots; the next free one is before the last size_ entries
  std::vector<int> table_;           // slots by cell, or kNone; linear probing
  std::array<Rings, 2 * kMaxZoom + 1> rings_{};  // number from pole to pole, by zoom and octave
  double cell_size_ = 0;
  int size_ = 0;
  int end_ = 0;  // no slot from here on is in use
  std::uint32_t last_id_ = 0;
  std::int64_t replaced_ = 0;
};

}  // namespace alidade
