#include "core/mapping/picture_links.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>

#include "core/mapping/map_projection.h"
#include "core/model/mechanics.h"

namespace alidade {
namespace {

// Features of each picture that are used for retrieval.
constexpr std::size_t kAskingFeatures = 300;
constexpr int kRetrievalChecks = 32;
// Sigma of a match while the lens is unknown, as a share of the threshold.
constexpr double kStartSigmaShare = 0.25;

Camera<double> plain_camera(int width, int height, double log_f) {
  Camera<double> camera;
  camera.focal_length = std::exp(log_f);
  camera.width = width;
  camera.height = height;
  return camera;
}

struct Candidate {
  double rank = 0;  // smaller is better
  int partner = 0;
};

// The best candidates of each picture, as pairs.
std::set<std::pair<int, int>> best_pairs(std::vector<std::vector<Candidate>> candidates, int most) {
  std::set<std::pair<int, int>> out;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    auto& of_one = candidates[i];
    std::sort(of_one.begin(), of_one.end(), [](const Candidate& a, const Candidate& b) {
      return a.rank != b.rank ? a.rank < b.rank : a.partner < b.partner;
    });
    if (static_cast<int>(of_one.size()) > most) of_one.resize(static_cast<std::size_t>(most));
    for (const Candidate& c : of_one) {
      out.insert(std::minmax(static_cast<int>(i), c.partner));
    }
  }
  return out;
}

bool is_placed(const LinkedPicture& picture) { return picture.R_base_from_camera.has_value(); }

// Candidates among pictures with telemetry, by telemetry and zoom.
void add_placed(const std::vector<LinkedPicture>& pictures, int width, int height,
                const LinkOptions& options, std::vector<std::vector<Candidate>>* candidates) {
  const double diagonal = std::hypot(width, height);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!is_placed(pictures[i])) continue;
    for (std::size_t j = i + 1; j < pictures.size(); ++j) {
      if (!is_placed(pictures[j])) continue;
      const LinkedPicture& a = pictures[i];
      const LinkedPicture& b = pictures[j];
      const double zoomed_by = std::abs(a.log_f - b.log_f);
      if (zoomed_by > options.most_log_f_off) continue;
      const Vector3<double> off = a.R_base_from_camera->transpose() * b.R_base_from_camera->col(2);
      const double apart = std::atan2(off.head<2>().norm(), off.z());
      const double reach = std::atan(diagonal / (2 * std::exp(a.log_f))) +
                           std::atan(diagonal / (2 * std::exp(b.log_f)));
      const double unsure = 3 * std::hypot(a.R_sigma, b.R_sigma);
      if (apart > reach + unsure) continue;
      const double rank = apart / reach + zoomed_by / options.most_log_f_off;
      (*candidates)[i].push_back({rank, static_cast<int>(j)});
      (*candidates)[j].push_back({rank, static_cast<int>(i)});
    }
  }
}

// Candidates for pictures without telemetry, by similar features.
void add_retrieved(const std::vector<LinkedPicture>& pictures,
                   std::vector<std::vector<Candidate>>* candidates) {
  std::vector<Descriptor> all;
  std::vector<int> picture_of;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const auto& descriptors = pictures[i].features.descriptors;
    all.insert(all.end(), descriptors.begin(), descriptors.end());
    picture_of.insert(picture_of.end(), descriptors.size(), static_cast<int>(i));
  }
  const FeatureIndex index(all);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (is_placed(pictures[i])) continue;
    const auto& descriptors = pictures[i].features.descriptors;
    const std::size_t asking = std::min(kAskingFeatures, descriptors.size());
    const std::vector<Descriptor> queries(
        descriptors.begin(), descriptors.begin() + static_cast<std::ptrdiff_t>(asking));
    std::vector<double> votes(pictures.size(), 0);
    for (const NearFeatures& near : index.nearest(queries, kRetrievalChecks)) {
      // The feature itself is the nearest. A vote counts more the farther the last of the near ones
      // is.
      const double furthest = near.back().square;
      for (const NearFeature& one : near) {
        if (one.indexed < 0 || !(furthest > 0)) break;
        const int other = picture_of[static_cast<std::size_t>(one.indexed)];
        if (other == static_cast<int>(i)) continue;
        votes[static_cast<std::size_t>(other)] += 1 - one.square / furthest;
      }
    }
    for (std::size_t j = 0; j < votes.size(); ++j) {
      if (votes[j] > 0) (*candidates)[i].push_back({-votes[j], static_cast<int>(j)});
    }
  }
}

