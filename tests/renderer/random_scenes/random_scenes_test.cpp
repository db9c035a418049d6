// SPDX-License-Identifier: Apache-2.0
// Scenes in which everything is random: compares the reference with directMarch(), and every method with the
// reference. SCOLOPAX_RANDOM_SCENES is the number of scenes, SCOLOPAX_RANDOM_SCENES_FIRST the number of the
// first one, and SCOLOPAX_RANDOM_SCENES_FOLDER the folder for files of failing scenes.
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>

#include "tests/renderer/random_scenes/checks.h"

namespace scolopax::random_scenes {
namespace {

std::uint64_t numberFrom(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// An exception is a finding. It is caught here, because it would cancel the computation of the other scenes.
std::vector<Finding> findingsIn(std::uint64_t number) {
  try {
    return checkScene(drawScene(number));
  } catch (const std::exception& error) {
    return {{number, "exception", error.what()}};
  }
}

/// The scenes are divided among this many tests, so that none takes too long for ctest.
constexpr int kParts = 10;

class RandomScenes : public testing::TestWithParam<int> {};

TEST_P(RandomScenes, LookTheSameByAllMethods) {
  const std::uint64_t count = numberFrom("SCOLOPAX_RANDOM_SCENES", 300);
  const std::uint64_t first = numberFrom("SCOLOPAX_RANDOM_SCENES_FIRST", 0);
  const std::uint64_t part = std::uint64_t(GetParam());
  std::mutex mutex;
  std::vector<Finding> findings;
  tbb::parallel_for(first + count * part / kParts, first + count * (part + 1) / kParts,
                    [&](std::uint64_t number) {
                      const std::vector<Finding> found = findingsIn(number);
                      const std::lock_guard lock(mutex);
                      findings.insert(findings.end(), found.begin(), found.end());
                    });
  std::sort(findings.begin(), findings.end(),
            [](const Finding& a, const Finding& b) { return a.scene < b.scene; });
  for (const Finding& finding : findings) {
    const RandomScene scene = drawScene(finding.scene);
    std::string again =
        "SCOLOPAX_RANDOM_SCENES=1 SCOLOPAX_RANDOM_SCENES_FIRST=" + std::to_string(finding.scene);
    if (const char* folder = std::getenv("SCOLOPAX_RANDOM_SCENES_FOLDER"))
      again = writeScene(scene, std::string(folder) + "/" + std::to_string(finding.scene));
    ADD_FAILURE() << finding.what << ": " << finding.text << "\n" << describe(scene) << "\n" << again;
  }
}

INSTANTIATE_TEST_SUITE_P(Parts, RandomScenes, testing::Range(0, kParts));

}  // namespace
}  // namespace scolopax::random_scenes
