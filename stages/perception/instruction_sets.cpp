#include "stages/perception/instruction_sets.hpp"

#include <hwy/targets.h>

namespace roborun::stages {

std::int64_t kernel_instruction_sets() noexcept { return hwy::SupportedTargets(); }

void use_kernel_instruction_sets(std::int64_t sets) noexcept {
  hwy::SetSupportedTargetsForTest(sets == ~std::int64_t{0} ? 0 : sets);
  hwy::GetChosenTarget().DeInit();
}

}  // namespace roborun::stages
