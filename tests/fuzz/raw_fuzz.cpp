// SPDX-License-Identifier: Apache-2.0
// The first byte selects the kind of sidecar; the rest is the sidecar, for a small data file that it may
// name.
#include "tests/fuzz/load_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const std::uint8_t kVoxels[4096] = {1, 2, 3};
  if (size == 0) return 0;
  scolopax::fuzz::writeFile("v.raw", kVoxels, sizeof kVoxels);
  return scolopax::fuzz::loadAs(bytes[0] % 2 == 0 ? "a.dat" : "a.ivf", bytes + 1, size - 1);
}
