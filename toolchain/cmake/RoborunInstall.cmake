# What `cmake --install` puts where. Nothing in it names this tree: the prefix may be moved.
#
#   bin/roborun                        the program
#   include/roborun/                   headers, by the paths that the sources include them by
#   lib/libroborun_*.a                 static libraries
#   lib/cmake/roborun/                 find_package(roborun COMPONENTS flight | mission)
#   share/roborun/{worlds,scenarios,vehicles}   what the program can fly at once
#   share/man, share/bash-completion, share/zsh, share/fish   made by the program itself: roborun manual
#   lib/{systemd,udev,tmpfiles.d,roborun}, share/doc/roborun  the service of the bench and what it needs, roborun-feed-dds
#   share/doc/libroborun-dev/example, share/doc/roborun-doc   programs of one's own; all pages
# Components: roborun, libroborun-dev, roborun-doc, one Debian package each (RoborunPackage.cmake).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(_package ${CMAKE_INSTALL_LIBDIR}/cmake/roborun)

set(_components flight)
if(ROBORUN_SIMULATOR)
  list(APPEND _components mission)
endif()
foreach(_component IN LISTS _components)
  get_property(_targets GLOBAL PROPERTY ROBORUN_${_component}_TARGETS)
  install(TARGETS ${_targets} EXPORT roborun_${_component} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libroborun-dev)
  install(EXPORT roborun_${_component} NAMESPACE roborun:: FILE roborun_${_component}.cmake DESTINATION ${_package}
          COMPONENT libroborun-dev)
endforeach()

# Of platform only what a component holds.
set(_headers firmware_if core governor stages platform)
foreach(_folder IN LISTS _headers)
  file(GLOB_RECURSE _files CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/${_folder}/*.hpp
       ${PROJECT_SOURCE_DIR}/${_folder}/*.h)
  list(FILTER _files EXCLUDE REGEX "/example/|^platform/(app|evaluation|feed)/")
  if(NOT ROBORUN_SIMULATOR)
    list(FILTER _files EXCLUDE REGEX "_backend/|^platform/[^f]")
  endif()
  foreach(_file IN LISTS _files)
    cmake_path(GET _file PARENT_PATH _parent)
    install(FILES ${PROJECT_SOURCE_DIR}/${_file} DESTINATION include/roborun/${_parent} COMPONENT libroborun-dev)
  endforeach()
endforeach()

if(ROBORUN_APP)
  install(TARGETS roborun RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT roborun)
  if(TARGET roborun-feed-dds)
    install(TARGETS roborun-feed-dds RUNTIME DESTINATION lib/roborun COMPONENT roborun)
  endif()
  install(DIRECTORY platform/sitl/worlds platform/sitl/scenarios DESTINATION ${CMAKE_INSTALL_DATADIR}/roborun COMPONENT roborun
          FILES_MATCHING PATTERN *.toml)
  install(DIRECTORY platform/vehicle/ DESTINATION ${CMAKE_INSTALL_DATADIR}/roborun/vehicles COMPONENT roborun FILES_MATCHING PATTERN *.toml)
  # The program writes its pages where it is installed to. One that this machine cannot run leaves none, and says so.
  string(JOIN "\" \"" _emulator ${CMAKE_CROSSCOMPILING_EMULATOR})
  install(CODE "
    set(emulator \"${_emulator}\")
    execute_process(COMMAND \${emulator} \"$<TARGET_FILE:roborun>\" manual --out \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}\" RESULT_VARIABLE failed)
    if(failed)
      message(WARNING \"no man pages and completions: roborun manual ended with \${failed}\")
    endif()" COMPONENT roborun)

  # The service's paths are those of the prefix. What would change a machine's network is an example to copy.
  install(CODE "
    file(READ \"${PROJECT_SOURCE_DIR}/platform/deploy/roborun-bench.service\" unit)
    string(REPLACE \"/usr/local/\" \"\${CMAKE_INSTALL_PREFIX}/\" unit \"\${unit}\")
    file(WRITE \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/lib/systemd/system/roborun-bench.service\" \"\${unit}\")" COMPONENT roborun)
  install(FILES platform/deploy/80-roborun.rules DESTINATION lib/udev/rules.d COMPONENT roborun)
  install(FILES platform/deploy/roborun.conf DESTINATION lib/tmpfiles.d COMPONENT roborun)
  install(PROGRAMS platform/deploy/can-irq-priority DESTINATION lib/roborun COMPONENT roborun)
  install(FILES platform/deploy/80-can.link platform/deploy/80-can.network DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/roborun/examples COMPONENT roborun)
endif()
install(DIRECTORY platform/flight/example DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libroborun-dev COMPONENT libroborun-dev)
foreach(_name IN ITEMS roborun libroborun-dev roborun-doc)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${_name} RENAME copyright COMPONENT ${_name})
endforeach()
# Pages keep their folders, so that links between them work.
install(FILES README.md CONTRIBUTING.md SECURITY.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/roborun-doc COMPONENT roborun-doc)
install(DIRECTORY ${_headers} toolchain tests DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/roborun-doc COMPONENT roborun-doc
        FILES_MATCHING PATTERN *.md PATTERN *.svg)

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/roborunConfig.cmake.in ${PROJECT_BINARY_DIR}/roborunConfig.cmake
  INSTALL_DESTINATION ${_package})
# Before 1.0 the second number tells incompatible versions apart.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/roborunConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/roborunConfig.cmake ${PROJECT_BINARY_DIR}/roborunConfigVersion.cmake DESTINATION ${_package}
        COMPONENT libroborun-dev)
if(ROBORUN_SIMULATOR)
  install(FILES ${CMAKE_CURRENT_LIST_DIR}/FindGpiod.cmake ${CMAKE_CURRENT_LIST_DIR}/FindOMPL.cmake
          ${CMAKE_CURRENT_LIST_DIR}/FindZstd.cmake DESTINATION ${_package} COMPONENT libroborun-dev)
endif()
if(PROJECT_IS_TOP_LEVEL AND ROBORUN_APP)
  include(RoborunPackage)
endif()
