/// The memory of a flight as bytes: what has changed in it since the flight was made, and the way back into a flight that was
/// made in the same way. A flight takes all its memory before its first frame, so its state is in blocks that are known.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace roborun::mission {

/// Not RT-safe: allocates, and reads all of the memory.
class FlightMemory {
 public:
  /// A block without addresses, all zero before the flight was made in it. All blocks begin at a multiple of 8 bytes, and outlive
  /// this.
  void add_data(std::span<const std::byte> block) { add(block, false); }
  /// An object: its words may become addresses of other blocks, or of constants of the program.
  void add_object(std::span<const std::byte> block) { add(block, true); }
  template <typename T>
  void add_object(const T& object) {
    add_object(std::as_bytes(std::span(&object, 1)));
  }
  /// Keeps what the blocks hold: of a flight that was just made.
  void begin();
  /// What has changed since begin(); addresses as the block that they lie in, and where.
  [[nodiscard]] std::string changes() const;
  /// The inverse, into the memory of a flight that was just made of the same configuration. Throws InputError for what is no
  /// such text; what a block holds then is not defined.
  void apply(std::string_view changes) const;

 private:
  struct Block {
    std::uint64_t* first;
    std::size_t words;
    bool has_addresses;
    std::vector<std::uint32_t> page;  ///< Of kept_, from 1 on; 0: all zero.
  };
  /// A block, or the program, and the bytes behind its beginning.
  struct Place {
    std::uint32_t block;
    std::uint64_t offset;
  };
  /// The blocks are the caller's, and not constant: apply() writes them.
  void add(std::span<const std::byte> block, bool has_addresses) {
    auto* const first = static_cast<std::uint64_t*>(static_cast<void*>(const_cast<std::byte*>(block.data())));
    block_.push_back({first, block.size() / sizeof(std::uint64_t), has_addresses, {}});
  }
  [[nodiscard]] std::optional<Place> place_of(std::uint64_t word) const;
  [[nodiscard]] std::uint64_t address_of(const Place& place) const;
  [[nodiscard]] const std::uint64_t* kept(const Block& block, std::size_t page) const;

  std::vector<Block> block_;
  std::vector<std::uint64_t> kept_;  ///< Pages that are not all zero.
};

/// Of the running program, as its linker wrote it: other code has another one. Empty if there is none.
[[nodiscard]] std::string program_build_id();

}  // namespace roborun::mission
