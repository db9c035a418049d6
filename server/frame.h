// SPDX-License-Identifier: Apache-2.0
// A session's picture on its way to the viewers: first rendered (float), then encoded (JPEG, with the float
// image).
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "renderer/data/aov.h"
#include "renderer/data/image.h"

namespace scolopax::server {

using TimePoint = std::chrono::steady_clock::time_point;
/// The steady clock, or a test's own.
using Now = std::function<TimePoint()>;

using ViewerId = std::uint64_t;  ///< a client that watches a session; 0: none of them

/// Metadata of a frame; most of it is also in the frame header on the wire.
struct FrameInfo {
  std::uint32_t number = 0;           ///< counts a session's encoded frames from 1; 0 before encoding
  std::uint32_t revision = 0;         ///< of the scene that it shows; a frame never mixes two scenes
  std::uint32_t samples = 0;          ///< per pixel
  Method method = Method::automatic;  ///< the method that was used
  float error = 0;  ///< estimated RMSE over linear premultiplied RGBA; NaN below two samples
  std::uint32_t rebuildUs = 0, renderUs = 0,
                encodeUs = 0;  ///< times of the last rebuild, the last pass, this encoding
  bool interactive = false;    ///< made while edits arrive or soon after; may be reduced
  bool reduced = false;        ///< smaller than the scene's picture; the viewer enlarges it
  bool mixed = false;          ///< blended with the reduced picture before it (blend.h); not for scripts
  bool final = false;          ///< the stop rule is met: nothing better follows at this revision
};

/// A film's linear picture, passed from the render thread to the encoder thread.
struct RenderedFrame {
  FrameInfo info;
  std::shared_ptr<const Image> image;
  glm::vec3 background{0};
  std::shared_ptr<const std::vector<AovValues>> aovs;  ///< in the order of kAovs; null if not requested
};

/// One encoding serves every viewer of a session.
struct EncodedFrame {
  FrameInfo info;
  int width = 0, height = 0;
  std::shared_ptr<const std::vector<unsigned char>> jpeg;
  std::shared_ptr<const Image> image;  ///< for scripts that ask for png or exr; null once dropped
  glm::vec3 background{0};
  std::shared_ptr<const std::vector<AovValues>> aovs;  ///< as in RenderedFrame
};

}  // namespace scolopax::server
