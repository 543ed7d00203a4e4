#pragma once
// SceneDrift: do the map's landmarks stand still? Each landmark has a rate in the map's frame, from
// its places over some seconds, and the map has a rate against telemetry, from its offsets. A rate
// (pan, tilt; rad/s) is that by which the camera would have to turn for the same change in the
// image; for ground the sum of both rates is zero. Landmarks form one group, or two of one rate
// each: clouds before a mountain. Telemetry shows which of two is at rest; until then the verdict
// is kUndecided. A single group moves if its rate is steady: play and sway are not steady, and a
// rate that follows the angle is the gear's. Then a new map has to prove itself. The constructor
// takes all memory; nothing else allocates, waits or throws. One thread.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/model/linear_algebra.h"
#include "core/realtime/oe_mode/fading_fit.h"
#include "core/realtime/oe_mode/orientation_solve.h"

namespace alidade {

enum class SceneVerdict {
  kRest,       // as far as can be seen
  kUndecided,  // two groups: it is not known yet which is at rest
  kPartMoves,  // the landmarks of the group apart, which the map does not follow
  kMapMoves,   // the landmarks of the other group, which the map follows
  kAllMove
};

// Telemetry's angle minus the map's, at one time.
struct SeenOffset {
  double time_s = 0;
  Vector2<double> angle = Vector2<double>::Zero();     // rad, (pan, tilt)
  Vector2<double> offset = Vector2<double>::Zero();    // rad
  Vector2<double> variance = Vector2<double>::Zero();  // rad^2, of its noise
  // Standard deviation of d offset / d angle, by an error that goes with the angle.
  Vector2<double> slope_sigma = Vector2<double>::Zero();
};

class SceneDrift {
 public:
  // capacity: of the map.
  explicit SceneDrift(int capacity) : records_(static_cast<std::size_t>(capacity)) {}

  // For another calibration.
  void reset();
  // The map begins anew.
  void begin_map();

  void note(const SeenOffset& seen);
  // Begins a frame in which landmarks held. rate: rad/s, the camera's.
  void begin_frame(double time_s, const Vector2<double>& rate);
  // slot: below the map's capacity. d: unit, where it was found, in the map's frame. Ignored if d
  // is not finite, at elevations beyond +-1.4 rad, and beyond kMaxFoundLandmarks landmarks of a
  // frame.
  void note_landmark(int slot, std::uint32_t id, const Vector3<double>& d);
  // The verdict on that frame. pixel: rad, the angle of one pixel.
  SceneVerdict judge(double pixel);

  // True if, by the latest verdict, the answer is telemetry's although landmarks held.
  [[nodiscard]] bool withholds() const { return on_trial_ || verdict_ == SceneVerdict::kUndecided; }
  // A new map has to prove itself, as what was in view before moved.
  [[nodiscard]] bool is_on_trial() const { return on_trial_; }
  // rad^2, of (pan, tilt): how far the map may have drifted along with what moves, although no
  // verdict says so yet.
  [[nodiscard]] const Matrix2<double>& doubt() const { return doubt_; }
  // True if doubt() is from less than a second of telemetry: its noise alone then often gives some.
  [[nodiscard]] bool is_young() const;

  // The frame's landmarks that move, by the latest verdict: calls use(slot, id, d, rate).
  template <class Use>
  void for_each_moving(Use use) const {
    for (std::size_t i = 0; i < noted_count_; ++i) {
      const Noted& n = noted_[i];
      const bool moves = verdict_ == SceneVerdict::kAllMove ||
                         (verdict_ == SceneVerdict::kPartMoves && n.apart) ||
                         (verdict_ == SceneVerdict::kMapMoves && n.tested && !n.apart);
      if (moves) use(n.slot, n.id, n.d, n.apart ? apart_rate_ : rate_);
    }
  }
  // rad/s, of what moves against the rest, or of all. None if nothing was seen to move.
  [[nodiscard]] std::optional<double> moving_rate() const {
    if (verdict_ == SceneVerdict::kRest) return std::nullopt;
    return verdict_ == SceneVerdict::kAllMove ? rate_.norm() : (apart_group_ - group_).norm();
  }

  [[nodiscard]] std::size_t memory_bytes() const { return records_.capacity() * sizeof(Record); }

 private:
  // Sums for a straight line of y over t; older values count less. t: s since first_s. y: rad, the
  // change of place since then, with the opposite sign.
  struct Record {
    std::uint32_t id = 0;
    Vector2<double> first = Vector2<double>::Zero();  // rad, azimuth and elevation
    double first_s = 0;
    double last_s = 0;
    double weight = 0;
    double t = 0;
    double tt = 0;
    Vector2<double> y = Vector2<double>::Zero();
    Vector2<double> ty = Vector2<double>::Zero();
    Vector2<double> yy = Vector2<double>::Zero();
  };
  struct Noted {
    int slot = 0;
    std::uint32_t id = 0;
    Vector3<double> d = Vector3<double>::Zero();
    bool tested = false;                             // seen long enough for a rate
    bool apart = false;                              // of the group that the map does not follow
    Vector2<double> rate = Vector2<double>::Zero();  // rad/s
    double variance = 0;                             // (rad/s)^2
    double life_s = 0;
  };
  struct Rate {
    Vector2<double> value = Vector2<double>::Zero();     // rad/s
    Vector2<double> variance = Vector2<double>::Zero();  // (rad/s)^2
    double misfit = 0;  // mean square of what is left, 1: its noise
  };

  [[nodiscard]] bool map_rate(const Vector2<double>& slope_sigma, double pixel, Rate* out) const;
  void find_rates(double pixel);
  [[nodiscard]] bool find_groups(double pixel);
  [[nodiscard]] Vector2<double> median_rate(bool apart);
  SceneVerdict judge_two(double pixel);
  SceneVerdict judge_one(double pixel);

  std::vector<Record> records_;  // by slot
  std::array<Noted, kMaxFoundLandmarks> noted_{};
  std::size_t noted_count_ = 0;
  std::array<double, kMaxFoundLandmarks> sorted_{};
  std::array<FadingFit<3>, 2> lines_;  // of each axis: offset = a + rate t + slope angle
  Vector2<double> slope_sigma_ = Vector2<double>::Zero();
  double begun_s_ = 0;  // of the offsets
  Vector2<double> begun_angle_ = Vector2<double>::Zero();
  double noted_s_ = 0;
  bool has_offsets_ = false;
  double time_s_ = 0;            // of the frame
  double mean_square_rate_ = 0;  // (rad/s)^2, of the camera
  SceneVerdict verdict_ = SceneVerdict::kRest;
  Vector2<double> rate_ = Vector2<double>::Zero();  // against telemetry
  Vector2<double> apart_rate_ = Vector2<double>::Zero();
  Vector2<double> group_ = Vector2<double>::Zero();  // in the map's frame
  Vector2<double> apart_group_ = Vector2<double>::Zero();
  Matrix2<double> doubt_ = Matrix2<double>::Zero();
  bool on_trial_ = false;
  Vector2<double> moved_rate_ = Vector2<double>::Zero();  // of what moved last
};

}  // namespace alidade
