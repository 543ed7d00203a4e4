# Code that is never on a record's way lies together in the executable, so that locked memory can do without it; a linker that takes
# no such scripts leaves it where it is. Another linker needs another build folder, as the answer is kept.
function(alidade_gather_batch_code name)
  include(CheckLinkerFlag)
  set(script ${PROJECT_SOURCE_DIR}/cmake/batch_code.ld)
  check_linker_flag(CXX -Wl,-T,${script} ALIDADE_LINKER_TAKES_SCRIPTS)
  if(ALIDADE_LINKER_TAKES_SCRIPTS)
    target_link_options(${name} PRIVATE -Wl,-T,${script})
    set_target_properties(${name} PROPERTIES LINK_DEPENDS ${script})
  endif()
endfunction()
