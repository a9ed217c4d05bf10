// SPDX-License-Identifier: Apache-2.0
/// \file
/// Counts every allocation of a test program, Eigen's included: malloc itself is replaced (GNU C library; not under
/// AddressSanitizer, which replaces it too). Include it in one source of a program.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define WHEELWRIGHT_COUNTS_ALLOCATIONS 1

namespace wheelwright::testing_support {
/// Number of allocations since the start of the program.
inline std::atomic<std::size_t> allocations = 0;
}  // namespace wheelwright::testing_support

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++wheelwright::testing_support::allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++wheelwright::testing_support::allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++wheelwright::testing_support::allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++wheelwright::testing_support::allocations;
  return __libc_memalign(alignment, size);
}
}

#endif
