# Cross-compiles for Debian 12 arm64 against the sysroot of toolchains/make-sysroot, and runs the
# tests under qemu-user. Another sysroot: -DTARGET_SYSROOT=DIR or the environment variable.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(_triplet aarch64-linux-gnu)

if(NOT TARGET_SYSROOT)
  if(DEFINED ENV{TARGET_SYSROOT})
    set(TARGET_SYSROOT "$ENV{TARGET_SYSROOT}")
  else()
    get_filename_component(TARGET_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/sysroot-arm64" ABSOLUTE)
  endif()
endif()
if(NOT EXISTS "${TARGET_SYSROOT}/usr/include")
  message(FATAL_ERROR "No sysroot in ${TARGET_SYSROOT}: run toolchains/make-sysroot arm64")
endif()
# try_compile() runs this file again in a project of its own and must find the same sysroot.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TARGET_SYSROOT)

set(CMAKE_SYSROOT "${TARGET_SYSROOT}")
set(CMAKE_C_COMPILER ${_triplet}-gcc)
set(CMAKE_CXX_COMPILER ${_triplet}-g++)
set(CMAKE_LIBRARY_ARCHITECTURE ${_triplet})

# The linker resolves the needs of shared libraries only where it is told to look.
set(_rpath_link "-Wl,-rpath-link,${TARGET_SYSROOT}/usr/lib/${_triplet}:${TARGET_SYSROOT}/lib/${_triplet}")
foreach(_kind EXE SHARED MODULE)
  set(CMAKE_${_kind}_LINKER_FLAGS_INIT "${_rpath_link}")
endforeach()

set(CMAKE_FIND_ROOT_PATH "${TARGET_SYSROOT}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} "${TARGET_SYSROOT}")
set(ENV{PKG_CONFIG_LIBDIR}
  "${TARGET_SYSROOT}/usr/lib/${_triplet}/pkgconfig:${TARGET_SYSROOT}/usr/share/pkgconfig")

# Cortex-A72: a common board, and without the extensions of newer cores that the tests might hide.
find_program(QEMU_AARCH64 NAMES qemu-aarch64-static qemu-aarch64)
if(QEMU_AARCH64)
  set(CMAKE_CROSSCOMPILING_EMULATOR "${QEMU_AARCH64};-cpu;cortex-a72;-L;${TARGET_SYSROOT}")
endif()
