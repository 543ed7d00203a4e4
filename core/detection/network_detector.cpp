#include "core/detection/network_detector.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/dnn/all_layers.hpp>
#include <opencv2/imgproc.hpp>

namespace alidade {
namespace {

constexpr int kPaddingGrey = 114;  // as in the networks' training

// Layout of an output: where a candidate's values are.
struct Layout {
  bool values_first = false;  // 1 x values x candidates
  int candidates = 0;
  int classes = 0;

  [[nodiscard]] int before_classes() const { return values_first ? 4 : 5; }
};

std::string shape_of(const cv::Mat& output) {
  std::string shape;
  for (int i = 0; i < output.dims; ++i) {
    shape += (i > 0 ? "x" : "") + std::to_string(output.size[i]);
  }
  return shape;
}

// Number of places of YOLO's three grids, of strides 8, 16 and 32.
int places_of(const NetworkOptions& options) {
  int places = 0;
  for (const int stride : {8, 16, 32})
    places += (options.width_px / stride) * (options.height_px / stride);
  return places;
}

bool layout_of(const cv::Mat& output, const NetworkOptions& options, Layout* layout) {
  if (output.dims != 3 || output.size[0] != 1 || output.type() != CV_32F) return false;
  // Small inputs have fewer candidates than values. Networks other than YOLO's own have other
  // grids.
  const int places = places_of(options);
  const bool as_v8 = output.size[2] == places;
  const bool as_v5 = output.size[1] == 3 * places;
  if (as_v8 == as_v5 && output.size[1] == output.size[2]) return false;
  layout->values_first = as_v8 != as_v5 ? as_v8 : output.size[1] < output.size[2];
  const int values = layout->values_first ? output.size[1] : output.size[2];
  layout->candidates = layout->values_first ? output.size[2] : output.size[1];
  layout->classes = values - layout->before_classes();
  return layout->classes >= 1;
}

int values_between(const cv::dnn::MatShape& shape, std::size_t first, std::size_t end) {
  int values = 1;
  for (std::size_t i = first; i < end; ++i) values *= shape[i];
  return values;
}

// OpenCV 4.6 loses the shape of a constant factor, and lays its values along the axes from 1 on.
// YOLOv8's strides, 1 x N for boxes of 1 x 4 x N, belong elsewhere, as ONNX aligns shapes at their
// ends. Sets the axis for that in layers that cannot work as they are.
void align_constant_factors(cv::dnn::Net& net, const cv::dnn::MatShape& input) {
  for (const auto& name : net.getLayerNames()) {
    const int id = net.getLayerId(name);
    const auto layer = net.getLayer(id).dynamicCast<cv::dnn::ScaleLayer>();
    if (!layer || layer->axis != 1 || layer->blobs.empty()) continue;
    std::vector<cv::dnn::MatShape> inputs, outputs;
    net.getLayerShapes(input, id, inputs, outputs);
    const cv::dnn::MatShape& shape = inputs.front();
    const int factors = static_cast<int>(layer->blobs.front().total());
    bool works = factors == 1;
    for (std::size_t end = 2; end <= shape.size(); ++end)
      works = works || values_between(shape, 1, end) == factors;
    for (std::size_t axis = 2; !works && axis < shape.size(); ++axis) {
      works = values_between(shape, axis, shape.size()) == factors;
      if (works) layer->axis = static_cast<int>(axis);
    }
  }
}

// OpenCV also logs what it throws; this silences it, as the caller gets the error.
class SilentLog {
 public:
  SilentLog() : before_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~SilentLog() { cv::utils::logging::setLogLevel(before_); }
  SilentLog(const SilentLog&) = delete;
  SilentLog& operator=(const SilentLog&) = delete;

