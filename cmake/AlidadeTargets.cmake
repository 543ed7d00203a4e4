# The one way to declare a library, a program, a test and a benchmark: every target gets the same
# standard, warnings and sanitizers, and a test cannot be built without being registered.
include_guard(GLOBAL)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

add_library(alidade_options INTERFACE)
target_compile_features(alidade_options INTERFACE cxx_std_17)
target_compile_options(alidade_options INTERFACE
  # In a unit of several sources a local may have the name of something in another: `dev` and `fuzz` look.
  $<$<NOT:$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wshadow>
  -Wall -Wextra -Wpedantic -Wconversion -Wnon-virtual-dtor -Wold-style-cast
  -Woverloaded-virtual -Wnull-dereference -Werror)
# 32-bit ARM. The macro as for those who use core/model: a prelude is taken only where the same macros are defined. In Eigen's scalar loops
# GCC 12 takes the memory of a vector that may be empty for read.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^armv[67]")
  target_compile_definitions(alidade_options INTERFACE EIGEN_DONT_VECTORIZE)
  target_compile_options(alidade_options INTERFACE -Wno-null-dereference)
endif()
# GCC's collection of garbage is a tenth of its time; without it a source takes 2 GB at most. For libraries: tests are clang's.
cmake_host_system_information(RESULT host_memory_mb QUERY TOTAL_PHYSICAL_MEMORY)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND host_memory_mb GREATER 8000)
  set(ALIDADE_COMPILER_MEMORY "SHELL:--param ggc-min-heapsize=1500000")
