#include "platform/sensor_port/port_reader.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cstring>

namespace roborun::sensor_port {
namespace {

// A file that processes of both sides map: the layout is the interface.
static_assert(sizeof(roborun_port_header) == 128 && sizeof(roborun_port_slot) == 16);
static_assert(sizeof(roborun_port_depth) == 96 && sizeof(roborun_port_cloud) == 64);
static_assert(sizeof(roborun_port_odometry) == 144 && sizeof(roborun_port_imu) == 64);
static_assert(sizeof(roborun_port_gnss) == 88 && sizeof(roborun_port_range) == 64);
static_assert(sizeof(roborun_port_pressure) == 32 && sizeof(roborun_port_can) == 32);
static_assert(sizeof(roborun_port_lines) == 24);

template <typename T>
T load(const T& shared, int order) noexcept {
  return order == __ATOMIC_ACQUIRE ? __atomic_load_n(&shared, __ATOMIC_ACQUIRE)
                                   : __atomic_load_n(&shared, __ATOMIC_RELAXED);
}

}  // namespace

const char* kind_name(std::uint32_t kind) noexcept {
  switch (kind) {
    case ROBORUN_PORT_DEPTH:
      return "depth";
    case ROBORUN_PORT_CLOUD:
      return "cloud";
    case ROBORUN_PORT_ODOMETRY:
      return "odometry";
    case ROBORUN_PORT_IMU:
      return "imu";
    case ROBORUN_PORT_GNSS:
      return "gnss";
    case ROBORUN_PORT_RANGE:
      return "range";
    case ROBORUN_PORT_PRESSURE:
      return "pressure";
    case ROBORUN_PORT_CAN:
      return "can";
    case ROBORUN_PORT_LINES:
      return "lines";
    default:
      return "unknown";
  }
}

std::size_t copy_shared(std::span<const std::byte> from, std::size_t first, std::size_t bytes,
                        std::span<std::byte> to) noexcept {
  const auto* words = static_cast<const std::uint64_t*>(static_cast<const void*>(from.data())) + first / 8;
  const std::size_t before = first % 8, count = (before + bytes + 7) / 8;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t word = load(words[i], __ATOMIC_RELAXED);
    std::memcpy(&to[8 * i], &word, sizeof word);
  }
  return before;
}

std::string PortReader::check_layout() {
  if (memory_.size() < sizeof(roborun_port_header)) return "is no sensor port: shorter than its header";
  roborun_port_header h;  // what is checked is what is used
  std::memcpy(&h, memory_.data(), sizeof h);
  if (std::memcmp(h.magic, ROBORUN_PORT_MAGIC, sizeof h.magic) != 0)
    return "is no sensor port: must begin with " ROBORUN_PORT_MAGIC;
  if (h.version != ROBORUN_PORT_VERSION)
    return fmt::format("is of port version {}: must be {}", h.version, ROBORUN_PORT_VERSION);
  const std::uint32_t sample_bytes = roborun_port_sample_bytes(h.kind);
  if (sample_bytes == 0) return fmt::format("holds samples of kind {}: must be 1 to 9", h.kind);
  if (kind_ != 0 && h.kind != kind_)
    return fmt::format("holds {} samples: must be {}", kind_name(h.kind), kind_name(kind_));
  if (h.sample_bytes != sample_bytes)
    return fmt::format("its {} samples have {} bytes: must be {}", kind_name(h.kind), h.sample_bytes,
                       sample_bytes);
  if (h.slot_count < 2 || h.slot_count > ROBORUN_PORT_MOST_SLOTS)
    return fmt::format("has {} slots: must be 2 to {}", h.slot_count, ROBORUN_PORT_MOST_SLOTS);
  if (h.slot_bytes % 64 != 0 || h.slot_bytes < sizeof(roborun_port_slot) + sample_bytes ||
      h.slot_bytes > ROBORUN_PORT_MOST_BYTES)
    return fmt::format("has slots of {} bytes: must be a multiple of 64 from {} to {}", h.slot_bytes,
                       sizeof(roborun_port_slot) + sample_bytes, ROBORUN_PORT_MOST_BYTES);
  if (memory_.size() != roborun_port_file_bytes(h.slot_count, h.slot_bytes))
    return fmt::format("has {} bytes: must be {}", memory_.size(),
                       roborun_port_file_bytes(h.slot_count, h.slot_bytes));
  kind_ = h.kind;
  slot_count_ = h.slot_count;
  slot_bytes_ = h.slot_bytes;
  sample_bytes_ = sample_bytes;
  writer_ = h.writer;
  next_ = h.written;
  return {};
}

