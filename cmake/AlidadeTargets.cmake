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
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wnon-virtual-dtor -Wold-style-cast
  -Woverloaded-virtual -Wnull-dereference -Werror)
# GCC 12 reports -Wnull-dereference and -Wmaybe-uninitialized inside inlined library code when it
# also instruments; the plain release build keeps both.
if(ALIDADE_SANITIZE)
  target_compile_options(alidade_options INTERFACE
    -fsanitize=${ALIDADE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
    $<$<CXX_COMPILER_ID:GNU>:-Wno-null-dereference;-Wno-maybe-uninitialized;-Wno-array-bounds;-Wno-stringop-overflow>)
  target_link_options(alidade_options INTERFACE -fsanitize=${ALIDADE_SANITIZE})
endif()
if(ALIDADE_FUZZ)
  # Every library tells libFuzzer which ways its code took.
  target_compile_options(alidade_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

# alidade_library(model [INTERNAL] HEADERS ... SOURCES ... PUBLIC ... PRIVATE ... OPTIONS ...)
# makes target alidade_model and alias alidade::model. Without SOURCES it is header-only.
# PUBLIC and PRIVATE name what it links; OPTIONS are compile options for its own sources.
# INTERNAL: not part of the installed package.
function(alidade_library name)
  cmake_parse_arguments(A "INTERNAL" "" "HEADERS;SOURCES;PUBLIC;PRIVATE;OPTIONS" ${ARGN})
  set(target alidade_${name})
  if(A_SOURCES)
    add_library(${target} STATIC ${A_SOURCES} ${A_HEADERS})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:alidade_options> ${A_PRIVATE})
    target_compile_options(${target} PRIVATE ${A_OPTIONS})
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

# Everything that the thread sanitizer is worth building for: the tests labelled `threads`.
add_custom_target(threaded_programs)

# What another processor can make different, and qemu-user can run: the tests labelled `processor`. Those that start
# programs of the other processor or need pseudo-terminals cannot run there.
add_custom_target(processor_programs)

# alidade_test(camera_test SOURCES camera_test.cpp LINK alidade::model [LABELS ...] [TIMEOUT s]
#              [ARGUMENTS ...] [DEPENDS target...])
# builds a GoogleTest program and registers each of its tests with ctest, with the labels and those of the folder,
# ALIDADE_TEST_LABELS. With a sanitizer, those labelled statistics or
# films are neither built nor run.
function(alidade_test name)
  cmake_parse_arguments(A "" "TIMEOUT" "SOURCES;LINK;LABELS;ARGUMENTS;DEPENDS" ${ARGN})
  if(NOT ALIDADE_BUILD_TESTS)
    return()
  endif()
  if(NOT A_TIMEOUT)
    set(A_TIMEOUT 120)
  endif()
  # An emulator is slower by ten to twenty times.
  if(CMAKE_CROSSCOMPILING)
    math(EXPR A_TIMEOUT "5 * ${A_TIMEOUT}")
  endif()
  alidade_executable(${name} SOURCES ${A_SOURCES} LINK ${A_LINK} GTest::gmock GTest::gtest GTest::gtest_main)
  # The product is what shall have no undefined behaviour: looking for it in tests too would double the time
  # that they take to compile. Headers without a library have their tests only.
  if(ALIDADE_SANITIZE MATCHES undefined AND NOT "alidade::model" IN_LIST A_LINK)
    target_compile_options(${name} PRIVATE -fno-sanitize=undefined)
  endif()
  if(A_DEPENDS)
    add_dependencies(${name} ${A_DEPENDS})
  endif()
  # Repetition, and films of hundreds of pictures: what runs a thousand times there, other tests run instrumented.
  if(ALIDADE_SANITIZE AND ("statistics" IN_LIST A_LABELS OR "films" IN_LIST A_LABELS))
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
    return()
  endif()
  list(APPEND A_LABELS ${ALIDADE_TEST_LABELS})
  if("processor" IN_LIST A_LABELS)
    add_dependencies(processor_programs ${name})
  endif()
  if("threads" IN_LIST A_LABELS)
    add_dependencies(threaded_programs ${name})
  endif()
  include(GoogleTest)
  # Values of parameters stay out of the names: printed bytes of a struct differ from run to run.
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60 NO_PRETTY_VALUES
    EXTRA_ARGS ${A_ARGUMENTS}
    PROPERTIES TIMEOUT ${A_TIMEOUT} LABELS "${A_LABELS}")
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

# What `ctest -L fuzz` runs, and all that the preset `fuzz` builds.
add_custom_target(fuzz_programs)

# alidade_fuzz_target(vapix LINK alidade::platform [MUTATIONS n] [LONGEST bytes])
# builds fuzz_vapix of vapix_fuzz.cpp and registers it. Under the preset `fuzz` it is linked with libFuzzer, and
# `ctest -L fuzz` lets it search for a minute, from corpus/vapix and regressions/vapix on; what it finds worth
# keeping goes to <build>/fuzz-corpus/vapix/, an input that fails to <build>/fuzz-artifacts/; ten million inputs
# of no more bytes than that (1024) are `ctest --preset fuzz-long`. In all other builds fuzz_regressions_vapix
# runs those files, and n mutations of them (alidade::regression_driver).
function(alidade_fuzz_target name)
  cmake_parse_arguments(A "" "MUTATIONS;LONGEST" "LINK" ${ARGN})
  set(inputs ${CMAKE_CURRENT_SOURCE_DIR}/corpus/${name})
  # Globbed at each build: the first regression of a target makes its folder.
  file(GLOB regressions CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/regressions/${name})
  list(APPEND inputs ${regressions})
  if(ALIDADE_FUZZ)
    set(found ${PROJECT_BINARY_DIR}/fuzz-corpus/${name})
    set(artifacts ${PROJECT_BINARY_DIR}/fuzz-artifacts)
    file(MAKE_DIRECTORY ${found} ${artifacts})
    alidade_executable(fuzz_${name} SOURCES ${name}_fuzz.cpp LINK ${A_LINK})
    target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
    add_dependencies(fuzz_programs fuzz_${name})
    set(search fuzz_${name} -timeout=30 -print_final_stats=1 -artifact_prefix=${artifacts}/${name}-)
    add_test(NAME fuzz_${name} COMMAND ${search} -max_total_time=60 ${found} ${inputs})
    set_tests_properties(fuzz_${name} PROPERTIES LABELS fuzz TIMEOUT 180)
    if(NOT A_LONGEST)
      set(A_LONGEST 1024)
    endif()
    add_test(NAME fuzz_${name}_ten_million
      COMMAND ${search} -runs=10000000 -max_len=${A_LONGEST} ${found} ${inputs})
    # A fifth faster; an input that fails tells more when it is run again without.
    set_tests_properties(fuzz_${name}_ten_million PROPERTIES LABELS "fuzz;slow" TIMEOUT 10800
      ENVIRONMENT ASAN_OPTIONS=malloc_context_size=0:quarantine_size_mb=16)
  else()
    alidade_executable(fuzz_${name} SOURCES ${name}_fuzz.cpp LINK alidade::regression_driver ${A_LINK})
    if(NOT A_MUTATIONS)
      set(A_MUTATIONS 5000)
    endif()
    add_test(NAME fuzz_regressions_${name}
      COMMAND fuzz_${name} --mutations=${A_MUTATIONS} ${inputs})
    set_tests_properties(fuzz_regressions_${name} PROPERTIES TIMEOUT 120 LABELS processor)
    add_dependencies(processor_programs fuzz_${name})
  endif()
endfunction()
