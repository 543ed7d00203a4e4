#pragma once
// FrameWarp: where pixels of one frame are in an earlier frame, by both frames' orientations and
// lenses, each pixel at its own row's time: u_then = pixel_then(direction_now(u_now)).
// Computed exactly at nodes some 128 px apart; from the nodes interpolated cubically to the corners
// of tiles of kTile x kTile pixels, and linearly within a tile. The error is below 0.04 px for 7 %
// distortion in the corner and frames half an image apart (comparison_test). The constructor takes
// all memory. One thread.

#include <vector>

#include "core/realtime/frame_orientation.h"

namespace alidade {

inline constexpr int kTile = 16;  // px

struct TileCorner {
  float u, v;  // px, in the earlier frame
};

// Corners of tiles, row by row: that of column i and row j is the point (16 i, 16 j) px.
using TileCorners = std::vector<TileCorner>;

class FrameWarp {
 public:
  // width, height: px, of the images; at least kTile.
  FrameWarp(int width, int height);

  [[nodiscard]] int columns() const { return columns_; }  // of tiles; the last may reach beyond
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] std::size_t corners() const {
    return static_cast<std::size_t>(columns_ + 1) * static_cast<std::size_t>(rows_ + 1);
  }

  // Sets the current frame. False: a node has no direction; to() must then not be called.
  [[nodiscard]] bool look(const FrameOrientation& now);
  // Where the current frame's pixels are in an earlier frame; they may lie outside its image. out:
  // corners() elements. False: the direction of a node has no pixel in the earlier frame; *out is
  // then unchanged. Needs look().
  [[nodiscard]] bool to(const FrameOrientation& then, TileCorners* out);

 private:
  // Cubic through four nodes from `first` on.
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
