// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/load_bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  return scolopax::fuzz::loadAs("a.tif", bytes, size);
}
