#pragma once
// EnduranceConsumer: what `alidade run` does with the events of its links, on one thread and in their order,
// so that a virtual day takes as long as its images take to render: the real-time stage's step and, if
// wanted, the calibration thread's work beside it.
//
// An adjustment takes kAdjustingTime of the day, whatever it takes here: what it is made of is what had come
// when it began, what comes meanwhile waits, and its outcome is taken over when it is over.

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "edge_app/self_calibration/self_calibration.h"
#include "edge_app/step/orientation_step.h"

namespace alidade::test {

// The calibrations of a camera, kept as long as this lives.
class MemoryArchive : public CalibrationArchive {
 public:
  explicit MemoryArchive(double zoom_tolerance) : zoom_tolerance_(zoom_tolerance) {}
  [[nodiscard]] const StoredCalibration* find(std::optional<double> zoom) const override;
  [[nodiscard]] const ZoomCurve& zoom_curve() const override { return no_curve_; }
  [[nodiscard]] bool save(const StoredCalibration& calibration, std::string* error) override;
  [[nodiscard]] bool has_pending() const override { return false; }
  [[nodiscard]] bool save_pending(std::string*) override { return true; }
  [[nodiscard]] std::string set_zooms_aside() override {
    kept_.clear();
    return "";
  }

 private:
  double zoom_tolerance_;
  std::vector<std::unique_ptr<StoredCalibration>> kept_;
  ZoomCurve no_curve_;
};

struct Answer {
  OrientationRecord record;
  Calibration calibration;  // by which it was made
};

class EnduranceConsumer {
 public:
  static constexpr double kAdjustingTime = 1.5;  // s

  // Begins with step.calibration. calibrating: none leaves it as it is.
  EnduranceConsumer(const OrientationStepOptions& step,
                    const std::optional<SelfCalibrationOptions>& calibrating);

  void add(const PanTiltSample& sample);
  [[nodiscard]] Answer add(const FrameStamp& stamp, const ImageView& image);
  void telemetry_lost();
  void video_lost(double now_s);

  // Of the calibration thread, whether or not it is adjusting.
  [[nodiscard]] CalibrationReport report() const { return said_; }
  // How often a calibration was taken over that says calibrated.
  [[nodiscard]] int published() const { return published_; }
  // The one in force.
  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  // Of the log, since the last call.
  [[nodiscard]] std::vector<std::string> take_messages();

 private:
  struct FeedFrame {
    FrameTracks tracks;
    std::vector<std::uint8_t> image;  // empty: none was wanted
  };
  enum class Loss { kVideo, kTelemetry };
  using Feed = std::variant<PanTiltSample, FeedFrame, Loss>;

  void calibrate(double now_s);
  void adopt(const PublishedCalibration& outcome);
  void feed(const Feed& feed);

  Calibration calibration_;
  OrientationStep step_;
  std::unique_ptr<MemoryArchive> archive_;
  std::unique_ptr<SelfCalibration> calibrating_;
  int width_, height_;
  std::deque<Feed> waiting_;  // for the calibration
  double busy_until_s_ = 0;
  std::shared_ptr<const PublishedCalibration> outcome_;  // of the adjustment under way
  bool image_wanted_ = false;
  CalibrationReport report_;  // as the records tell it
  CalibrationReport said_;
  int published_ = 0;
  std::vector<std::string> messages_;
};

}  // namespace alidade::test
