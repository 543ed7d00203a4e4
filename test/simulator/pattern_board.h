#pragma once
// A printed pattern on a table: its points, and how bright it is, exactly averaged over small boxes.
//
// Pattern frame: x right, y down, the first point of the grid at the origin (an AprilGrid: the first tag's upper left corner);
// m. Points row by row; of a tag its lower left, lower right, upper right and upper left corner. Tags count from 0 along the rows.
//   chessboard         columns x rows inner corners, a white square's room around
//   circles            asymmetric: every second row moved by `size`, neighbours of a row 2 * size apart, rows `size`
//   symmetric_circles  `size` apart
//   april_grid         tag36h11 (codes from libapriltag, as printed), side `size`, gap * size between tags; border: cells of black
//                      about a code, kalibr prints 2; corner squares: the black squares that kalibr prints where gaps cross
//   charuco            columns x rows squares of OpenCV's board, side `size`, markers with side `marker`; points: the inner corners
// Circles have a quarter of the least distance of two as radius. With a `page`, what is seen is what that SVG file prints, its
// shapes' middle on the middle of the points. Thread-safe after construction.

#include <Eigen/Core>
#include <vector>

#include "test/simulator/config.h"

namespace alidade::simulator {

struct PrintedPage;

class PatternBoard {
 public:
  explicit PatternBoard(const PatternConfig& config);

  // Is OpenCV's aruco in this build?
  [[nodiscard]] static bool has_charuco();
  // Of one of OpenCV's dictionaries; 0 without aruco.
  [[nodiscard]] static int charuco_markers(int dictionary);

  [[nodiscard]] const std::vector<Eigen::Vector2d>& points() const { return points_; }
  [[nodiscard]] Eigen::Vector2d centre() const { return (low_ + high_) / 2; }
  // What is printed or white lies between these corners, the table around.
  [[nodiscard]] const Eigen::Vector2d& low() const { return low_; }
  [[nodiscard]] const Eigen::Vector2d& high() const { return high_; }

  // Mean over the box of this size about the place, 1 = white light.
  [[nodiscard]] double brightness(const Eigen::Vector2d& place, const Eigen::Vector2d& box) const;

 private:
  // Where a coordinate lies among nodes: index of the cell and how far into it, m.
  struct Place {
    int cell;
    double in;
  };
  class Nodes {
   public:
    void set(std::vector<double> nodes);
    [[nodiscard]] Place find(double x) const;
    [[nodiscard]] int cells() const { return static_cast<int>(nodes_.size()) - 1; }
    [[nodiscard]] double length(int cell) const;

   private:
    std::vector<double> nodes_;
    std::vector<int> first_;  // cell at the begin of each of equal steps
    double steps_per_m_ = 0;
  };

  void make_chessboard(const PatternConfig& config);
  void make_circles(const PatternConfig& config);
  void make_april_grid(const PatternConfig& config);
  void make_charuco(const PatternConfig& config);
  void lay_page(const PrintedPage& page);
  // Where the cells' columns and rows end, m.
  void lay(const std::vector<double>& x, const std::vector<double>& y);
  // is_black(column, row) of the cells.
  template <class IsBlack>
  void fill(const IsBlack& is_black);
  [[nodiscard]] double integral(const Place& x, const Place& y) const;
  [[nodiscard]] double circles_cover(const Eigen::Vector2d& place,
                                     const Eigen::Vector2d& box) const;

  PatternConfig config_;
  std::vector<Eigen::Vector2d> points_;
  Eigen::Vector2d low_, high_;
  double radius_ = 0;  // of circles, m
  std::vector<Eigen::Vector2d> page_circles_;
  // What is of one brightness from node to node: the brightness above the table's, and its integral from the corner to each node.
  Nodes x_, y_;
  std::vector<double> above_table_, integral_;
};

// How much of a box of this size lies on the inner side of a straight edge: the box's centre lies `depth` inside, the edge's
// unit normal is n.
[[nodiscard]] double box_cover(double depth, const Eigen::Vector2d& n, const Eigen::Vector2d& box);

}  // namespace alidade::simulator
