// SPDX-License-Identifier: Apache-2.0
#include "server/encoder.h"

#include <turbojpeg.h>

#include <memory>
#include <string>

#include "renderer/core/error.h"

namespace scolopax::server {
namespace {

constexpr int kMaxSide = 65500;  // libjpeg's JPEG_MAX_DIMENSION

struct DestroyHandle {
  void operator()(void* handle) const { tjDestroy(handle); }
};

// One per thread, because a handle may be used by only one thread at a time and is costly to create.
tjhandle threadCompressor() {
  thread_local const std::unique_ptr<void, DestroyHandle> handle(tjInitCompress());
  if (!handle) throw Error(ErrorCode::io, std::string("JPEG encoder: ") + tjGetErrorStr2(nullptr));
  return handle.get();
}

}  // namespace

std::uint64_t jpegMemory(std::uint64_t pixels) {
  // 3 bytes a pixel for the 8-bit picture, 6 for the library's upper bound (which rounds the sides up), and 2
  // for the copy of the result.
  return pixels * (3 + 6 + 2) + (1 << 16);
}

std::vector<std::uint8_t> encodeJpeg(const Image8& image, int quality, ChromaSampling sampling) {
  if (image.width < 1 || image.height < 1 ||
      image.rgb.size() != std::size_t(image.width) * std::size_t(image.height) * 3)
    throw Error(ErrorCode::badInput, "JPEG: expected width x height x 3 bytes, found an image of " +
                                         std::to_string(image.width) + " x " + std::to_string(image.height) +
                                         " with " + std::to_string(image.rgb.size()) + " bytes");
  if (image.width > kMaxSide || image.height > kMaxSide)
    throw Error(ErrorCode::tooLarge, "JPEG: expected at most 65500 pixels on a side, found " +
                                         std::to_string(image.width) + " x " + std::to_string(image.height));
  const int subsampling = sampling == ChromaSampling::full444 ? TJSAMP_444 : TJSAMP_420;
  std::vector<std::uint8_t> bytes(tjBufSize(image.width, image.height, subsampling));
  unsigned char* begin = bytes.data();
  auto size = static_cast<unsigned long>(bytes.size());
  const tjhandle handle = threadCompressor();
  // NOREALLOC: the buffer has the size of the library's own upper bound, so the result always fits into it.
  if (tjCompress2(handle, image.rgb.data(), image.width, 0, image.height, TJPF_RGB, &begin, &size,
                  subsampling, quality, TJFLAG_NOREALLOC) != 0)
    throw Error(ErrorCode::io, std::string("JPEG encoder: ") + tjGetErrorStr2(handle));
  return {bytes.begin(), bytes.begin() + std::ptrdiff_t(size)};  // the bound is many times larger
}

}  // namespace scolopax::server
