// SPDX-License-Identifier: Apache-2.0
// What marks code that runs on host and device alike. Kernels use only + - * /, comparisons and the
// functions of math.h in this folder, so that every compiler and device computes the same bits.
#pragma once

#if defined(__CUDACC__)
#define SCOLOPAX_HD __host__ __device__
#else
#define SCOLOPAX_HD
#endif
