#pragma once
// Grey value and gradient between pixels, by one of three kernels:
//   value(u) = sum_k image[k] w(u - c_k),   gradient(u) = sum_k image[k] w'(u - c_k),
// c_k are the pixels' centres; w is a product of one function of u and the same of v. The gradient
// is exactly the derivative of the value.
//   Bilinear      2x2  continuous; the gradient jumps at pixel centres
//   CatmullRom    4x4  continuous gradient; interpolates the pixels
//   CubicBSpline  4x4  cubic B-spline without prefilter: blurs (standard deviation 0.58 px) almost
//                 equally at any position, does not interpolate the pixels
// Points whose taps leave the image are refused. Pure functions. Position errors by kernel:
// docs/measurements.md.

#include <cmath>

#include "core/model/linear_algebra.h"
#include "core/realtime/image/byte_vector.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

template <int kCount>
struct Taps {
  float weight[kCount];
  float slope[kCount];  // 1/px; derivative of weight with respect to the position
};

struct Bilinear {
  static constexpr int kTaps = 2;
  [[nodiscard]] static Taps<2> taps(float t) { return {{1 - t, t}, {-1, 1}}; }
};

struct CatmullRom {
  static constexpr int kTaps = 4;
  [[nodiscard]] static Taps<4> taps(float t) {
    return {{t * (-0.5F + t * (1 - 0.5F * t)), 1 + t * t * (-2.5F + 1.5F * t),
             t * (0.5F + t * (2 - 1.5F * t)), t * t * (-0.5F + 0.5F * t)},
            {-0.5F + t * (2 - 1.5F * t), t * (-5 + 4.5F * t), 0.5F + t * (4 - 4.5F * t),
             t * (-1 + 1.5F * t)}};
  }
};

struct CubicBSpline {
  static constexpr int kTaps = 4;
  [[nodiscard]] static Taps<4> taps(float t) {
    const float s = 1 - t;
    constexpr float kSixth = 1.0F / 6;
    return {{kSixth * s * s * s, kSixth * (4 + t * t * (3 * t - 6)),
             kSixth * (4 + s * s * (3 * s - 6)), kSixth * t * t * t},
            {-0.5F * s * s, t * (1.5F * t - 2), s * (2 - 1.5F * s), 0.5F * t * t}};
  }
};

// Position of a point among the kTaps x kTaps taps of a kernel.
struct TapPlace {
  int column, row;  // of the first tap
  float t_u, t_v;   // [0, 1)
};

enum class SampleStatus {
  kOk,
  kOutsideMargin  // a tap is outside the image, or the point is not finite
};

// For a point (u, v), px, or for the first of columns x rows points 1 px apart: the status is that
// of all. *out is written on kOk.
template <int kTaps>
[[nodiscard]] inline SampleStatus find_taps(const ImageView& image, double u, double v, int columns,
                                            int rows, TapPlace* out) {
  constexpr int kBefore = kTaps / 2 - 1;
  const double x = u - (0.5 + kBefore);
  const double y = v - (0.5 + kBefore);
  // Compared before the cast, as not every value fits an int. False for NaN.
  if (!(x >= 0 && y >= 0 && x < image.width - (kTaps + columns - 2) &&
        y < image.height - (kTaps + rows - 2))) {
    return SampleStatus::kOutsideMargin;
  }
  out->column = static_cast<int>(x);
  out->row = static_cast<int>(y);
  out->t_u = static_cast<float>(x - out->column);
  out->t_v = static_cast<float>(y - out->row);
  return SampleStatus::kOk;
}

// *value (grey levels) and, if wanted, *gradient (d/du, d/dv; grey levels / px) are written on kOk.
template <class Kernel>
[[nodiscard]] inline SampleStatus sample(const ImageView& image, double u, double v, float* value,
                                         Vector2<float>* gradient = nullptr) {
  TapPlace place;
  const SampleStatus status = find_taps<Kernel::kTaps>(image, u, v, 1, 1, &place);
  if (status != SampleStatus::kOk) return status;
  const auto across = Kernel::taps(place.t_u);
  const auto down = Kernel::taps(place.t_v);
  if constexpr (Kernel::kTaps == 4) {
    FloatVector column{};
    FloatVector column_dv{};
    for (int j = 0; j < 4; ++j) {
      const FloatVector pixels = load_four(image.row(place.row + j) + place.column);
      column += down.weight[j] * pixels;
      column_dv += down.slope[j] * pixels;
    }
    const FloatVector weight = load_four(across.weight);
    *value = sum(weight * column);
    if (gradient != nullptr) {
      *gradient = {sum(load_four(across.slope) * column), sum(weight * column_dv)};
    }
  } else {
    const std::uint8_t* upper = image.row(place.row) + place.column;
    const std::uint8_t* lower = image.row(place.row + 1) + place.column;
    const float line[2] = {across.weight[0] * upper[0] + across.weight[1] * upper[1],
                           across.weight[0] * lower[0] + across.weight[1] * lower[1]};
    *value = down.weight[0] * line[0] + down.weight[1] * line[1];
    if (gradient != nullptr) {
      *gradient = {down.weight[0] * static_cast<float>(upper[1] - upper[0]) +
                       down.weight[1] * static_cast<float>(lower[1] - lower[0]),
                   line[1] - line[0]};
    }
  }
  return SampleStatus::kOk;
}

}  // namespace alidade
