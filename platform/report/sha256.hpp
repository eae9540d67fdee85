/// SHA-256, as `sha256sum` prints it: what an auditor can check without this program. Source: FIPS 180-4.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace roborun::report {

class Sha256 {
 public:
  void add(std::string_view bytes);
  /// 64 hexadecimal digits. Once: nothing may be added after it.
  [[nodiscard]] std::string finish();

 private:
  void block();

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<unsigned char, 64> buffer_{};
  std::size_t used_{0};
  std::uint64_t bytes_{0};
};

[[nodiscard]] std::string sha256(std::string_view bytes);
/// Of a file's content; "unknown" if it cannot be read.
[[nodiscard]] std::string sha256_of_file(const std::string& path);

}  // namespace roborun::report
