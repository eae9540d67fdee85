#include "platform/mission/flight_memory.hpp"

#include <elf.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "platform/input/input_error.hpp"
#include "platform/log/mcap_records.hpp"

namespace roborun::mission {
namespace {

constexpr std::size_t kPage_words = 512;
constexpr std::array<std::uint64_t, kPage_words> kZeros{};
constexpr std::uint32_t kProgram = 0xFFFF'FFFF;  ///< As a block.

/// Where the program was loaded, and what it is.
struct Program {
  std::uint64_t begin{}, end{};
  std::string build_id;
};

void take_notes(const char* at, const char* end, std::string& build_id) {
  const auto padded = [](std::uint32_t bytes) { return (bytes + 3U) & ~3U; };
  for (ElfW(Nhdr) note{}; end - at >= static_cast<std::ptrdiff_t>(sizeof note);) {
    std::memcpy(&note, at, sizeof note);
    const char* const text = at + sizeof note + padded(note.n_namesz);
    at = text + padded(note.n_descsz);
    if (at <= end && note.n_type == NT_GNU_BUILD_ID) build_id.assign(text, note.n_descsz);
  }
}

int take_program(dl_phdr_info* info, std::size_t /*size*/, void* to) {
  auto& program = *static_cast<Program*>(to);
  program.begin = info->dlpi_addr;
  for (const ElfW(Phdr) & header : std::span(info->dlpi_phdr, info->dlpi_phnum)) {
    if (header.p_type == PT_LOAD)
      program.end = std::max<std::uint64_t>(program.end, info->dlpi_addr + header.p_vaddr + header.p_memsz);
    if (header.p_type != PT_NOTE) continue;
    const auto* const notes =
        reinterpret_cast<const char*>(info->dlpi_addr + header.p_vaddr);  // NOLINT(performance-no-int-to-ptr)
    take_notes(notes, notes + header.p_memsz, program.build_id);
  }
  return 1;  // the first is the program itself
}

const Program& program() {
  static const Program found = [] {
    Program p;
    (void)dl_iterate_phdr(take_program, &p);
    return p;
  }();
  return found;
}

/// Where Linux places programs, heaps and libraries; no double but denormal ones.
bool is_like_address(std::uint64_t word) {
  return word >= (std::uint64_t{1} << 40U) && word < (std::uint64_t{1} << 47U);
}

std::uint64_t number_of(const void* address) { return reinterpret_cast<std::uintptr_t>(address); }

}  // namespace

// None where an address is half a word, and where the program stands at an address that is a small number, too.
std::string program_build_id() {
  return sizeof(void*) == sizeof(std::uint64_t) && is_like_address(program().begin) ? program().build_id
                                                                                    : std::string();
}

void FlightMemory::begin() {
  kept_.clear();
  std::size_t most = 0;
  for (const Block& block : block_) most += block.words + kPage_words;
  kept_.reserve(most);  // what is not needed is never touched
  for (Block& block : block_) {
    block.page.clear();
    for (std::size_t at = 0; at < block.words; at += kPage_words) {
      const std::size_t words = std::min(kPage_words, block.words - at);
      const std::uint64_t* const first = block.first + at;
      if (std::memcmp(first, kZeros.data(), words * sizeof *first) == 0) {
        block.page.push_back(0);
        continue;
      }
      kept_.insert(kept_.end(), first, first + words);
      kept_.resize((kept_.size() + kPage_words - 1) / kPage_words * kPage_words);
      block.page.push_back(static_cast<std::uint32_t>(kept_.size() / kPage_words));
    }
  }
}

const std::uint64_t* FlightMemory::kept(const Block& block, std::size_t page) const {
  const std::uint32_t at = block.page[page];
  return at == 0 ? kZeros.data() : kept_.data() + (at - 1) * kPage_words;
}

std::optional<FlightMemory::Place> FlightMemory::place_of(std::uint64_t word) const {
  for (std::size_t i = 0; i < block_.size(); ++i) {
    const std::uint64_t begin = number_of(block_[i].first);
    if (word >= begin && word < begin + block_[i].words * sizeof word)
      return Place{static_cast<std::uint32_t>(i), word - begin};
  }
  if (word >= program().begin && word < program().end) return Place{kProgram, word - program().begin};
  return {};
}

std::uint64_t FlightMemory::address_of(const Place& place) const {
  if (place.block == kProgram) return program().begin + place.offset;
  if (place.block >= block_.size()) throw InputError("an address of a block that is not there");
  return number_of(block_[place.block].first) + place.offset;
}

/// In an object also what is as it was: members that no constructor sets began with what was there before. Only what may be an
/// address, and has not changed, is left to the constructor.
///
/// For each block: runs of words as u32 unchanged before them, u32 count, words; a run of none ends them. Then its
/// addresses: u32 count; each as u32 word, u32 block, u64 offset.
std::string FlightMemory::changes() const {
  constexpr std::size_t kLikely_bytes = 1U << 25U;
  std::string text;
  text.reserve(kLikely_bytes);
  log::Put put(text);
  for (const Block& block : block_) {
    std::string addresses;
    std::uint32_t address_count = 0;
    std::size_t run_at = 0;   // where the number of the run's words stands in the text
    std::size_t run_end = 0;  // behind its last word
    std::uint32_t run_words = 0;
    const auto end_run = [&] {
      if (run_words > 0) std::memcpy(text.data() + run_at, &run_words, sizeof run_words);
      run_words = 0;
    };
    for (std::size_t at = 0; at < block.words; at += kPage_words) {
      const std::size_t words = std::min(kPage_words, block.words - at);
      const std::uint64_t* const before = kept(block, at / kPage_words);
      const std::uint64_t* const now = block.first + at;
      if (!block.has_addresses && std::memcmp(before, now, words * sizeof *now) == 0) continue;
      for (std::size_t i = 0; i < words; ++i) {
        if (before[i] == now[i] && (!block.has_addresses || is_like_address(now[i]))) continue;
        if (run_words == 0 || at + i != run_end) {
          end_run();
          put.number(static_cast<std::uint32_t>(at + i - run_end));
          run_at = text.size();
          put.number(std::uint32_t{});
        }
        std::uint64_t word = now[i];
        if (const auto place = block.has_addresses ? place_of(word) : std::nullopt) {
          log::Put(addresses).number(static_cast<std::uint32_t>(at + i)).number(place->block);
          log::Put(addresses).number(place->offset);
          ++address_count;
          word = 0;
        }
        put.number(word);
        ++run_words;
        run_end = at + i + 1;
      }
    }
    end_run();
    put.number(std::uint32_t{}).number(std::uint32_t{}).number(address_count);
    text += addresses;
  }
  return text;
}

void FlightMemory::apply(std::string_view changes) const {
  log::Get get(changes);
  for (const Block& block : block_) {
    std::size_t at = 0;
    for (;;) {
      at += get.number<std::uint32_t>();
      const auto words = get.number<std::uint32_t>();
      if (words == 0) break;
      if (at + words > block.words) throw InputError("changes behind the end of a block");
      const std::string_view bytes = get.bytes(words * sizeof(std::uint64_t));
      std::memcpy(block.first + at, bytes.data(), bytes.size());
      at += words;
    }
    for (auto count = get.number<std::uint32_t>(); count > 0; --count) {
      const auto word = get.number<std::uint32_t>();
      const auto to = get.number<std::uint32_t>();
      if (word >= block.words) throw InputError("an address behind the end of a block");
      block.first[word] = address_of({to, get.number<std::uint64_t>()});
    }
  }
  if (!get.rest().empty()) throw InputError("changes of more blocks");
}

}  // namespace roborun::mission