endif()
# The presets with sanitizers take clang: it compiles Eigen's expressions in half of GCC's time, and GCC 12 reports slips inside inlined
# library code when it also instruments.
if(ALIDADE_SANITIZE)
  target_compile_options(alidade_options INTERFACE
    -fsanitize=${ALIDADE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
    $<$<BOOL:$<TARGET_PROPERTY:ALIDADE_UNCHECKED>>:-fno-sanitize=$<TARGET_PROPERTY:ALIDADE_UNCHECKED>>)
  target_link_options(alidade_options INTERFACE -fsanitize=${ALIDADE_SANITIZE})
endif()
if(ALIDADE_FUZZ)
  # Every library tells libFuzzer which ways its code took.
  target_compile_options(alidade_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

# What makes a slip in memory hard to use for an attack, in all that is shipped: canaries on the stack, checked calls of the C library,
# no jump over the stack's guard page, and calls and jumps that land only where the compiler meant them to. For builds that optimise:
# _FORTIFY_SOURCE does nothing in others. The sanitizers see more without it.
add_library(alidade_hardening INTERFACE)
if(ALIDADE_HARDEN)
  if(ALIDADE_SANITIZE OR ALIDADE_FUZZ)
    message(FATAL_ERROR "ALIDADE_HARDEN hides from sanitizers and fuzzing what they are to find: leave it OFF here")
  endif()
  target_compile_options(alidade_hardening INTERFACE -fstack-protector-strong -fstack-clash-protection
    $<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE$<SEMICOLON>-D_FORTIFY_SOURCE=3>)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|amd64|AMD64")
    target_compile_options(alidade_hardening INTERFACE -fcf-protection=full)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
    target_compile_options(alidade_hardening INTERFACE -mbranch-protection=standard)
  endif()
endif()

# alidade_harden(target)
# compiles a library's own sources so, and links a program, whose symbols are then resolved at its start: never on the real-time thread,
# and their table is read-only from then on. Not for tests: they are not shipped.
function(alidade_harden target)
  get_target_property(type ${target} TYPE)
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:alidade_hardening>)
  if(type STREQUAL "EXECUTABLE")
    target_link_options(${target} PRIVATE -pie -Wl,-z,relro,-z,now,-z,noexecstack)
  endif()
endfunction()

# alidade_leave_unchecked(target)
# for the rooms of mathematics and the tests: each of Eigen's accesses would carry these checks, half of what such a source costs. The address
# sanitizer and Eigen's own assertions find what they are for; the preset `fuzz` has them. A property: an option of the target itself would
# stand before the one that asks for them.
function(alidade_leave_unchecked target)
  if(ALIDADE_SANITIZE MATCHES undefined AND NOT ALIDADE_FUZZ)
    set_target_properties(${target} PROPERTIES ALIDADE_UNCHECKED null,alignment,object-size,vptr,pointer-overflow)
  endif()
endfunction()

# alidade_leave_uninstrumented(target)
# for a tool of the tests: sanitizers are for what is shipped, and the films would take most of their suites' time. The thread sanitizer must
# see what all threads do.
function(alidade_leave_uninstrumented target)
  if(ALIDADE_SANITIZE MATCHES address)
    set_target_properties(${target} PROPERTIES ALIDADE_UNCHECKED all)
    target_compile_options(${target} PRIVATE -O2)
  endif()
endfunction()

# alidade_prelude(edge_app HEADERS <Eigen/Dense> ... LINK ... OPTIONS ...)
# compiles once what most sources of the libraries with `PRELUDE edge_app` include; OPTIONS are those of the libraries. Each
# source includes what it needs nevertheless: the build for fuzzing has neither preludes nor sources compiled as one, and shows it.
function(alidade_prelude name)
  cmake_parse_arguments(A "" "" "HEADERS;LINK;OPTIONS" ${ARGN})
  if(ALIDADE_FUZZ)
    return()
  endif()
  add_library(alidade_${name}_prelude OBJECT ${PROJECT_SOURCE_DIR}/cmake/prelude.cpp)
  target_link_libraries(alidade_${name}_prelude PRIVATE alidade_options ${A_LINK})
  target_compile_options(alidade_${name}_prelude PRIVATE ${A_OPTIONS} ${ALIDADE_COMPILER_MEMORY})
  alidade_harden(alidade_${name}_prelude)
  target_precompile_headers(alidade_${name}_prelude PRIVATE ${A_HEADERS})
  set_property(GLOBAL PROPERTY ALIDADE_PRELUDE_LINKS_${name} ${A_LINK})
endfunction()

# alidade_unity(target)
# compiles up to eight sources of the target as one, which halves what most rooms cost: half of that is what their sources include.
# Names in anonymous namespaces must then differ within a room. The presets `dev` and `fuzz` compile each source by itself.
function(alidade_unity target)
  if(ALIDADE_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
endfunction()

# alidade_library(model [INTERNAL] [UNITY] [PRELUDE name] HEADERS ... SOURCES ... PUBLIC ... PRIVATE ... OPTIONS ...)
# makes target alidade_model and alias alidade::model. Without SOURCES it is header-only.
# PUBLIC and PRIVATE name what it links; OPTIONS are compile options for its own sources.
# INTERNAL: not part of the installed package. UNITY: see alidade_unity.
function(alidade_library name)
  cmake_parse_arguments(A "INTERNAL;UNITY" "PRELUDE" "HEADERS;SOURCES;PUBLIC;PRIVATE;OPTIONS" ${ARGN})
  set(target alidade_${name})
  if(A_SOURCES)
    add_library(${target} STATIC ${A_SOURCES} ${A_HEADERS})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:alidade_options> ${A_PRIVATE})
    target_compile_options(${target} PRIVATE ${A_OPTIONS} ${ALIDADE_COMPILER_MEMORY})
    alidade_harden(${target})
    if(A_UNITY)
      alidade_unity(${target})
    endif()
    if(CMAKE_CURRENT_SOURCE_DIR MATCHES "^${PROJECT_SOURCE_DIR}/core/")
      alidade_leave_unchecked(${target})
    endif()
    if(TARGET alidade_${A_PRELUDE}_prelude)
      target_precompile_headers(${target} REUSE_FROM alidade_${A_PRELUDE}_prelude)
      # The compiler takes a prelude only where the same macros are defined.
      get_property(links GLOBAL PROPERTY ALIDADE_PRELUDE_LINKS_${A_PRELUDE})
      list(TRANSFORM links REPLACE "(.+)" "$<BUILD_INTERFACE:\\1>")
      target_link_libraries(${target} PRIVATE ${links})
    endif()
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_compile_features(${target} ${scope} cxx_std_17)
  target_include_directories(${target} ${scope}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/alidade>)
  target_link_libraries(${target} ${scope} ${A_PUBLIC})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  add_library(alidade::${name} ALIAS ${target})
  if(A_INTERNAL)
    return()
  endif()
  set_property(GLOBAL APPEND PROPERTY ALIDADE_LIBRARIES ${target})
  file(RELATIVE_PATH here "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  foreach(header IN LISTS A_HEADERS)
    get_filename_component(folder "${here}/${header}" DIRECTORY)
    install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/alidade/${folder} COMPONENT dev)
  endforeach()
endfunction()

# alidade_executable(alidade SOURCES ... LINK ...)
function(alidade_executable name)
  cmake_parse_arguments(A "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  target_link_libraries(${name} PRIVATE alidade_options ${A_LINK})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
endfunction()

# What is tested is built as it is shipped; to optimise the tests' own code would cost half of their compilation.
set(ALIDADE_TEST_OPTIONS $<$<CONFIG:Release>:-O1>)

# clang compiles Eigen's expressions in half of GCC's time. What is tested is GCC's, as it is shipped; the tests' own code is clang's where
# there is one.
if(ALIDADE_BUILD_TESTS AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_CROSSCOMPILING)
  find_program(ALIDADE_TEST_COMPILER NAMES clang++-14 DOC "Compiles the tests' own code, in GCC's place")
endif()
function(alidade_compile_as_test target)
  target_compile_options(${target} PRIVATE ${ALIDADE_TEST_OPTIONS})
  if(ALIDADE_TEST_COMPILER)
    # Not the standard that clang takes when told of none: CMake asks GCC for none, whose own it is.
    target_compile_options(${target} PRIVATE -std=gnu++17)
    set_property(TARGET ${target} PROPERTY CXX_COMPILER_LAUNCHER
      ${PROJECT_SOURCE_DIR}/cmake/compile-by ${ALIDADE_TEST_COMPILER} ${CMAKE_CXX_COMPILER} ${CMAKE_CXX_COMPILER_LAUNCHER})
  endif()
endfunction()

# What test programs share, compiled once: GoogleTest and Eigen are most of what each test file includes.
if(ALIDADE_BUILD_TESTS AND NOT ALIDADE_FUZZ)
  add_library(alidade_test_prelude OBJECT ${PROJECT_SOURCE_DIR}/cmake/prelude.cpp)
  target_link_libraries(alidade_test_prelude PRIVATE alidade_options Eigen3::Eigen GTest::gmock GTest::gtest)
  # As the test programs are compiled, which use it.
  set_target_properties(alidade_test_prelude PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(alidade_test_prelude PRIVATE -fPIE)
  alidade_compile_as_test(alidade_test_prelude)
  alidade_leave_unchecked(alidade_test_prelude)
  target_precompile_headers(alidade_test_prelude PRIVATE
    <gmock/gmock.h> <gtest/gtest.h> <Eigen/Dense> <chrono> <filesystem> <fstream> <functional> <map> <random> <sstream> <string> <thread> <vector>)
endif()

# alidade_find_opencv(libraries core imgproc)
# appends these modules to the variable, and finds OPENCV_INCLUDE_DIR. The modules alone: Debian keeps OpenCVConfig.cmake in
# libopencv-dev, which brings in all of them.
function(alidade_find_opencv libraries)
  find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  foreach(module IN LISTS ARGN)
    string(TOUPPER OPENCV_${module} library)
    find_library(${library} opencv_${module} REQUIRED)
    list(APPEND ${libraries} ${${library}})
  endforeach()
  set(${libraries} ${${libraries}} PARENT_SCOPE)
endfunction()

# alidade_find_aruco()
# finds OPENCV_ARUCO as ALIDADE_CHARUCO asks for; empty: without. After alidade_find_opencv(). The static library: the shared one lies in
# Debian's libopencv-contrib406, which needs Qt and Tesseract wherever the executable runs.
function(alidade_find_aruco)
  set(found "")
  if(NOT ALIDADE_CHARUCO STREQUAL "OFF")
    find_library(OPENCV_ARUCO_LIBRARY libopencv_aruco.a)
    if(OPENCV_ARUCO_LIBRARY AND EXISTS ${OPENCV_INCLUDE_DIR}/opencv2/aruco/charuco.hpp)
      set(found ${OPENCV_ARUCO_LIBRARY})
    elseif(ALIDADE_CHARUCO STREQUAL "ON")
      message(FATAL_ERROR "ALIDADE_CHARUCO is ON, and OpenCV's aruco is not there: install libopencv-contrib-dev")
    else()
      message(STATUS "ChArUco boards are left out: they need libopencv-contrib-dev")
    endif()
  endif()
  set(OPENCV_ARUCO "${found}" PARENT_SCOPE)
endfunction()

# All test programs that another processor can run; what `cmake --build` of an ARM preset builds.
add_custom_target(processor_programs)

# All that the tests without the label `thorough` need, in two parts: the programs of core's rooms, core_*_test, and the others.
add_custom_target(core_programs)
add_custom_target(outer_programs)
add_custom_target(quick_programs)
add_dependencies(quick_programs core_programs outer_programs)

# alidade_test(core_model_test SOURCES camera_test.cpp ... LINK alidade::model [options])
# builds the GoogleTest program of a room and registers it with ctest as one entry of that name.
#   SUPPORT     sources without tests of their own
#   THREADED    those of SOURCES that a thread-sanitized build has: what shares memory between threads. None: no program there
#   NATIVE      those of SOURCES that do not run under an emulated processor (programs are started, pseudo-terminals,
#               libraries that the sysroot lacks), with NATIVE_SUPPORT and NATIVE_LINK; `NATIVE ALL`: the whole program
#   THOROUGH    patterns of cases that only `scripts/test all` runs: entry NAME.thorough, with the label thorough
#   UNSANITIZED patterns of cases from which a sanitizer learns nothing that others do not show it: repetition, long films.
#               Under an emulated processor they are THOROUGH
#   SHARDS      how many processes share the cases, for a room whose tests mostly wait
#   COST        seconds, of a room that takes long: ctest starts the dearest first, so that none is left over at the end
#   UNITY       see alidade_unity
#   DEFINITIONS, DEPENDS, LABELS, TIMEOUT (s), RESOURCE_LOCK
function(alidade_test name)
  cmake_parse_arguments(A "UNITY" "TIMEOUT;RESOURCE_LOCK;SHARDS;COST"
    "SOURCES;SUPPORT;LINK;THREADED;NATIVE;NATIVE_SUPPORT;NATIVE_LINK;THOROUGH;UNSANITIZED;DEFINITIONS;DEPENDS;LABELS" ${ARGN})
  if(NOT ALIDADE_BUILD_TESTS)
    return()
  endif()
  if(ALIDADE_SANITIZE STREQUAL "thread")
    set(A_SOURCES ${A_THREADED})
  endif()
  if(CMAKE_CROSSCOMPILING)
    if("ALL" IN_LIST A_NATIVE)
      return()
    endif()
    list(REMOVE_ITEM A_SOURCES ${A_NATIVE} "")
  else()
    list(APPEND A_SUPPORT ${A_NATIVE_SUPPORT})
    list(APPEND A_LINK ${A_NATIVE_LINK})
  endif()
  if(NOT A_SOURCES)
    return()
  endif()
  alidade_executable(${name} SOURCES ${A_SOURCES} ${A_SUPPORT}
    LINK ${A_LINK} Eigen3::Eigen GTest::gmock GTest::gtest GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE ${A_DEFINITIONS})
  # The few with threads make other units than all of them, in which names of two sources may meet.
  if(A_UNITY AND NOT ALIDADE_SANITIZE STREQUAL "thread")
    alidade_unity(${name})
  endif()
  alidade_compile_as_test(${name})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT ALIDADE_TEST_COMPILER)
    # GCC 12 reports it inside inlined library code.
    target_compile_options(${name} PRIVATE -Wno-maybe-uninitialized)
  endif()
  target_precompile_headers(${name} REUSE_FROM alidade_test_prelude)
  # No less: where a test and a library make the same function of a template, the linker takes the test's.
  alidade_leave_unchecked(${name})
  if(A_DEPENDS)
    add_dependencies(${name} ${A_DEPENDS})
  endif()
  add_dependencies(processor_programs ${name})
  if(NOT "thorough" IN_LIST A_LABELS)
    if(name MATCHES "^core_")
      add_dependencies(core_programs ${name})
    else()
      add_dependencies(outer_programs ${name})
    endif()
  endif()

  set(left_out)
  if(ALIDADE_SANITIZE)
    set(left_out ${A_UNSANITIZED})
  elseif(CMAKE_CROSSCOMPILING)
    list(APPEND A_THOROUGH ${A_UNSANITIZED})
  endif()
  string(REPLACE ";" ":" thorough "${A_THOROUGH}")
  string(REPLACE ";" ":" left_out "${left_out}")
  alidade_register_cases(${name} ${name} "*-${thorough}:${left_out}" "${A_LABELS}")
  if(A_THOROUGH)
    alidade_register_cases(${name} ${name}.thorough "${thorough}-${left_out}" "thorough;${A_LABELS}")
  endif()
endfunction()

# One entry of ctest for the cases of a program that the filter leaves. Takes TIMEOUT, RESOURCE_LOCK, SHARDS and
# COST from alidade_test.
function(alidade_register_cases program name filter labels)
  # Only what hangs shall meet it: a shared machine is at times a third as fast.
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 900)
  endif()
  # An emulator is slower by ten to twenty times, a sanitizer by two to five.
  if(CMAKE_CROSSCOMPILING OR ALIDADE_SANITIZE)
    math(EXPR A_TIMEOUT "5 * ${A_TIMEOUT}")
  endif()
  set(command ${program})
  if(A_SHARDS AND NOT CMAKE_CROSSCOMPILING)
    find_program(SYSTEM_PYTHON3 NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH REQUIRED)
    set(command ${SYSTEM_PYTHON3} -B ${PROJECT_SOURCE_DIR}/test/support/run_shards.py ${A_SHARDS} $<TARGET_FILE:${program}>)
  endif()
  add_test(NAME ${name} COMMAND ${command} --gtest_brief=1 --gtest_filter=${filter})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${A_TIMEOUT} LABELS "${labels}")
  if(A_COST)
    set_tests_properties(${name} PROPERTIES COST ${A_COST})
  endif()
  if(A_RESOURCE_LOCK)
    set_tests_properties(${name} PROPERTIES RESOURCE_LOCK ${A_RESOURCE_LOCK})
  endif()
