#include "core/detection/frame_warp.h"

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

constexpr double kNodeSpacing_px = 128;
constexpr int kLeastNodes = 4;

}  // namespace

FrameWarp::Axis FrameWarp::make_axis(int length, int tiles) {
  Axis axis;
  axis.nodes = std::max(kLeastNodes, static_cast<int>(std::ceil(length / kNodeSpacing_px)) + 1);
  axis.spacing = length / (axis.nodes - 1.0);
  for (int i = 0; i <= tiles; ++i) {
    const double place = i * kTile / axis.spacing;
    Stencil stencil{};
    stencil.first = std::clamp(static_cast<int>(place) - 1, 0, axis.nodes - 4);
    const double s = place - stencil.first;
    stencil.weight[0] = static_cast<float>(-(s - 1) * (s - 2) * (s - 3) / 6);
    stencil.weight[1] = static_cast<float>(s * (s - 2) * (s - 3) / 2);
    stencil.weight[2] = static_cast<float>(-s * (s - 1) * (s - 3) / 2);
    stencil.weight[3] = static_cast<float>(s * (s - 1) * (s - 2) / 6);
    axis.of_corner.push_back(stencil);
  }
  return axis;
}

FrameWarp::FrameWarp(int width, int height)
    : columns_((width + kTile - 1) / kTile),
      rows_((height + kTile - 1) / kTile),
      across_(make_axis(width, columns_)),
      down_(make_axis(height, rows_)) {
  const std::size_t nodes =
      static_cast<std::size_t>(across_.nodes) * static_cast<std::size_t>(down_.nodes);
  directions_.resize(nodes);
  pixels_.resize(nodes);
  lines_.resize(static_cast<std::size_t>(across_.nodes));
}

bool FrameWarp::look(const FrameOrientation& now) {
  for (int j = 0; j < down_.nodes; ++j) {
    for (int i = 0; i < across_.nodes; ++i) {
      const Vector2<double> u(i * across_.spacing, j * down_.spacing);
      if (now.direction(u, &directions_[node(i, j)]) != ProjectionStatus::kOk) return false;
    }
  }
  return true;
}

bool FrameWarp::to(const FrameOrientation& then, TileCorners* out) {
  for (std::size_t k = 0; k < directions_.size(); ++k) {
    Vector2<double> u;
    if (then.pixel(directions_[k], &u) != ProjectionStatus::kOk) return false;
    pixels_[k] = {static_cast<float>(u.x()), static_cast<float>(u.y())};
  }
  TileCorner* corner = out->data();
  for (const Stencil& vertical : down_.of_corner) {
    for (int i = 0; i < across_.nodes; ++i) {
      TileCorner sum{0, 0};
      for (int k = 0; k < 4; ++k) {
        const TileCorner& at = pixels_[node(i, vertical.first + k)];
        sum.u += vertical.weight[k] * at.u;
        sum.v += vertical.weight[k] * at.v;
      }
      lines_[static_cast<std::size_t>(i)] = sum;
    }
    for (const Stencil& horizontal : across_.of_corner) {
      TileCorner sum{0, 0};
      for (int k = 0; k < 4; ++k) {
        const TileCorner& at = lines_[static_cast<std::size_t>(horizontal.first + k)];
        sum.u += horizontal.weight[k] * at.u;
        sum.v += horizontal.weight[k] * at.v;
      }
      *corner++ = sum;
    }
  }
  return true;
}

}  // namespace alidade
