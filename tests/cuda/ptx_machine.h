// SPDX-License-Identifier: Apache-2.0
// The parts from which translated PTX (ptx_to_cpp.py) is built: registers, instructions without a C++
// equivalent, and memory whose accesses are all checked.
#pragma once
#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace ptx {

// Untyped registers: every instruction states the type as which it reads their bits.
union Register16 {
  std::uint8_t u8;
  std::int8_t s8;
  std::uint16_t u16;
  std::int16_t s16;
};
union Register32 {
  std::uint8_t u8;
  std::int8_t s8;
  std::uint16_t u16;
  std::int16_t s16;
  std::uint32_t u32;
  std::int32_t s32;
  float f32;
};
union Register64 {
  std::uint8_t u8;
  std::int8_t s8;
  std::uint16_t u16;
  std::int16_t s16;
  std::uint32_t u32;
  std::int32_t s32;
  float f32;
  std::uint64_t u64;
  std::int64_t s64;
  double f64;
};

struct Index {
  unsigned x, y, z;
};

/// A range of memory that a thread may use.
struct Range {
  std::uint64_t begin, end;
  bool onHost = false;  ///< memory of the host that is mapped to the device
  bool holds(std::uint64_t address, std::size_t size) const {
    return address >= begin && address < end && size <= end - address;
  }
};

struct Frame;

/// One thread of a grid: its position, and the memory that it may access.
struct Thread {
  Index tid, ntid, ctaid, nctaid;
  std::span<const Range> global;      ///< allocations and tables, by address
  std::span<const Range> parameters;  ///< of the kernel; read only
  const Frame* local = nullptr;
};

/// A variable in local memory, while the function that declares it runs.
struct Frame {
  template <std::size_t kSize>
  Frame(Thread& owner, std::byte (&bytes)[kSize])
      : thread(owner),
        range{reinterpret_cast<std::uint64_t>(bytes), reinterpret_cast<std::uint64_t>(bytes) + kSize},
        outer(owner.local) {
    std::memset(bytes, 0xa5, kSize);  // reading uninitialised memory changes the picture
    thread.local = this;
  }
  Frame(const Frame&) = delete;
  ~Frame() { thread.local = outer; }
  Thread& thread;
  Range range;
  const Frame* outer;
};

/// An access outside of the memory that the thread may use, or one that is not aligned.
struct Fault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Function = void (*)(Thread& thread, std::byte* result, const std::byte* const* arguments);

/// Registers a kernel under its name when the program starts.
struct Kernel {
  Kernel(const char* name, Function run, std::vector<std::size_t> parameterSizes, unsigned maxThreads);
  std::string name;
  Function run;
  std::vector<std::size_t> parameterSizes;
  unsigned maxThreads;  ///< in a block
};

/// Mangled names of the kernels that are linked into the program.
std::vector<std::string> kernelNames();

/// Constant memory of a module.
struct Table {
  template <class T, std::size_t kCount>
  explicit Table(const T (&values)[kCount]) : Table(values, sizeof values) {}
  Table(const void* values, std::size_t size);
};

/// Throws Fault unless the address is a multiple of the size, a power of two. The size of a vector is its
/// whole size.
inline void checkAlignment(std::uint64_t address, std::size_t size) {
  if (address % size != 0) throw Fault("misaligned address");
}
enum class Access { load, store };
/// Number of accesses to memory of the host so far.
inline std::atomic<std::uint64_t> hostAccesses = 0;
/// Throws Fault unless the thread may make this access.
void checkAccess(const Thread& thread, std::uint64_t address, std::size_t size, Access access);

inline std::uint64_t addressOf(const void* pointer) { return reinterpret_cast<std::uint64_t>(pointer); }

template <class T>
T read(std::uint64_t address) {
  T value;
  std::memcpy(&value, reinterpret_cast<const void*>(address), sizeof value);
  return value;
}
template <class T>
void write(std::uint64_t address, T value) {
  std::memcpy(reinterpret_cast<void*>(address), &value, sizeof value);
}
template <class T>
T load(const Thread& thread, std::uint64_t address) {
  checkAccess(thread, address, sizeof(T), Access::load);
  return read<T>(address);
}
template <class T>
void store(const Thread& thread, std::uint64_t address, T value) {
  checkAccess(thread, address, sizeof(T), Access::store);
  write(address, value);
}

inline float floatOf(std::uint32_t bits) { return std::bit_cast<float>(bits); }
/// A device's clock: here, it advances when it is read.
inline constexpr std::uint32_t kCyclesPerReading = 1u << 16;
inline std::atomic<std::uint64_t> clockReadings = 0;
inline std::uint32_t readClock() { return std::uint32_t(++clockReadings) * kCyclesPerReading; }

inline double doubleOf(std::uint64_t bits) { return std::bit_cast<double>(bits); }

/// A whole float as an integer: the nearest representable one; 0 for NaN.
template <class Integer, class Float>
Integer saturate(Float x) {
  using Limits = std::numeric_limits<Integer>;
  if (x != x) return 0;
  if (x <= Float(Limits::min())) return Limits::min();
  if (x >= Float(Limits::max())) return Limits::max();
  return Integer(x);
}

/// If one operand is NaN, the result is the other one; -0 is below +0.
template <class T>
T minimum(T a, T b) {
  if constexpr (std::is_floating_point_v<T>) {
    if (a != a) return b;
    if (b != b) return a;
    if (a == b) return std::signbit(a) ? a : b;
  }
  return a < b ? a : b;
}
template <class T>
T maximum(T a, T b) {
  if constexpr (std::is_floating_point_v<T>) {
    if (a != a) return b;
    if (b != b) return a;
    if (a == b) return std::signbit(a) ? b : a;
  }
  return a > b ? a : b;
}

/// Shifts by the width or more push every bit out.
template <class T>
T shiftLeft(T a, std::uint32_t by) {
  return by >= sizeof(T) * 8 ? T(0) : T(std::make_unsigned_t<T>(a) << by);
}
template <class T>
T shiftRight(T a, std::uint32_t by) {
  return by >= sizeof(T) * 8 ? T(a < 0 ? -1 : 0) : T(a >> by);
}

template <class T>
T reverseBits(T a) {
  T reversed = 0;
  for (std::size_t i = 0; i < sizeof(T) * 8; ++i) reversed = T(reversed << 1 | ((a >> i) & 1));
  return reversed;
}

/// Inserts the `length` low bits of `field` into `into` from bit `position` on. Bits beyond the register are
/// dropped.
template <class T>
T insertBits(T field, T into, std::uint32_t position, std::uint32_t length) {
  for (std::uint32_t i = 0; i < (length & 0xff) && (position & 0xff) + i < sizeof(T) * 8; ++i) {
    const T bit = T(T(1) << ((position & 0xff) + i));
    into = T((field >> i & 1) ? into | bit : into & T(~bit));
  }
  return into;
}

/// The upper or lower word of high:low, shifted by the lowest five bits of `by`.
inline std::uint32_t funnelLeft(std::uint32_t low, std::uint32_t high, std::uint32_t by) {
  return std::uint32_t(((std::uint64_t(high) << 32 | low) << (by & 31)) >> 32);
}
inline std::uint32_t funnelRight(std::uint32_t low, std::uint32_t high, std::uint32_t by) {
  return std::uint32_t((std::uint64_t(high) << 32 | low) >> (by & 31));
}

}  // namespace ptx
