/// ThreadSanitizer tells memory by its address: two mappings of one file are two memories to it.
#pragma once

#include <sys/mman.h>

#include "platform/sensor_port/port_reader.hpp"

namespace roborun::sensor_port {

/// As long as it lives, `writer` writes through the mapping of a reader of its port.
class OneMapping {
 public:
  /// Preconditions: both are open, and the reader has something to read: it is taken.
  OneMapping(roborun_port_writer& writer, PortReader& reader) : writer_(writer), own_(writer.header) {
    PortLoan loan;
    if (reader.borrow(loan) != Status::kOk || reader.give_back(loan) != Status::kOk) return;
    const std::size_t before = sizeof *own_ + (loan.number % own_->slot_count) * own_->slot_bytes +
                               sizeof(roborun_port_slot) + own_->sample_bytes;
    void* at = const_cast<std::byte*>(loan.port.payload.data()) - before;
    at = mmap(at, writer.bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED, writer.file, 0);
    if (at != MAP_FAILED) writer.header = static_cast<roborun_port_header*>(at);
  }
  ~OneMapping() { writer_.header = own_; }
  OneMapping(const OneMapping&) = delete;
  OneMapping& operator=(const OneMapping&) = delete;
  [[nodiscard]] bool is_one() const noexcept { return writer_.header != own_; }

 private:
  roborun_port_writer& writer_;
  roborun_port_header* own_;
};

}  // namespace roborun::sensor_port
