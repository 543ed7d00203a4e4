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

std::vector<NearFeatures> FeatureIndex::nearest(const std::vector<Descriptor>& queries,
                                                int checks) const {
  std::vector<NearFeatures> out(queries.size());
  if (state_->trees == nullptr || queries.empty()) return out;
  const int count = std::min(kNearFeatures, state_->rows.rows);
  const cv::Mat rows = descriptor_rows(queries);
  cv::Mat found(rows.rows, count, CV_32S);
  cv::Mat squares(rows.rows, count, CV_32F);
  cvflann::seed_random(kTreeSeed);
  state_->trees->knnSearch(rows, found, squares, count, cvflann::SearchParams(checks));
  for (int i = 0; i < rows.rows; ++i) {
    for (int k = 0; k < count; ++k) {
      if (found.at<int>(i, k) < 0) break;
      out[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] = {found.at<int>(i, k),
                                                                       squares.at<float>(i, k)};
    }
  }
  return out;
}

std::vector<FeatureMatch> FeatureIndex::match(const std::vector<Descriptor>& queries,
                                              const MatchOptions& options) const {
  return believed_matches(nearest(queries, options.checks), options.ratio);
}

std::vector<NearFeatures> nearest_features(const std::vector<Descriptor>& queries,
                                           const std::vector<Descriptor>& indexed) {
  std::vector<NearFeatures> out(queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    NearFeatures& near = out[i];
    const std::uint8_t* a = queries[i].data();
    int furthest = std::numeric_limits<int>::max();  // of those kept
    for (std::size_t j = 0; j < indexed.size(); ++j) {
      const std::uint8_t* b = indexed[j].data();
      int square = 0;
      for (int n = 0; n < kDescriptorSize; ++n) {
        const int off = a[n] - b[n];
        square += off * off;
      }
      if (square >= furthest) continue;
      std::size_t at = kNearFeatures - 1;
      for (; at > 0 && near[at - 1].square > static_cast<float>(square); --at) {
        near[at] = near[at - 1];
      }
      near[at] = {static_cast<int>(j), static_cast<float>(square)};
      if (near.back().indexed >= 0) furthest = static_cast<int>(near.back().square);
    }
  }
  return out;
}

std::vector<FeatureMatch> believed_matches(const std::vector<NearFeatures>& near, double ratio,
                                           const std::function<bool(int, int)>& is_same) {
  std::vector<FeatureMatch> all;
  std::vector<float> squares;
  int last = -1;
  for (std::size_t i = 0; i < near.size(); ++i) {
    const NearFeature& first = near[i].front();
    if (first.indexed < 0) continue;
    std::size_t second = 1;
    while (second < near[i].size() && near[i][second].indexed >= 0 && is_same &&
           is_same(first.indexed, near[i][second].indexed)) {
      ++second;
    }
    // If all show one thing, the last of them bounds the distance to anything else.
    if (second == near[i].size()) --second;
    if (near[i][second].indexed < 0 || !(near[i][second].square > 0)) continue;
    const double found = std::sqrt(static_cast<double>(first.square) / near[i][second].square);
    if (!(found < ratio)) continue;
    all.push_back({static_cast<int>(i), first.indexed, found});
    squares.push_back(first.square);
    last = std::max(last, first.indexed);
  }
  // If several match the same one, the nearest keeps it, the first of equals.
  std::vector<int> keeps(static_cast<std::size_t>(last + 1), -1);
  for (std::size_t i = 0; i < all.size(); ++i) {
    int& kept = keeps[static_cast<std::size_t>(all[i].indexed)];
    if (kept < 0 || squares[i] < squares[static_cast<std::size_t>(kept)]) {
      kept = static_cast<int>(i);
    }
  }
  std::vector<FeatureMatch> out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (keeps[static_cast<std::size_t>(all[i].indexed)] == static_cast<int>(i)) {
      out.push_back(all[i]);
    }
  }
  return out;
}

}  // namespace alidade
