# SPDX-License-Identifier: Apache-2.0
# Enables CUDA if nvcc is found; otherwise prints a notice and leaves SCOLOPAX_HAVE_NVCC off.
find_program(SCOLOPAX_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda PATH_SUFFIXES bin)
if(SCOLOPAX_NVCC AND NOT CMAKE_CUDA_COMPILER)
  set(CMAKE_CUDA_COMPILER ${SCOLOPAX_NVCC})
endif()
set(CMAKE_CUDA_ARCHITECTURES OFF)  # cuda/CMakeLists.txt lists them
include(CheckLanguage)
check_language(CUDA)
if(NOT CMAKE_CUDA_COMPILER)
  message(NOTICE "CUDA: no working nvcc, so the kernels are not compiled for devices")
  set(SCOLOPAX_HAVE_NVCC OFF)
  return()
endif()
enable_language(CUDA)
find_package(CUDAToolkit REQUIRED)
set(SCOLOPAX_HAVE_NVCC ON)
# CMake before 3.25.2 does not know the option for nvcc 12 and later.
set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION -std=c++20)
set(CMAKE_CUDA_STANDARD 20)
set(CMAKE_CUDA_STANDARD_REQUIRED ON)
# The same arithmetic as on the CPU: no contraction anywhere. The suppressed warning concerns redundant
# execution-space specifiers on GLM's defaulted functions.
set(SCOLOPAX_NVCC_FLAGS --expt-relaxed-constexpr -diag-suppress=20012 -fmad=false
  -Werror=all-warnings -Xcompiler=-Wall,-Wextra,-Werror,-ffp-contract=off)
