#include "test/simulator/timeline.h"

#include <algorithm>
#include <limits>

namespace alidade::simulator {

JitteredStamps::JitteredStamps(const JitterConfig& config, std::uint64_t seed, Stream stream)
    : config_(config),
      generator_(make_generator(seed, stream)),
      last_delivery_(-std::numeric_limits<double>::infinity()) {}

double JitteredStamps::stamp(double time_s) {
  // Every call draws the same number of values, so that one setting does not shift another's.
  const double white = std::normal_distribution<double>()(generator_);
  const double exponential = std::exponential_distribution<double>()(generator_);
  const double burst = std::uniform_real_distribution<double>()(generator_);
  const bool bursts = std::bernoulli_distribution(config_.burst_probability)(generator_);
  const double delay = config_.exponential * exponential + (bursts ? config_.burst * burst : 0);
  last_delivery_ = std::max(last_delivery_, time_s + delay);
  return last_delivery_ + config_.sigma * white;
}

FrameTimeline::FrameTimeline(const Config& config)
    : period_(1 / config.image.rate_hz),
      skew_(config.timing.image_clock_skew),
      loss_(config.timing.frame_loss),
      stamps_(config.timing.image, config.seed, Stream::kImageStamp),
      loss_generator_(make_generator(config.seed, Stream::kFrameLoss)) {}

FrameEvent FrameTimeline::next() {
  std::bernoulli_distribution lost(loss_);
  while (lost(loss_generator_)) ++sequence_;
  FrameEvent event;
  event.frame = frame_++;
  event.sequence = sequence_++;
  event.capture_s = static_cast<double>(event.sequence) * period_;
  event.stamp_s = stamps_.stamp(event.capture_s);
  event.sender_s = event.capture_s * (1 + skew_);
  return event;
}

}  // namespace alidade::simulator
