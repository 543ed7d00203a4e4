#pragma once
// LinkDelay: how much later telemetry comes, against the pictures, than the calibration says.
//   telemetry(t + delay) = image(t) + constant
// image(t): the mount's angles as the images show them, from any zero; t contains the calibration's
// clock offset. Each sample is compared with image(t) at every delay of a grid within kRange_s at
// which there are images; a larger delay is not found. Once the mount has accelerated, the sums of
// squares give the delay and its sigma, and from then on follow the delay. A delay that was
// believed is replaced only by one that explains two stretches of motion in a row. Measured units,
// rad; s. Fixed memory, no allocation. One thread. Derivation: docs/clocks.md.

#include <array>
#include <cstddef>
#include <type_traits>

#include "core/model/angle.h"
#include "core/realtime/telemetry/telemetry_buffer.h"

namespace alidade {

// The mount's angles as one image shows them.
struct ImageAngles {
  double time_s = 0;      // s, telemetry clock by the calibration's offset
  PanTilt<double> angle;  // rad, measured units, from any zero, not wrapped
  PanTilt<double> rate;   // rad/s
};

enum class LinkDelayState {
  kCalibrated,  // the calibration's offset is this connection's
  kOpen,        // another connection: nothing has shown its delay yet
  kFound        // motion has shown the delay
};

[[nodiscard]] inline const char* to_string(LinkDelayState state) {
  switch (state) {
    case LinkDelayState::kCalibrated:
      return "calibrated";
    case LinkDelayState::kOpen:
      return "open";
    case LinkDelayState::kFound:
      return "found";
  }
  return "open";
}

class LinkDelay {
 public:
  static constexpr double kRange_s = 0.5;       // earlier and later
  static constexpr double kOpenSigma_s = 0.15;  // of a uniform distribution from 0 to 0.5 s

  // angle_sigma: rad, of the white noise of a sample, > 0. connections_sigma_s: one standard
  // deviation of the difference between the delays of two connections.
  LinkDelay(double angle_sigma, double connections_sigma_s);

  // The calibration's clock offset was found through this connection.
  void begin_calibrated();
  // The connection is another one. sigma_s: of its delay, until motion shows it. Until then
  // delay_s() stays as it was.
  void open(double sigma_s = kOpenSigma_s);
  // The delay of this connection is known from before.
  void begin_found(double delay_s, double sigma_s);
  // Another calibration is used, whose clock offset is larger by by_s and was found through yet
  // another connection. What is known of this connection's delay stays.
  void change_calibration(double by_s);
  // The angles of the next image do not continue those before.
  void break_images();

  // error_variance: rad^2, (pan, tilt), of an error that samples at neighbouring angles share, such
  // as the rest of a gear's error. Ignored: values that are not finite; a sample that is not later
  // than the last one, or repeats its angles. An image that is not later than the last one, or
  // later by 0.3 s or more, begins a new motion.
  void add(const TelemetrySample& sample,
           const Vector2<double>& error_variance = Vector2<double>::Zero());
  void add(const ImageAngles& image);

  [[nodiscard]] LinkDelayState state() const { return state_; }
  // s, to be added to the calibration's clock offset, and its standard deviation.
  [[nodiscard]] double delay_s() const { return delay_s_; }
  [[nodiscard]] double sigma_s() const { return sigma_s_; }
  // Number of delays that motion has shown: 1 with the first, 1 more with each that replaced one.
  [[nodiscard]] int found() const { return found_; }

 private:
  static constexpr int kCandidates = 201;
  static constexpr int kCentre = kCandidates / 2;
  static constexpr double kStep_s = 2 * kRange_s / (kCandidates - 1);
  static constexpr std::size_t kImages = 256;
  static constexpr std::size_t kSamples = 256;

  // Sums over the residuals of one axis, at each candidate.
  struct Sums {
    std::array<double, kCandidates> squares{};  // about the mean of each stretch
    std::array<double, kCandidates> lagged{};   // products of neighbours, likewise
    std::array<double, kCandidates> degrees{};  // of freedom
    double square_rate = 0;                     // (rad/s)^2, sum over the samples
    double shared = 0;                          // rad^2, likewise: variance of the shared error
    double samples = 0;
    double stretches = 0;
  };
  // The stretch of motion that is being summed.
  struct Stretch {
    std::array<double, kCandidates> sum{};
    std::array<double, kCandidates> squares{};
    std::array<double, kCandidates> lagged{};
    std::array<double, kCandidates> begin{};   // residual of the first sample
    std::array<double, kCandidates> before{};  // and of the last
    std::array<int, kCandidates> count{};      // of the samples with an image at that time
    double reference = 0;                      // rad, near all residuals
    double square_rate = 0;
    double shared = 0;
    int samples = 0;
  };
  struct Sample {
    TelemetrySample reading;
    std::array<double, 2> error_variance{};
  };
  using BothAxes = std::array<Sums, 2>;
  struct Told {
    bool sure = false;
    double delay_s = 0;
    double sigma_s = 0;
    double improbable = 0;  // -log of the present delay's likelihood against this one's
  };
  template <class T, std::size_t kCapacity>
  class Ring {
   public:
    void push(const T& item) {
      items_[(first_ + size_) % kCapacity] = item;
      if (size_ < kCapacity) {
        ++size_;
      } else {
        first_ = (first_ + 1) % kCapacity;
      }
    }
    void pop() {
      first_ = (first_ + 1) % kCapacity;
      --size_;
    }
    void clear() { size_ = 0; }
    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] const T& operator[](std::size_t i) const {
      return items_[(first_ + i) % kCapacity];
    }

   private:
    std::array<T, kCapacity> items_{};
    std::size_t first_ = 0;
    std::size_t size_ = 0;
  };

  void forget();
  void compare(const Sample& sample, std::array<Stretch, 2>* stretch) const;
  void sum(const Sample& sample);
  void find_early();
  [[nodiscard]] bool moves() const;
  void close_stretch();
  static void add_stretch(const Stretch& stretch, Sums* sums);
  [[nodiscard]] BothAxes with(const std::array<Stretch, 2>& stretch) const;
  [[nodiscard]] Told judge(const BothAxes& sums) const;
  void take(const Told& told);

  double angle_sigma_;
  double connections_sigma_s_;
  LinkDelayState state_ = LinkDelayState::kCalibrated;
  double delay_s_ = 0;
  double sigma_s_ = 0;
  int found_ = 0;
  Ring<ImageAngles, kImages> images_;
  Ring<Sample, kSamples> samples_;
  TelemetrySample last_;  // of the samples
  bool has_last_ = false;
  std::array<Stretch, 2> stretch_;
  double stretch_since_s_ = 0;
  BothAxes sums_;          // of the stretches before, fading
  BothAxes last_against_;  // the stretch before, if it contradicts the present delay
  bool is_contradicted_ = false;
};

static_assert(std::is_trivially_copyable_v<LinkDelay>);

}  // namespace alidade
