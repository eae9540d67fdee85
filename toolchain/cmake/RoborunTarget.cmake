# One place for the flags of our own targets.
#
# roborun_library(NAME [REAL_TIME] [PRIVATE_TO_TREE] SOURCES... DEPENDS...)   a static library; REAL_TIME adds
#     -fno-exceptions -fno-rtti. Installed as roborun::NAME without its "roborun_": real-time ones with the component
#     flight, the others with mission, those PRIVATE_TO_TREE not at all.
# roborun_test(NAME [ALONE] SOURCES... DEPENDS...)          a GoogleTest program, each TEST a ctest test; ALONE: nothing else runs meanwhile
#
# What whoever links us must compile with too, or the results differ: -ffp-contract=off (GCC fuses multiply-adds on
# AArch64 otherwise), -fsigned-char, no -march=native, and Eigen without vectorisation, so that sums are added in the same
# order on every machine.
add_library(roborun_flags INTERFACE)
target_include_directories(roborun_flags INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include/roborun>)
target_compile_features(roborun_flags INTERFACE cxx_std_20)
target_compile_options(roborun_flags INTERFACE -ffp-contract=off -fsigned-char)
target_compile_definitions(roborun_flags INTERFACE EIGEN_DONT_VECTORIZE EIGEN_MPL2_ONLY)
target_link_libraries(roborun_flags INTERFACE Eigen3::Eigen)

# What is ours alone: directory options reach every target of this tree and no other. Errors only where we are at home: the
# next compiler warns of more.
add_compile_options(
  -fstack-protector-strong -fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=  # no path of this machine in assertions
  -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wdouble-promotion
  -Wold-style-cast -Wcast-align -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wvla)
if(PROJECT_IS_TOP_LEVEL)
  add_compile_options(-Werror)
endif()
# What an attacker of a parser meets; toolchain/lint/hardening looks for each in the program. FORTIFY needs an optimiser, and
# is not for sanitizers, which intercept the same calls.
add_compile_options(-fstack-clash-protection $<$<CONFIG:Release>:-D_FORTIFY_SOURCE=3>)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  add_compile_options(-fcf-protection)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  add_compile_options(-mbranch-protection=standard)
endif()
add_link_options(-Wl,-z,relro -Wl,-z,now)
if(CMAKE_SIZEOF_VOID_P EQUAL 4)
  add_compile_definitions(_FILE_OFFSET_BITS=64)  # logs and sizes that are checked go beyond 2 GiB there, too
endif()

# Libraries are position-independent, because plugins are shared objects that bring their own copy of what they call
# (platform/board/plugin.hpp). Without semantic interposition the code is that of a program.

# Half of the time of a build is reading the same headers: once for libraries, real-time ones and tests each.
set(_common <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath> <cstdint> <limits> <span>)
set(_hosted <functional> <memory> <string> <vector>)
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled.cpp CONTENT "")
foreach(_kind IN ITEMS real_time hosted test)
  add_library(roborun_precompiled_${_kind} OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/precompiled.cpp)
  target_link_libraries(roborun_precompiled_${_kind} PRIVATE roborun_flags)
endforeach()
foreach(_kind IN ITEMS real_time hosted)
  target_compile_options(roborun_precompiled_${_kind} PRIVATE -fno-semantic-interposition)
  set_target_properties(roborun_precompiled_${_kind} PROPERTIES POSITION_INDEPENDENT_CODE ON)
endforeach()
if(ROBORUN_TESTS)
  target_link_libraries(roborun_precompiled_test PRIVATE GTest::gtest)
  target_precompile_headers(roborun_precompiled_test PRIVATE ${_common} ${_hosted} <gtest/gtest.h>)
endif()
target_compile_options(roborun_precompiled_real_time PRIVATE -fno-exceptions -fno-rtti)
target_precompile_headers(roborun_precompiled_real_time PRIVATE ${_common})
target_precompile_headers(roborun_precompiled_hosted PRIVATE ${_common} ${_hosted})

# What is installed, by component: RoborunInstall.cmake.
function(roborun_export component)
  foreach(target IN LISTS ARGN)
    string(REGEX REPLACE "^roborun_" "" name ${target})
    add_library(roborun::${name} ALIAS ${target})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
    set_property(GLOBAL APPEND PROPERTY ROBORUN_${component}_TARGETS ${target})
  endforeach()
endfunction()
roborun_export(flight roborun_flags)

function(roborun_library name)
  cmake_parse_arguments(ARG "REAL_TIME;PRIVATE_TO_TREE" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC roborun_flags ${ARG_DEPENDS})
  target_compile_options(${name} PRIVATE -fno-semantic-interposition)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  if(ARG_REAL_TIME)
    # The symbol check (toolchain/lint/symbols) reads exactly the archives that carry this mark.
    target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti)
    set_property(GLOBAL APPEND PROPERTY ROBORUN_REAL_TIME_TARGETS ${name})
    target_precompile_headers(${name} REUSE_FROM roborun_precompiled_real_time)
    roborun_export(flight ${name})
  else()
    target_precompile_headers(${name} REUSE_FROM roborun_precompiled_hosted)
    if(NOT ARG_PRIVATE_TO_TREE)
      roborun_export(mission ${name})
    endif()
  endif()
endfunction()

function(roborun_test name)
  cmake_parse_arguments(ARG "ALONE" "TIMEOUT;LABEL" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE roborun_flags ${ARG_DEPENDS} GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE ROBORUN_TEST_DATA="${PROJECT_SOURCE_DIR}/tests/data")
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
