# Files per head on a line, from the rows of kHeads in platform/pan_tilt/heads.h. ALIDADE_HEADS is
# the list of their keys. A missing file of a head, or a file without a row, is an error of CMake,
# so that none is left unbuilt.
include_guard(GLOBAL)

set(heads ${PROJECT_SOURCE_DIR}/platform/pan_tilt/heads.h)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${heads})
file(STRINGS ${heads} rows REGEX "^ +{HeadType::k[A-Za-z0-9]+, \"[a-z0-9_]+\"")
list(LENGTH rows count)
file(STRINGS ${heads} all_rows REGEX "^ +{HeadType::k")
list(LENGTH all_rows all)
if(count EQUAL 0 OR NOT count EQUAL all)
  message(FATAL_ERROR "${heads}: ${count} of ${all} rows of kHeads are read; expected lines {HeadType::kFoo, \"foo\", ...")
endif()
set(ALIDADE_HEADS)
foreach(row IN LISTS rows)
  string(REGEX REPLACE "^[^\"]*\"([a-z0-9_]+)\".*" "\\1" key "${row}")
  list(APPEND ALIDADE_HEADS ${key})
endforeach()

# alidade_files_of_heads(sources pan_tilt/ _protocol.cpp)
# sets the variable to pan_tilt/KEY_protocol.cpp of each head. The prefix is a folder below the
# current one, or "". No other file there may end like that.
function(alidade_files_of_heads out prefix suffix)
  set(files)
  foreach(key IN LISTS ALIDADE_HEADS)
    set(file ${prefix}${key}${suffix})
    if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${file})
      message(FATAL_ERROR "${CMAKE_CURRENT_SOURCE_DIR}/${file} is missing: platform/pan_tilt/heads.h has a head '${key}'. "
        "All that a head has: platform/pan_tilt/README.md")
    endif()
    list(APPEND files ${file})
  endforeach()
  file(GLOB found RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${prefix}*${suffix})
  foreach(file IN LISTS found)
    if(NOT file IN_LIST files)
      message(FATAL_ERROR "${CMAKE_CURRENT_SOURCE_DIR}/${file} is of no head: kHeads of platform/pan_tilt/heads.h has ${ALIDADE_HEADS}")
    endif()
  endforeach()
  set(${out} ${files} PARENT_SCOPE)
endfunction()
