#include "platform/video/jpeg_decoder.h"

#include <turbojpeg.h>

#include "platform/streams/picture_size.h"

namespace alidade {
namespace {

const unsigned char* bytes_of(std::string_view jpeg) {
  return reinterpret_cast<const unsigned char*>(jpeg.data());
}

}  // namespace

void JpegDecoder::Close::operator()(void* handle) const { tjDestroy(handle); }

JpegDecoder::JpegDecoder() : handle_(tjInitDecompress()) {}

// After a broken header the handle takes every later picture for the same one (libjpeg-turbo 2.1).
bool JpegDecoder::fail(const std::string& error) {
  error_ = error;
  handle_.reset(tjInitDecompress());
  return false;
}

bool JpegDecoder::read_size(std::string_view jpeg, int* width, int* height) {
  if (!handle_) {
    error_ = "libjpeg-turbo does not start";
    return false;
  }
  *width = 0;
  *height = 0;
  int subsampling = 0;
  int colours = 0;
  if (tjDecompressHeader3(handle_.get(), bytes_of(jpeg), jpeg.size(), width, height, &subsampling,
                          &colours) != 0) {
    return fail(std::string("damaged JPEG picture: ") + tjGetErrorStr2(handle_.get()));
  }
  // For the library, tables alone are a complete JPEG stream.
  if (*width < 1 || *height < 1) {
    return fail("damaged JPEG picture: it has no size");
  }
  if (colours == TJCS_CMYK || colours == TJCS_YCCK) {
    return fail("the JPEG picture is in printing colours; use grey or YCbCr pictures");
  }
  if (std::int64_t{*width} * *height > kMostFilePixels) {
    return fail("the JPEG picture claims " + std::to_string(*width) + "x" +
                std::to_string(*height) + " pixels; at most " + std::to_string(kMostFilePixels) +
                " are taken");
  }
  return true;
}

bool JpegDecoder::decode(std::string_view jpeg, Picture* picture) {
  int width = 0;
  int height = 0;
  if (!read_size(jpeg, &width, &height)) {
    return false;
  }
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::shared_ptr<std::uint8_t> luma = pool_.take(size);
  if (tjDecompress2(handle_.get(), bytes_of(jpeg), jpeg.size(), luma.get(), width, width, height,
                    TJPF_GRAY, TJFLAG_LIMITSCANS) != 0) {
    const std::string message = tjGetErrorStr2(handle_.get());
    // "Corrupt JPEG data: 2 extraneous bytes before marker 0xd9": all rows were decoded.
    if (tjGetErrorCode(handle_.get()) != TJERR_WARNING ||
        message.find("extraneous bytes before marker 0xd9") == std::string::npos) {
      return fail("damaged JPEG picture: " + message);
    }
  }
  picture->width = width;
  picture->height = height;
  picture->luma = luma.get();
  picture->stride = width;
  picture->pts = Picture::kNoPts;
  picture->owner = luma;
  return true;
}

}  // namespace alidade
