# The only way to declare a library, a program, a test and a benchmark. Every target gets the same
# standard, warnings and sanitizers, and a test cannot be built without being registered.
include_guard(GLOBAL)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

add_library(alidade_options INTERFACE)
target_compile_features(alidade_options INTERFACE cxx_std_17)
target_compile_options(alidade_options INTERFACE
  # Off in units of several sources, where a local may have the name of something in another source.
  # The presets `dev` and `fuzz` check it.
  $<$<NOT:$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wshadow>
  -Wall -Wextra -Wpedantic -Wconversion -Wnon-virtual-dtor -Wold-style-cast
  -Woverloaded-virtual -Wnull-dereference -Werror)
# 32-bit ARM. The macro is the one that core/model gives its users: GCC takes a prelude only where the
# same macros are defined. The warning is a false one: in Eigen's scalar loops GCC 12 takes the memory of
# a vector that may be empty for read.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^armv[67]")
  target_compile_definitions(alidade_options INTERFACE EIGEN_DONT_VECTORIZE)
  target_compile_options(alidade_options INTERFACE -Wno-null-dereference)
endif()
# GCC's garbage collection takes a tenth of its time; without it a source takes 2 GB at most. For
# libraries only: tests are compiled by clang.
cmake_host_system_information(RESULT host_memory_mb QUERY TOTAL_PHYSICAL_MEMORY)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND host_memory_mb GREATER 8000)
  set(ALIDADE_COMPILER_MEMORY "SHELL:--param ggc-min-heapsize=1500000")
