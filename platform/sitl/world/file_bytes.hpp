/// Whole binary files.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace roborun::sitl {

/// Throws InputError "PATH: cannot be opened: must be WANTED", or that it is larger than `most` bytes.
[[nodiscard]] std::vector<unsigned char> read_bytes(const std::string& path, std::size_t most,
                                                    const std::string& wanted);

}  // namespace roborun::sitl
