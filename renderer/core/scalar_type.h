// SPDX-License-Identifier: Apache-2.0
// The voxel types that are kept in memory and sampled by the kernels without conversion.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace scolopax {

/// One line per type: name, C++ type. Everything that depends on the set of types expands this list.
#define SCOLOPAX_SCALAR_TYPES(X) \
  X(u8, std::uint8_t)            \
  X(u16, std::uint16_t)          \
  X(i16, std::int16_t)           \
  X(f32, float)

enum class ScalarType : std::uint8_t {
#define X(name, type) name,
  SCOLOPAX_SCALAR_TYPES(X)
#undef X
};

/// Calls f(T{}) with T the C++ type of `type`.
template <class F>
constexpr decltype(auto) visitScalarType(ScalarType type, F&& f) {
  switch (type) {
#define X(name, T)       \
  case ScalarType::name: \
    return f(T{});
    SCOLOPAX_SCALAR_TYPES(X)
#undef X
  }
  return f(std::uint8_t{});  // not reached: the switch is complete
}

template <class T>
struct ScalarTypeOf;
#define X(name, T)                                        \
  template <>                                             \
  struct ScalarTypeOf<T> {                                \
    static constexpr ScalarType value = ScalarType::name; \
  };
SCOLOPAX_SCALAR_TYPES(X)
#undef X
template <class T>
inline constexpr ScalarType scalarTypeOf = ScalarTypeOf<T>::value;

constexpr std::size_t sizeBytes(ScalarType type) {
  return visitScalarType(type, [](auto zero) { return sizeof(zero); });
}

constexpr std::string_view nameOf(ScalarType type) {
  switch (type) {
#define X(name, T)       \
  case ScalarType::name: \
    return #name;
    SCOLOPAX_SCALAR_TYPES(X)
#undef X
  }
  return "";
}

}  // namespace scolopax
