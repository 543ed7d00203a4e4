#include "test/benchmark/calibration_load.h"

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <cstdio>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/realtime.h"

namespace alidade::benchmarks {
namespace {

constexpr int kCollected = 360;  // frames that the calibration is made of

double thread_cpu_s() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

VideoMessage Streams::frame(int k) const {
  VideoMessage message;
  message.stamp.frame = k;
  message.stamp.sequence = k;
  message.stamp.receive_time_s = time_s(k);
  message.image = camera_.view(k);
  return message;
}

PanTiltSample Streams::sample(int k, int i) {
  const int sequence = kSamplesPerFrame * k + i;
  const double time = camera_.time_s(k - 1) + (i + 1) * (camera_.time_s(1) / kSamplesPerFrame);
  const PanTilt<double> angle = camera_.angle(time);
  PanTiltSample sample;
  sample.sequence = sequence;
  sample.earliest_time_s = sample.latest_time_s = start_s_ + time;
  sample.pan_rad = angle.pan + noise_(random_);
  sample.tilt_rad = angle.tilt + noise_(random_);
  return sample;
}

OrientationStepOptions step_options(const TurningCamera& camera, bool calibrated) {
  OrientationStepOptions options;
  options.calibration = camera.calibration();
  options.calibrated = calibrated;
  options.telemetry_noise.pan_tilt_sigma = kHeadSigma;
  options.oe = oe_options(camera.calibration().camera);
  options.follow_points = true;
  return options;
}

Heard::Heard(const TurningCamera& camera) : camera_(camera) {
  OrientationStep step(step_options(camera, false));
  Streams streams(camera, 0);
  StepEvents events;
  for (int k = 0; k < kCollected; ++k) {
    for (int i = 0; i < kSamplesPerFrame; ++i) {
      samples_.push_back(streams.sample(k, i));
      step.add_telemetry(samples_.back());
    }
    const VideoMessage message = streams.frame(k);
    static_cast<void>(step.add_frame(message.stamp, message.image, &events));
    step.maintain();
    tracks_.emplace_back();
    step.get_tracks(&tracks_.back());
  }
}

std::unique_ptr<SelfCalibration> Heard::told() const {
  SelfCalibrationOptions options;
  options.data_sheet = camera_.calibration();
  options.data_sheet.camera.focal_length *= 1.1;
  options.data_sheet.line_delay = 0;
  options.noise.pan_tilt_sigma_rad = kHeadSigma;
  auto calibration = std::make_unique<SelfCalibration>(options, nullptr);
  for (int k = 0; k < kCollected; ++k) {
    for (int i = 0; i < kSamplesPerFrame; ++i)
      calibration->add(samples_[static_cast<std::size_t>(kSamplesPerFrame * k + i)]);
    calibration->add(tracks_[static_cast<std::size_t>(k)]);
    if (calibration->wants_keyframe())
      calibration->add_keyframe(tracks_[static_cast<std::size_t>(k)].stamp.frame, camera_.view(k));
  }
  return calibration;
}

CalibrationThread::CalibrationThread(const Heard& heard)
    : heard_(heard), thread_(&CalibrationThread::run, this) {}

CalibrationThread::~CalibrationThread() {
  end_ = true;
  asked_.post();
  thread_.join();
}

void CalibrationThread::begin() {
  calibration_ = heard_.told();
  done_ = false;
  asked_.post();
}

void CalibrationThread::cancel() {
  calibration_->cancel();
  const sched_param none{};
  pthread_setschedparam(thread_.native_handle(), SCHED_OTHER, &none);
}

void CalibrationThread::run() {
  const std::string warning = set_lowest_priority();
  if (!warning.empty()) std::fprintf(stderr, "calibration thread: %s\n", warning.c_str());
  for (asked_.wait(); !end_; asked_.wait()) {
    const double begin_s = monotonic_now_s();
    const double cpu_begin_s = thread_cpu_s();
    if (auto published = calibration_->work()) {
      published_ = std::move(published);
      ++publications_;
    }
    ++works_;
    wall_s_ += monotonic_now_s() - begin_s;
    cpu_s_ += thread_cpu_s() - cpu_begin_s;
    done_ = true;
  }
}

}  // namespace alidade::benchmarks
