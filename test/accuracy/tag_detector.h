#pragma once
// Finds one AprilTag in an image: the four corners of its black square, to a few hundredths of a pixel.
//
// The library rounds to whole pixels where it samples along an edge, which alone makes errors of 0.05 px.
// So the tag is looked for in the whole image first, and then once more in its surroundings,
// enlarged (april_tag_test.cpp measures what remains: 0.006 px without noise).
// Its edges are taken as straight lines, in order round the square. Pixels as in CONVENTIONS.md. Allocates.

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>

#include "core/realtime/image/image_view.h"

namespace alidade::test {

using TagCorners = std::array<Eigen::Vector2d, 4>;

class TagDetector {
 public:
  explicit TagDetector(int tag);  // number in the family 36h11
  ~TagDetector();
  TagDetector(const TagDetector&) = delete;
  TagDetector& operator=(const TagDetector&) = delete;

  // Empty: not in the image, or too near to its border.
  [[nodiscard]] std::optional<TagCorners> find(const ImageView& image);

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace alidade::test
