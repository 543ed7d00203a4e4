#include "test/accuracy/mot_metrics.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "test/accuracy/optimal_assignment.h"

namespace alidade::test {

namespace {

using Identity = std::int64_t;

struct MotFrame {
  std::vector<MotBox> objects, tracks;
  Eigen::MatrixXd iou;  // of objects (rows) and tracks
};

std::map<std::int64_t, MotFrame> frames_of(const std::vector<MotBox>& truth,
                                           const std::vector<MotBox>& result) {
  std::map<std::int64_t, MotFrame> frames;
  for (const MotBox& box : truth) {
    std::vector<MotBox>& objects = frames[box.frame].objects;
    if (box.counts) objects.push_back(box);
  }
  for (const MotBox& box : result) frames[box.frame].tracks.push_back(box);
  for (auto& [number, frame] : frames) {
    frame.iou.resize(static_cast<Eigen::Index>(frame.objects.size()),
                     static_cast<Eigen::Index>(frame.tracks.size()));
    for (Eigen::Index i = 0; i < frame.iou.rows(); ++i) {
      for (Eigen::Index j = 0; j < frame.iou.cols(); ++j) {
        frame.iou(i, j) = intersection_over_union(frame.objects[static_cast<std::size_t>(i)],
                                                  frame.tracks[static_cast<std::size_t>(j)]);
      }
    }
  }
  return frames;
}

double quotient(double a, double b) { return a / b; }

// 1 - IoU, as motmetrics compares it: at most a half.
bool may_match(double iou) { return 1 - iou <= 0.5; }

class ClearMot {
 public:
  void add(const MotFrame& frame) {
    std::vector<char> object_done(frame.objects.size(), 0);
    std::vector<char> track_done(frame.tracks.size(), 0);
    if (!frame.objects.empty() && !frame.tracks.empty()) {
      keep_matches(frame, &object_done, &track_done);
      match_others(frame, &object_done, &track_done);
    }
    for (std::size_t i = 0; i < frame.objects.size(); ++i) {
      seen_[frame.objects[i].identity].push_back(object_done[i] != 0);
    }
    metrics_.num_false_positives += std::count(track_done.begin(), track_done.end(), 0);
    metrics_.num_misses += std::count(object_done.begin(), object_done.end(), 0);
    metrics_.num_objects += static_cast<std::int64_t>(frame.objects.size());
    metrics_.num_predictions += static_cast<std::int64_t>(frame.tracks.size());
    ++metrics_.num_frames;
  }

  [[nodiscard]] MotMetrics result() const {
    MotMetrics m = metrics_;
    m.num_unique_objects = static_cast<std::int64_t>(seen_.size());
    for (const auto& [identity, seen] : seen_) {
      const auto first = std::find(seen.begin(), seen.end(), true);
      const auto last = std::find(seen.rbegin(), seen.rend(), true).base();
      for (auto i = first; i != seen.end() && i + 1 < last; ++i) {
        if (*i && !*(i + 1)) ++m.num_fragmentations;
      }
      const double ratio = static_cast<double>(std::count(seen.begin(), seen.end(), true)) /
                           static_cast<double>(seen.size());
      ++(ratio >= 0.8 ? m.mostly_tracked : ratio >= 0.2 ? m.partially_tracked : m.mostly_lost);
    }
    const auto objects = static_cast<double>(m.num_objects);
    const auto found = static_cast<double>(m.num_matches + m.num_switches);
    const auto wrong = static_cast<double>(m.num_false_positives);
    m.mota = 1 - quotient(static_cast<double>(m.num_misses + m.num_switches) + wrong, objects);
    m.motp = quotient(distance_, found);
    m.precision = quotient(found, wrong + found);
    m.recall = quotient(found, objects);
    m.faf = quotient(wrong, static_cast<double>(m.num_frames));
    return m;
  }

