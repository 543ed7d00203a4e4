#pragma once
// What a neural network of the user's finds, by OpenCV's cv::dnn: a YOLO exported to ONNX, one input of 1 x 3 x height x width, one output of one of two
// shapes, N candidates of C classes, told apart by N, which is that of grids of strides 8, 16 and 32, three times
// that for v5, and else by there being more candidates than values (an export with NMS, 1 x N x 6, cannot be told from v5's):
//   1 x (4 + C) x N   YOLOv8:       centre u, v, width, height, C class scores
//   1 x N x (5 + C)   YOLOv5:       centre u, v, width, height, objectness, C class scores; the score is objectness x class score
// in pixels of the input, scores 0 to 1. The picture is scaled to fit, whole and in proportion, in the input's middle, the rest grey 114 (letterbox); values
// 0 to 1. There is no colour: all three channels are the grey levels. Of boxes that overlap, whatever their class, the surest stays (cv::dnn::NMSBoxes).
// Scratch memory is taken as OpenCV does, on OpenCV's threads: not for the real-time thread. For one thread.

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
  double most_overlap = 0.45;       // of two boxes that stay
  int most_boxes = 64;              // the surest
  std::vector<std::string> labels;  // of classes 0, 1, ...; none: their numbers

  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class NetworkStatus {
  kOk,
  kNoImage,  // not valid
  kFailed    // the network's output is not what it was at the start
};

class NetworkDetector {
 public:
  // model: a file's bytes; options are valid. It looks once, at nothing. Null with one line that says why: no ONNX network, none of this input, of this
  // output, none whose boxes are in pixels, or of so many classes.
  [[nodiscard]] static std::unique_ptr<NetworkDetector> load(const std::string& model,
                                                             const NetworkOptions& options,
                                                             std::string* error);
  ~NetworkDetector();
  NetworkDetector(const NetworkDetector&) = delete;
  NetworkDetector& operator=(const NetworkDetector&) = delete;

  [[nodiscard]] NetworkStatus find(const ImageView& image);
  // Of the latest picture, the surest first.
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
