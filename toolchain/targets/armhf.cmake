# Cross-build for 32-bit ARM: ARMv7-A with VFPv3, what Debian's armhf asks for.
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(triplet arm-linux-gnueabihf)
set(debian_architecture armhf)
set(emulator qemu-arm-static)
set(CMAKE_CXX_FLAGS_INIT -Wno-psabi)  # notes about an ABI of 2017
include(${CMAKE_CURRENT_LIST_DIR}/cross.cmake)
