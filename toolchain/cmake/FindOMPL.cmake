# OMPL as one target, OMPL::ompl. The package's own config file carries absolute paths, which no sysroot survives.
find_path(OMPL_INCLUDE_DIR ompl/config.h PATH_SUFFIXES ompl-1.5)
find_library(OMPL_LIBRARY ompl)
find_library(OMPL_BOOST_SERIALIZATION boost_serialization)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OMPL REQUIRED_VARS OMPL_LIBRARY OMPL_INCLUDE_DIR OMPL_BOOST_SERIALIZATION)
if(OMPL_FOUND AND NOT TARGET OMPL::ompl)
  add_library(OMPL::ompl UNKNOWN IMPORTED)
  set_target_properties(OMPL::ompl PROPERTIES
    IMPORTED_LOCATION "${OMPL_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${OMPL_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "${OMPL_BOOST_SERIALIZATION}")
endif()
