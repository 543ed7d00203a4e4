#pragma once
// The homography of two pictures by their matched features, by OpenCV: what baselines and checks are made of.
// OpenCV's random numbers begin anew with each call, so that each gives the same.

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade::test {

// Features of one picture: a place and a row of descriptors each.
struct PlacedFeatures {
  std::vector<cv::Point2f> points;  // px
  cv::Mat descriptors;
};

struct MatchedHomography {
  Matrix3<double> H;                      // of pixels of `from` to those of `to`
  std::vector<Vector2<double>> agreeing;  // of `from`, px
};
// By RANSAC with this threshold on the nearest neighbours that are nearer than 0.75 of the next. Nothing where fewer than
// 25 features are there, match or agree.
[[nodiscard]] std::optional<MatchedHomography> match_homography(const PlacedFeatures& from,
                                                                const PlacedFeatures& to,
                                                                double agrees_px);

[[nodiscard]] Matrix3<double> as_matrix(const cv::Mat& homography);

}  // namespace alidade::test
