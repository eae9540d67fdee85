# What `cmake --install` puts where. Nothing in it names this tree: the prefix may be moved.
#
#   bin/roborun                        the program
#   include/roborun/                   headers, by the paths that the sources include them by
#   lib/libroborun_*.a                 static libraries
#   lib/cmake/roborun/                 find_package(roborun COMPONENTS flight | mission)
#   share/roborun/{worlds,scenarios}   what the program can fly at once
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(_package ${CMAKE_INSTALL_LIBDIR}/cmake/roborun)

set(_components flight)
if(ROBORUN_SIMULATOR)
  list(APPEND _components mission)
endif()
foreach(_component IN LISTS _components)
  get_property(_targets GLOBAL PROPERTY ROBORUN_${_component}_TARGETS)
  install(TARGETS ${_targets} EXPORT roborun_${_component} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT roborun_${_component} NAMESPACE roborun:: FILE roborun_${_component}.cmake DESTINATION ${_package})
endforeach()

# Of platform only what a component holds.
set(_headers firmware_if core governor stages platform)
foreach(_folder IN LISTS _headers)
  file(GLOB_RECURSE _files CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/${_folder}/*.hpp
       ${PROJECT_SOURCE_DIR}/${_folder}/*.h)
  list(FILTER _files EXCLUDE REGEX "/example/|^platform/(app|evaluation)/")
  if(NOT ROBORUN_SIMULATOR)
    list(FILTER _files EXCLUDE REGEX "_backend/|^platform/[^f]")
  endif()
  foreach(_file IN LISTS _files)
    cmake_path(GET _file PARENT_PATH _parent)
    install(FILES ${PROJECT_SOURCE_DIR}/${_file} DESTINATION include/roborun/${_parent})
  endforeach()
endforeach()

if(ROBORUN_APP)
  install(TARGETS roborun RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(DIRECTORY platform/sitl/worlds platform/sitl/scenarios DESTINATION ${CMAKE_INSTALL_DATADIR}/roborun)
endif()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/roborunConfig.cmake.in ${PROJECT_BINARY_DIR}/roborunConfig.cmake
  INSTALL_DESTINATION ${_package})
# Before 1.0 the second number tells incompatible versions apart.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/roborunConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/roborunConfig.cmake ${PROJECT_BINARY_DIR}/roborunConfigVersion.cmake DESTINATION ${_package})
if(ROBORUN_SIMULATOR)
  install(FILES ${CMAKE_CURRENT_LIST_DIR}/FindGpiod.cmake ${CMAKE_CURRENT_LIST_DIR}/FindOMPL.cmake
          ${CMAKE_CURRENT_LIST_DIR}/FindZstd.cmake DESTINATION ${_package})
endif()
