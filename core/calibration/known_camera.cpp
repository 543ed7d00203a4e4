#include "core/calibration/known_camera.h"

#include <cmath>
#include <utility>

#include "core/calibration/calibration_difference.h"
#include "core/calibration/number_text.h"

namespace alidade {
namespace {

constexpr double kMostSigmas = 5;
// Relative difference of focal lengths that means another zoom, not a flaw of either calibration.
constexpr double kAnotherZoom = 0.03;

struct Difference {
  double relative = 0;
  double sigmas = 0;
  std::string text;  // "A +- B is known, the recording alone gives C +- D"
};

Difference difference_of(const CalibrationPrior& known, double alone, double sigma_alone,
                         double unit, const char* unit_name) {
  const auto estimate = [&](double value, double sigma_of) {
    return estimate_text(value / unit, sigma_of / unit, unit_name);
  };
  Difference difference;
  const double sigma = std::hypot(known.sigma, sigma_alone);
  const double error = std::abs(alone - known.value);
  difference.relative = error / std::abs(known.value);
  difference.sigmas = error == 0 ? 0 : error / sigma;
  difference.text = estimate(known.value, known.sigma) + " is known, the recording alone gives " +
                    estimate(alone, sigma_alone) + ", " +
                    short_text(std::round(difference.sigmas)) + " sigmas apart";
  return difference;
}

class KnownCameraTrial {
 public:
  KnownCameraTrial(const CalibrationInput& input, const CalibrationOptions& options,
                   const KnownCamera& known)
      : input_(input), stated_(options), known_(known) {}

  KnownCameraCalibration run() {
    CalibrationOptions alone = stated_;
    if (known_.aspect.wanted) alone.aspect.reset();
    CalibrationResult result = calibrate_part(alone, 0, 0.5);
    done_.options = stated_;
    if (result.status == CalibrationStatus::kCancelled ||
        result.status == CalibrationStatus::kBadInput) {
      done_.result = std::move(result);
      return std::move(done_);
    }
    if (is_solved(result)) {
      take_what_agrees(result.calibration);
    } else {
      take_on_trust();
    }
    done_.result = calibrate_part(done_.options, 0.5, 1);
    return std::move(done_);
  }

 private:
  [[nodiscard]] static bool is_solved(const CalibrationResult& result) {
    // Weak, too, is what has no covariance: then the calibration is not filled in.
    return result.ok() ||
           (result.status == CalibrationStatus::kWeak && result.quality.observations > 0);
  }

  CalibrationResult calibrate_part(CalibrationOptions options, double begin, double end) const {
    if (stated_.progress) {
      options.progress = [this, begin, end](double done, const char* what) {
        return stated_.progress(begin + (end - begin) * done, what);
      };
    }
    return calibrate(input_, options);
  }

  void say(const std::string& line) { done_.remarks.push_back(known_.name + ": " + line); }

  void take_what_agrees(const Calibration& alone) {
    const auto sigma = [&](Parameter p) { return parameter_sigma(alone, p); };
    CalibrationOptions& options = done_.options;
    if (known_.line_delay.wanted) {
      const Difference d = difference_of(known_.line_delay.prior, alone.line_delay,
                                         sigma(Parameter::kLineDelay), 1e-6, "us/row");
      if (d.sigmas <= kMostSigmas) {
        options.line_delay = known_.line_delay.prior;
      } else {
        const bool turned =
            difference_of({-known_.line_delay.prior.value, known_.line_delay.prior.sigma},
                          alone.line_delay, sigma(Parameter::kLineDelay), 1, "")
                .sigmas <= kMostSigmas;
        say("line delay contradicts the recording and is left out: " + d.text +
            (turned ? "; is the camera mounted the other way up, with its picture turned?"
                    : "; is it of this camera, in this video mode?"));
      }
    }
    if (known_.aspect.wanted) {
      const Difference d =
          difference_of(known_.aspect.prior, alone.camera.aspect, sigma(Parameter::kAspect), 1, "");
      if (d.sigmas <= kMostSigmas) {
        options.aspect = known_.aspect.prior;
      } else {
        say("aspect contradicts the recording and is left out: " + d.text +
            "; is it of this camera, in this video mode?");
      }
    }
    take_lens(alone);
  }

  // Focal length and distortion, if this is the zoom at which they were found.
  void take_lens(const Calibration& alone) {
    if (!known_.focal_length.wanted && !known_.radial_distortion.wanted) return;
    CalibrationOptions& options = done_.options;
    const Difference f = difference_of(known_.focal_length.prior, alone.camera.focal_length,
                                       parameter_sigma(alone, Parameter::kFocalLength), 1, "px");
    if (f.sigmas > kMostSigmas) {
      say(f.relative > kAnotherZoom
              ? "focal length and distortion were found at another zoom and are not used: " + f.text
              : "focal length contradicts the recording and is left out, with the distortion: " +
                    f.text + "; is the lens focused as it was then, and at the same zoom?");
      return;
    }
    if (known_.focal_length.wanted) options.focal_length = known_.focal_length.prior;
    if (!known_.radial_distortion.wanted) return;
    const Difference k =
        difference_of(known_.radial_distortion.prior, alone.camera.distortion.only_term(),
                      parameter_sigma(alone, Parameter::kRadialDistortion), 1, "");
    if (k.sigmas <= kMostSigmas) {
      options.radial_distortion = known_.radial_distortion.prior;
    } else {
      say("radial distortion contradicts the recording and is left out: " + k.text +
          "; is it of this camera and lens?");
    }
  }

  void take_on_trust() {
    if (known_.line_delay.wanted) done_.options.line_delay = known_.line_delay.prior;
    if (known_.aspect.wanted) done_.options.aspect = known_.aspect.prior;
    if (known_.line_delay.wanted || known_.aspect.wanted) {
      say("the recording alone gives no calibration to compare with, so line delay and aspect are "
          "used unchecked, and focal length and distortion are not used");
    }
  }

  const CalibrationInput& input_;
  const CalibrationOptions& stated_;
  const KnownCamera& known_;
  KnownCameraCalibration done_;
};

}  // namespace

KnownCameraCalibration calibrate_knowing(const CalibrationInput& input,
                                         const CalibrationOptions& options,
                                         const KnownCamera& known) {
  if (known.empty()) return {calibrate(input, options), options, {}};
  return KnownCameraTrial(input, options, known).run();
}

}  // namespace alidade
