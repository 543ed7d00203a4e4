#pragma once
// LandmarkMap: the landmarks that the camera can recognise, by slot and by place (PTCEE section V-A, Fig. 6).
//
// Directions are unit vectors in the map's frame, which follows the base frame but for an offset that
// OeMode knows. The unit sphere is divided into cells of about equal size: rings of constant
// latitude, each cut into as many cells as its circumference has room for. Cells of octave l are 2^l
// times as wide as those of octave 0, up to a largest size, and hold at most one landmark of that
// octave (PTCEE V-A). Behind a lens that zooms cells follow the image: made at 2^(zoom / 4) times the focal length that the map
// began with, a landmark has a cell 2^(-zoom / 4) times as wide, among those of its octave and zoom.
// A full map replaces its least useful landmark, see worth(), by a new one.
// All memory is taken by the constructor; nothing else allocates, waits or throws. One thread.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/model/linear_algebra.h"
#include "core/realtime/oe_mode/landmark.h"

namespace alidade {

enum class InsertStatus {
  kOk,
  kCellTaken,  // by a landmark of this octave
  kFull,       // and none is worth less than a new one
  kBad         // direction not finite or not of unit length, or octave out of range
};

class LandmarkMap {
 public:
  static constexpr int kMaxOctaves = 8;
  static constexpr double kMaxCellSize = 0.5;  // rad
  static constexpr int kZoomsPerOctave = 4;
  static constexpr int kMaxZoom = 8 * kZoomsPerOctave;

  // capacity: at least 1. cell_size: rad, of octave 0, in [1e-6, 0.5]; what is outside is taken as
  // the nearest. A landmark costs about 600 bytes.
  LandmarkMap(int capacity, double cell_size, double largest_cell_size = kMaxCellSize);
  LandmarkMap(const LandmarkMap&) = delete;
  LandmarkMap& operator=(const LandmarkMap&) = delete;

  // Forgets all landmarks, but not which ids were given; cells have a new size.
  void clear(double cell_size, double largest_cell_size = kMaxCellSize);

  [[nodiscard]] int capacity() const;
  [[nodiscard]] int size() const;
  [[nodiscard]] double cell_size() const;
  [[nodiscard]] std::size_t memory_bytes() const;
  // Landmarks that had to go for new ones, since clear().
  [[nodiscard]] std::int64_t replaced() const;

  // Slots: 0 to capacity() - 1; one stays with its landmark until that is retired or replaced.
  [[nodiscard]] bool occupied(int slot) const;
  [[nodiscard]] const Landmark& at(int slot) const;          // occupied(slot)
  [[nodiscard]] LandmarkStatistics& statistics(int slot);    // occupied(slot)
  [[nodiscard]] LandmarkSensitivity& sensitivity(int slot);  // occupied(slot)

  // zoom: -kMaxZoom to kMaxZoom; what is beyond is taken as these.
  // On kOk it has a new id, a slot and fresh statistics, last looked for now (count of frames).
  [[nodiscard]] InsertStatus insert(const Landmark& landmark, std::uint32_t now, int* slot,
                                    int zoom = 0);
  void retire(int slot);  // occupied(slot)

  // A better direction, a few pixels from the old one; the cell stays that of the first. One that
  // is not finite or not of unit length is ignored.
  void refine(int slot, const Vector3<double>& d, const Matrix2<double>& covariance);

  // Whether a landmark of this octave and zoom has d's cell.
  [[nodiscard]] bool cell_taken(const Vector3<double>& d, int octave, int zoom = 0) const;

  // Slots of all landmarks within an angle of a direction, in ascending order; at most `capacity` of
  // them are written. Returns how many there are: none for a direction or angle that is not finite.
  [[nodiscard]] int find(const Vector3<double>& centre, double cosine_of_angle, int* slots,
                         int capacity) const;

  // Of use, 0 to 1: a landmark that is found when looked for, and not long forgotten; what was found
  // often is forgotten later. A new one has 1/2 for 30 frames, so that others made soon
  // after do not drive it out.
  [[nodiscard]] double worth(int slot, std::uint32_t now) const;

 private:
  using Key = std::uint64_t;  // of a cell, octave and zoom included
  using Rings = std::array<int, kMaxOctaves>;

  [[nodiscard]] Key cell_of(const Vector3<double>& d, int octave, int zoom) const;
  [[nodiscard]] std::size_t home(Key key) const;      // where the search for it begins
  [[nodiscard]] std::size_t position(Key key) const;  // where it is, or the gap where it would be
  [[nodiscard]] int slot_of_least_worth(std::uint32_t now) const;
  void place(int slot, const Vector3<double>& d);  // where find() looks for it

  std::vector<Landmark> landmarks_;  // by slot
  std::vector<Key> cells_;           // by slot
  std::vector<float> x_, y_, z_;     // by slot; free ones are far from the sphere
  std::vector<int> free_;            // slots, the next to give last; size_ of them are not
  std::vector<int> table_;           // slots by cell, or kNone: linear probing
  std::array<Rings, 2 * kMaxZoom + 1> rings_{};  // from pole to pole, by zoom and octave
  double cell_size_ = 0;
  int size_ = 0;
  int end_ = 0;  // no slot from here on is in use
  std::uint32_t last_id_ = 0;
  std::int64_t replaced_ = 0;
};

}  // namespace alidade
