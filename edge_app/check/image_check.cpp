#include "edge_app/check/image_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace alidade {
namespace {

constexpr double kFullScale = 255;  // grey levels

double median_of(const std::vector<double>& values) {
  const std::optional<Spread> spread = spread_of(values);
  return spread ? spread->median : 0;
}

// An image with 98 % of its pixels within so few grey levels shows nothing: corners need contrasts
// of 10 (LandmarkMakerOptions::corner_threshold).
constexpr double kNothing = 10;

void judge(ImageReport* report, const ImageNeeds& needs) {
  // With fewer than 10 landmarks OE mode takes a view as new (LookOptions::few), with fewer than 50
  // as empty (LandmarkMakerOptions::empty_view).
  constexpr double kTooFewPoints = 10;
  constexpr double kFewPoints = 50;
  // Saturated parts show no corners. If a third of the image is lost, another exposure is worth it.
  constexpr double kMuchSaturated = 1.0 / 3;
  const Severity severity = needs.landmarks ? Severity::kProblem : Severity::kAdvice;
  const auto add = [&](Severity as, const std::string& text) {
    report->findings.push_back({as, "video " + needs.source + ": " + text});
  };
  const ImageLight& light = report->light;
  if (light.dark > 0.99) {
    add(severity, "the picture is black; take off the cap, open the iris, give light");
  } else if (light.saturated > 0.9) {
    add(severity, "the picture is white all over; shorten the exposure or close the iris");
  } else if (light.range < kNothing) {
    add(severity,
        fmt::format(
            "the picture is one even grey ({:.0f} of 255); focus the camera, and point it at "
            "something",
            light.mean));
  } else if (report->points->median < kTooFewPoints) {
    add(severity,
        fmt::format("too little texture for landmarks: {:.0f} points to follow, {:.0f} are "
                    "needed; focus the camera, or point it at something with detail",
                    report->points->median, kTooFewPoints));
  } else if (report->points->median < kFewPoints) {
    add(Severity::kAdvice,
        fmt::format("little texture: {:.0f} points to follow; {:.0f} or more make OE mode reliable",
                    report->points->median, kFewPoints));
  } else if (light.saturated > kMuchSaturated) {
    add(Severity::kAdvice,
        fmt::format("{:.0f} % of the picture is saturated; a shorter exposure would "
                    "show more landmarks and blur less",
                    100 * light.saturated));
  }
}

}  // namespace

ImageLight measure_light(const ImageView& image) {
  constexpr int kStep = 8;
  constexpr int kDark = 16;
  constexpr int kLeastTop = 230;
  std::array<std::size_t, 256> histogram{};
  std::size_t count = 0;
  for (int v = 0; v < image.height; v += kStep) {
    const std::uint8_t* row = image.row(v);
    for (int u = 0; u < image.width; u += kStep) ++histogram[row[u]];
    count += static_cast<std::size_t>((image.width + kStep - 1) / kStep);
  }
  ImageLight light;
  const auto all = static_cast<double>(count);
  double below = 0;
  double darkest = -1;
  double brightest = 0;
  std::size_t top = 0;
  for (std::size_t level = 0; level < histogram.size(); ++level) {
    const auto pixels = static_cast<double>(histogram[level]);
    if (pixels == 0) continue;
    light.mean += pixels / all * static_cast<double>(level);
    if (level <= kDark) light.dark += pixels / all;
    if (darkest < 0 && below + pixels > 0.01 * all) darkest = static_cast<double>(level);
    if (below < 0.99 * all) brightest = static_cast<double>(level);
    below += pixels;
    top = level;
  }
  light.range = brightest - darkest;
  if (top >= kLeastTop) {
    light.saturated = static_cast<double>(histogram[top] + histogram[top - 1]) / all;
  }
  return light;
}

void ImageCheck::add(std::int64_t frame, const ImageView& image, bool connected) {
  if (!image.valid()) {
    ++without_;
    return;
  }
  lights_.push_back(measure_light(image));
  if (!tracker_ || image.width != width_ || image.height != height_) {
    width_ = image.width;
    height_ = image.height;
    StartUpOptions options;
    options.width = width_;
    options.height = height_;
    tracker_ = std::make_unique<StartUpTracker>(options);
    before_.reset();
  }
  const StartUpStatus status = tracker_->process(image);
  if (status == StartUpStatus::kBadImage) return;
  points_.push_back(tracker_->observation_count());
  noise_.push_back(tracker_->statistics().noise);
  // The next image is compared with the same frame again.
  if (status == StartUpStatus::kLost) return;
  if (status == StartUpStatus::kOk && connected && before_) {
    shifts_.push_back({*before_, frame, tracker_->statistics().shift});
  }
  before_ = frame;
}

ImageReport ImageCheck::report(const ImageNeeds& needs) const {
  ImageReport report;
  report.images = lights_.size();
  report.without = without_;
  report.shifts = shifts_;
  const auto median_light = [&](double ImageLight::*member) {
    std::vector<double> values;
    for (const ImageLight& light : lights_) values.push_back(light.*member);
    return median_of(values);
  };
  report.light = {median_light(&ImageLight::mean), median_light(&ImageLight::range),
                  median_light(&ImageLight::dark), median_light(&ImageLight::saturated)};
  report.points = spread_of(points_);
  report.noise = median_of(noise_);
  if (report.images == 0 && report.without > 0) {
    add_advice(&report.findings,
               "video " + needs.source +
                   ": no picture could be used, so neither calibration nor OE mode is possible");
  } else if (report.points) {
    judge(&report, needs);
  }
  return report;
}

ReportLines describe(const ImageReport& report) {
  if (report.images == 0) return {};
  return {
      {"picture",
       fmt::format("brightness {:.0f} %, {:.1f} % dark, {:.1f} % saturated, noise {:.1f} of 255; "
                   "{:.0f} points to follow",
                   100 * report.light.mean / kFullScale, 100 * report.light.dark,
                   100 * report.light.saturated, report.noise,
                   report.points ? report.points->median : 0)}};
}

}  // namespace alidade
