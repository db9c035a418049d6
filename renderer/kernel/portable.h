// SPDX-License-Identifier: Apache-2.0
// What marks code that runs on host and device alike. Kernels use only + - * /, comparisons and the
// functions of math.h in this folder, so that every compiler and device computes the same bits.
#pragma once

#if defined(__CUDACC__)
#define SCOLOPAX_HD __host__ __device__
#else
#define SCOLOPAX_HD
#endif

// What most of the time is spent in, with all that it calls; and what is seldom called, out of its way. On a
// device everything is inlined.
#if defined(__CUDACC__)
#define SCOLOPAX_HOT SCOLOPAX_HD
#define SCOLOPAX_APART SCOLOPAX_HD
#else
#define SCOLOPAX_HOT __attribute__((flatten))
#define SCOLOPAX_APART __attribute__((noinline))
#endif
