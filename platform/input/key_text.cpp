#include "platform/input/key_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace roborun::input {

std::string_view unit_of(std::string_view key) {
  // Longer suffixes before those that they end in.
  constexpr std::array<std::pair<std::string_view, std::string_view>, 27> kUnits{{
      {"_quadratic_s2pm", "s2/m"},
      {"quadratic_Ns2pm2", "N s2/m2"},
      {"linear_Nspm", "N s/m"},
      {"angular_Nms", "N m s"},
      {"_kgm2", "kg m2"},
      {"_radps", "rad/s"},
      {"_mps3", "m/s3"},
      {"_mps2", "m/s2"},
      {"_mps", "m/s"},
      {"_mmph", "mm/h"},
      {"_s2pm", "s2/m"},
      {"_m3", "m3"},
      {"_per_m", "1/m"},
      {"_torque_m", "N m/N"},
      {"_m", "m"},
      {"_kg", "kg"},
      {"_rad", "rad"},
      {"_deg", "degrees"},
      {"_Hz", "Hz"},
      {"_N", "N"},
      {"_W", "W"},
      {"_J", "J"},
      {"_s", "s"},
      {"_ratio", "ratio"},
      {"_px", "pixels"},
      {"pixels", "pixels"},
      {"_factor", "times"},
  }};
  const auto unit =
      std::find_if(kUnits.begin(), kUnits.end(), [key](const auto& u) { return key.ends_with(u.first); });
  return unit == kUnits.end() ? std::string_view("-") : unit->second;
}

std::string reference_of(const std::vector<KeyText>& keys) {
  std::string text;
  std::string table;
  for (const KeyText& k : keys) {
    if (k.table != table) {
      text += fmt::format("{}[{}]\n", text.empty() ? "" : "\n", k.table);
      table = k.table;
    }
    text += fmt::format("  {:<22} {:<8} {:>8} .. {:<8} {:>9}  {}\n", k.key, unit_of(k.key),
                        fmt::format("{:g}", k.low), fmt::format("{:g}", k.high), fmt::format("{:g}", k.value),
                        k.text);
  }
  return text;
}

}  // namespace roborun::input