endfunction()

# alidade_benchmark(pt_mode_benchmark SOURCES ... LINK ...)
# builds a Google Benchmark program; `ctest -L benchmark` runs it and keeps its JSON in
# <build>/benchmark-results/.
function(alidade_benchmark name)
  cmake_parse_arguments(A "" "" "SOURCES;LINK" ${ARGN})
  if(NOT ALIDADE_BUILD_BENCHMARKS)
    return()
  endif()
  find_package(benchmark REQUIRED)
  alidade_executable(${name} SOURCES ${A_SOURCES} LINK ${A_LINK} benchmark::benchmark)
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/benchmark-results)
  add_test(NAME ${name} COMMAND ${name}
    --benchmark_out=${PROJECT_BINARY_DIR}/benchmark-results/${name}.json
    --benchmark_out_format=json)
  set_tests_properties(${name} PROPERTIES LABELS benchmark RUN_SERIAL ON TIMEOUT 600)
endfunction()

# What `ctest -L fuzz` runs, and all that the preset `fuzz` builds, by the outermost folder that a target links.
add_custom_target(fuzz_programs)
foreach(part core platform edge)
  add_custom_target(fuzz_${part}_programs)
  add_dependencies(fuzz_programs fuzz_${part}_programs)
endforeach()

# alidade_fuzz_target(vapix LINK alidade::platform [MUTATIONS n] [LONGEST bytes])
# declares the target of vapix_fuzz.cpp. Under the preset `fuzz` it is a program of its own, fuzz_vapix, linked with
# libFuzzer: `ctest -L fuzz` lets it search for a minute, or $FUZZ_SECONDS, from corpus/vapix and regressions/vapix on; what it finds worth
# keeping goes to <build>/fuzz-corpus/vapix/, an input that fails to <build>/fuzz-artifacts/; ten million inputs
# of no more bytes than that (1024) are `ctest --preset fuzz-long`. In all other builds it is a part of the program that
# alidade_fuzz_regressions() makes, which runs those files and n mutations of them (5000).
function(alidade_fuzz_target name)
  cmake_parse_arguments(A "" "MUTATIONS;LONGEST" "LINK" ${ARGN})
  file(GLOB seeds CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/corpus/${name}/*)
  if(NOT seeds)
    message(FATAL_ERROR "${CMAKE_CURRENT_SOURCE_DIR}/corpus/${name} is empty: a fuzz target begins with examples")
  endif()
  set_property(GLOBAL APPEND PROPERTY ALIDADE_FUZZ_SOURCES ${name}_fuzz.cpp)
  if(NOT A_MUTATIONS)
    set(A_MUTATIONS 5000)
  endif()
  if(NOT ALIDADE_FUZZ)
    set_property(GLOBAL APPEND PROPERTY ALIDADE_FUZZ_TARGETS ${name})
    set_property(GLOBAL APPEND PROPERTY ALIDADE_FUZZ_LIBRARIES ${A_LINK})
    set_property(GLOBAL APPEND_STRING PROPERTY ALIDADE_FUZZ_ROWS "    {\"${name}\", fuzz_${name}, ${A_MUTATIONS}},\n")
    set_property(GLOBAL APPEND_STRING PROPERTY ALIDADE_FUZZ_DECLARATIONS
      "extern \"C\" int fuzz_${name}(const std::uint8_t* data, std::size_t size);\n")
    return()
  endif()
  set(inputs ${CMAKE_CURRENT_SOURCE_DIR}/corpus/${name})
  # Globbed at each build: the first regression of a target makes its folder.
  file(GLOB regressions CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/regressions/${name})
  list(APPEND inputs ${regressions})
  set(found ${PROJECT_BINARY_DIR}/fuzz-corpus/${name})
  set(artifacts ${PROJECT_BINARY_DIR}/fuzz-artifacts)
  file(MAKE_DIRECTORY ${found} ${artifacts})
  alidade_executable(fuzz_${name} SOURCES ${name}_fuzz.cpp LINK ${A_LINK})
  target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
  set(part core)
  foreach(library IN LISTS A_LINK)
    if(library STREQUAL "alidade::platform")
      set(part platform)
    elseif(NOT library MATCHES "^alidade::(model|realtime|calibration)$")
      set(part edge)
      break()
    endif()
  endforeach()
  add_dependencies(fuzz_${part}_programs fuzz_${name})
  set(search -timeout=30 -print_final_stats=1 -artifact_prefix=${artifacts}/${name}-)
  add_test(NAME fuzz_${name} COMMAND sh -c [[exec "$@" -max_total_time="${FUZZ_SECONDS:-60}"]] sh
    $<TARGET_FILE:fuzz_${name}> ${search} ${found} ${inputs})
  set_tests_properties(fuzz_${name} PROPERTIES LABELS "fuzz;fuzz-${part}" TIMEOUT 180)
  if(NOT A_LONGEST)
    set(A_LONGEST 1024)
  endif()
  add_test(NAME fuzz_${name}_ten_million
    COMMAND fuzz_${name} ${search} -runs=10000000 -max_len=${A_LONGEST} ${found} ${inputs})
  # A fifth faster; an input that fails tells more when it is run again without.
  set_tests_properties(fuzz_${name}_ten_million PROPERTIES LABELS "fuzz;slow" TIMEOUT 10800
    ENVIRONMENT ASAN_OPTIONS=malloc_context_size=0:quarantine_size_mb=16)
endfunction()

# Every *_fuzz.cpp here is of a target that has been declared, or is one of those named: none lies about unbuilt.
function(alidade_require_fuzz_targets)
  get_property(declared GLOBAL PROPERTY ALIDADE_FUZZ_SOURCES)
  set(others ${ARGN})
  list(TRANSFORM others APPEND _fuzz.cpp)
  file(GLOB found RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*_fuzz.cpp)
  foreach(file IN LISTS found)
    if(NOT file IN_LIST declared AND NOT file IN_LIST others)
      message(FATAL_ERROR "${CMAKE_CURRENT_SOURCE_DIR}/${file} is of no target: declare it in CMakeLists.txt, or its head in "
        "platform/pan_tilt/heads.h")
    endif()
  endforeach()
endfunction()

# The program fuzz_regressions of all targets declared so far, and planted_defect_fuzz.cpp, which proves that it bites.
function(alidade_fuzz_regressions)
  get_property(targets GLOBAL PROPERTY ALIDADE_FUZZ_TARGETS)
  get_property(libraries GLOBAL PROPERTY ALIDADE_FUZZ_LIBRARIES)
  list(REMOVE_DUPLICATES libraries)
  get_property(ALIDADE_FUZZ_ROWS GLOBAL PROPERTY ALIDADE_FUZZ_ROWS)
  get_property(ALIDADE_FUZZ_DECLARATIONS GLOBAL PROPERTY ALIDADE_FUZZ_DECLARATIONS)
  configure_file(regression_targets.h.in test/fuzz/regression_targets.h @ONLY)
  set(sources regression_driver.cpp)
  foreach(target IN LISTS targets ITEMS planted_defect)
    set_source_files_properties(${target}_fuzz.cpp PROPERTIES
      COMPILE_DEFINITIONS LLVMFuzzerTestOneInput=fuzz_${target})
    list(APPEND sources ${target}_fuzz.cpp)
  endforeach()
  alidade_executable(fuzz_regressions SOURCES ${sources} LINK ${libraries})
  target_include_directories(fuzz_regressions PRIVATE ${CMAKE_CURRENT_BINARY_DIR})
  add_test(NAME fuzz_regressions COMMAND fuzz_regressions --all ${CMAKE_CURRENT_SOURCE_DIR})
  set_tests_properties(fuzz_regressions PROPERTIES TIMEOUT 900)
  add_dependencies(processor_programs fuzz_regressions)
  add_dependencies(outer_programs fuzz_regressions)
endfunction()
