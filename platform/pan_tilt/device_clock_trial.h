#pragma once
// DeviceClockTrial: decides whether the times in a polled device's answers are useful.
//
// What a device gives as time differs: when it measured, when it answered, the latter in whole
// seconds, a constant, or nothing. Times are useful if they never go backwards, are finer than
// whole seconds, and have advanced as the host's clock since the first answer, to kSlack_s. The
// verdict comes with the second advance of the device time. It is kUseless at once if a time is
// missing, goes backwards or differs by more than kSlack_s; also if the second advance has not come
// by the first answer that is the kAnswers-th or later and over kPatience_s after the first. A
// verdict other than kOpen is final. No I/O; one thread.

#include <cmath>
#include <optional>

namespace alidade {

class DeviceClockTrial {
 public:
  enum class Verdict { kOpen, kUseful, kUseless };

  // device_time_s: s, device clock, from the answer received at host_time_s (s, host
  // CLOCK_MONOTONIC). nullopt gives kUseless.
  Verdict add(std::optional<double> device_time_s, double host_time_s) {
    if (verdict_ != Verdict::kOpen) {
      return verdict_;
    }
    if (!device_time_s) {
      return verdict_ = Verdict::kUseless;
    }
    fine_ = fine_ || *device_time_s != std::floor(*device_time_s);
    ++answers_;
    if (answers_ == 1) {
      first_host_s_ = host_time_s;
      first_device_s_ = *device_time_s;
    } else {
      const double advance_s = *device_time_s - last_device_s_;
      const double ahead_s = (*device_time_s - first_device_s_) - (host_time_s - first_host_s_);
      changes_ += advance_s > 0 ? 1 : 0;
      const bool contradicts = advance_s < 0 || std::abs(ahead_s) > kSlack_s;
      const bool tells = changes_ >= kChanges;
      const bool stands = answers_ >= kAnswers && host_time_s - first_host_s_ > kPatience_s;
      if (contradicts || tells || stands) {
        verdict_ = !contradicts && tells && fine_ ? Verdict::kUseful : Verdict::kUseless;
      }
    }
    last_device_s_ = *device_time_s;
    return verdict_;
  }

 private:
  static constexpr int kChanges = 2;
  static constexpr int kAnswers = 4;
  static constexpr double kPatience_s = 1;
  static constexpr double kSlack_s = 1;

  Verdict verdict_ = Verdict::kOpen;
  int answers_ = 0;
  int changes_ = 0;
  bool fine_ = false;
  double first_host_s_ = 0;
  double first_device_s_ = 0;
  double last_device_s_ = 0;
};

}  // namespace alidade
