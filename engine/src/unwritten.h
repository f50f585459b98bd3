// SPDX-License-Identifier: Apache-2.0
// Vectors whose new elements are left as they are.
#pragma once

#include <memory>
#include <new>
#include <utility>

namespace fibrolite {

/// Leaves new elements as they are: they are written over in parallel, which also shares out the cost of fresh memory.
template <class T>
struct Unwritten : std::allocator<T> {
  template <class U>
  struct rebind {  // NOLINT(readability-identifier-naming): the name the standard asks for
    using other = Unwritten<U>;
  };
  template <class U, class... Args>
  void construct(U* at, Args&&... args) {
    if constexpr (sizeof...(Args) == 0) {
      ::new (static_cast<void*>(at)) U;
    } else {
      ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
    }
  }
};

}  // namespace fibrolite
