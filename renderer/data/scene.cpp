// SPDX-License-Identifier: Apache-2.0
#include "renderer/data/scene.h"

namespace scolopax {

bool makeSameFilm(const Scene& a, const Scene& b) {
  if (a.background == b.background) return a == b;
  Scene other = a;
  other.background = b.background;
  return other == b;
}

}  // namespace scolopax
