#include "test/accuracy/matched_homography.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

namespace alidade::test {

Matrix3<double> as_matrix(const cv::Mat& homography) {
  Matrix3<double> out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out(i, j) = homography.at<double>(i, j);
  }
  return out;
}

std::optional<MatchedHomography> match_homography(const PlacedFeatures& from,
                                                  const PlacedFeatures& to, double agrees_px) {
  constexpr int kFewest = 25;
  if (from.points.size() < kFewest || to.points.size() < kFewest) return std::nullopt;
  std::vector<std::vector<cv::DMatch>> matches;
  cv::BFMatcher().knnMatch(from.descriptors, to.descriptors, matches, 2);
  std::vector<cv::Point2f> a;
  std::vector<cv::Point2f> b;
  for (const auto& pair : matches) {
    if (pair.size() < 2 || pair[0].distance > 0.75F * pair[1].distance) continue;
    a.push_back(from.points[static_cast<std::size_t>(pair[0].queryIdx)]);
    b.push_back(to.points[static_cast<std::size_t>(pair[0].trainIdx)]);
  }
  if (a.size() < kFewest) return std::nullopt;
  cv::setRNGSeed(1);
  cv::Mat inliers;
  const cv::Mat found = cv::findHomography(a, b, cv::RANSAC, agrees_px, inliers);
  if (found.empty() || cv::countNonZero(inliers) < kFewest) return std::nullopt;
  MatchedHomography out{as_matrix(found), {}};
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (inliers.at<std::uint8_t>(static_cast<int>(i)) != 0)
      out.agreeing.emplace_back(a[i].x, a[i].y);
  }
  return out;
}

}  // namespace alidade::test
