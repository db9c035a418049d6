// SPDX-License-Identifier: Apache-2.0
// Macros that mark code that runs on host and device alike, and code that runs on one lane or many. Kernels
// use only arithmetic, comparisons and the functions of this folder, so that every compiler and device
// computes the same bits.
#pragma once

#if defined(__CUDACC__)
#define SCOLOPAX_HD __host__ __device__
#else
#define SCOLOPAX_HD
#endif

// Device kernels of plain scenes are compiled in files of their own, which define SCOLOPAX_PLAIN_SCENES:
// without the code that only other scenes need, because a device allocates registers and local memory for all
// compiled code, whether it runs or not.
namespace scolopax::kernel {
#if defined(__CUDA_ARCH__) && defined(SCOLOPAX_PLAIN_SCENES)
inline constexpr bool kPlainDevice = true;
#else
inline constexpr bool kPlainDevice = false;
#endif
}  // namespace scolopax::kernel

// SCOLOPAX_HOT marks functions in which most of the time is spent; everything that they call is inlined.
// SCOLOPAX_PART marks parts of a function that are functions only for the reader. They are inlined wherever
// they are called, so that what they take by reference stays in registers. SCOLOPAX_APART and SCOLOPAX_RARE
// mark functions that are seldom called and are not inlined. On a device, everything is inlined except
// SCOLOPAX_RARE functions, which only few scenes need. With sanitizers, whose code is long, no inlining is
// forced.
#if defined(__CUDACC__)
#define SCOLOPAX_HOT SCOLOPAX_HD
#define SCOLOPAX_PART SCOLOPAX_HD __attribute__((always_inline))
#define SCOLOPAX_APART SCOLOPAX_HD
#define SCOLOPAX_RARE SCOLOPAX_HD __attribute__((noinline))
#elif defined(__SANITIZE_ADDRESS__)
#define SCOLOPAX_HOT
#define SCOLOPAX_PART
#define SCOLOPAX_APART
#define SCOLOPAX_RARE
#else
#define SCOLOPAX_HOT __attribute__((flatten))
#define SCOLOPAX_PART __attribute__((always_inline))
#define SCOLOPAX_APART __attribute__((noinline))
#define SCOLOPAX_RARE SCOLOPAX_APART
#endif

// SCOLOPAX_LANES marks templates over a lane type (lanes.h). A file that is compiled for an instruction set
// includes cpu/lanes_*.h first, which defines SCOLOPAX_SIMD. The instances of the templates in that file then
// have the lane type of the set, and are inlined into functions whose target is the set. The target is set
// for functions, not for files: otherwise an inline function in a file compiled for AVX2 might be the copy
// that the linker keeps for the whole program. Functions that are not inlined take and return vectors by
// address: g++ 12 passes only half of a vector by value if its instruction set is not that of the file.
#if defined(SCOLOPAX_SIMD)
#define SCOLOPAX_LANES SCOLOPAX_SIMD_INLINE inline
#define SCOLOPAX_LANES_PART SCOLOPAX_LANES
#define SCOLOPAX_LANES_LAMBDA SCOLOPAX_SIMD_INLINE
#define SCOLOPAX_LANES_APART SCOLOPAX_SIMD __attribute__((noinline))
#define SCOLOPAX_LANES_RARE SCOLOPAX_LANES_APART
#else
#define SCOLOPAX_LANES SCOLOPAX_HD inline
#define SCOLOPAX_LANES_PART SCOLOPAX_PART inline
#define SCOLOPAX_LANES_LAMBDA
#define SCOLOPAX_LANES_APART SCOLOPAX_APART
#define SCOLOPAX_LANES_RARE SCOLOPAX_RARE
#endif