std::string PortReader::open(const std::string& path, std::uint32_t kind) {
  path_ = path;
  kind_ = kind;
  std::string wrong = memory_.open(path);
  if (wrong.empty()) wrong = check_layout();
  if (wrong.empty()) {
    copy_.assign((slot_bytes_ - sizeof(roborun_port_slot)) / 8, 0);
  } else {
    memory_.close();
  }
  return wrong;
}

bool PortReader::look(std::uint64_t& written) noexcept {
  const std::uint64_t writer = load(header().writer, __ATOMIC_ACQUIRE);
  if (writer != writer_) ++counters_.restarts;
  writer_ = writer;
  written = load(header().written, __ATOMIC_ACQUIRE);
  constexpr std::uint64_t kMost = std::uint64_t{1} << 62U;  // twice that is a guard
  if (written < next_ || written > kMost) {                 // no writer that keeps the rules does that
    ++counters_.refused;
    next_ = written <= kMost ? written : next_;
    return false;
  }
  return written > next_;
}

bool PortReader::lend(std::uint64_t n, PortLoan& loan) noexcept {
  const roborun_port_slot& slot = slot_of(n);
  if (load(slot.guard, __ATOMIC_ACQUIRE) != 2 * n + 2) return false;
  const std::uint32_t bytes = load(slot.payload_bytes, __ATOMIC_RELAXED);
  const auto* sample = static_cast<const std::byte*>(static_cast<const void*>(&slot + 1));
  loan.number = n;
  loan.is_too_long = bytes > payload_room_bytes();
  const auto copied = std::as_writable_bytes(std::span(copy_)).first(sample_bytes_);
  copy_shared({sample, sample_bytes_}, 0, sample_bytes_, copied);
  loan.port.sample = copied;
  loan.port.payload = {sample + sample_bytes_, loan.is_too_long ? 0 : bytes};
  loan.port.clock_offset_ns = load(header().clock_offset_ns, __ATOMIC_RELAXED);
  return true;
}

PortSample PortReader::copy(const PortLoan& loan) noexcept {
  PortSample whole = loan.port;
  const auto copied = std::as_writable_bytes(std::span(copy_)).subspan(sample_bytes_);
  copy_shared(whole.payload, 0, whole.payload.size(), copied);
  whole.payload = copied.first(whole.payload.size());
  return whole;
}

bool PortReader::finish(const PortLoan& loan) noexcept {
  // What was read of it was read before the guard is looked at again.
  std::atomic_thread_fence(std::memory_order_acquire);
  if (load(slot_of(loan.number).guard, __ATOMIC_RELAXED) != 2 * loan.number + 2) {
    ++counters_.torn;
    return false;
  }
  counters_.dropped += loan.number - next_;
  counters_.refused += loan.is_too_long ? 1 : 0;
  next_ = loan.number + 1;
  ++counters_.read;
  return true;
}

Status PortReader::borrow(PortLoan& loan) noexcept {
  if (memory_.data() == nullptr || memory_.is_cut()) return Status::kIo;
  for (int i = 0; i < kTries; ++i) {
    std::uint64_t written = 0;
    if (!look(written)) break;
    if (lend(written - 1, loan)) return Status::kOk;
    ++counters_.torn;
  }
  return memory_.is_cut() ? Status::kIo : Status::kNotReady;
}

Status PortReader::give_back(const PortLoan& loan) noexcept {
  const bool whole = finish(loan);
  return memory_.is_cut() ? Status::kIo : whole ? Status::kOk : Status::kNotReady;
}

Status PortReader::newest(PortSample& out) noexcept {
  Status status = Status::kNotReady;
  for (int i = 0; i < kTries && status == Status::kNotReady; ++i) {
    PortLoan loan;
    if (const Status lent = borrow(loan); lent != Status::kOk) return lent;
    out = copy(loan);
    status = give_back(loan);
  }
  return status;
}

Status PortReader::next(PortSample& out) noexcept {
  if (memory_.data() == nullptr || memory_.is_cut()) return Status::kIo;
  for (int i = 0; i < kTries; ++i) {
    std::uint64_t written = 0;
    if (!look(written)) break;
    // The slot of the one before these is the next that is written.
    const std::uint64_t oldest = written >= slot_count_ ? written - slot_count_ + 1 : 0;
    if (next_ < oldest) {
      counters_.dropped += oldest - next_;
      next_ = oldest;
    }
    PortLoan loan;
    if (!lend(next_, loan)) {
      ++counters_.torn;
      continue;
    }
    out = copy(loan);
    if (finish(loan)) return memory_.is_cut() ? Status::kIo : Status::kOk;
  }
  return memory_.is_cut() ? Status::kIo : Status::kNotReady;
}

}  // namespace roborun::sensor_port
