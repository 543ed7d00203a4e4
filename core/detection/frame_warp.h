#pragma once
// Where the pixels of one frame are in an earlier one, by both frames' orientations and lenses, each pixel at its own row's time:
//   u_then = pixel_then(direction_now(u_now)),   FrameOrientation of each
// Exact at nodes some 128 px apart, cubic between them, at the corners of tiles of kTile x kTile pixels; linear in a tile. Where a lens
// distorts by 7 % in the corner and frames are half a picture apart that is within 0.04 px of exact (comparison_test).
// A frame of which a node has no pixel is refused as a whole. All memory is taken by the constructor. For one thread.

#include <vector>

#include "core/realtime/frame_orientation.h"

namespace alidade {

inline constexpr int kTile = 16;  // px

struct TileCorner {
  float u, v;  // px, in the earlier frame
};

// Corners of tiles, row after row: that of column i and row j is of pixel (16 i, 16 j).
using TileCorners = std::vector<TileCorner>;

class FrameWarp {
 public:
  // Of pictures of that size, both at least kTile.
  FrameWarp(int width, int height);

  [[nodiscard]] int columns() const { return columns_; }  // of tiles; the last may reach beyond
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] std::size_t corners() const {
    return static_cast<std::size_t>(columns_ + 1) * static_cast<std::size_t>(rows_ + 1);
  }

  // The frame whose pixels are asked for. False: a pixel has no direction.
  [[nodiscard]] bool look(const FrameOrientation& now);
  // out: of corners() elements.
  [[nodiscard]] bool to(const FrameOrientation& then, TileCorners* out);

 private:
  // Cubic through four nodes, the first of them named.
  struct Stencil {
    int first;
    float weight[4];
  };
  struct Axis {
    int nodes;
    double spacing;                  // px
    std::vector<Stencil> of_corner;  // of tiles
  };
  [[nodiscard]] static Axis make_axis(int length, int tiles);
  [[nodiscard]] std::size_t node(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(across_.nodes) +
           static_cast<std::size_t>(i);
  }

  int columns_, rows_;
  Axis across_, down_;
  std::vector<Vector3<double>> directions_;  // of nodes
  std::vector<TileCorner> pixels_;           // of nodes
  std::vector<TileCorner> lines_;            // of one row of corners, at the nodes' columns
};

}  // namespace alidade
