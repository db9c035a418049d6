// SPDX-License-Identifier: Apache-2.0
// What marks code that runs on host and device alike, and code that runs on one lane or many. Kernels use
// only arithmetic, comparisons and the functions of this folder, so that every compiler and device computes
// the same bits.
#pragma once

#if defined(__CUDACC__)
#define SCOLOPAX_HD __host__ __device__
#else
#define SCOLOPAX_HD
#endif

// What most of the time is spent in, with all that it calls; and what is seldom called, out of its way. On a
// device everything is inlined but what only rare scenes need; with sanitizers, whose code is long, nothing
// must be.
#if defined(__CUDACC__)
#define SCOLOPAX_HOT SCOLOPAX_HD
#define SCOLOPAX_APART SCOLOPAX_HD
#define SCOLOPAX_RARE SCOLOPAX_HD __attribute__((noinline))
#elif defined(__SANITIZE_ADDRESS__)
#define SCOLOPAX_HOT
#define SCOLOPAX_APART
#define SCOLOPAX_RARE
#else
#define SCOLOPAX_HOT __attribute__((flatten))
#define SCOLOPAX_APART __attribute__((noinline))
#define SCOLOPAX_RARE SCOLOPAX_APART
#endif

// For everything that is a template over a lane type (lanes.h). A file that is compiled for an instruction
// set includes cpu/lanes_*.h first, which defines SCOLOPAX_SIMD: its instances are of that set's lane type,
// and are inlined into functions that have the set. Functions, not files, have it: an inline function that a
// file compiled for AVX2 might be the one that the linker keeps for everybody. What is not inlined takes and
// returns vectors by their addresses: by value, g++ 12 passes half of a vector of a set that is not the
// file's.
#if defined(SCOLOPAX_SIMD)
#define SCOLOPAX_LANES SCOLOPAX_SIMD_INLINE inline
#define SCOLOPAX_LANES_LAMBDA SCOLOPAX_SIMD_INLINE
#define SCOLOPAX_LANES_APART SCOLOPAX_SIMD __attribute__((noinline))
#define SCOLOPAX_LANES_RARE SCOLOPAX_LANES_APART
#else
#define SCOLOPAX_LANES SCOLOPAX_HD inline
#define SCOLOPAX_LANES_LAMBDA
#define SCOLOPAX_LANES_APART SCOLOPAX_APART
#define SCOLOPAX_LANES_RARE SCOLOPAX_RARE
#endif
