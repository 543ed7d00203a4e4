# 32-bit ARM with hardware floating point: Debian's armhf. Debian's own packages do without NEON there; the compiler's
# vectors of core/realtime would become scalar code, so that Alidade asks for it.
set(architecture armhf)
set(triplet arm-linux-gnueabihf)
set(emulator arm)
# ARMv7-A with NEON: the oldest that the programs are for.
set(emulated_cpu cortex-a9)
set(CMAKE_SYSTEM_PROCESSOR armv7l)
# GCC's notes that passing some types changed in GCC 7 concern nothing that was built before it; within Eigen's unrolled
# loops it takes what a called function always writes for uninitialised, here alone.
set(CMAKE_CXX_FLAGS_INIT "-mfpu=neon -Wno-psabi -Wno-maybe-uninitialized")
include("${CMAKE_CURRENT_LIST_DIR}/debian-sysroot.cmake")
