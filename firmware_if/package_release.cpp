#include "firmware_if/package_release.hpp"

namespace roborun::firmware_if {
namespace {

constexpr Nanos kSayAgain{1'000'000'000};

}  // namespace

Status PackageRelease::step(MonotonicTime now, const Input& in) noexcept {
  // The comparisons are written so that NaN keeps the hook closed.
  const bool safe = in.wanted && in.estimated && !in.killed && in.height_m <= config_.height_max_m &&
                    in.speed_mps <= config_.speed_max_mps;
  if (in.wanted && !safe) ++counters_.unsafe;
  if (safe && !safe_) safe_since_ = now;
  safe_ = safe;
  const bool open = safe && now - safe_since_ >= config_.steady;
  if (open && !open_) ++counters_.releases;
  open_ = open;
  gate_.allow_release(open);
  if (!said_ || said_open_ != open || now - said_at_ >= kSayAgain) {
    const dronecan::HardpointCommand command{.hardpoint_id = config_.hardpoint_id,
                                             .command = static_cast<std::uint16_t>(open ? 0 : 1)};
    if (gate_.send(command, now) == Status::kOk) {
      said_ = true;
      said_open_ = open;
      said_at_ = now;
    } else {
      ++counters_.refused;
    }
  }
  return line_ != nullptr ? line_->set(open) : Status::kOk;
}

}  // namespace roborun::firmware_if
