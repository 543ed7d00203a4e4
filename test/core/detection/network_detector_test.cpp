#include "core/detection/network_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "test/support/not_a_number.h"

namespace alidade::test {
namespace {

// test/data/make_networks.py says what they answer.
std::string network_file(const std::string& kind) {
  std::ifstream file(std::string(ALIDADE_TEST_DATA) + "/bright_cells_" + kind + ".onnx",
                     std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

NetworkOptions of_cells() {
  NetworkOptions options;
  options.width_px = 64;
  options.height_px = 64;
  options.threshold = 0.7;
  return options;
}

std::unique_ptr<NetworkDetector> loaded(const std::string& kind, const NetworkOptions& options) {
  std::string error;
  auto detector = NetworkDetector::load(network_file(kind), options, &error);
  EXPECT_TRUE(detector) << error;
  return detector;
}

// Mid-grey, of which the networks are sure of nothing, with bright or dark rectangles.
class Picture {
 public:
  Picture(int width, int height) : memory_(static_cast<std::size_t>(width * height), 128) {
    view = {memory_.data(), width, height, width};
  }
  void paint(int left, int top, int width, int height, std::uint8_t grey) {
    for (int v = top; v < top + height; ++v) {
      for (int u = left; u < left + width; ++u) {
        memory_[static_cast<std::size_t>(v * view.width + u)] = grey;
      }
    }
  }
  ImageView view;

 private:
  std::vector<std::uint8_t> memory_;
};

MATCHER_P4(Spans, u, v, width, height, "") {
  return std::abs(arg.u - u) < 1e-3 && std::abs(arg.v - v) < 1e-3 &&
         std::abs(arg.width - width) < 1e-3 && std::abs(arg.height - height) < 1e-3;
}

TEST(NetworkDetector, FindsWhatItWasTaughtInEitherLayoutOnceAndTheSurestFirst) {
  for (const auto& [kind, objectness] : {std::pair{"v8", 1.0}, std::pair{"v5", 0.8}}) {
    const auto detector = loaded(kind, of_cells());
    ASSERT_TRUE(detector);
    EXPECT_EQ(detector->classes(), 2);
    Picture picture(64, 64);
    picture.paint(16, 8, 8, 8, 255);
    picture.paint(40, 48, 8, 8, 10);
    ASSERT_EQ(detector->find(picture.view), NetworkStatus::kOk);
    // Cells' middles at 20, 12 and 44, 52; 1 right and 2 below, 10 x 6 px.
    ASSERT_THAT(detector->boxes(),
                ::testing::ElementsAre(Spans(16, 11, 10, 6), Spans(40, 51, 10, 6)));
    EXPECT_EQ(detector->boxes()[0].name, "0");
    EXPECT_EQ(detector->boxes()[1].name, "1");
    EXPECT_NEAR(detector->boxes()[0].score, objectness, 1e-5);
    EXPECT_NEAR(detector->boxes()[1].score, objectness * (1 - 10 / 255.0), 1e-5);
  }
}

TEST(NetworkDetector, BoxesAreWhereThePictureIsInItsFrame) {
  NetworkOptions options = of_cells();
  options.labels = {"bright", "dark"};
  const auto detector = loaded("v8", options);
  ASSERT_TRUE(detector);
  // Scaled by 1/4 to 64 x 32, rows 16 to 48 of the input: its cell from 24, 24 on is this.
  Picture wide(256, 128);
  wide.paint(96, 32, 32, 32, 255);
  ASSERT_EQ(detector->find(wide.view), NetworkStatus::kOk);
  ASSERT_THAT(detector->boxes(), ::testing::ElementsAre(Spans(96, 4 * (30 - 3 - 16), 40, 24)));
  EXPECT_EQ(detector->boxes()[0].name, "bright");
  // Scaled by 2 to 32 x 64, columns 16 to 48.
  Picture high(16, 32);
  high.paint(4, 12, 4, 4, 0);
  ASSERT_EQ(detector->find(high.view), NetworkStatus::kOk);
  // cv::resize mixes in what is beside the cell: of a class, at its place.
  ASSERT_EQ(detector->boxes().size(), 1U);
  EXPECT_EQ(detector->boxes()[0].name, "dark");
  EXPECT_THAT(detector->boxes()[0], Spans((29 - 5 - 16) / 2.0, (30 - 3) / 2.0, 5, 3));
}

TEST(NetworkDetector, BoxesEndAtThePicturesEdge) {
  const auto detector = loaded("v8", of_cells());
  ASSERT_TRUE(detector);
  Picture picture(64, 64);
  picture.paint(56, 56, 8, 8, 255);
  ASSERT_EQ(detector->find(picture.view), NetworkStatus::kOk);
  EXPECT_THAT(detector->boxes(), ::testing::ElementsAre(Spans(56, 59, 8, 5)));
}

TEST(NetworkDetector, KeepsAsManyBoxesAsAskedFor) {
  NetworkOptions options = of_cells();
  options.most_boxes = 5;
  const auto detector = loaded("v8", options);
  ASSERT_TRUE(detector);
  Picture picture(64, 64);
  picture.paint(0, 0, 64, 64, 255);
  ASSERT_EQ(detector->find(picture.view), NetworkStatus::kOk);
  EXPECT_EQ(detector->boxes().size(), 5U);
  EXPECT_EQ(detector->find({}), NetworkStatus::kNoImage);
  EXPECT_THAT(detector->boxes(), ::testing::IsEmpty());
}

TEST(NetworkDetector, SaysInALineWhyItCannotBeUsed) {
  const auto error_of = [](const std::string& model, const NetworkOptions& options) {
    std::string error;
    EXPECT_FALSE(NetworkDetector::load(model, options, &error));
    EXPECT_THAT(error, ::testing::Not(::testing::HasSubstr("\n")));
    return error;
  };
  const std::string v8 = network_file("v8");
  EXPECT_THAT(error_of("", of_cells()), ::testing::HasSubstr("is not an ONNX network"));
  EXPECT_THAT(error_of("nothing of the kind", of_cells()),
              ::testing::HasSubstr("is not an ONNX network"));
  EXPECT_THAT(error_of(v8.substr(0, v8.size() / 2), of_cells()),
              ::testing::HasSubstr("is not an ONNX network"));
  NetworkOptions other_size = of_cells();
  other_size.width_px = 128;
  EXPECT_THAT(error_of(v8, other_size),
              ::testing::HasSubstr("does not take pictures of 128x64 px"));
  EXPECT_THAT(error_of(network_file("pictures"), of_cells()),
              ::testing::HasSubstr("has an output of 1x1x8x8; expected 1x(4+classes)xN"));
  EXPECT_THAT(error_of(network_file("shares"), of_cells()),
              ::testing::HasSubstr("gives boxes that are not in pixels of its input"));
  NetworkOptions three = of_cells();
  three.labels = {"a", "b", "c"};
  EXPECT_THAT(error_of(v8, three), ::testing::HasSubstr("has 2 classes, but there are 3 labels"));
}

TEST(NetworkOptions, SayWhatIsWrong) {
  const char* error = nullptr;
  EXPECT_TRUE(NetworkOptions().validate(&error));
  NetworkOptions options;
  options.threshold = kNan;
  EXPECT_FALSE(options.validate(&error));
  EXPECT_STREQ(error, "threshold must be between 0 and 1");
  options = {};
  options.width_px = 0;
  EXPECT_FALSE(options.validate(&error));
  EXPECT_STREQ(error, "width_px and height_px must be 32 to 4096");
}

}  // namespace
}  // namespace alidade::test
