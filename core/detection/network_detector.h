#pragma once
// NetworkDetector: a user's YOLO, exported to ONNX, run by OpenCV's cv::dnn. One input of 1 x 3 x
// height x width. One output with N candidates of C classes, in pixels of the input, scores 0 to 1:
//   1 x (4 + C) x N   YOLOv8: centre u, v, width, height, C class scores
//   1 x N x (5 + C)   YOLOv5: the same, and before the class scores their factor, objectness
// The picture is scaled in proportion to fit into the input's middle; the rest is grey 114
// (letterbox). All three channels are the grey levels, 0 to 1. The surest of overlapping boxes, of
// any class, stays (NMSBoxes). Boxes are cut at the picture's border. Takes scratch memory and
// threads as OpenCV does: not for the real-time thread. For one thread.

#include <memory>
#include <string>
#include <vector>

#include "core/detection/detection_box.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

struct NetworkOptions {
  int width_px = 640;               // of the network's input; a multiple of 32 for YOLO
  int height_px = 640;              // likewise
  double threshold = 0.25;          // of the score
  double most_overlap = 0.45;       // of two boxes that both stay
  int most_boxes = 64;              // the surest
  std::vector<std::string> labels;  // of classes 0, 1, ...; empty: numbers are used

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class NetworkStatus {
  kOk,
  kNoImage,  // not valid, or stored bottom up
  kFailed    // OpenCV could not run the network, or its output has another layout than at first
};

class NetworkDetector {
 public:
  // model: the bytes of a file. options must be valid. Runs once on an empty image. The output's
  // kind follows from N: v8 has one candidate for each cell of grids with strides 8, 16 and 32, v5
  // has three. If N is another number, the larger dimension is taken for the candidates, the
  // smaller one for the values. (An export with NMS, 1 x N x 6, looks like v5's.) Null and one line
  // in *error: not an ONNX network, another input or output, boxes not in pixels, or labels of
  // another number.
  [[nodiscard]] static std::unique_ptr<NetworkDetector> load(const std::string& model,
                                                             const NetworkOptions& options,
                                                             std::string* error);
  ~NetworkDetector();
  NetworkDetector(const NetworkDetector&) = delete;
  NetworkDetector& operator=(const NetworkDetector&) = delete;

  [[nodiscard]] NetworkStatus find(const ImageView& image);
  // Boxes of the latest picture, surest first; empty unless its status was kOk.
  [[nodiscard]] const std::vector<DetectionBox>& boxes() const { return boxes_; }
  [[nodiscard]] int classes() const;

 private:
  struct Network;
  NetworkDetector(std::unique_ptr<Network> network, const NetworkOptions& options);

  NetworkOptions options_;
  std::unique_ptr<Network> network_;
  std::vector<DetectionBox> boxes_;
};

}  // namespace alidade
