#include "core/realtime/oe_mode/coarse_alignment.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace alidade {
namespace {

struct Group {
  const CoarsePatch* patches;
  int count;
  const ImageView& image;
  double scale;  // octave px per image px

  [[nodiscard]] Vector2<double> place(int i, const Vector2<double>& angle) const {
    return scale * (patches[i].u + patches[i].J_angle * angle);
  }
  [[nodiscard]] Matrix2<double> J(int i) const { return scale * patches[i].J_angle; }
};

struct Found {
  int patches = 0;  // in the image
  double share = 0;
};

Found count_found(const Group& group, const Vector2<double>& angle, double min_correlation) {
  Found found;
  int alike = 0;
  for (int i = 0; i < group.count; ++i) {
    PatchStep step;
    if (!measure_step(*group.patches[i].reference, group.image, group.place(i, angle), &step)) {
      continue;
    }
    ++found.patches;
    if (step.correlation >= min_correlation) ++alike;
  }
  found.share = found.patches > 0 ? static_cast<double>(alike) / found.patches : 0;
  return found;
}

// The shift of the most similar patches, from a grid with 2 px of this octave between shifts.
Vector2<double> search(const Group& group, double radius_px) {
  constexpr int kMaxSteps = 5;
  Matrix2<double> J = Matrix2<double>::Zero();
  for (int i = 0; i < group.count; ++i) J += group.J(i) / group.count;
  const Matrix2<double> to_angle = J.inverse();
  const int steps = std::min(kMaxSteps, static_cast<int>(std::ceil(radius_px * group.scale / 2)));
  double best = 0;
  Vector2<double> best_angle = Vector2<double>::Zero();
  for (int row = -steps; row <= steps; ++row) {
    for (int column = -steps; column <= steps; ++column) {
      const Vector2<double> angle = to_angle * Vector2<double>(2 * column, 2 * row);
      double alike = 0;
      for (int i = 0; i < group.count; ++i) {
        PatchStep step;
        if (measure_step(*group.patches[i].reference, group.image, group.place(i, angle), &step)) {
          alike += std::max(step.correlation, 0.0);
        }
      }
      if (alike <= best) continue;
      best = alike;
      best_angle = angle;
    }
  }
  return best_angle;
}

// One Gauss-Newton step of all patches; false if there are too few.
bool common_step(const Group& group, const CoarseOptions& options, Vector2<double>* angle,
                 double* moved_px) {
  struct Term {
    Vector2<double> step;
    Matrix2<double> information;
    Matrix2<double> J;
  };
  std::array<Term, kMaxCoarsePatches> terms;
  int count = 0;
  for (int i = 0; i < group.count; ++i) {
    PatchStep step;
    const ReferencePatch& reference = *group.patches[i].reference;
    if (!measure_step(reference, group.image, group.place(i, *angle), &step) || step.gain <= 0) {
      continue;
    }
    Term& term = terms[static_cast<std::size_t>(count++)];
    // The linearisation is not reliable beyond 1.5 px.
    term.step = step.step / std::max(1.0, step.step.norm() / 1.5);
    // Equal noise everywhere: the weight is contrast alone, so that hidden patches cannot dominate.
    const Matrix2<double> variance =
        (reference.unit_covariance + 100 * reference.unobserved).cast<double>();
    term.information = variance.inverse();
    term.J = group.J(i);
  }
  if (count < options.min_patches) return false;

  Vector2<double> change = Vector2<double>::Zero();
  constexpr int kReweightings = 4;
  for (int round = 0; round < kReweightings; ++round) {
    Matrix2<double> N = Matrix2<double>::Zero();
    Vector2<double> b = Vector2<double>::Zero();
    for (int i = 0; i < count; ++i) {
      const Term& term = terms[static_cast<std::size_t>(i)];
      constexpr double kScaleSquare = 0.25;  // px^2
      const double weight =
          round == 0 ? 1
                     : kScaleSquare / (kScaleSquare + (term.step - term.J * change).squaredNorm());
      const Matrix2<double> JtW = weight * term.J.transpose() * term.information;
      N += JtW * term.J;
      b += JtW * term.step;
    }
    change = N.inverse() * b;
    if (!all_finite(change)) return false;
  }
  *angle += change;
  *moved_px = (terms[0].J * change).norm();
  return true;
}

}  // namespace

bool align_coarsely(const Pyramid& pyramid, const CoarsePatch* patches, int count,
                    const CoarseOptions& options, CoarseAlignment* out) {
  *out = {};
  bool searched = options.search_px <= 0;
  bool aligned = false;
  for (int begin = 0; begin < count;) {
    const int octave = patches[begin].octave;
    int end = begin;
    while (end < count && patches[end].octave == octave) ++end;
    const Group group{patches + begin, std::min(end - begin, kMaxCoarsePatches),
                      pyramid.octave(octave), std::ldexp(1.0, -octave)};
    begin = end;
    if (group.count < options.min_patches) continue;
    if (!searched) out->angle = search(group, options.search_px);
    searched = true;
    constexpr double kSettled = 0.05;  // px of this octave
    for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
      double moved_px = 0;
      if (!common_step(group, options, &out->angle, &moved_px)) break;
      aligned = true;
      if (moved_px < kSettled) break;
    }
    const Found found = count_found(group, out->angle, options.min_correlation);
    if (found.patches < options.min_patches) continue;
    out->found = found.share;
    out->patches = found.patches;
  }
  return aligned && out->found >= options.min_found;
}

}  // namespace alidade