// The pose of b in the frame of a. f_b: prior of f of b, which includes the uncertainty of f of a.
PicturePose relative_pose(const std::vector<LinkedPicture>& pictures, const PictureLink& link,
                          const LensCurve& lens, double log_f_a, const FocalLengthPrior& f_b,
                          double threshold_px) {
  const LinkedPicture& a = pictures[static_cast<std::size_t>(link.a)];
  const LinkedPicture& b = pictures[static_cast<std::size_t>(link.b)];
  const Camera<double> camera_a = lens.camera_of(log_f_a);
  const Matrix3<double> I = Matrix3<double>::Identity();
  std::vector<PoseMatch> matches;
  for (const FeatureMatch& match : link.matches) {
    PoseMatch m;
    m.u = b.features.features[static_cast<std::size_t>(match.query)].u;
    m.sigma_px = kStartSigmaShare * threshold_px;
    // A match without a direction keeps its index but is unusable.
    if (unproject_to_map(camera_a, a.motion, I,
                         a.features.features[static_cast<std::size_t>(match.indexed)].u,
                         &m.d_b) != ProjectionStatus::kOk) {
      m.d_b.setZero();
    }
    matches.push_back(m);
  }
  PoseKnowledge knowledge;
  knowledge.lens = lens;
  knowledge.motion = b.motion;
  knowledge.focal_length = f_b;
  knowledge.least_log_f = f_b.log_f - 2;
  knowledge.most_log_f = f_b.log_f + 2;
  PoseOptions options;
  options.threshold_px = threshold_px;
  options.max_trials = 500;
  return find_pose(matches, knowledge, options);
}

}  // namespace

std::vector<std::pair<int, int>> pairs_to_compare(const std::vector<LinkedPicture>& pictures,
                                                  int width, int height,
                                                  const LinkOptions& options) {
  std::vector<std::vector<Candidate>> candidates(pictures.size());
  add_placed(pictures, width, height, options, &candidates);
  std::set<std::pair<int, int>> out = best_pairs(candidates, options.most_partners);
  if (!std::all_of(pictures.begin(), pictures.end(), is_placed)) {
    std::vector<std::vector<Candidate>> retrieved(pictures.size());
    add_retrieved(pictures, &retrieved);
    const auto more = best_pairs(retrieved, options.most_partners);
    out.insert(more.begin(), more.end());
  }
  return {out.begin(), out.end()};
}

PictureLink match_pair(const std::vector<LinkedPicture>& pictures, int a, int b,
                       const LinkOptions& options) {
  PictureLink link;
  link.a = a;
  link.b = b;
  link.matches =
      believed_matches(nearest_features(pictures[static_cast<std::size_t>(b)].features.descriptors,
                                        pictures[static_cast<std::size_t>(a)].features.descriptors),
                       options.ratio);
  return link;
}

void check_link(const std::vector<LinkedPicture>& pictures, const LensCurve& lens,
                const LinkOptions& options, PictureLink* link) {
  const LinkedPicture& a = pictures[static_cast<std::size_t>(link->a)];
  const LinkedPicture& b = pictures[static_cast<std::size_t>(link->b)];
  link->status = PoseStatus::kTooFewMatches;
  const FocalLengthPrior f_b{b.log_f, std::hypot(a.log_f_sigma, b.log_f_sigma)};
  const double threshold_px = options.threshold_share * lens.width();
  const PicturePose pose = relative_pose(pictures, *link, lens, a.log_f, f_b, threshold_px);
  link->status = pose.status;
  if (pose.status != PoseStatus::kOk) return;
  if (static_cast<int>(pose.inliers.size()) < options.least_inliers) {
    link->status = PoseStatus::kTooFewMatches;
    return;
  }
  if (a.R_base_from_camera && b.R_base_from_camera) {
    const Matrix3<double> told = a.R_base_from_camera->transpose() * *b.R_base_from_camera;
    const double off = log_so3(Matrix3<double>(told.transpose() * pose.R_base_from_camera)).norm();
    const double of_lens = 2 * threshold_px / std::exp(std::min(a.log_f, b.log_f));
    if (off > 5 * std::hypot(a.R_sigma, b.R_sigma) + of_lens) {
      link->status = PoseStatus::kRival;
      return;
    }
  }
  link->inliers = pose.inliers;
  link->R_a_from_b = pose.R_base_from_camera;
}

