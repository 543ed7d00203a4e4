# 64-bit ARM: Debian's arm64. NEON is part of the architecture.
set(architecture arm64)
set(triplet aarch64-linux-gnu)
set(emulator aarch64)
# A common board's, and without the extensions of newer cores that tests might hide.
set(emulated_cpu cortex-a72)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
include("${CMAKE_CURRENT_LIST_DIR}/debian-sysroot.cmake")
