/// Whole binary files, and what is said of a bad one.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace roborun::sitl {

/// Throws InputError "PATH: cannot be opened: must be WANTED", or that it is larger than `most` bytes.
[[nodiscard]] std::vector<unsigned char> read_bytes(const std::string& path, std::size_t most,
                                                    const std::string& wanted);

/// Throws InputError "NAME: WHAT".
[[noreturn]] void refuse(const std::string& name, const std::string& what);

}  // namespace roborun::sitl
