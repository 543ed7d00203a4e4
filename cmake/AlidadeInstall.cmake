# Installs every library made by alidade_library() with an exported package, so that another
# project writes find_package(alidade) and links alidade::model.
include(CMakePackageConfigHelpers)

get_property(libraries GLOBAL PROPERTY ALIDADE_LIBRARIES)
install(TARGETS ${libraries} EXPORT alidadeTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
install(EXPORT alidadeTargets NAMESPACE alidade::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/alidade COMPONENT dev)
set(ALIDADE_PACKAGE_HAS_CALIBRATION OFF)
if(TARGET alidade::calibration)
  set(ALIDADE_PACKAGE_HAS_CALIBRATION ON)
endif()
configure_package_config_file(cmake/alidadeConfig.cmake.in alidadeConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/alidade)
write_basic_package_version_file(alidadeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/alidadeConfig.cmake ${PROJECT_BINARY_DIR}/alidadeConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/alidade COMPONENT dev)
