#include "core/mapping/feature_matching.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/flann.hpp>
#include <utility>

namespace alidade {
namespace {

using DescriptorTrees = cv::flann::GenericIndex<cvflann::L2<std::uint8_t>>;

constexpr int kTrees = 4;
constexpr unsigned kTreeSeed = 1;

cv::Mat descriptor_rows(const std::vector<Descriptor>& descriptors) {
  cv::Mat rows(static_cast<int>(descriptors.size()), kDescriptorSize, CV_8U);
  for (int i = 0; i < rows.rows; ++i) {
    const Descriptor& d = descriptors[static_cast<std::size_t>(i)];
    std::copy(d.begin(), d.end(), rows.ptr(i));
  }
  return rows;
}

}  // namespace

struct FeatureIndex::State {
  cv::Mat rows;  // the trees point into it
  std::unique_ptr<DescriptorTrees> trees;
};

FeatureIndex::FeatureIndex(const std::vector<Descriptor>& descriptors) : state_(new State) {
  state_->rows = descriptor_rows(descriptors);
  if (state_->rows.rows < 2) return;
  cvflann::seed_random(kTreeSeed);
  state_->trees = std::make_unique<DescriptorTrees>(
      state_->rows, cvflann::KDTreeIndexParams(kTrees), cvflann::L2<std::uint8_t>());
}

FeatureIndex::~FeatureIndex() = default;
FeatureIndex::FeatureIndex(FeatureIndex&&) noexcept = default;
FeatureIndex& FeatureIndex::operator=(FeatureIndex&&) noexcept = default;

std::size_t FeatureIndex::size() const { return static_cast<std::size_t>(state_->rows.rows); }

std::vector<FeatureMatch> FeatureIndex::match(const std::vector<Descriptor>& queries,
                                              const MatchOptions& options) const {
  std::vector<FeatureMatch> out;
  if (state_->trees == nullptr || queries.empty()) return out;
  const cv::Mat rows = descriptor_rows(queries);
  cv::Mat nearest(rows.rows, 2, CV_32S);
  cv::Mat squares(rows.rows, 2, CV_32F);
  cvflann::seed_random(kTreeSeed);
  state_->trees->knnSearch(rows, nearest, squares, 2, cvflann::SearchParams(options.checks));

  std::vector<int> claimed_by(size(), -1);  // of out
  std::vector<float> claim(size(), 0);
  std::vector<bool> keeps;
  for (int i = 0; i < rows.rows; ++i) {
    const float first = squares.at<float>(i, 0);
    const float second = squares.at<float>(i, 1);
    const int found = nearest.at<int>(i, 0);
    if (found < 0 || nearest.at<int>(i, 1) < 0 || !(second > 0)) continue;
    const double ratio = std::sqrt(static_cast<double>(first) / second);
    if (!(ratio < options.ratio)) continue;
    const auto at = static_cast<std::size_t>(found);
    if (claimed_by[at] >= 0) {
      if (claim[at] <= first) continue;
      keeps[static_cast<std::size_t>(claimed_by[at])] = false;
    }
    claimed_by[at] = static_cast<int>(out.size());
    claim[at] = first;
    out.push_back({i, found, ratio});
    keeps.push_back(true);
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (keeps[i]) out[kept++] = out[i];
  }
  out.resize(kept);
  return out;
}

}  // namespace alidade
