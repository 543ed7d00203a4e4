#pragma once
// TargetTracker: targets from detections, frame by frame: predicted, associated, updated
// (target_filter.h, joint_association.h), born and given up. Rules: docs/derivations.md. A late
// frame is put in its place and the frames after it are processed again: the result is that of the
// right order. A target that is then born again keeps its identity if it is near where it was. A
// frame with any fault is refused as a whole, with its reason.
// Identities count from 1 and are never reused. Equal calls give equal results. For one thread. The
// constructor takes all memory, no call allocates: about max_targets * (300 + 100 max_detections) +
// history_frames * (320 max_targets + 50 max_detections) bytes.

#include <cstdint>
#include <vector>

#include "core/tracking/joint_association.h"
#include "core/tracking/target_filter.h"
#include "core/tracking/target_frame.h"

namespace alidade {

struct TargetTrackerOptions {
  TargetSpace space = TargetSpace::kPlane;
  AssociationMethod association = AssociationMethod::kExact;
  double acceleration_density = 0.5;   // m^2/s^3 or rad^2/s^3; 0.5: walkers
  double sigma_first_velocity = 2;     // m/s or rad/s
  double detection_probability = 0.9;  // that a target in view is detected, in (0, 1)
  // Probability that a target's detection is in its gate, in (0, 1). The gate is wide, so that a
  // target that turns sharply stays inside; a detection at its edge gets little weight.
  double gate_probability = 0.99999;
  int birth_hits = 3;          // sightings that confirm a target
  int birth_looks = 5;         // the number of first looks among which they must be
  double lose_after_s = 1;     // longest time in view without being seen
  double forget_after_s = 60;  // since last seen, in view or not; at least lose_after_s
  double most_sigma = 30;      // m or rad, of the place along its worst direction; beyond: given up
  double most_ahead_s = 0.5;   // limit of a frame's time after now
  double history_s = 2;        // limit of a late frame's delay
  int history_frames = 64;     // kept for late frames
  int max_targets = 256;       // including unconfirmed ones
  int max_detections = 256;    // of a frame

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class FrameStatus {
  kTaken,
  kTakenLate,            // put in its place, later frames processed again
  kTooLate,              // beyond the history
  kInTheFuture,          // more than most_ahead_s after now
  kBadFrame,             // not finite, H singular, density not positive, or a count out of range
  kTooManyDetections,    // more than max_detections
  kDetectionNotFinite,   // place or covariance
  kDetectionCovariance,  // not symmetric and positive definite
  kDetectionOutside,     // of the view by more than five sigmas
};

[[nodiscard]] const char* to_string(FrameStatus status);

struct FrameAnswer {
  FrameStatus status = FrameStatus::kTaken;
  int detection = -1;  // index of the detection at fault; -1: none is
  int steps = 0;       // frames processed: 1, more for a late one, 0 for a refused one
};

struct Target {
  std::uint64_t identity = 0;  // 0: not confirmed
  TargetState state;           // at the newest frame's time
  double born_s = 0;           // time of its first frame
  double seen_s = 0;           // time of the last frame that saw it
  double unseen_s = 0;         // unseen although in view, since then; a doubtful view counts less
  double in_view = 1;          // probability of being in view of the last frame
  int detection = -1;  // index in the last frame: the one by which it counts as seen; -1: none
  int looks = 0;       // frames that had it in view, until it was confirmed
  int hits = 0;        // of these, the ones that saw it
};

class TargetTracker {
 public:
  // options must be valid.
  explicit TargetTracker(const TargetTrackerOptions& options);

  // now_s: the present time on the clock of the frames' times. A refused frame changes nothing.
  [[nodiscard]] FrameAnswer add(const TargetFrame& frame, double now_s);

  // In order of birth. Targets without identity may be false alarms.
  [[nodiscard]] const std::vector<Target>& targets() const { return targets_; }
  // s; time of the newest frame. 0 before the first one.
  [[nodiscard]] double time_s() const { return time_s_; }
  // Births refused because there were max_targets. Frames that are processed again count again.
  [[nodiscard]] std::int64_t births_refused() const { return births_refused_; }

 private:
  // A frame as it came, and the targets after it.
  struct Kept {
    TargetFrame frame;
    std::vector<TargetMeasurement> detections;
    std::vector<Target> after;
  };
  struct Seen {
    ExpectedPlace place;
    bool in_front = false;
    int first_pair = 0;
    int pairs = 0;
  };

  [[nodiscard]] FrameAnswer check(const TargetFrame& frame, double now_s) const;
  void keep(const TargetFrame& frame, std::size_t position);
  void step(Kept* kept);
  void predict(double time_s, const TargetFrame& frame);
  void gate(const Kept& kept);
  void associate();
  void update();
  void count_looks(const TargetFrame& frame, double dt_s);
  void bear(const Kept& kept);
  [[nodiscard]] bool gives_up(const Target& target, double time_s) const;
  void name_replayed(std::size_t position);

  TargetTrackerOptions options_;
  double gate_;  // chi-square
  JointAssociation association_;
  std::vector<Target> targets_;
  double time_s_ = 0;
  std::uint64_t last_identity_ = 0;
  std::uint64_t last_provisional_ = 0;
  std::int64_t births_refused_ = 0;
  bool forgotten_ = false;  // frames have left the history
  bool replaying_ = false;

  std::vector<Kept> history_;
  std::vector<std::size_t> order_;  // of history_, by time
  std::vector<std::size_t> free_;
  std::vector<Target> before_replay_;
  // Scratch of the current frame.
  std::vector<Seen> seen_;
  std::vector<GatedPair> pairs_;
  std::vector<Innovation> innovations_;
  std::vector<double> weights_, missed_, claimed_;
  // For each detection, 1: no other target may be seen in it and none born from it.
  std::vector<char> taken_;
  std::vector<int> by_x_;
};

}  // namespace alidade
