// SPDX-License-Identifier: Apache-2.0
// SCOLOPAX_SANITIZED is 1 with the address or the thread sanitizer, else 0. gcc and clang tell it
// differently.
#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SCOLOPAX_SANITIZED 1
#endif
#endif
#if !defined(SCOLOPAX_SANITIZED)
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SCOLOPAX_SANITIZED 1
#else
#define SCOLOPAX_SANITIZED 0
#endif
#endif
