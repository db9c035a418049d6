// SPDX-License-Identifier: Apache-2.0
// Parallel loops over the pixels of a film and of its records. Run them in a launcher's arena.
#pragma once
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>

namespace scolopax {

/// [0, pixels) in pieces that are worth a task each.
inline tbb::blocked_range<std::size_t> pixelRange(std::size_t pixels) { return {0, pixels, 1 << 14}; }

template <class F>
void forEachPixel(std::size_t pixels, const F& f) {
  tbb::parallel_for(pixelRange(pixels), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) f(i);
  });
}

}  // namespace scolopax
