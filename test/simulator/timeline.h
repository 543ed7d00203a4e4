#pragma once
// When frames are captured and what stamps they get: jitter, loss, and the sender's own clock.
//
// Frame number n (the sequence) is captured at n / rate_hz. Its stamp on the image clock is that time
// plus jitter: a symmetric white part, and a one-sided part (exponential delays and bursts) in which,
// as on a stream, nothing overtakes: a frame is never delivered before its predecessor. A lost frame
// appears nowhere but as a gap in the sequence; `frame` counts those delivered. Times are s.
// Not thread-safe.

#include <cstdint>
#include <random>

#include "test/simulator/config.h"
#include "test/simulator/random.h"

namespace alidade::simulator {

// Turns true times, given in order, into stamps.
class JitteredStamps {
 public:
  JitteredStamps(const JitterConfig& config, std::uint64_t seed, Stream stream);
  [[nodiscard]] double stamp(double time_s);

 private:
  JitterConfig config_;
  std::mt19937_64 generator_;
  double last_delivery_;
};

struct FrameEvent {
  std::int64_t frame = 0;     // 0, 1, 2, ... of those delivered
  std::int64_t sequence = 0;  // of all, lost ones too
  double capture_s = 0;       // row coordinate 0, true time
  double stamp_s = 0;         // on the image clock
  double sender_s = 0;        // capture time on the sender's skewed clock
};

class FrameTimeline {
 public:
  explicit FrameTimeline(const Config& config);
  // The next frame that is not lost.
  [[nodiscard]] FrameEvent next();

 private:
  double period_, skew_, loss_;
  JitteredStamps stamps_;
  std::mt19937_64 loss_generator_;
  std::int64_t frame_ = 0, sequence_ = 0;
};

}  // namespace alidade::simulator