 private:
  cv::utils::logging::LogLevel before_;
};

}  // namespace

struct NetworkDetector::Network {
  cv::dnn::Net net;
  Layout layout;
  cv::Mat scaled, input, blob, output;
  cv::Rect of_picture;  // within the input
  std::vector<cv::Rect2d> places;
  std::vector<float> scores;
  std::vector<int> classes, kept;

  // Scales the picture into the input's middle.
  void letterbox(const cv::Mat& grey, const NetworkOptions& options) {
    const double scale = std::min(static_cast<double>(options.width_px) / grey.cols,
                                  static_cast<double>(options.height_px) / grey.rows);
    of_picture.width = std::max(1, cvRound(grey.cols * scale));
    of_picture.height = std::max(1, cvRound(grey.rows * scale));
    of_picture.x = (options.width_px - of_picture.width) / 2;
    of_picture.y = (options.height_px - of_picture.height) / 2;
    cv::resize(grey, scaled, of_picture.size(), 0, 0,
               scale < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
    cv::copyMakeBorder(scaled, scaled, of_picture.y, options.height_px - of_picture.br().y,
                       of_picture.x, options.width_px - of_picture.br().x, cv::BORDER_CONSTANT,
                       cv::Scalar::all(kPaddingGrey));
    cv::cvtColor(scaled, input, cv::COLOR_GRAY2BGR);
  }

  // Reads the candidates, in the picture's pixels.
  void read_candidates(const cv::Size& picture, double threshold) {
    places.clear();
    scores.clear();
    classes.clear();
    const auto* values = output.ptr<float>();
    const int first = layout.before_classes();
    const auto value = [&](int candidate, int which) -> double {
      const int at = layout.values_first ? which * layout.candidates + candidate
                                         : candidate * (first + layout.classes) + which;
      return values[at];
    };
    const double scale_u = static_cast<double>(of_picture.width) / picture.width;
    const double scale_v = static_cast<double>(of_picture.height) / picture.height;
    for (int i = 0; i < layout.candidates; ++i) {
      int best = 0;
      for (int k = 1; k < layout.classes; ++k) {
        if (value(i, first + k) > value(i, first + best)) best = k;
      }
      const double score = value(i, first + best) * (layout.values_first ? 1 : value(i, 4));
      if (!(score >= threshold)) continue;
      const double width = value(i, 2) / scale_u;
      const double height = value(i, 3) / scale_v;
      const cv::Rect2d place =
          cv::Rect2d((value(i, 0) - of_picture.x) / scale_u - width / 2,
                     (value(i, 1) - of_picture.y) / scale_v - height / 2, width, height) &
          cv::Rect2d(0, 0, picture.width, picture.height);
      if (!(place.area() > 0)) continue;
      places.push_back(place);
      scores.push_back(static_cast<float>(std::min(score, 1.0)));
      classes.push_back(best);
    }
  }

  // Normalised boxes, and a YOLOX's before decoding, have their middles near 0.
  [[nodiscard]] bool places_are_pixels(const NetworkOptions& options) const {
    const auto* values = output.ptr<float>();
    const int step = layout.values_first ? 1 : layout.before_classes() + layout.classes;
    for (int i = 0; i < layout.candidates; ++i) {
      if (static_cast<double>(values[i * step]) > options.width_px / 2.0) return true;
    }
    return false;
  }

  // Call once before forward(). False: as there.
  bool prepare() {
    try {
      align_constant_factors(net, {1, 3, input.rows, input.cols});
    } catch (const std::exception&) {
      return false;
    }
    return true;
  }

  // False: the network does not take this input.
  bool forward() {
    try {
      cv::dnn::blobFromImage(input, blob, 1.0 / 255);
      net.setInput(blob);
      output = net.forward();
    } catch (const std::exception&) {
      return false;
    }
    return true;
  }
};

bool NetworkOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (most_boxes < 1) problem = "most_boxes must be at least 1";
  if (!(most_overlap >= 0 && most_overlap <= 1)) problem = "most_overlap must be 0 to 1";
  if (!(threshold > 0 && threshold < 1)) problem = "threshold must be between 0 and 1";
  if (width_px < 32 || height_px < 32 || width_px > 4096 || height_px > 4096) {
    problem = "width_px and height_px must be 32 to 4096";
  }
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

NetworkDetector::NetworkDetector(std::unique_ptr<Network> network, const NetworkOptions& options)
    : options_(options), network_(std::move(network)) {}

NetworkDetector::~NetworkDetector() = default;

int NetworkDetector::classes() const { return network_->layout.classes; }

std::unique_ptr<NetworkDetector> NetworkDetector::load(const std::string& model,
                                                       const NetworkOptions& options,
                                                       std::string* error) {
  const SilentLog silent;
  auto network = std::make_unique<Network>();
  try {
    network->net = cv::dnn::readNetFromONNX(model.data(), model.size());
  } catch (const std::exception&) {
  }
  if (network->net.empty()) {
    *error =
        "is not an ONNX network that OpenCV can read; export it with opset 12, a static shape and "
        "32-bit values";
    return nullptr;
  }
  const std::string size =
      std::to_string(options.width_px) + "x" + std::to_string(options.height_px);
  network->input.create(options.height_px, options.width_px, CV_8UC3);
  network->input.setTo(cv::Scalar::all(kPaddingGrey));
  if (!network->prepare() || !network->forward()) {
    *error =
        "does not take pictures of " + size +
        " px with three channels; set width_px and height_px to the size that it was exported for";
    return nullptr;
  }
  if (!layout_of(network->output, options, &network->layout)) {
    *error = "has an output of " + shape_of(network->output) +
             "; expected 1x(4+classes)xN (YOLOv8) or 1xNx(5+classes) (YOLOv5)";
    return nullptr;
  }
  if (!network->places_are_pixels(options)) {
    *error =
        "gives boxes that are not in pixels of its input (normalised, or of a YOLOX without its "
        "decoding); export it with boxes in pixels";
    return nullptr;
  }
  const auto classes = static_cast<std::size_t>(network->layout.classes);
  if (!options.labels.empty() && options.labels.size() != classes) {
    *error = "has " + std::to_string(classes) + " classes, but there are " +
             std::to_string(options.labels.size()) +
             " labels; give one label for each class, one a line";
    return nullptr;
  }
  return std::unique_ptr<NetworkDetector>(new NetworkDetector(std::move(network), options));
}

NetworkStatus NetworkDetector::find(const ImageView& image) {
  boxes_.clear();
  if (!image.valid() || image.stride < 0) return NetworkStatus::kNoImage;
  Network& n = *network_;
  const cv::Mat grey(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.row(0)),
                     static_cast<std::size_t>(image.stride));
  n.letterbox(grey, options_);
  Layout layout;
  if (!n.forward() || !layout_of(n.output, options_, &layout) ||
      layout.classes != n.layout.classes) {
    return NetworkStatus::kFailed;
  }
  n.layout = layout;
  n.read_candidates(grey.size(), options_.threshold);
  cv::dnn::NMSBoxes(n.places, n.scores, static_cast<float>(options_.threshold),
                    static_cast<float>(options_.most_overlap), n.kept);
  const auto most = static_cast<std::size_t>(options_.most_boxes);
  if (n.kept.size() > most) n.kept.resize(most);
  for (const int kept : n.kept) {
    const auto at = static_cast<std::size_t>(kept);
    DetectionBox box;
    box.u = n.places[at].x;
    box.v = n.places[at].y;
    box.width = n.places[at].width;
    box.height = n.places[at].height;
    box.score = n.scores[at];
    const auto number = static_cast<std::size_t>(n.classes[at]);
    box.name = options_.labels.empty() ? std::to_string(number) : options_.labels[number];
    boxes_.push_back(std::move(box));
  }
  return NetworkStatus::kOk;
}

}  // namespace alidade
