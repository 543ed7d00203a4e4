#pragma once
// A TurningCamera's images and telemetry at its own pace, for a Pipeline without a link.

#include <atomic>
#include <random>
#include <string>

#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/system/clock.h"
#include "platform/video/frame_source.h"
#include "test/benchmark/turning_camera.h"

namespace alidade::benchmarks {

inline constexpr int kPacedSamples = 2;      // of telemetry, a frame
inline constexpr double kPacedSigma = 1e-5;  // rad

// Of monotonic_now_s().
void sleep_until(double due_s);

// speed: times that of the camera, which has 30 frames/s. Frames are stamped when read() returns, as if their last packet came then.
// decodes: false: without luma, as where nobody looks at it.
class PacedVideo final : public FrameSource {
 public:
  PacedVideo(const TurningCamera& camera, double start_s, double speed, bool decodes)
      : camera_(camera), start_s_(start_s), speed_(speed), decodes_(decodes) {}
  ReadStatus read(Frame& frame, double) override {
    if (stopped_) return ReadStatus::kStopped;
    sleep_until(start_s_ + camera_.time_s(next_) / speed_);
    const ImageView view = camera_.view(next_);
    frame = {};
    frame.stamp.frame = next_;
    frame.stamp.sequence = next_++;
    frame.width = view.width;
    frame.height = view.height;
    if (decodes_) frame.luma = view.luma;
    frame.stride = view.stride;
    frame.stamp.receive_time_s = monotonic_now_s();
    return ReadStatus::kOk;
  }
  void stop() override { stopped_ = true; }
  [[nodiscard]] std::string error() const override { return ""; }
  [[nodiscard]] std::string name() const override { return "turning camera"; }

 private:
  const TurningCamera& camera_;
  double start_s_;
  double speed_;
  bool decodes_;
  int next_ = 0;
  std::atomic<bool> stopped_{false};
};

class PacedPanTilt final : public PanTiltSource {
 public:
  PacedPanTilt(const TurningCamera& camera, double start_s, double speed)
      : camera_(camera), start_s_(start_s), speed_(speed) {}
  ReadStatus read(PanTiltSample& sample, double) override {
    if (stopped_) return ReadStatus::kStopped;
    const double time_s = next_ * camera_.time_s(1) / kPacedSamples;
    sleep_until(start_s_ + time_s / speed_);
    const PanTilt<double> angle = camera_.angle(time_s);
    sample = {};
    sample.sequence = next_++;
    sample.earliest_time_s = sample.latest_time_s = monotonic_now_s();
    sample.pan_rad = angle.pan + noise_(random_);
    sample.tilt_rad = angle.tilt + noise_(random_);
    return ReadStatus::kOk;
  }
  void stop() override { stopped_ = true; }
  [[nodiscard]] std::string error() const override { return ""; }
  [[nodiscard]] std::string name() const override { return "turning camera's head"; }

 private:
  const TurningCamera& camera_;
  double start_s_;
  double speed_;
  int next_ = 0;
  std::mt19937 random_{1};
  std::normal_distribution<double> noise_{0, kPacedSigma};
  std::atomic<bool> stopped_{false};
};

}  // namespace alidade::benchmarks
