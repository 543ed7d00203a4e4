# Debian packages, by `cpack` in the build folder (scripts/package does everything): alidade, the
# executable as a service; alidade-dev, headers, libraries and the CMake package; where it is built,
# alidade-simulator, the virtual camera with its examples and photos. Must be included
# last: it packs what was installed so far.
set(packaging ${PROJECT_SOURCE_DIR}/edge_app/packaging)
set(packages_dir ${PROJECT_BINARY_DIR}/packaging)

set(architecture_of_x86_64-linux-gnu amd64)
set(architecture_of_aarch64-linux-gnu arm64)
set(architecture_of_arm-linux-gnueabihf armhf)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${architecture_of_${CMAKE_LIBRARY_ARCHITECTURE}})
if(NOT CPACK_DEBIAN_PACKAGE_ARCHITECTURE)
  message(STATUS "No Debian packages: none are made for '${CMAKE_LIBRARY_ARCHITECTURE}'")
  return()
endif()

set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${packaging}/changelog ${packaging}/alidade.1)
file(STRINGS ${packaging}/changelog newest LIMIT_COUNT 1)
if(NOT newest MATCHES "^alidade \\(${PROJECT_VERSION}\\) ")
  message(FATAL_ERROR "${packaging}/changelog begins with '${newest}', and the version is ${PROJECT_VERSION}: add it there")
endif()

# Compressed as Debian requires, and identical in each build.
file(MAKE_DIRECTORY ${packages_dir})
foreach(file alidade.1 changelog)
  execute_process(COMMAND gzip -9nc ${packaging}/${file} OUTPUT_FILE ${packages_dir}/${file}.gz
    COMMAND_ERROR_IS_FATAL ANY)
endforeach()

# alidade_unit(FILE NAME ...): the unit of one camera, or the template for several, with
# configuration and state by the instance's name.
function(alidade_unit file)
  cmake_parse_arguments(A "" "NAME;DESCRIPTION;CONFIGURATION;STATE;OWN_ENVIRONMENT" "" ${ARGN})
  foreach(word NAME DESCRIPTION CONFIGURATION STATE OWN_ENVIRONMENT)
    set(${word} "${A_${word}}")
  endforeach()
  configure_file(${packaging}/alidade.service.in ${packages_dir}/${file} @ONLY)
endfunction()
alidade_unit(alidade.service NAME alidade CONFIGURATION alidade STATE alidade)
alidade_unit(alidade@.service NAME alidade@NAME DESCRIPTION ": %i" CONFIGURATION %i STATE alidade/%i
  OWN_ENVIRONMENT "EnvironmentFile=-/etc/alidade/%i.environment\n")

install(FILES ${packages_dir}/alidade.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)
# bash finds it there by the program's name.
install(FILES ${packaging}/alidade.bash-completion DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
  RENAME alidade COMPONENT runtime)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/edge_app/examples/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/alidade/examples
  COMPONENT runtime FILES_MATCHING PATTERN "*.yaml" PATTERN "*.conf")
# Only for packages: `cmake --install` does not write to the system's own folders.
install(FILES ${PROJECT_SOURCE_DIR}/edge_app/examples/service.yaml DESTINATION /etc/alidade RENAME alidade.yaml
  COMPONENT system EXCLUDE_FROM_ALL)
install(FILES ${packages_dir}/alidade.service ${packages_dir}/alidade@.service DESTINATION /lib/systemd/system
  COMPONENT system EXCLUDE_FROM_ALL)
install(FILES ${packaging}/60-alidade.rules DESTINATION /lib/udev/rules.d COMPONENT system EXCLUDE_FROM_ALL)
install(FILES ${packaging}/lintian-overrides DESTINATION /usr/share/lintian/overrides RENAME alidade
  COMPONENT system EXCLUDE_FROM_ALL)
install(FILES ${packaging}/copyright ${packages_dir}/changelog.gz DESTINATION /usr/share/doc/alidade
  COMPONENT system EXCLUDE_FROM_ALL)
install(FILES ${packaging}/copyright ${packages_dir}/changelog.gz DESTINATION /usr/share/doc/alidade-dev
  COMPONENT dev-system EXCLUDE_FROM_ALL)
install(FILES ${packaging}/copyright ${packages_dir}/changelog.gz DESTINATION /usr/share/doc/alidade-simulator
  COMPONENT virtual-system EXCLUDE_FROM_ALL)

