# What the toolchain files of one folder share: cross-compiles for Debian 12 against a sysroot of make-sysroot, and lets
# ctest run the tests under qemu-user. Included with these set:
#   architecture   Debian's name of it: arm64
#   triplet        GNU's: aarch64-linux-gnu
#   emulator       qemu-user's: aarch64
#   emulated_cpu   the oldest processor that the programs are for
# Another sysroot than build/sysroot-<architecture>: -DTARGET_SYSROOT=DIR, or the environment variable.
set(CMAKE_SYSTEM_NAME Linux)

if(NOT TARGET_SYSROOT)
  if(DEFINED ENV{TARGET_SYSROOT})
    set(TARGET_SYSROOT "$ENV{TARGET_SYSROOT}")
  else()
    get_filename_component(TARGET_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/sysroot-${architecture}" ABSOLUTE)
  endif()
endif()
if(NOT EXISTS "${TARGET_SYSROOT}/usr/include")
  message(FATAL_ERROR "No sysroot in ${TARGET_SYSROOT}: run toolchains/make-sysroot ${architecture}")
endif()
# try_compile() runs the toolchain file again in a project of its own and must find the same sysroot.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TARGET_SYSROOT)

set(CMAKE_SYSROOT "${TARGET_SYSROOT}")
set(CMAKE_C_COMPILER ${triplet}-gcc)
set(CMAKE_CXX_COMPILER ${triplet}-g++)
set(CMAKE_LIBRARY_ARCHITECTURE ${triplet})

# The linker resolves the needs of shared libraries only where it is told to look.
foreach(kind EXE SHARED MODULE)
  set(CMAKE_${kind}_LINKER_FLAGS_INIT
    "-Wl,-rpath-link,${TARGET_SYSROOT}/usr/lib/${triplet}:${TARGET_SYSROOT}/lib/${triplet}")
endforeach()

# -DCMAKE_FIND_ROOT_PATH=DIR adds a folder: catkin's, with the configuration files of packages that are being built.
list(PREPEND CMAKE_FIND_ROOT_PATH "${TARGET_SYSROOT}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} "${TARGET_SYSROOT}")
set(ENV{PKG_CONFIG_LIBDIR}
  "${TARGET_SYSROOT}/usr/lib/${triplet}/pkgconfig:${TARGET_SYSROOT}/usr/share/pkgconfig")

find_program(QEMU_USER_${emulator} NAMES qemu-${emulator}-static qemu-${emulator})
if(QEMU_USER_${emulator})
  set(CMAKE_CROSSCOMPILING_EMULATOR "${QEMU_USER_${emulator}};-cpu;${emulated_cpu};-L;${TARGET_SYSROOT}")
endif()
