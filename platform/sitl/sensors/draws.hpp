/// What several sensor models draw.
#pragma once

#include "core/geometry/vector.hpp"
#include "core/random/counter_rng.hpp"

namespace roborun::sitl {

/// Three standard normal numbers.
[[nodiscard]] inline Vector3 normal3(core::CounterRng& rng) noexcept {
  Vector3 v;
  for (int i = 0; i < 3; ++i) v[i] = rng.normal();
  return v;
}

}  // namespace roborun::sitl
