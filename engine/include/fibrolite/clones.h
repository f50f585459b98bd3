// SPDX-License-Identifier: Apache-2.0
// Functions that exist for the plain instruction set and for AVX2; which one is called is settled when a program
// starts.
#pragma once

/// Before a function whose loops gain from wider registers. Both give the same bits: neither fuses a * b + c.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define FIBROLITE_CLONES [[gnu::target_clones("avx2", "default")]]
#else  // the thread sanitizer is not there yet when programs settle it
#define FIBROLITE_CLONES
#endif