std::optional<double> common_focal_length(const std::vector<LinkedPicture>& pictures,
                                          const std::vector<PictureLink>& links, int width,
                                          int height, const LinkOptions& options) {
  constexpr std::size_t kLinks = 8;     // that are tried
  constexpr double kStep = 0.12;        // of log f
  constexpr double kLeastWidths = 0.4;  // f, in image widths
  constexpr double kMostWidths = 12;
  std::vector<const PictureLink*> strongest;
  strongest.reserve(links.size());
  for (const PictureLink& link : links) strongest.push_back(&link);
  std::stable_sort(strongest.begin(), strongest.end(), [](const auto* a, const auto* b) {
    return a->matches.size() > b->matches.size();
  });
  if (strongest.size() > kLinks) strongest.resize(kLinks);
  const double threshold_px = options.threshold_share * width / 2;
  const double least = std::log(kLeastWidths * width);
  const int steps = static_cast<int>(std::ceil(std::log(kMostWidths / kLeastWidths) / kStep));
  double most = 0;
  std::optional<double> best;
  for (int step = 0; step < steps; ++step) {
    const double log_f = least + step * kStep;
    const LensCurve lens = LensCurve::of(plain_camera(width, height, log_f));
    double fit = 0;
    for (const PictureLink* link : strongest) {
      const PicturePose pose =
          relative_pose(pictures, *link, lens, log_f, {log_f, 0.002}, threshold_px);
      if (pose.status != PoseStatus::kOk) continue;
      fit += static_cast<double>(pose.inliers.size()) / (1 + pose.noise_scale);
    }
    if (!(fit > most)) continue;
    most = fit;
    best = log_f;
  }
  return best;
}

std::vector<std::optional<Matrix3<double>>> start_orientations(
    const std::vector<LinkedPicture>& pictures, const std::vector<PictureLink>& links) {
  std::vector<std::optional<Matrix3<double>>> out;
  out.reserve(pictures.size());
  std::vector<std::size_t> inliers(pictures.size(), 0);
  for (const LinkedPicture& picture : pictures) out.push_back(picture.R_base_from_camera);
  for (const PictureLink& link : links) {
    inliers[static_cast<std::size_t>(link.a)] += link.inliers.size();
    inliers[static_cast<std::size_t>(link.b)] += link.inliers.size();
  }
  if (!pictures.empty() && std::none_of(pictures.begin(), pictures.end(), is_placed)) {
    const auto root = std::max_element(inliers.begin(), inliers.end()) - inliers.begin();
    out[static_cast<std::size_t>(root)] = r_frd_from_rdf<double>();
  }
  for (;;) {
    const PictureLink* strongest = nullptr;
    for (const PictureLink& link : links) {
      if (link.status != PoseStatus::kOk) continue;
      const bool has_a = out[static_cast<std::size_t>(link.a)].has_value();
      const bool has_b = out[static_cast<std::size_t>(link.b)].has_value();
      if (has_a == has_b) continue;
      if (strongest == nullptr || link.inliers.size() > strongest->inliers.size()) {
        strongest = &link;
      }
    }
    if (strongest == nullptr) return out;
    auto& a = out[static_cast<std::size_t>(strongest->a)];
    auto& b = out[static_cast<std::size_t>(strongest->b)];
    if (a) {
      b = Matrix3<double>(*a * strongest->R_a_from_b);
    } else {
      a = Matrix3<double>(*b * strongest->R_a_from_b.transpose());
    }
  }
}

}  // namespace alidade
