/// What other processes wrote to a sensor port (roborun_port.h), copied out whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware_if/status.hpp"
#include "platform/sensor_port/port_memory.hpp"
#include "platform/sensor_port/roborun_port.h"

namespace roborun::sensor_port {

/// Never decrease.
struct PortCounters {
  std::uint64_t read{};      ///< Samples handed out.
  std::uint64_t dropped{};   ///< Written, and overwritten before anybody here asked for them.
  std::uint64_t torn{};      ///< Copies that were thrown away, because the writer came by meanwhile.
  std::uint64_t refused{};   ///< Samples that contradict the port's own rules: a length, a count that fell.
  std::uint64_t restarts{};  ///< Of the writer.
};

struct PortSample {
  std::span<const std::byte> sample{};   ///< The kind's struct of roborun_port.h.
  std::span<const std::byte> payload{};  ///< Valid, like `sample`, until the next call.
  std::int64_t clock_offset_ns{};        ///< To CLOCK_MONOTONIC.
};

/// Nothing in the file is believed twice: what open() read of its layout is kept, lengths are checked against it, and what is handed out is a copy
/// that no writer can reach. The writer may be dead, slow, another one, or hostile.
class PortReader {
 public:
  /// Empty: open. Otherwise what is wrong, in one line without the path. Takes the memory for one sample. Not for the loop.
  [[nodiscard]] std::string open(const std::string& path, std::uint32_t kind);
  /// The same file again, or the one that took its place. Not for the loop.
  [[nodiscard]] std::string reopen() { return open(path_, kind_); }

  // Both: kOk; kNotReady: nothing new, or the writer was faster kTries times; kIo: not open, or the file was cut short. No system call, no heap.
  // RT-safe: O(bytes of the sample).
  [[nodiscard]] Status newest(PortSample& out) noexcept;
  /// The oldest that was not read yet and is still there.
  [[nodiscard]] Status next(PortSample& out) noexcept;

  [[nodiscard]] bool is_replaced() const { return memory_.is_replaced(); }
  [[nodiscard]] const PortCounters& counters() const noexcept { return counters_; }
  /// Of the file that is open.
  [[nodiscard]] std::uint32_t kind() const noexcept { return kind_; }
  [[nodiscard]] std::uint32_t slot_count() const noexcept { return slot_count_; }
  [[nodiscard]] std::uint32_t payload_room_bytes() const noexcept {
    return slot_bytes_ - static_cast<std::uint32_t>(sizeof(roborun_port_slot)) - sample_bytes_;
  }

  static constexpr int kTries = 3;

 private:
  [[nodiscard]] std::string check_layout();
  [[nodiscard]] const roborun_port_header& header() const noexcept {
    return *static_cast<const roborun_port_header*>(static_cast<const void*>(memory_.data()));
  }
  /// How many samples there are, after a look at who writes. False: nothing to read.
  [[nodiscard]] bool look(std::uint64_t& written) noexcept;
  /// Copies sample n. False: it was not whole, or no longer there.
  [[nodiscard]] bool copy(std::uint64_t n, PortSample& out) noexcept;

  PortMemory memory_;
  std::string path_;
  std::uint32_t kind_{}, slot_count_{}, slot_bytes_{}, sample_bytes_{};
  std::uint64_t writer_{};
  std::uint64_t next_{};  ///< First sample that was not handed out.
  std::vector<std::uint64_t> copy_;
  PortCounters counters_{};
};

/// "depth", "cloud", ...; "unknown" for what is none.
[[nodiscard]] const char* kind_name(std::uint32_t kind) noexcept;

}  // namespace roborun::sensor_port
