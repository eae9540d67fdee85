/// SHA-256, as `sha256sum` prints it: what an auditor can check without this program.
#pragma once

#include <string>
#include <string_view>

#include "firmware_if/sha256.hpp"

namespace roborun::report {

class Sha256 {
 public:
  void add(std::string_view bytes);
  /// 64 hexadecimal digits. Once: nothing may be added after it.
  [[nodiscard]] std::string finish();

 private:
  firmware_if::Sha256 hash_;
};

[[nodiscard]] std::string sha256(std::string_view bytes);
/// Of a file's content; "unknown" if it cannot be read.
[[nodiscard]] std::string sha256_of_file(const std::string& path);

}  // namespace roborun::report
