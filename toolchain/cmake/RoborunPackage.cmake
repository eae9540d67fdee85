# cpack in a build folder: roborun, libroborun-dev and roborun-doc as Debian packages. toolchain/package builds and tries them.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME roborun)
set(CPACK_PACKAGE_CONTACT "roborun developers <roborun@localhost>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
# With DESTDIR, so that what is written at the installation knows its real prefix.
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # cpack asks for all that is built, tests included: `packaged` below is enough
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL roborun libroborun-dev roborun-doc)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_ROBORUN_PACKAGE_NAME roborun)
set(CPACK_COMPONENT_ROBORUN_DESCRIPTION "navigation runtime for drones: program and simulator
 At every decision roborun chooses how precisely to look at the world and how long to think about it. This
 is the program: simulator, bench, tools for DroneCAN, MAVLink, maps and logs. It cannot fly a real vehicle yet.")
set(CPACK_DEBIAN_ROBORUN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/platform/deploy/postinst ${PROJECT_SOURCE_DIR}/platform/deploy/postrm)
set(CPACK_DEBIAN_ROBORUN_PACKAGE_SUGGESTS "roborun-doc, libroborun-dev, stress-ng")
set(CPACK_DEBIAN_LIBROBORUN-DEV_PACKAGE_NAME libroborun-dev)
set(CPACK_DEBIAN_LIBROBORUN-DEV_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_LIBROBORUN-DEV_DESCRIPTION "navigation runtime for drones: headers and static libraries
 To link the runtime, or to build a planner, map or policy of your own: find_package(roborun).")
set(CPACK_DEBIAN_LIBROBORUN-DEV_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4), libhwy-dev")
set(CPACK_DEBIAN_LIBROBORUN-DEV_PACKAGE_RECOMMENDS
    "cmake, libboost-serialization-dev, libboost-filesystem-dev, libboost-system-dev, libfmt-dev, libgpiod-dev, liboctomap-dev, libompl-dev, libtinyxml2-dev, libtomlplusplus-dev, libzstd-dev, nlohmann-json3-dev, zlib1g-dev")
set(CPACK_DEBIAN_ROBORUN-DOC_PACKAGE_NAME roborun-doc)
set(CPACK_DEBIAN_ROBORUN-DOC_PACKAGE_SECTION doc)
set(CPACK_DEBIAN_ROBORUN-DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_COMPONENT_ROBORUN-DOC_DESCRIPTION "navigation runtime for drones: guides and reports
 The pages of the source tree, with their pictures. Begin with platform/GUIDES.md.")

if(CMAKE_CROSSCOMPILING)  # Debian's names, and what dpkg-shlibdeps would find out on such a machine
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${debian_architecture})
  set(CPACK_DEBIAN_ROBORUN_PACKAGE_DEPENDS
      "libc6, libfmt9, libgpiod2, liboctomap1.9, libompl16, libddsc0debian, libpng16-16, libseccomp2, libstdc++6, libtinyxml2-9, libzstd1, zlib1g, libhwy1, passwd")
else()
  set(CPACK_DEBIAN_ROBORUN_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_ROBORUN_PACKAGE_DEPENDS passwd)
endif()
include(CPack)

# All that is installed, and no test.
set(_packaged "")
foreach(_component IN LISTS _components)
  get_property(_targets GLOBAL PROPERTY ROBORUN_${_component}_TARGETS)
  list(APPEND _packaged ${_targets})
endforeach()
add_custom_target(packaged DEPENDS roborun ${_packaged})
if(TARGET roborun-feed-dds)
  add_dependencies(packaged roborun-feed-dds)
endif()
