#include "core/detection/person_detector.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>

#include "core/tracking/target_scale.h"

namespace alidade {
namespace {

// The SVM's window, and the person within it.
constexpr int kWindowWidth_px = 64;
constexpr int kWindowHeight_px = 128;
constexpr double kPersonHeight_px = 96;
constexpr double kPersonWidth_px = 40;
constexpr double kPersonTop_px = 16;
constexpr int kStride_px = 8;
constexpr double kScaleStep = 1.05;
constexpr double kRowStep_px = 4;
constexpr int kMostHits = 4096;

DetectionBox person_box(double left, double top, double scale, double score) {
  DetectionBox box;
  box.u = left + (kWindowWidth_px - kPersonWidth_px) / 2 / scale;
  box.v = top + kPersonTop_px / scale;
  box.width = kPersonWidth_px / scale;
  box.height = kPersonHeight_px / scale;
  box.score = score;
  return box;
}

}  // namespace

struct PersonDetector::Hog {
  cv::HOGDescriptor descriptor;
  cv::Mat scaled;
  std::vector<cv::Point> places;
  std::vector<double> weights;

  Hog() { descriptor.setSVMDetector(cv::HOGDescriptor::getDefaultPeopleDetector()); }

  // Searches rows [top, bottom) of the image, scaled.
  void look(const ImageView& image, int top, int bottom, double scale, double threshold,
            std::vector<DetectionBox>* boxes) {
    const cv::Mat part(bottom - top, image.width, CV_8U, const_cast<std::uint8_t*>(image.row(top)),
                       static_cast<std::size_t>(image.stride));
    const cv::Size size(cvRound(image.width * scale), cvRound((bottom - top) * scale));
    if (size.width < kWindowWidth_px || size.height < kWindowHeight_px) return;
    cv::resize(part, scaled, size, 0, 0, scale < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
    // Windows may reach beyond the edges by the empty space around a person.
    descriptor.detect(scaled, places, weights, threshold, {kStride_px, kStride_px}, {16, 16});
    const double scale_u = static_cast<double>(size.width) / image.width;
    for (std::size_t i = 0; i < places.size() && boxes->size() < kMostHits; ++i) {
      boxes->push_back(
          person_box(places[i].x / scale_u, top + places[i].y / scale, scale, weights[i]));
    }
  }
};

const char* to_string(PersonStatus status) {
  switch (status) {
    case PersonStatus::kOk:
      return "ok";
    case PersonStatus::kNoImage:
      return "no picture, or a picture that is not of the calibration's size";
    case PersonStatus::kNoOrientation:
      return "no orientation";
    case PersonStatus::kNowhere:
      return "no part of the picture shows people at a size that can be found";
  }
  return "unknown status";
}

bool PersonOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (most_boxes < 1) problem = "most_boxes must be at least 1";
  if (!(most_overlap >= 0 && most_overlap <= 1)) problem = "most_overlap must be 0 to 1";
  if (!std::isfinite(threshold)) problem = "threshold must be finite";
  if (!(least_height_px >= 24 && most_height_px >= least_height_px)) {
    problem = "least_height_px must be at least 24, and most_height_px not below it";
  }
  if (!(height_step > 1 && height_step <= 2)) problem = "height_step must be above 1 and at most 2";
  if (!(height_tolerance > 0 && height_tolerance <= 1)) {
    problem = "height_tolerance must be above 0 and at most 1";
  }
  if (!(height_m > 0 && height_m < 100)) problem = "height_m must be above 0 and below 100";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

PersonDetector::PersonDetector(const PersonOptions& options)
    : options_(options), hog_(std::make_unique<Hog>()) {}

PersonDetector::~PersonDetector() = default;

// Bands from the bottom upwards, along the picture's middle column.
void PersonDetector::find_bands(const FrameOrientation& frame, const WorldPlane& plane, int width,
                                int height) {
  bands_.clear();
  for (double row = height; row > 0; row -= kRowStep_px) {
    UprightTarget target;
    if (upright_target(plane, frame, {0.5 * width, row - 0.5 * kRowStep_px}, options_.height_m,
                       &target) != PlaneStatus::kOk ||
        target.height_px < options_.least_height_px || target.height_px > options_.most_height_px) {
      continue;
    }
    const double top = row - kRowStep_px;
    // Heights decrease upwards. A band has the height of its lower edge until it is complete.
    if (!bands_.empty() && bands_.back().top == row &&
        bands_.back().height_px <= options_.height_step * target.height_px &&
        target.height_px <= options_.height_step * bands_.back().height_px) {
      bands_.back().top = top;
    } else {
      bands_.push_back({top, row, target.height_px});
    }
  }
}

void PersonDetector::look_at(const ImageView& image, const Band& band) {
  // The middle of the heights in the band, from height_px down to that over height_step.
  const double height = band.height_px / std::sqrt(options_.height_step);
  const double scale = kPersonHeight_px / height;
  const double above = 1.2 * band.height_px + kStride_px / scale;
  const double below = (kWindowHeight_px - kPersonTop_px - kPersonHeight_px + kStride_px) / scale;
  const int top = std::max(0, static_cast<int>(band.top - above));
  const int bottom = std::min(image.height, static_cast<int>(std::ceil(band.bottom + below)));
  if (bottom > top) hog_->look(image, top, bottom, scale, options_.threshold, &boxes_);
}

void PersonDetector::drop_overlapped() {
  std::stable_sort(boxes_.begin(), boxes_.end(),
                   [](const DetectionBox& a, const DetectionBox& b) { return a.score > b.score; });
  std::size_t kept = 0;
  const auto most = static_cast<std::size_t>(options_.most_boxes);
  for (std::size_t i = 0; i < boxes_.size() && kept < most; ++i) {
    const bool overlapped =
        std::any_of(boxes_.begin(), boxes_.begin() + static_cast<std::ptrdiff_t>(kept),
                    [&](const DetectionBox& surer) {
                      return overlap(surer, boxes_[i]) > options_.most_overlap;
                    });
    if (!overlapped) boxes_[kept++] = boxes_[i];
  }
  boxes_.resize(kept);
}

PersonStatus PersonDetector::find(const ImageView& image, const FrameOrientation& frame,
                                  const WorldPlane& plane) {
  boxes_.clear();
  const Camera<double>& camera = frame.calibration.camera;
  if (!image.valid() || image.stride < 0 || camera.width != image.width ||
      camera.height != image.height) {
    return PersonStatus::kNoImage;
  }
  if (frame.mode == OrientationMode::kNone) return PersonStatus::kNoOrientation;
  find_bands(frame, plane, image.width, image.height);
  if (bands_.empty()) return PersonStatus::kNowhere;
  for (const Band& band : bands_) {
    const std::size_t first = boxes_.size();
    look_at(image, band);
    // People of other bands are found there.
    const auto wrong = [&](const DetectionBox& box) {
      const double foot = box.v + box.height;
      const double slack = kStride_px / kPersonHeight_px * box.height;
      if (foot < band.top - slack || foot > band.bottom + slack) return true;
      UprightTarget target;
      const Vector2<double> foot_u(box.u + 0.5 * box.width, foot);
      return upright_target(plane, frame, foot_u, options_.height_m, &target) != PlaneStatus::kOk ||
             std::abs(std::log(box.height / target.height_px)) > options_.height_tolerance;
    };
    boxes_.erase(
        std::remove_if(boxes_.begin() + static_cast<std::ptrdiff_t>(first), boxes_.end(), wrong),
        boxes_.end());
  }
  drop_overlapped();
  return PersonStatus::kOk;
}

PersonStatus PersonDetector::find_at_all_scales(const ImageView& image) {
  boxes_.clear();
  if (!image.valid() || image.stride < 0) return PersonStatus::kNoImage;
  double height = options_.least_height_px;
  while (height <= options_.most_height_px) {
    hog_->look(image, 0, image.height, kPersonHeight_px / height, options_.threshold, &boxes_);
    height *= kScaleStep;
  }
  drop_overlapped();
  return PersonStatus::kOk;
}

}  // namespace alidade
