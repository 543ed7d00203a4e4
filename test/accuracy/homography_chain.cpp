#include "test/accuracy/homography_chain.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "test/accuracy/matched_homography.h"

namespace alidade::test {
namespace {

constexpr int kLeastCommon = 12;

// Where one picture sees its landmarks.
using Sights = std::map<int, Eigen::Vector2d>;

struct Step {
  int from = -1, to = -1;
  int common = 0;
};

int common_of(const Sights& a, const Sights& b) {
  int out = 0;
  for (const auto& [landmark, u] : a) out += b.count(landmark) > 0 ? 1 : 0;
  return out;
}

// u_a ~ H u_b, px.
std::optional<Eigen::Matrix3d> homography(const Sights& a, const Sights& b) {
  std::vector<cv::Point2d> of_a, of_b;
  for (const auto& [landmark, u] : a) {
    const auto other = b.find(landmark);
    if (other == b.end()) continue;
    of_a.emplace_back(u.x(), u.y());
    of_b.emplace_back(other->second.x(), other->second.y());
  }
  const cv::Mat H = cv::findHomography(of_b, of_a, cv::RANSAC, 3);
  if (H.empty()) return std::nullopt;
  return as_matrix(H);
}

// False: no camera has such a homography.
bool follow(const AdjustedPicture& a, const Eigen::Matrix3d& H, AdjustedPicture* b) {
  Eigen::Matrix3d to_middle = Eigen::Matrix3d::Identity();
  to_middle.col(2) << a.camera.width / 2.0, a.camera.height / 2.0, 1;
  Eigen::Matrix3d K = to_middle;
  K(0, 0) = K(1, 1) = a.camera.focal_length;
  Eigen::Matrix3d M = K.inverse() * H * to_middle;
  if (M.determinant() < 0) M = -M;
  const double f = M.col(2).norm() / std::sqrt(M.col(0).norm() * M.col(1).norm());
  if (!std::isfinite(f) || !(f > 0)) return false;
  M.leftCols<2>() *= f;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  b->R_base_from_camera = a.R_base_from_camera * svd.matrixU() * svd.matrixV().transpose();
  b->camera = a.camera;
  b->camera.focal_length = f;
  return true;
}

}  // namespace

std::vector<AdjustedPicture> chain_homographies(const MapEvidence& evidence, int root,
                                                const AdjustedPicture& known,
                                                std::vector<char>* reached) {
  cv::setRNGSeed(1);
  std::vector<Sights> sights(evidence.pictures.size());
  for (const MapObservation& o : evidence.observations) {
    sights[static_cast<std::size_t>(o.picture)].emplace(o.landmark, o.u);
  }
  std::vector<AdjustedPicture> out(sights.size());
  out[static_cast<std::size_t>(root)] = known;
  reached->assign(sights.size(), 0);
  // Prim's tree: the step with most in common first. A step that fails is not taken again.
  std::vector<Step> steps;
  const auto stand_at = [&](int at) {
    const auto i = static_cast<std::size_t>(at);
    (*reached)[i] = 1;
    for (std::size_t j = 0; j < sights.size(); ++j) {
      if ((*reached)[j] != 0) continue;
      const int common = common_of(sights[i], sights[j]);
      if (common >= kLeastCommon) steps.push_back({at, static_cast<int>(j), common});
    }
  };
  stand_at(root);
  while (!steps.empty()) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < steps.size(); ++i) {
      if (steps[i].common > steps[best].common) best = i;
    }
    const Step step = steps[best];
    steps.erase(steps.begin() + static_cast<std::ptrdiff_t>(best));
    const auto from = static_cast<std::size_t>(step.from), to = static_cast<std::size_t>(step.to);
    if ((*reached)[to] != 0) continue;
    const auto H = homography(sights[from], sights[to]);
    if (H && follow(out[from], *H, &out[to])) stand_at(step.to);
  }
  return out;
}

}  // namespace alidade::test
