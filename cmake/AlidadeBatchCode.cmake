# Gathers code that is never on a record's way in one part of the executable, so that it need not be
# in locked memory. A linker that accepts no such scripts leaves it where it is. Use another build
# folder for another linker, as the result of the check is cached.
function(alidade_gather_batch_code name)
  include(CheckLinkerFlag)
  set(script ${PROJECT_SOURCE_DIR}/cmake/batch_code.ld)
  check_linker_flag(CXX -Wl,-T,${script} ALIDADE_LINKER_TAKES_SCRIPTS)
  if(ALIDADE_LINKER_TAKES_SCRIPTS)
    target_link_options(${name} PRIVATE -Wl,-T,${script})
    set_target_properties(${name} PROPERTIES LINK_DEPENDS ${script})
  endif()
endfunction()