# Everything that is packed; `all` would also build the tests.
get_property(libraries GLOBAL PROPERTY ALIDADE_LIBRARIES)
add_custom_target(packaged DEPENDS alidade)
if(TARGET manual)
  add_dependencies(packaged manual)
endif()
foreach(library IN LISTS libraries)
  get_target_property(type ${library} TYPE)
  if(type STREQUAL STATIC_LIBRARY)
    add_dependencies(packaged ${library})
  endif()
endforeach()

set(ALIDADE_SIMULATOR_EXECUTABLE "")
if(TARGET alidade-simulate)
  add_dependencies(packaged alidade-simulate)
  set(ALIDADE_SIMULATOR_EXECUTABLE ${PROJECT_BINARY_DIR}/test/simulator/alidade-simulate)
endif()

# dpkg-shlibdeps reads dpkg's database of the machine or of the sysroot.
set(ALIDADE_EXECUTABLE ${PROJECT_BINARY_DIR}/edge_app/alidade)
configure_file(${PROJECT_SOURCE_DIR}/cmake/AlidadePackagesConfig.cmake.in ${packages_dir}/config.cmake @ONLY)

# cpack only packs what has been built: `cmake --build . --target packaged`.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
set(CPACK_GENERATOR DEB)
set(CPACK_PROJECT_CONFIG_FILE ${packages_dir}/config.cmake)
set(CPACK_PACKAGE_NAME alidade)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGE_CONTACT "Alidade developers <alidade@example.com>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL runtime system dev dev-system)
if(TARGET alidade-simulate)
  list(APPEND CPACK_COMPONENTS_ALL virtual virtual-system)
endif()
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_EDGE_PACKAGE_NAME alidade)
set(CPACK_DEBIAN_EDGE_PACKAGE_SECTION science)
set(CPACK_DEBIAN_EDGE_PACKAGE_CONTROL_EXTRA
  "${packaging}/postinst;${packaging}/prerm;${packaging}/postrm;${packaging}/conffiles")
set(CPACK_COMPONENT_EDGE_DESCRIPTION
  "direction sensor made of a pan-tilt-zoom camera
Gives, for every video frame and in real time, the orientation of a cheap
pan-tilt-zoom camera and the direction of any pixel, each with an honest
uncertainty. It listens to video (RTSP, MJPEG, V4L2) and to pan and tilt
telemetry (VAPIX, ONVIF, heads on a serial line, TCP or UDP), and calibrates
itself while the camera moves.

This is the program, and a systemd service that runs it. On armhf it needs a
processor with NEON.")
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_NAME alidade-dev)
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_SECTION libdevel)
# What the CMake package finds and its static libraries link.
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_DEPENDS
  "libavcodec-dev, libavformat-dev, libavutil-dev, libboost-dev, libcurl4-openssl-dev, libeigen3-dev, libfmt-dev, libgstreamer-plugins-base1.0-dev, libpugixml-dev, libspdlog-dev, libssl-dev, libswscale-dev, libsystemd-dev, libturbojpeg0-dev, libyaml-cpp-dev")
set(CPACK_COMPONENT_LIBRARIES_DESCRIPTION
  "direction sensor made of a pan-tilt-zoom camera (libraries)
Headers, static libraries and a CMake package of Alidade, for programs that
turn the pixels of a pan-tilt-zoom camera into directions themselves.")

set(CPACK_DEBIAN_SIMULATOR_PACKAGE_NAME alidade-simulator)
set(CPACK_DEBIAN_SIMULATOR_PACKAGE_SECTION science)
set(CPACK_COMPONENT_SIMULATOR_DESCRIPTION
  "virtual pan-tilt-zoom camera for Alidade
Serves real RTSP video and real pan/tilt telemetry (VAPIX, ONVIF, heads on a
line) of a camera whose truth is known, or writes a recording of it. Comes with
photos and examples: alidade-simulate --example zoom --size 480x270.")

include(CPack)
cpack_add_component(runtime GROUP edge)
cpack_add_component(system GROUP edge)
cpack_add_component(dev GROUP libraries)
cpack_add_component(dev-system GROUP libraries)
cpack_add_component_group(edge)
cpack_add_component_group(libraries)
if(TARGET alidade-simulate)
  cpack_add_component(virtual GROUP simulator)
  cpack_add_component(virtual-system GROUP simulator)
  cpack_add_component_group(simulator)
endif()
