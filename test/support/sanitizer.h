#pragma once
// Which sanitizer the test is compiled with, as GCC and clang tell it: ALIDADE_ADDRESS_SANITIZER, ALIDADE_THREAD_SANITIZER.

#if defined(__SANITIZE_ADDRESS__)
#define ALIDADE_ADDRESS_SANITIZER 1
#elif defined(__SANITIZE_THREAD__)
#define ALIDADE_THREAD_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define ALIDADE_ADDRESS_SANITIZER 1
#elif __has_feature(thread_sanitizer)
#define ALIDADE_THREAD_SANITIZER 1
#endif
#endif
