# One place for the flags of our own targets.
#
# roborun_library(NAME [REAL_TIME] SOURCES... DEPENDS...)   a static library; REAL_TIME adds -fno-exceptions -fno-rtti
# roborun_test(NAME [ALONE] SOURCES... DEPENDS...)          a GoogleTest program, each TEST a ctest test; ALONE: nothing else runs meanwhile
#
# Determinism: -ffp-contract=off (GCC fuses multiply-adds on AArch64 otherwise), -fsigned-char, no -march=native,
# and Eigen without vectorisation, so that sums are added in the same order on every machine.

add_library(roborun_flags INTERFACE)
target_include_directories(roborun_flags INTERFACE ${CMAKE_SOURCE_DIR})
target_compile_options(roborun_flags INTERFACE
  -ffp-contract=off -fsigned-char -fstack-protector-strong
  -Wall -Wextra -Wpedantic -Werror -Wconversion -Wsign-conversion -Wdouble-promotion
  -Wold-style-cast -Wcast-align -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wvla)
target_compile_definitions(roborun_flags INTERFACE EIGEN_DONT_VECTORIZE EIGEN_MPL2_ONLY)
target_link_libraries(roborun_flags INTERFACE Eigen3::Eigen)
get_target_property(_eigen_include Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
target_include_directories(roborun_flags SYSTEM INTERFACE ${_eigen_include})

# Half of the time of a build is reading the same headers: once for libraries, real-time ones and tests each.
set(_common <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath> <cstdint> <limits> <span>)
set(_hosted <functional> <memory> <string> <vector>)
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/precompiled.cpp CONTENT "")
foreach(_kind IN ITEMS real_time hosted test)
  add_library(roborun_precompiled_${_kind} OBJECT ${CMAKE_BINARY_DIR}/precompiled.cpp)
  target_link_libraries(roborun_precompiled_${_kind} PRIVATE roborun_flags)
endforeach()
if(ROBORUN_TESTS)
  target_link_libraries(roborun_precompiled_test PRIVATE GTest::gtest)
endif()
target_compile_options(roborun_precompiled_real_time PRIVATE -fno-exceptions -fno-rtti)
target_precompile_headers(roborun_precompiled_real_time PRIVATE ${_common})
target_precompile_headers(roborun_precompiled_hosted PRIVATE ${_common} ${_hosted})
target_precompile_headers(roborun_precompiled_test PRIVATE ${_common} ${_hosted} <gtest/gtest.h>)

function(roborun_library name)
  cmake_parse_arguments(ARG "REAL_TIME" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC roborun_flags ${ARG_DEPENDS})
  if(ARG_REAL_TIME)
    # The symbol check (toolchain/lint/symbols) reads exactly the archives that carry this mark.
    target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti)
    set_property(GLOBAL APPEND PROPERTY ROBORUN_REAL_TIME_TARGETS ${name})
    target_precompile_headers(${name} REUSE_FROM roborun_precompiled_real_time)
  else()
    target_precompile_headers(${name} REUSE_FROM roborun_precompiled_hosted)
  endif()
endfunction()

function(roborun_test name)
  cmake_parse_arguments(ARG "ALONE" "TIMEOUT;LABEL" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE roborun_flags ${ARG_DEPENDS} GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE ROBORUN_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
  target_precompile_headers(${name} REUSE_FROM roborun_precompiled_test)
  # GCC 12 warns inside std::string once that is precompiled, of what it inlines from a macro's text.
  target_compile_options(${name} PRIVATE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow)
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)  # sanitizers on a busy machine included
  endif()
  set(properties TIMEOUT ${ARG_TIMEOUT} RUN_SERIAL ${ARG_ALONE})
  if(ARG_LABEL)  # an empty value would shift those behind it
    list(APPEND properties LABELS ${ARG_LABEL})
  endif()
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES ${properties})
endfunction()