 private:
  void keep_matches(const MotFrame& frame, std::vector<char>* object_done,
                    std::vector<char>* track_done) {
    for (std::size_t i = 0; i < frame.objects.size(); ++i) {
      const Identity object = frame.objects[i].identity;
      const auto before = track_of_.find(object);
      if (before == track_of_.end()) continue;
      for (std::size_t j = 0; j < frame.tracks.size(); ++j) {
        const double iou = frame.iou(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
        if ((*track_done)[j] || frame.tracks[j].identity != before->second || !may_match(iou)) {
          continue;
        }
        (*object_done)[i] = (*track_done)[j] = 1;
        ++metrics_.num_matches;
        distance_ += 1 - iou;
        objects_matched_.insert(object);
        tracks_matched_.insert(frame.tracks[j].identity);
        break;
      }
    }
  }

  void match_others(const MotFrame& frame, std::vector<char>* object_done,
                    std::vector<char>* track_done) {
    // One that may not match costs more than all that may.
    const double forbidden = 10 * static_cast<double>(frame.objects.size() + frame.tracks.size());
    Eigen::MatrixXd cost(frame.iou.rows(), frame.iou.cols());
    for (Eigen::Index i = 0; i < cost.rows(); ++i) {
      for (Eigen::Index j = 0; j < cost.cols(); ++j) {
        const bool free = !(*object_done)[static_cast<std::size_t>(i)] &&
                          !(*track_done)[static_cast<std::size_t>(j)];
        cost(i, j) = free && may_match(frame.iou(i, j)) ? 1 - frame.iou(i, j) : forbidden;
      }
    }
    const std::vector<int> assigned = optimal_assignment(cost);
    for (std::size_t i = 0; i < assigned.size(); ++i) {
      if (assigned[i] < 0 || cost(static_cast<Eigen::Index>(i), assigned[i]) == forbidden) continue;
      const auto j = static_cast<std::size_t>(assigned[i]);
      const Identity object = frame.objects[i].identity;
      const Identity track = frame.tracks[j].identity;
      const auto before = track_of_.find(object);
      const bool is_switch = before != track_of_.end() && before->second != track;
      if (is_switch && tracks_matched_.count(track) == 0) ++metrics_.num_ascend;
      const auto owner = object_of_.find(track);
      if (owner != object_of_.end() && owner->second != object) {
        ++metrics_.num_transfer;
        if (objects_matched_.count(object) == 0) ++metrics_.num_migrate;
      }
      ++(is_switch ? metrics_.num_switches : metrics_.num_matches);
      distance_ += cost(static_cast<Eigen::Index>(i), assigned[i]);
      tracks_matched_.insert(track);
      objects_matched_.insert(object);
      track_of_[object] = track;
      object_of_[track] = object;
      (*object_done)[i] = (*track_done)[j] = 1;
    }
  }

  MotMetrics metrics_;
  double distance_ = 0;
  std::map<Identity, Identity> track_of_, object_of_;
  std::set<Identity> objects_matched_, tracks_matched_;
  std::map<Identity, std::vector<bool>> seen_;  // of each object, frame by frame
};

// Numbers identities from 0.
std::map<Identity, Eigen::Index> numbered(const std::vector<MotBox>& boxes) {
  std::map<Identity, Eigen::Index> numbers;
  for (const MotBox& box : boxes) {
    if (box.counts) numbers.emplace(box.identity, 0);
  }
  Eigen::Index next = 0;
  for (auto& entry : numbers) entry.second = next++;
  return numbers;
}

struct Numbers {
  std::map<Identity, Eigen::Index> object, track;
};

void add_identity(const std::map<std::int64_t, MotFrame>& frames, const Numbers& number,
                  MotMetrics* m) {
  Eigen::MatrixXd together = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(number.object.size()),
                                                   static_cast<Eigen::Index>(number.track.size()));
  for (const auto& [at, frame] : frames) {
    for (Eigen::Index i = 0; i < frame.iou.rows(); ++i) {
      for (Eigen::Index j = 0; j < frame.iou.cols(); ++j) {
        if (!may_match(frame.iou(i, j))) continue;
        together(number.object.at(frame.objects[static_cast<std::size_t>(i)].identity),
                 number.track.at(frame.tracks[static_cast<std::size_t>(j)].identity)) += 1;
      }
    }
  }
  double idtp = 0;
  const std::vector<int> assigned = optimal_assignment(-together);
  for (std::size_t i = 0; i < assigned.size(); ++i) {
    if (assigned[i] >= 0) idtp += together(static_cast<Eigen::Index>(i), assigned[i]);
  }
  const auto objects = static_cast<double>(m->num_objects);
  const auto predictions = static_cast<double>(m->num_predictions);
  m->idp = quotient(idtp, predictions);
  m->idr = quotient(idtp, objects);
  m->idf1 = quotient(2 * idtp, objects + predictions);
}

void add_hota(const std::map<std::int64_t, MotFrame>& frames, const Numbers& number,
              MotMetrics* m) {
  const auto objects = static_cast<Eigen::Index>(number.object.size());
  const auto tracks = static_cast<Eigen::Index>(number.track.size());
  constexpr int kThresholds = 19;
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  Eigen::VectorXd object_count = Eigen::VectorXd::Zero(objects);
  Eigen::VectorXd track_count = Eigen::VectorXd::Zero(tracks);
  Eigen::MatrixXd potential = Eigen::MatrixXd::Zero(objects, tracks);
  const auto object_at = [&](const MotFrame& frame, Eigen::Index i) {
    return number.object.at(frame.objects[static_cast<std::size_t>(i)].identity);
  };
  const auto track_at = [&](const MotFrame& frame, Eigen::Index j) {
    return number.track.at(frame.tracks[static_cast<std::size_t>(j)].identity);
  };
  for (const auto& [at, frame] : frames) {
    for (Eigen::Index i = 0; i < frame.iou.rows(); ++i) object_count[object_at(frame, i)] += 1;
    for (Eigen::Index j = 0; j < frame.iou.cols(); ++j) track_count[track_at(frame, j)] += 1;
    for (Eigen::Index i = 0; i < frame.iou.rows(); ++i) {
      for (Eigen::Index j = 0; j < frame.iou.cols(); ++j) {
        const double all = frame.iou.row(i).sum() + frame.iou.col(j).sum() - frame.iou(i, j);
        if (all > kEpsilon) {
          potential(object_at(frame, i), track_at(frame, j)) += frame.iou(i, j) / all;
        }
      }
    }
  }
  const Eigen::MatrixXd alignment =
      (potential.array() / (object_count.replicate(1, tracks) +
                            track_count.transpose().replicate(objects, 1) - potential)
                               .array())
          .matrix();

  std::vector<Eigen::MatrixXd> matched(kThresholds, Eigen::MatrixXd::Zero(objects, tracks));
  std::vector<double> located(kThresholds, 0.0);
  for (const auto& [at, frame] : frames) {
    if (frame.iou.size() == 0) continue;
    Eigen::MatrixXd score(frame.iou.rows(), frame.iou.cols());
    for (Eigen::Index i = 0; i < score.rows(); ++i) {
      for (Eigen::Index j = 0; j < score.cols(); ++j) {
        score(i, j) = alignment(object_at(frame, i), track_at(frame, j)) * frame.iou(i, j);
      }
    }
    const std::vector<int> assigned = optimal_assignment(-score);
    for (std::size_t i = 0; i < assigned.size(); ++i) {
      if (assigned[i] < 0) continue;
      const auto row = static_cast<Eigen::Index>(i);
      const double iou = frame.iou(row, assigned[i]);
      for (std::size_t a = 0; a < kThresholds; ++a) {
        if (iou < 0.05 * static_cast<double>(a + 1) - kEpsilon) continue;
        matched[a](object_at(frame, row), track_at(frame, assigned[i])) += 1;
        located[a] += iou;
      }
    }
  }
  for (std::size_t a = 0; a < kThresholds; ++a) {
    const double tp = matched[a].sum();
    const double all =
        static_cast<double>(m->num_objects) + static_cast<double>(m->num_predictions) - tp;
    double association = 0;
    for (Eigen::Index i = 0; i < objects; ++i) {
      for (Eigen::Index j = 0; j < tracks; ++j) {
        const double n = matched[a](i, j);
        if (n > 0) association += n * n / (object_count[i] + track_count[j] - n);
      }
    }
    const double deta = tp / std::max(all, 1.0);
    const double assa = association / std::max(tp, 1.0);
    m->deta += deta / kThresholds;
    m->assa += assa / kThresholds;
    m->hota += std::sqrt(deta * assa) / kThresholds;
    m->loca += (tp > 0 ? located[a] / tp : 1) / kThresholds;
  }
}

}  // namespace

double intersection_over_union(const MotBox& a, const MotBox& b) {
  const double width = std::min(a.left + a.width, b.left + b.width) - std::max(a.left, b.left);
  const double height = std::min(a.top + a.height, b.top + b.height) - std::max(a.top, b.top);
  if (width <= 0 || height <= 0) return 0;
  const double both = width * height;
  return both / (a.width * a.height + b.width * b.height - both);
}

MotMetrics mot_metrics(const std::vector<MotBox>& truth, const std::vector<MotBox>& result) {
  const std::map<std::int64_t, MotFrame> frames = frames_of(truth, result);
  ClearMot clear;
  for (const auto& entry : frames) clear.add(entry.second);
  MotMetrics metrics = clear.result();
  const Numbers number{numbered(truth), numbered(result)};
  add_identity(frames, number, &metrics);
  add_hota(frames, number, &metrics);
  return metrics;
}

std::vector<std::pair<std::string, std::int64_t>> counts_of(const MotMetrics& m) {
  return {{"num_frames", m.num_frames},
          {"num_objects", m.num_objects},
          {"num_predictions", m.num_predictions},
          {"num_unique_objects", m.num_unique_objects},
          {"num_matches", m.num_matches},
          {"num_misses", m.num_misses},
          {"num_false_positives", m.num_false_positives},
          {"num_switches", m.num_switches},
          {"num_fragmentations", m.num_fragmentations},
          {"num_transfer", m.num_transfer},
          {"num_ascend", m.num_ascend},
          {"num_migrate", m.num_migrate},
          {"mostly_tracked", m.mostly_tracked},
          {"partially_tracked", m.partially_tracked},
          {"mostly_lost", m.mostly_lost}};
}

std::vector<std::pair<std::string, double>> ratios_of(const MotMetrics& m) {
  return {{"mota", m.mota},     {"motp", m.motp}, {"precision", m.precision},
          {"recall", m.recall}, {"faf", m.faf},   {"idf1", m.idf1},
          {"idp", m.idp},       {"idr", m.idr},   {"hota", m.hota},
          {"deta", m.deta},     {"assa", m.assa}, {"loca", m.loca}};
}

}  // namespace alidade::test
