// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/majorant_grid.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace scolopax {

std::vector<float> buildMajorants(const std::vector<ValueInterval>& intervals,
                                  const TransferFunction& transfer) {
  std::vector<float> bounds(intervals.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, intervals.size(), 4096),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i)
                        bounds[i] = transfer.majorant(intervals[i]);
                    });
  return bounds;
}

std::vector<float> combineMajorants(std::span<const std::vector<float>* const> channels, std::size_t cells,
                                    bool sums) {
  const std::size_t stride = 1 + channels.size();
  std::vector<float> values(cells * stride);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells, 4096),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        float* cell = &values[i * stride];
                        for (std::size_t n = 0; n < channels.size(); ++n) {
                          cell[1 + n] = (*channels[n])[i];
                          cell[0] = sums ? cell[0] + cell[1 + n] : std::max(cell[0], cell[1 + n]);
                        }
                      }
                    });
  return values;
}

}  // namespace scolopax
