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

/// A sample whose payload still lies in the writer's memory, which may change it at any moment: read it with copy_shared(), and use nothing of it
/// unless give_back() says that it was whole.
struct PortLoan {
  PortSample port{};
  std::uint64_t number{};
  bool is_too_long{};  ///< It says more bytes than there is room for: none are lent.
};

/// Copies bytes that another process may be writing, in whole words, each of them once. Returns how many stand in `to` before the first one that was
/// asked for: `first % 8`. Preconditions: `from` begins at a multiple of eight and goes on to one, as payloads do; so does `to`, which holds them all.
std::size_t copy_shared(std::span<const std::byte> from, std::size_t first, std::size_t bytes,
                        std::span<std::byte> to) noexcept;

/// Nothing in the file is believed twice: what open() read of its layout is kept, lengths are checked against it, and what is handed out is a copy
/// that no writer can reach. The writer may be dead, slow, another one, or hostile.
class PortReader {
 public:
  /// Empty: open. Otherwise what is wrong, in one line without the path. Takes the memory for one sample. Not for the loop.
  [[nodiscard]] std::string open(const std::string& path, std::uint32_t kind);
  /// The same file again, or the one that took its place. Not for the loop.
  [[nodiscard]] std::string reopen() { return open(path_, kind_); }

  // All: kOk; kNotReady: nothing new, or the writer was faster kTries times; kIo: not open, or the file was cut short. No system call, no heap.
  // RT-safe: O(bytes of the sample).
  [[nodiscard]] Status newest(PortSample& out) noexcept;
  /// The oldest that was not read yet and is still there.
  [[nodiscard]] Status next(PortSample& out) noexcept;
  /// The newest, for one who makes something else of its payload. Its struct is copied, and valid until the next call. RT-safe: O(1).
  [[nodiscard]] Status borrow(PortLoan& loan) noexcept;
  /// kOk: it was whole all the time. kNotReady: the writer came by.
  [[nodiscard]] Status give_back(const PortLoan& loan) noexcept;

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
  /// Sample n with its struct copied. False: it is not whole, or no longer there.
  [[nodiscard]] bool lend(std::uint64_t n, PortLoan& loan) noexcept;
  /// The same with a copy of its payload.
  [[nodiscard]] PortSample copy(const PortLoan& loan) noexcept;
  /// False, and counted: the writer came by. True: it is taken, and all before it are behind.
  [[nodiscard]] bool finish(const PortLoan& loan) noexcept;
  [[nodiscard]] const roborun_port_slot& slot_of(std::uint64_t n) const noexcept {
    const std::byte* at = memory_.data() + sizeof(roborun_port_header) + (n % slot_count_) * slot_bytes_;
    return *static_cast<const roborun_port_slot*>(static_cast<const void*>(at));
  }

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