endif()
# The presets with sanitizers use clang. It compiles Eigen's expressions in half of GCC's time, and
# GCC 12 warns inside inlined library code when it also instruments.
if(ALIDADE_SANITIZE)
  target_compile_options(alidade_options INTERFACE
    -fsanitize=${ALIDADE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
    $<$<BOOL:$<TARGET_PROPERTY:ALIDADE_UNCHECKED>>:-fno-sanitize=$<TARGET_PROPERTY:ALIDADE_UNCHECKED>>)
  target_link_options(alidade_options INTERFACE -fsanitize=${ALIDADE_SANITIZE})
endif()
if(ALIDADE_FUZZ)
  # Makes every library report its code coverage to libFuzzer.
  target_compile_options(alidade_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

# Hardening of all that is shipped, so that a memory error is hard to exploit: stack canaries,
# checked calls of the C library, no jump over the stack's guard page, and calls and jumps only to
# intended places. For optimising builds, as _FORTIFY_SOURCE does nothing in others. Sanitizers find
# more without it.
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
# compiles a library's own sources with hardening. Links a program such that its symbols are
# resolved at its start, never on the real-time thread, and their table is read-only afterwards. Not
# for tests, which are not shipped.
function(alidade_harden target)
  get_target_property(type ${target} TYPE)
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:alidade_hardening>)
  if(type STREQUAL "EXECUTABLE")
    target_link_options(${target} PRIVATE -pie -Wl,-z,relro,-z,now,-z,noexecstack)
  endif()
endfunction()

# alidade_leave_unchecked(target)
# leaves out some checks, for the rooms of mathematics and the tests. Each access of Eigen would
# carry these checks, half of the cost of such a source. The address sanitizer and Eigen's own
# assertions find the same errors, and the preset `fuzz` has the checks. This is a property because
# an option of the target itself would come before the one that enables the checks.
function(alidade_leave_unchecked target)
  if(ALIDADE_SANITIZE MATCHES undefined AND NOT ALIDADE_FUZZ)
    set_target_properties(${target} PROPERTIES ALIDADE_UNCHECKED null,alignment,object-size,vptr,pointer-overflow)
  endif()
endfunction()

# alidade_leave_uninstrumented(target)
# leaves out the sanitizers, for a tool of the tests. Sanitizers are for what is shipped, and the
# films would take most of their suites' time. Not in the thread-sanitized build: the thread
# sanitizer must see all threads.
function(alidade_leave_uninstrumented target)
  if(ALIDADE_SANITIZE MATCHES address)
    set_target_properties(${target} PROPERTIES ALIDADE_UNCHECKED all)
    target_compile_options(${target} PRIVATE -O2)
  endif()
endfunction()

# alidade_prelude(edge_app HEADERS <Eigen/Dense> ... LINK ... OPTIONS ...)
# precompiles headers that most sources of the libraries with `PRELUDE edge_app` include. OPTIONS
# are those of the libraries. Each source must still include what it needs: the build for fuzzing
# has neither preludes nor units of several sources, and fails otherwise.
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
# compiles up to eight sources of the target as one. That halves the cost of most rooms, as half of
# it is for what their sources include. Names in anonymous namespaces must then differ within a
# room. The presets `dev` and `fuzz` compile each source separately.
function(alidade_unity target)
  if(ALIDADE_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  endif()
endfunction()

# alidade_library(model [INTERNAL] [UNITY] [PRELUDE name] HEADERS ... SOURCES ... PUBLIC ...
#                 PRIVATE ... OPTIONS ...)
# makes target alidade_model and alias alidade::model. Without SOURCES it is header-only. PUBLIC and
# PRIVATE name what it links; OPTIONS are compile options for its own sources. INTERNAL: not part of
# the installed package. UNITY: see alidade_unity.
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
      # The compiler uses a prelude only if the same macros are defined.
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

# What is tested is built as it is shipped. To optimise the tests' own code would cost half of their
# compilation time.
set(ALIDADE_TEST_OPTIONS $<$<CONFIG:Release>:-O1>)

# clang compiles Eigen's expressions in half of GCC's time. The code under test is compiled by GCC,
# as it is shipped. The tests' own code is compiled by clang if it is installed.
if(ALIDADE_BUILD_TESTS AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_CROSSCOMPILING)
  find_program(ALIDADE_TEST_COMPILER NAMES clang++-14 DOC "Compiles the tests' own code, in GCC's place")
endif()
function(alidade_compile_as_test target)
  target_compile_options(${target} PRIVATE ${ALIDADE_TEST_OPTIONS})
  if(ALIDADE_TEST_COMPILER)
    # clang's default standard is another one. CMake passes none to GCC, whose default it is.
    target_compile_options(${target} PRIVATE -std=gnu++17)
    set_property(TARGET ${target} PROPERTY CXX_COMPILER_LAUNCHER
      ${PROJECT_SOURCE_DIR}/cmake/compile-by ${ALIDADE_TEST_COMPILER} ${CMAKE_CXX_COMPILER} ${CMAKE_CXX_COMPILER_LAUNCHER})
  endif()
endfunction()

# Headers that test programs share, compiled once: GoogleTest and Eigen are most of what each test
# file includes.
if(ALIDADE_BUILD_TESTS AND NOT ALIDADE_FUZZ)
  add_library(alidade_test_prelude OBJECT ${PROJECT_SOURCE_DIR}/cmake/prelude.cpp)
  target_link_libraries(alidade_test_prelude PRIVATE alidade_options Eigen3::Eigen GTest::gmock GTest::gtest)
  # The same as for the test programs that use it.
  set_target_properties(alidade_test_prelude PROPERTIES POSITION_INDEPENDENT_CODE OFF)
  target_compile_options(alidade_test_prelude PRIVATE -fPIE)
  alidade_compile_as_test(alidade_test_prelude)
  alidade_leave_unchecked(alidade_test_prelude)
  target_precompile_headers(alidade_test_prelude PRIVATE
    <gmock/gmock.h> <gtest/gtest.h> <Eigen/Dense> <chrono> <filesystem> <fstream> <functional> <map> <random> <sstream> <string> <thread> <vector>)
endif()

# alidade_find_opencv(libraries core imgproc)
# appends these modules to the variable, and finds OPENCV_INCLUDE_DIR. It finds single modules,
# because Debian has OpenCVConfig.cmake in libopencv-dev, which installs all of them.
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
# sets OPENCV_ARUCO as ALIDADE_CHARUCO asks for; empty: without. Call it after
# alidade_find_opencv(). It finds the static library: the shared one is in Debian's
# libopencv-contrib406, which needs Qt and Tesseract wherever the executable runs.
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

# All test programs that can run on another processor; built by `cmake --build` of an ARM preset.
add_custom_target(processor_programs)

# All programs for the tests without the label `thorough`, in two parts: those of core's rooms,
# core_*_test, and the others.
add_custom_target(core_programs)
add_custom_target(outer_programs)
add_custom_target(quick_programs)
add_dependencies(quick_programs core_programs outer_programs)

# alidade_test(core_model_test SOURCES camera_test.cpp ... LINK alidade::model [options])
# builds the GoogleTest program of a room and registers it with ctest as one entry of that name.
#   SUPPORT     sources without tests of their own
#   THREADED    the SOURCES of a thread-sanitized build: those that share memory between threads.
#               Without them there is no program in that build
#   NATIVE      the SOURCES that do not run under an emulated processor (they start programs, use
#               pseudo-terminals or libraries that the sysroot lacks), with NATIVE_SUPPORT and
#               NATIVE_LINK; `NATIVE ALL`: the whole program
#   THOROUGH    patterns of cases that only `scripts/test all` runs: entry NAME.thorough, with the
#               label thorough
#   UNSANITIZED patterns of cases that show a sanitizer nothing new: repetition, long films. Under
#   an
#               emulated processor they are THOROUGH
#   SHARDS      number of processes that share the cases, for a room whose tests mostly wait
#   COST        seconds, for a room that takes long: ctest starts the most expensive first, so that
#               none is left over at the end
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
  # The THREADED sources alone would form other units, in which names of two sources may clash.
  if(A_UNITY AND NOT ALIDADE_SANITIZE STREQUAL "thread")
    alidade_unity(${name})
  endif()
  alidade_compile_as_test(${name})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT ALIDADE_TEST_COMPILER)
    # GCC 12 warns inside inlined library code.
    target_compile_options(${name} PRIVATE -Wno-maybe-uninitialized)
  endif()
  target_precompile_headers(${name} REUSE_FROM alidade_test_prelude)
  # Leaves out no further checks: if a test and a library instantiate the same template function,
  # the linker takes the test's.
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

# Registers the program's cases that the filter selects as one entry of ctest. Uses TIMEOUT,
# RESOURCE_LOCK, SHARDS and COST of alidade_test.
function(alidade_register_cases program name filter labels)
  # Only a test that hangs may reach it: a shared machine is at times a third as fast.
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 900)
  endif()
  # An emulator is ten to twenty times slower, a sanitizer two to five times.
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
# builds a Google Benchmark program. `ctest -L benchmark` runs it and stores its JSON in
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

