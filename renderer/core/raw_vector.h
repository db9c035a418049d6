// SPDX-License-Identifier: Apache-2.0
// A vector of numbers that leaves new elements uninitialised: for arrays that many threads fill afterwards.
#pragma once
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace scolopax {

template <class T>
struct RawAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = RawAllocator<U>;
  };
  /// Default-initialises the element, which does nothing for numbers.
  template <class U>
  void construct(U* at) noexcept(std::is_nothrow_default_constructible_v<U>) {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Values>
  void construct(U* at, Values&&... values) {
    ::new (static_cast<void*>(at)) U(std::forward<Values>(values)...);
  }
};

template <class T>
using RawVector = std::vector<T, RawAllocator<T>>;

}  // namespace scolopax
