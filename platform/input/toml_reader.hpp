/// Typed values of a TOML file, with the line in every complaint.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/geometry/vector.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::input {

/// The library limits how deep brackets nest, but not how many parts a dotted key has: each is a table in a
/// table, and freed recursively. Throws InputError.
inline void check_key_parts(const std::string& path, std::string_view text) {
  constexpr int kMost = 32;
  constexpr std::string_view kBetweenKeys = "\n,=[]{}#";
  int line = 1;
  int dots = 0;
  for (const char c : text) {
    if (c == '\n') ++line;
    if (kBetweenKeys.find(c) != std::string_view::npos) dots = 0;
    if (c == '.' && ++dots > kMost)
      throw InputError(fmt::format("{}:{}: not valid TOML: a key of more than {} parts", path, line, kMost));
  }
}

/// With what a file has of line ends and other control characters as spaces: a complaint is one line.
[[nodiscard]] inline std::string one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = ' ';
  return text;
}

/// Throws InputError with file and line if the text is not TOML.
[[nodiscard]] inline toml::table parse_toml(const std::string& path, std::string_view text) {
  check_key_parts(path, text);
  try {
    return toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    throw InputError(one_line(
        fmt::format("{}:{}: not valid TOML: {}", path, error.source().begin.line, error.description())));
  }
}

/// Reads typed values of one TOML file and says where they are wrong.
class TomlReader {
 public:
  explicit TomlReader(std::string path) : path_(std::move(path)) {}

  [[noreturn]] void refuse(const toml::node& node, std::string_view key, std::string_view what) const {
    throw InputError(one_line(fmt::format("{}:{}: {}: {}", path_, node.source().begin.line, key, what)));
  }
  void allow_keys(const toml::table& table, std::string_view where,
                  const std::set<std::string_view>& allowed) const {
    for (const auto& [key, node] : table) {
      if (allowed.count(key.str()) != 0) continue;
      refuse(node, key.str(),
             fmt::format("unknown key in {}: must be one of {}", where, fmt::join(allowed, ", ")));
    }
  }
  const toml::node& need(const toml::table& table, std::string_view key, std::string_view where) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) refuse(table, key, fmt::format("missing in {}", where));
    return *node;
  }
  double number(const toml::node& node, std::string_view key) const {
    const auto value = node.is_integer() || node.is_floating_point() ? node.value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value) || std::fabs(*value) > kLargest) {
      refuse(node, key, "must be a finite number, at most 20000");
    }
    return *value;
  }
  /// Within [low, high].
  double number(const toml::node& node, std::string_view key, double low, double high) const {
    const auto value = node.is_integer() || node.is_floating_point() ? node.value<double>() : std::nullopt;
    if (!value || !(*value >= low && *value <= high))
      refuse(node, key, fmt::format("must be a number from {} to {}", low, high));
    return *value;
  }
  /// A whole number within [low, high]; 96.0 is one, 96.5 is not.
  double whole(const toml::node& node, std::string_view key, double low, double high) const {
    const auto value = node.is_integer() || node.is_floating_point() ? node.value<double>() : std::nullopt;
    if (!value || !(*value >= low && *value <= high) || *value != std::floor(*value))
      refuse(node, key, fmt::format("must be a whole number from {} to {}", low, high));
    return *value;
  }
  double number_or(const toml::table& table, std::string_view key, double fallback) const {
    const toml::node* node = table.get(key);
    return node == nullptr ? fallback : number(*node, key);
  }
  Vector3 point(const toml::node& node, std::string_view key) const {
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() != 3) refuse(node, key, "must be three numbers: [x, y, z]");
    return {number((*array)[0], key), number((*array)[1], key), number((*array)[2], key)};
  }

 private:
  static constexpr double kLargest = 20e3;
  std::string path_;
};

}  // namespace roborun::input
