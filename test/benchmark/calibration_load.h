#pragma once
// What a calibration that computes beside the real-time thread is made of: the streams of a TurningCamera, what the
// calibration thread hears of them, and a thread of the lowest priority that does its whole work (adjustment, check,
// map) when asked.

#include <atomic>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/pipeline/realtime_stage.h"
#include "edge_app/self_calibration/self_calibration.h"
#include "platform/system/semaphore.h"
#include "test/benchmark/turning_camera.h"

namespace alidade::benchmarks {

inline constexpr int kSamplesPerFrame = 2;
inline constexpr double kHeadSigma = 1e-5;  // rad

// The streams of a camera that began to turn at start_s. Frames are stamped with their row 0, and known
// then: the constant delay of a real link is the clock offset's affair.
class Streams {
 public:
  Streams(const TurningCamera& camera, double start_s) : camera_(camera), start_s_(start_s) {}

  [[nodiscard]] double time_s(int k) const { return start_s_ + camera_.time_s(k); }
  [[nodiscard]] VideoMessage frame(int k) const;
  // The i-th of the samples just before frame k.
  [[nodiscard]] PanTiltSample sample(int k, int i);

 private:
  const TurningCamera& camera_;
  double start_s_;
  std::mt19937 random_{1};
  std::normal_distribution<double> noise_{0, kHeadSigma};
};

[[nodiscard]] OrientationStepOptions step_options(const TurningCamera& camera, bool calibrated);

// What the calibration thread heard of the first 12 s, to be told again and again.
class Heard {
 public:
  explicit Heard(const TurningCamera& camera);
  [[nodiscard]] std::unique_ptr<SelfCalibration> told() const;

 private:
  const TurningCamera& camera_;
  std::vector<PanTiltSample> samples_;
  std::vector<FrameTracks> tracks_;
};

class CalibrationThread {
 public:
  explicit CalibrationThread(const Heard& heard);
  ~CalibrationThread();
  CalibrationThread(const CalibrationThread&) = delete;
  CalibrationThread& operator=(const CalibrationThread&) = delete;

  // While done().
  void begin();
  // At normal priority, as it may be starved.
  void cancel();
  [[nodiscard]] bool done() const { return done_; }

  // While done().
  [[nodiscard]] const std::shared_ptr<const PublishedCalibration>& published() const {
    return published_;
  }
  [[nodiscard]] int works() const { return works_; }
  [[nodiscard]] int publications() const { return publications_; }
  [[nodiscard]] double cpu_share() const { return wall_s_ > 0 ? cpu_s_ / wall_s_ : 0; }
  [[nodiscard]] double wall_s() const { return wall_s_; }
  [[nodiscard]] std::vector<CalibrationMessage> messages() { return calibration_->take_messages(); }

 private:
  void run();

  const Heard& heard_;
  std::unique_ptr<SelfCalibration> calibration_;
  std::shared_ptr<const PublishedCalibration> published_;
  int works_ = 0;
  int publications_ = 0;
  double wall_s_ = 0;
  double cpu_s_ = 0;
  std::atomic<bool> done_{true};
  std::atomic<bool> end_{false};
  Semaphore asked_;
  std::thread thread_;
};

}  // namespace alidade::benchmarks
