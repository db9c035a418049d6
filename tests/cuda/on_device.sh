#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Checks and measures the CUDA path on a machine with a GPU. That machine needs nvcc, g++, CMake, ninja and python3;
# compute-sanitizer and ncu are used if they are there. Nothing is downloaded.
#   tests/cuda/on_device.sh pack DIR                on any machine that can build the program: makes DIR and DIR.tar.gz,
#                                                   a few MB, with all sources and libraries that are needed
#   DIR/tests/cuda/on_device.sh DIR [OUT.json]      on the machine with the GPU: at most DEVICE_SECONDS, 480 by default.
#                                                   tests/bench/report.py --device OUT.json makes the report of it.
set -u

usage() { sed -n 's/^#   /  /p' "$0" >&2; exit 2; }
fail() { echo "on_device.sh: $*" >&2; exit 1; }

pack() {
  local root; root=$(cd "$(dirname "$0")/../.." && pwd) || exit 1
  local to=$1 tbb; tbb=$(g++ -print-file-name=libtbb.so.12)
  local gtest=/usr/src/googletest/googletest
  [ -e "$tbb" ] || fail "there is no libtbb.so.12: .ci/install build test"
  for needed in /usr/include/glm /usr/include/tbb /usr/include/oneapi $gtest/src; do
    [ -d "$needed" ] || fail "there is no $needed: .ci/install build test"
  done
  rm -rf "$to" && mkdir -p "$to/third_party/include" "$to/third_party/lib" "$to/third_party/googletest" || exit 1
  tar -C "$root" --exclude=__pycache__ --exclude=renderer/io --exclude=renderer/metrics --exclude=renderer/reference \
    -cf - renderer cuda tests/cuda tests/support | tar -C "$to" -xf - || exit 1
  cp -r /usr/include/glm /usr/include/tbb /usr/include/oneapi "$to/third_party/include/" || exit 1
  cp -L "$tbb" "$to/third_party/lib/" && cp -r $gtest/src $gtest/include "$to/third_party/googletest/" || exit 1
  tar -C "$(dirname "$to")" -czf "$to.tar.gz" "$(basename "$to")" || exit 1
  echo "$to.tar.gz: $(($(stat -c %s "$to.tar.gz") / 1024)) KiB"
}

left() { echo $((DEVICE_SECONDS - SECONDS)); }

# NAME LIMIT COMMAND...: runs a command within LIMIT seconds and the time left. Its output goes to NAME.out and NAME.log,
# its exit status and seconds to NAME.status.
step() {
  local name=$1 limit=$2 begin=$SECONDS status; shift 2
  [ "$limit" -le "$(left)" ] || limit=$(left)
  if [ "$limit" -lt 5 ]; then
    echo "no time left" > "$logs/$name.status"
    echo "$name: no time left"
    return 1
  fi
  timeout -k 5 "$limit" "$@" > "$logs/$name.out" 2> "$logs/$name.log"; status=$?
  echo "$status $((SECONDS - begin))" > "$logs/$name.status"
  echo "$name: exit status $status after $((SECONDS - begin)) s"
  return $status
}

skip() {
  echo "$1: skipped"
  printf '{"skipped": "%s"}\n' "$1" > "$out"
  exit 0
}

# NAME: the program of CUDA's tools; nothing if there is none.
tool() {
  local found
  for found in "$(command -v "$1")" "$(dirname "$nvcc")/$1" "${NSIGHT_COMPUTE:-/opt/nvidia/nsight-compute}"/*/"$1"; do
    if [ -x "$found" ]; then echo "$found"; return; fi
  done
}

run() {
  local dir; dir=$(cd "$1" && pwd) || exit 1
  out=${2:-$dir/device.json}
  [ -d "$dir/third_party" ] || fail "$dir has no third_party: on_device.sh pack makes it"
  logs=$dir/logs
  rm -rf "$logs" && mkdir -p "$logs" || exit 1
  nvcc=$(command -v nvcc || ls /usr/local/cuda/bin/nvcc 2> /dev/null) || skip "no nvcc"
  if ! step probe_build 200 "$nvcc" -o "$dir/probe" "$dir/tests/cuda/on_device/probe.cpp"; then
    cat "$logs/probe_build.log"
    skip "nvcc does not work"
  fi
  if ! step probe 30 "$dir/probe"; then
    cat "$logs/probe.log"
    skip "no CUDA device"
  fi
  cat "$logs/probe.out"
  local capability; capability=$(sed -n 's/.*"capability": "\([0-9]*\)\.\([0-9]*\)".*/\1\2/p' "$logs/probe.out")

  # More than there are processors, so that the kernels, which take longest, do not wait for other files; each needs up
  # to 2 GiB.
  local build=$dir/build jobs=$(($(nproc) * 3)) most
  most=$(($(sed -n 's/^MemAvailable: *\([0-9]*\) kB/\1/p' /proc/meminfo) / 2097152))
  [ $jobs -le $most ] || jobs=$((most > 1 ? most : 1))
  if step configure 60 cmake -S "$dir/tests/cuda/on_device" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
      -DSCOLOPAX_NVCC="$nvcc" -DSCOLOPAX_CUDA_DEVICES="sm_$capability" -DSCOLOPAX_THIRD_PARTY="$dir/third_party" &&
      step build 330 cmake --build "$build" -j "$jobs"; then
    measure "$dir" "$build"
  fi
  python3 -B "$dir/tests/cuda/device_results.py" "$logs" > "$out" || exit 1
  echo "$out is written after $SECONDS s"
}

# What matters most comes first.
measure() {
  local dir=$1 build=$2 few sanitizer ncu check
  step parity 90 "$build/tests_cuda_device" --gtest_output="json:$logs/parity.json"
  # Of one instruction set, so that every bit is equal (README.md).
  step bench 110 env SCOLOPAX_INSTRUCTIONS=baseline "$build/device_bench" --seconds 60
  few='DevicePicture.OfOnePixel*:*.AreThoseOfTheCpuInEveryBlendModeAndLight/superposed:*.WithSurfaces*/hybrid'
  sanitizer=$(tool compute-sanitizer) ncu=$(tool ncu)
  for check in memcheck racecheck; do
    if [ -z "$sanitizer" ]; then
      echo "absent" > "$logs/$check.status"
      echo "$check: there is no compute-sanitizer"
    else
      step $check 75 "$sanitizer" --tool $check --error-exitcode 9 "$build/tests_cuda_device" --gtest_filter="$few"
    fi
    # ncu's numbers are worth more than racecheck's: kernels share no memory.
    [ $check = memcheck ] || continue
    for method in auto superposed; do
      if [ -z "$ncu" ]; then
        echo "absent" > "$logs/ncu_$method.status"
        echo "ncu_$method: there is no ncu"
      else
        step ncu_$method 45 "$ncu" --clock-control none --csv --page details --section SpeedOfLight --section Occupancy \
          --section LaunchStats --section WarpStateStats --section MemoryWorkloadAnalysis --section InstructionStats \
          --profile-from-start off --kernel-name regex:renderPixels --launch-count 1 --log-file "$logs/ncu_$method.csv" \
          "$build/device_bench" --frames $method 2
      fi
    done
  done
}

[ $# -ge 1 ] || usage
DEVICE_SECONDS=${DEVICE_SECONDS:-480}
if [ "$1" = pack ]; then
  [ $# -eq 2 ] || usage
  pack "$2"
else
  if [ $# -gt 2 ] || [ ! -d "$1" ]; then usage; fi
  run "$@"
fi
