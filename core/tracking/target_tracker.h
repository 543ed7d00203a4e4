#pragma once
// Targets from detections, frame after frame: predicted, associated, updated (target_filter.h, joint_association.h), born and given up.
//   born     from a detection that no target claims, nor a target could that is not seen; confirmed, with an identity, when seen in
//            birth_hits of its first birth_looks looks
//   given up when it was in view and not seen for lose_after_s: each frame counts with how much likelier the place was in view than not.
//            Out of view it waits while its covariance grows, for forget_after_s or until it could be anywhere (most_sigma), and is taken
//            up where it comes back
//   late     a frame is put in its place and those after it are done again, up to history_s and history_frames back: that costs one step
//            for each. What comes out is what the right order had given; targets keep their identities
//   refused  a frame with anything wrong in it, as a whole and with the reason; nothing changes
// A detection counts as seen for one target only, so that of two on the same target the younger dies. Identities count from 1 and never come again.
// Equal calls give equal results. Memory is taken in the constructor: about max_targets * (300 + 100 max_detections) +
// history_frames * (320 max_targets + 50 max_detections) bytes. No allocation after it. For one thread.

#include <cstdint>
#include <vector>

#include "core/tracking/joint_association.h"
#include "core/tracking/target_filter.h"
#include "core/tracking/target_frame.h"

namespace alidade {

struct TargetTrackerOptions {
  TargetSpace space = TargetSpace::kPlane;
  AssociationMethod association = AssociationMethod::kExact;
  double acceleration_density = 0.5;   // m^2/s^3 or rad^2/s^3; 0.5: people who walk
  double sigma_first_velocity = 2;     // m/s or rad/s
  double detection_probability = 0.9;  // of a target in view, in (0, 1)
  // That a target's detection is in its gate, in (0, 1). Wide: who turns sharply is still in it, and the weights know how unlikely that is.
  double gate_probability = 0.99999;
  int birth_hits = 3;
  int birth_looks = 5;         // at most 32
  double lose_after_s = 1;     // in view, unseen
  double forget_after_s = 60;  // since last seen
  double most_sigma = 30;      // m or rad, of the place along its worst direction
  double most_ahead_s = 0.5;   // a frame later than now by more is refused
  double history_s = 2;        // how late a frame may come
  int history_frames = 64;     // at most that many are kept for it
  int max_targets = 256;       // with those that are not confirmed
  int max_detections = 256;    // a frame

  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class FrameStatus {
  kTaken,
  kTakenLate,            // put in its place, later frames done again
  kTooLate,              // more than the history reaches back
  kInTheFuture,          // later than now
  kBadFrame,             // a number is not finite, H singular, the density not positive
  kTooManyDetections,    // more than max_detections
  kDetectionNotFinite,   // place or covariance
  kDetectionCovariance,  // not symmetric and positive definite
  kDetectionOutside,     // of the view, by more than five of its sigmas
};

[[nodiscard]] const char* to_string(FrameStatus status);

struct FrameAnswer {
  FrameStatus status = FrameStatus::kTaken;
  int detection = -1;  // the one at fault
  int steps = 0;       // frames done: 1, more for a late one
};

struct Target {
  std::uint64_t identity = 0;  // 0: not confirmed
  TargetState state;           // at the newest frame's time
  double born_s = 0;
  double seen_s = 0;    // time of the last frame it was seen in
  double unseen_s = 0;  // how long it has been in view without being seen
  double in_view = 1;   // how likely it was in view of the last frame
  int detection = -1;   // of the last frame, the one that counts as seen
  int looks = 0;        // until it was confirmed
  int hits = 0;
};

class TargetTracker {
 public:
  // options are valid.
  explicit TargetTracker(const TargetTrackerOptions& options);

  // now_s: the caller's clock, which frames' times are of.
  [[nodiscard]] FrameAnswer add(const TargetFrame& frame, double now_s);

  // In the order of their birth; those without identity may be false alarms.
  [[nodiscard]] const std::vector<Target>& targets() const { return targets_; }
  // Of the newest frame.
  [[nodiscard]] double time_s() const { return time_s_; }
  // Births refused because max_targets are there.
  [[nodiscard]] std::int64_t births_refused() const { return births_refused_; }

 private:
  // A frame as it came, and the targets as they were after it.
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
  // Of the frame at hand.
  std::vector<Seen> seen_;
  std::vector<GatedPair> pairs_;
  std::vector<Innovation> innovations_;
  std::vector<double> weights_, missed_, claimed_;
  std::vector<char>
      taken_;  // of each detection: no other target is seen in it, none is born from it
  std::vector<int> by_x_;
};

}  // namespace alidade
