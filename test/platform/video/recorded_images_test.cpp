// Pictures of each format that a recording may hold, beside another decoder.

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "platform/video/recording_frame_source.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

struct ImageKind {
  const char* name;
  const char* extension;
  int type;                  // OpenCV's
  std::vector<int> options;  // of its encoder
  int tolerance;  // grey levels: the decoders' transforms, or weights of colours, are rounded differently
};
void PrintTo(const ImageKind& kind, std::ostream* os) { *os << kind.name; }

class RecordedImages : public testing::TestWithParam<ImageKind> {};

INSTANTIATE_TEST_SUITE_P(
    All, RecordedImages,
    testing::Values(
        ImageKind{"GreyPng", "png", CV_8UC1, {}, 0}, ImageKind{"ColourPng", "png", CV_8UC3, {}, 1},
        ImageKind{"PngWithAlpha", "png", CV_8UC4, {}, 1},
        ImageKind{"DeepGreyPng", "png", CV_16UC1, {}, 1},
        ImageKind{"DeepColourPng", "png", CV_16UC3, {}, 2},
        ImageKind{"GreyJpeg", "jpg", CV_8UC1, {cv::IMWRITE_JPEG_QUALITY, 90}, 2},
        ImageKind{"ColourJpeg", "jpg", CV_8UC3, {cv::IMWRITE_JPEG_QUALITY, 90}, 2},
        ImageKind{"ProgressiveJpeg", "jpg", CV_8UC3, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}, 2},
        ImageKind{"GreyPgm", "pgm", CV_8UC1, {}, 0}, ImageKind{"DeepPgm", "pgm", CV_16UC1, {}, 1}),
    [](const auto& p) { return std::string(p.param.name); });

// Of real size, several in a row, unlike each other: where a decoder carries one over into the next.
TEST_P(RecordedImages, AreWhatAnotherDecoderSeesInThem) {
  constexpr int kImages = 3;
  constexpr int kWidth = 1280;
  constexpr int kHeight = 720;
  const ImageKind& kind = GetParam();
  const TemporaryDirectory directory;
  directory.write("recording.yaml", "format: 1\nwidth: 1280\nheight: 720\n");
  directory.write("frames.csv", "frame,receive_time_s\n0,100\n1,100.1\n2,100.2\n");
  cv::RNG random(7);
  std::vector<cv::Mat> expected;
  for (int i = 0; i < kImages; ++i) {
    cv::Mat image(kHeight, kWidth, kind.type);
    const double full = image.depth() == CV_16U ? 65535 : 255;
    random.fill(image, cv::RNG::UNIFORM, 0, full);
    cv::GaussianBlur(image, image, {}, 2);
    image *= 1 + 0.2 * i;
    std::vector<unsigned char> file;
    ASSERT_TRUE(cv::imencode(std::string(".") + kind.extension, image, file, kind.options));
    directory.write("frames/00000" + std::to_string(i) + "." + kind.extension,
                    std::string(file.begin(), file.end()));
    expected.push_back(cv::imdecode(file, cv::IMREAD_GRAYSCALE));
  }
  RecordingFrameSourceOptions options;
  options.directory = directory.path();
  const auto source = open_recorded_frames(options);
  for (const cv::Mat& image : expected) {
    Frame frame;
    ASSERT_EQ(source->read(frame, 0), ReadStatus::kOk) << source->error();
    const cv::Mat luma(kHeight, kWidth, CV_8UC1, const_cast<std::uint8_t*>(frame.luma),
                       static_cast<std::size_t>(frame.stride));
    EXPECT_LE(cv::norm(luma, image, cv::NORM_INF), kind.tolerance);
  }
}

}  // namespace
}  // namespace alidade