# Programs that `ctest -L fuzz` runs and the preset `fuzz` builds, by the outermost folder that a
# target links.
add_custom_target(fuzz_programs)
foreach(part core platform edge)
  add_custom_target(fuzz_${part}_programs)
  add_dependencies(fuzz_programs fuzz_${part}_programs)
endforeach()

# alidade_fuzz_target(vapix LINK alidade::platform [MUTATIONS n] [LONGEST bytes])
# declares the target of vapix_fuzz.cpp. Under the preset `fuzz` it is a program of its own,
# fuzz_vapix, linked with libFuzzer. `ctest -L fuzz` lets it search for a minute, or $FUZZ_SECONDS,
# starting from corpus/vapix and regressions/vapix. Inputs worth keeping go to
# <build>/fuzz-corpus/vapix/, failing inputs to <build>/fuzz-artifacts/. `ctest --preset fuzz-long`
# runs ten million inputs of at most LONGEST bytes (1024). In all other builds the target is part of
# the program of alidade_fuzz_regressions(), which runs those files and n mutations of them (5000).
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
  # Globbed at each build: the first regression of a target creates its folder.
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
  # These options make it a fifth faster. A failing input reports more when it is run again without
  # them.
  set_tests_properties(fuzz_${name}_ten_million PROPERTIES LABELS "fuzz;slow" TIMEOUT 10800
    ENVIRONMENT ASAN_OPTIONS=malloc_context_size=0:quarantine_size_mb=16)
endfunction()

# Checks that every *_fuzz.cpp here belongs to a declared target or to one of those named, so that
# none is left unbuilt.
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

# Builds the program fuzz_regressions of all targets declared so far and of planted_defect_fuzz.cpp,
# which proves that it detects defects.
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
