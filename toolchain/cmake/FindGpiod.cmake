# libgpiod 1.x as Gpiod::gpiod.
find_path(GPIOD_INCLUDE_DIR gpiod.h)
find_library(GPIOD_LIBRARY gpiod)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Gpiod REQUIRED_VARS GPIOD_LIBRARY GPIOD_INCLUDE_DIR)
if(GPIOD_FOUND AND NOT TARGET Gpiod::gpiod)
  add_library(Gpiod::gpiod UNKNOWN IMPORTED)
  set_target_properties(Gpiod::gpiod PROPERTIES
    IMPORTED_LOCATION "${GPIOD_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${GPIOD_INCLUDE_DIR}")
endif()
