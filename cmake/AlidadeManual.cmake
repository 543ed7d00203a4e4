# The manual for users, docs/manual, as HTML with a search: the target `manual`, a part of the
# package where Sphinx and MyST are installed (scripts/install-deps). It is made in
# share/doc/alidade/manual of the build folder, where `alidade run` of this build finds it, too.
find_program(SPHINX_BUILD sphinx-build)
find_program(SYSTEM_PYTHON3 NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)
if(SPHINX_BUILD AND SYSTEM_PYTHON3)
  execute_process(COMMAND ${SYSTEM_PYTHON3} -c "import myst_parser" RESULT_VARIABLE without_myst ERROR_QUIET)
endif()
if(NOT SPHINX_BUILD OR NOT SYSTEM_PYTHON3 OR without_myst)
  message(STATUS "The manual is left out: python3-sphinx and python3-myst-parser are not installed (scripts/install-deps)")
  return()
endif()

set(manual ${PROJECT_BINARY_DIR}/share/doc/alidade/manual)
file(GLOB_RECURSE manual_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/docs/manual/*)
# jQuery and its like, which Sphinx brings for pages of others: nothing here asks for them.
set(not_needed .buildinfo objects.inv _static/jquery.js _static/underscore.js _static/_sphinx_javascript_frameworks_compat.js
  _static/file.png _static/plus.png _static/minus.png)
list(TRANSFORM not_needed PREPEND ${manual}/)
add_custom_command(OUTPUT ${manual}/index.html
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${manual}
  COMMAND ${SPHINX_BUILD} -q -W --keep-going -b html -d ${PROJECT_BINARY_DIR}/manual.doctrees ${PROJECT_SOURCE_DIR}/docs/manual ${manual}
  COMMAND ${CMAKE_COMMAND} -E rm -f ${not_needed}
  DEPENDS ${manual_sources} COMMENT "Making the manual" VERBATIM)
add_custom_target(manual ALL DEPENDS ${manual}/index.html)
install(DIRECTORY ${manual}/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/alidade/manual COMPONENT runtime OPTIONAL)
