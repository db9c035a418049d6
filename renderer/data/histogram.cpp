// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/histogram.h"

#include <algorithm>
#include <cmath>

namespace scolopax {

double Histogram::quantile(double p) const {
  if (quantiles.empty()) return 0;
  const double at = std::clamp(p, 0.0, 1.0) * double(quantiles.size() - 1);
  const auto low = std::min(std::size_t(at), quantiles.size() - 1);
  const auto high = std::min(low + 1, quantiles.size() - 1);
  return std::lerp(quantiles[low], quantiles[high], at - double(low));
}

}  // namespace scolopax
