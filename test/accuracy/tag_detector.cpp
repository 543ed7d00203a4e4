#include "test/accuracy/tag_detector.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace alidade::test {
namespace {

constexpr double kEnlarged = 4;
constexpr float kCoarse = 3;  // the whole image is searched at a third of its size: tags of 40 px
// Round the corners: white that the library needs, and room for what enlarging does at a border.
constexpr double kMargin = 12;  // px

}  // namespace

struct TagDetector::Library {
  explicit Library(int number)
      : tag(number), family(tag36h11_create()), detector(apriltag_detector_create()) {
    apriltag_detector_add_family(detector, family);
  }
  ~Library() {
    apriltag_detector_destroy(detector);
    tag36h11_destroy(family);
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  std::optional<TagCorners> find(const cv::Mat& image, float decimate) const {
    detector->quad_decimate = decimate;
    image_u8_t view{image.cols, image.rows, static_cast<int>(image.step), image.data};
    zarray_t* found = apriltag_detector_detect(detector, &view);
    std::optional<TagCorners> corners;
    for (int i = 0; i < zarray_size(found); ++i) {
      apriltag_detection_t* detection = nullptr;
      zarray_get(found, i, &detection);
      if (detection->id != tag || detection->hamming != 0) continue;
      corners.emplace();
      for (std::size_t n = 0; n < 4; ++n) {
        corners->at(n) = {detection->p[n][0], detection->p[n][1]};
      }
    }
    apriltag_detections_destroy(found);
    return corners;
  }

  int tag;
  apriltag_family_t* family;
  apriltag_detector_t* detector;
};

TagDetector::TagDetector(int tag) : library_(std::make_unique<Library>(tag)) {}

TagDetector::~TagDetector() = default;

std::optional<TagCorners> TagDetector::find(const ImageView& image) {
  // The library's type has no const; it does not write into the image.
  const cv::Mat whole(image.height, image.width, CV_8U,
                      const_cast<std::uint8_t*>(image.luma),  // NOLINT
                      static_cast<std::size_t>(image.stride));
  const std::optional<TagCorners> roughly = library_->find(whole, kCoarse);
  if (!roughly) return std::nullopt;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : *roughly) box.extend(corner);
  const double margin = kMargin + 0.25 * box.sizes().maxCoeff();
  const cv::Point first(static_cast<int>(std::floor(box.min().x() - margin)),
                        static_cast<int>(std::floor(box.min().y() - margin)));
  const cv::Point last(static_cast<int>(std::ceil(box.max().x() + margin)),
                       static_cast<int>(std::ceil(box.max().y() + margin)));
  const cv::Rect window(first, last);
  if ((window & cv::Rect(0, 0, whole.cols, whole.rows)) != window) return std::nullopt;
  cv::Mat enlarged;
  cv::resize(whole(window), enlarged, {}, kEnlarged, kEnlarged, cv::INTER_CUBIC);
  std::optional<TagCorners> corners = library_->find(enlarged, 1);
  if (!corners) return std::nullopt;
  for (Eigen::Vector2d& corner : *corners) {
    corner = corner / kEnlarged + Eigen::Vector2d(first.x, first.y);
  }
  return corners;
}

}  // namespace alidade::test
