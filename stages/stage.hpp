/// What makes a type a stage: a value made once from a checked config, stepped once a cycle; no thread, clock
/// or I/O.
#pragma once

#include <concepts>

#include "firmware_if/status.hpp"

namespace roborun::stages {

template <typename T>
concept Stage = requires(const T& stage, const typename T::Config& config) {
  { config.validate() }
  noexcept->std::same_as<Status>;
  { stage.counters() }
  noexcept->std::same_as<const typename T::Counters&>;
};

}  // namespace roborun::stages
