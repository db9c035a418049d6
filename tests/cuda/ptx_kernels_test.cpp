// SPDX-License-Identifier: Apache-2.0
// Tests of the compiled kernels: none is missing, and all of their memory accesses are checked.
#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "tests/cuda/device_scenes.h"
#include "tests/cuda/ptx_counts.h"
#include "tests/cuda/substitute_runtime.h"
#include "tests/cuda/uploaded_plan.h"

namespace scolopax {
namespace {

using namespace test;

TEST(PtxKernels, AreOneForEveryMethodBlendModeAndLight) {
  // auto uses the other methods. raymarch and hybrid share two kernels, for equal steps and for voxel cells.
  // Each kernel exists with and without light, and both again for plain scenes. One more kernel rebuilds
  // totals.
  EXPECT_EQ(ptx::kernelNames().size(), (std::size(kMethods) - 1) * std::size(kBlendModes) * 2 * 2 + 1);
}

TEST(PtxKernels, AreCaughtReadingAndWritingWhereTheyMayNot) {
  const UploadedPlan uploaded(mixedVolume(), obliqueScene(*mixedVolume(), 8, 8));
  const auto faultOf = [&](const kernel::SceneView& view, std::size_t pixels) {
    const ExactPixels film(pixels);
    cuda::DeviceBand band = uploaded.band(film.data());
    band.scene = view;
    const Instance instance{Method::superposed, BlendMode::density, false, false};
    const auto launch = cuda::chooseLaunch(instance, band, uploaded.plan().view().channels);
    EXPECT_EQ(launch(band, nullptr), cudaSuccess);
    return cudaDeviceSynchronize() == cudaSuccess ? "" : substitute::lastFault();
  };
  const kernel::SceneView onDevice = uploaded.band(nullptr).scene;
  EXPECT_EQ(faultOf(onDevice, 64), "");
  EXPECT_THAT(faultOf(onDevice, 63), testing::HasSubstr("store outside of memory"));
  EXPECT_THAT(faultOf(uploaded.plan().view(), 64),
              testing::HasSubstr("load outside of memory"));  // the host's
}

TEST(PtxKernels, ReadTheFlagThatEndsThemSeldomUntilItIsSet) {
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const auto volume = mixedVolume();
  Scene scene = obliqueScene(*volume, 24, 32);
  scene.method = Method::raymarch;
  scene.step = 0.1;
  const UploadedPlan uploaded(volume, scene);
  const ExactPixels film(24 * 32);
  cuda::DeviceBand band = uploaded.band(film.data());
  const auto launch = cuda::chooseLaunch({Method::raymarch, BlendMode::density, false, false}, band,
                                         uploaded.plan().view().channels);
  struct Counts {
    std::uint64_t readings, hostAccesses;
  };
  const auto countsOf = [&](const std::atomic<bool>* cancel) {
    band.scene.cancel = cancel;
    const Counts before{ptx::clockReadings, ptx::hostAccesses};
    EXPECT_EQ(launch(band, nullptr), cudaSuccess);
    EXPECT_EQ(cudaDeviceSynchronize(), cudaSuccess);
    return Counts{ptx::clockReadings - before.readings, ptx::hostAccesses - before.hostAccesses};
  };
  const Counts without = countsOf(nullptr);
  EXPECT_EQ(without.readings, 0u);
  EXPECT_EQ(without.hostAccesses, 0u);

  void* memory = nullptr;
  ASSERT_EQ(cudaHostAlloc(&memory, sizeof(std::atomic<bool>), cudaHostAllocMapped), cudaSuccess);
  auto* const flag = new (memory) std::atomic<bool>(false);
  const Counts unset = countsOf(flag);
  const std::uint64_t blocks = 3 * 2, readingsPerAnswer = kernel::kAnswerCycles / ptx::kCyclesPerReading;
  EXPECT_GT(unset.readings, 10'000u);
  EXPECT_GE(unset.hostAccesses, unset.readings / (readingsPerAnswer + 1));
  EXPECT_LE(unset.hostAccesses, unset.readings / readingsPerAnswer + blocks);
  *flag = true;
  const Counts set = countsOf(flag);
  EXPECT_GE(set.hostAccesses + readingsPerAnswer, set.readings) << "as soon as it is set, always";
  EXPECT_LE(set.readings, 4u * 24 * 32) << "then rays end";
  cudaFreeHost(memory);

  band.scene.cancel = &kNever;  // not mapped
  EXPECT_EQ(launch(band, nullptr), cudaSuccess);
  EXPECT_EQ(cudaDeviceSynchronize(), cudaErrorIllegalAddress);
  EXPECT_THAT(substitute::lastFault(), testing::HasSubstr("load outside of memory"));
}

TEST(PtxInstructions, OfBitFieldsInsertOneAndCutWhatIsBeyond) {
  EXPECT_EQ(ptx::insertBits<std::uint32_t>(0xabc, 0xffffffff, 8, 8), 0xffffbcffu);
  EXPECT_EQ(ptx::insertBits<std::uint32_t>(0xabc, 0x12345678, 28, 8), 0xc2345678u);
  EXPECT_EQ(ptx::insertBits<std::uint64_t>(3, 1, 1, 63), 7u);
  EXPECT_EQ(ptx::insertBits<std::uint64_t>(~0ull, 5, 64, 4), 5u);
  EXPECT_EQ(ptx::insertBits<std::uint64_t>(~0ull, 5, 0, 0), 5u);
}

TEST(PtxInstructions, OfFunnelShiftsTakeBitsFromBothWords) {
  EXPECT_EQ(ptx::funnelLeft(0x80000001, 0x12345678, 4), 0x23456788u);
  EXPECT_EQ(ptx::funnelLeft(0x80000001, 0x12345678, 32), 0x12345678u);
  EXPECT_EQ(ptx::funnelRight(0x80000001, 0x12345678, 4), 0x88000000u);
  EXPECT_EQ(ptx::funnelRight(0x80000001, 0x12345678, 32), 0x80000001u);
}

TEST(PtxMemory, IsWhatAThreadOwnsAlignedAndOnlyWhileItDoes) {
  const std::vector<ptx::Range> global{{1000, 1024}, {2000, 2004}}, parameters{{3000, 3008}};
  ptx::Thread thread{{}, {}, {}, {}, global, parameters};
  const auto allowed = [&](std::uint64_t address, std::size_t size, ptx::Access access) {
    try {
      ptx::checkAccess(thread, address, size, access);
      return true;
    } catch (const ptx::Fault&) {
      return false;
    }
  };
  using enum ptx::Access;
  EXPECT_TRUE(allowed(1000, 8, load) && allowed(1016, 8, store) && allowed(2000, 4, store));
  EXPECT_FALSE(allowed(1024, 1, load) || allowed(999, 1, load) || allowed(2000, 8, store));
  EXPECT_FALSE(allowed(1004, 8, load)) << "misaligned";
  EXPECT_TRUE(allowed(3000, 8, load));
  EXPECT_FALSE(allowed(3000, 8, store)) << "parameters are constant";
  alignas(8) std::byte outer[8], inner[8];
  {
    const ptx::Frame outerFrame(thread, outer);
    {
      const ptx::Frame innerFrame(thread, inner);
      EXPECT_TRUE(allowed(ptx::addressOf(outer), 8, store) && allowed(ptx::addressOf(inner), 8, store));
    }
    EXPECT_TRUE(allowed(ptx::addressOf(outer), 8, load));
    EXPECT_FALSE(allowed(ptx::addressOf(inner), 8, load));
  }
  EXPECT_FALSE(allowed(ptx::addressOf(outer), 8, load));
}

TEST(PtxCounts, TellGlobalMemoryFromLocalMemoryAndParameters) {
  alignas(8) const std::byte outside[16]{}, parameter[8]{};
  const std::uint64_t begin = ptx::addressOf(parameter);
  const std::vector<ptx::Range> parameters{{begin, begin + sizeof parameter}};
  ptx::Thread thread{{}, {}, {}, {}, {}, parameters};
  alignas(8) std::byte outer[8], inner[8];
  const ptx::Frame outerFrame(thread, outer), innerFrame(thread, inner);
  ptx::counts = {};
  ptx::countLoad(thread, ptx::addressOf(outside), 16);
  ptx::countLoad(thread, ptx::addressOf(outside), 4);
  ptx::countLoad(thread, ptx::addressOf(outer), 8);
  ptx::countLoad(thread, ptx::addressOf(inner) + 4, 4);
  ptx::countLoad(thread, begin, 8);
  EXPECT_EQ(ptx::counts.loads, 2u);
  EXPECT_EQ(ptx::counts.loadedBytes, 20u);
  EXPECT_EQ(ptx::counts.localLoads, 2u);
  EXPECT_EQ(ptx::counts.localBytes, 12u);
  EXPECT_EQ(ptx::counts.instructions, 0u);
}

}  // namespace
}  // namespace scolopax
