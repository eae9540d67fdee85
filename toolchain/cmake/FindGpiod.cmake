# libgpiod as Gpiod::gpiod; Gpiod_MAJOR is 1 or 2, which have nothing in common but the name.
find_path(GPIOD_INCLUDE_DIR gpiod.h)
find_library(GPIOD_LIBRARY gpiod)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Gpiod REQUIRED_VARS GPIOD_LIBRARY GPIOD_INCLUDE_DIR)
if(GPIOD_INCLUDE_DIR)
  file(STRINGS ${GPIOD_INCLUDE_DIR}/gpiod.h gpiod_of_version_2 REGEX "gpiod_request_config_new")
  if(gpiod_of_version_2)
    set(Gpiod_MAJOR 2)
  else()
    set(Gpiod_MAJOR 1)
  endif()
endif()
if(GPIOD_FOUND AND NOT TARGET Gpiod::gpiod)
  add_library(Gpiod::gpiod UNKNOWN IMPORTED)
  set_target_properties(Gpiod::gpiod PROPERTIES
    IMPORTED_LOCATION "${GPIOD_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${GPIOD_INCLUDE_DIR}")
endif()
