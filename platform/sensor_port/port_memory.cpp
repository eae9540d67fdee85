#include "platform/sensor_port/port_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <mutex>

namespace roborun::sensor_port {
namespace {

struct Entry {
  std::atomic<std::uintptr_t> begin{0};  // 0: not in use
  std::atomic<std::size_t> bytes{0};
  std::atomic<bool> is_cut{false};
};
std::array<Entry, PortMemory::kMost> entries;
std::mutex opening;
struct sigaction before;

/// Puts zeros where a file has ended. Everything in it is allowed in a signal handler: atomics without locks, one system call.
void on_bus_error(int signal, siginfo_t* info, void* context) {
  const auto at = reinterpret_cast<std::uintptr_t>(info->si_addr);
  for (Entry& entry : entries) {
    const std::uintptr_t begin = entry.begin.load(std::memory_order_acquire);
    const std::size_t bytes = entry.bytes.load(std::memory_order_acquire);
    if (begin == 0 || at < begin || at - begin >= bytes) continue;
    entry.is_cut.store(true, std::memory_order_release);
    const int error = errno;
    void* zeros = mmap(reinterpret_cast<void*>(begin), bytes, PROT_READ,  // NOLINT(performance-no-int-to-ptr)
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
    errno = error;
    if (zeros != MAP_FAILED) return;
    break;
  }
  // Not ours: as if we had never been here.
  if ((before.sa_flags & SA_SIGINFO) != 0) return before.sa_sigaction(signal, info, context);
  sigaction(SIGBUS, &before, nullptr);
}

void handle_bus_errors() {
  static const bool once = [] {
    struct sigaction action {};
    action.sa_sigaction = on_bus_error;
    action.sa_flags = SA_SIGINFO | SA_NODEFER;
    sigaction(SIGBUS, &action, &before);
    return true;
  }();
  (void)once;
}

}  // namespace

PortMemory::~PortMemory() { close(); }

std::string PortMemory::open(const std::string& path) {
  close();
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (file < 0) return std::strerror(errno);
  struct stat status {};
  const bool known = fstat(file, &status) == 0;
  std::string wrong;
  constexpr off_t kMost_bytes = off_t{1} << 32;
  if (!known || !S_ISREG(status.st_mode))
    wrong = "is no file of shared memory";
  else if (status.st_size <= 0 || status.st_size > kMost_bytes)
    wrong = "its size is no port's";
  void* memory = MAP_FAILED;
  if (wrong.empty()) {
    memory = mmap(nullptr, static_cast<std::size_t>(status.st_size), PROT_READ, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED) wrong = std::strerror(errno);
  }
  ::close(file);
  if (!wrong.empty()) return wrong;

  const std::lock_guard lock(opening);
  handle_bus_errors();
  for (entry_ = 0; entry_ < kMost && entries[entry_].begin.load() != 0; ++entry_) {
  }
  if (entry_ == kMost) {
    munmap(memory, static_cast<std::size_t>(status.st_size));
    return "64 ports are open already";
  }
  path_ = path;
  bytes_ = static_cast<std::size_t>(status.st_size);
  data_ = static_cast<const std::byte*>(memory);
  device_ = status.st_dev;
  inode_ = status.st_ino;
  entries[entry_].is_cut.store(false);
  entries[entry_].bytes.store(bytes_);
  entries[entry_].begin.store(reinterpret_cast<std::uintptr_t>(memory), std::memory_order_release);
  // A page that is touched for the first time costs a fault: here, and not in the loop.
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  for (std::size_t i = 0; i < bytes_; i += page) (void)*static_cast<const volatile std::byte*>(data_ + i);
  return {};
}

void PortMemory::close() noexcept {
  if (data_ == nullptr) return;
  entries[entry_].begin.store(0, std::memory_order_release);
  munmap(const_cast<std::byte*>(data_), bytes_);
  data_ = nullptr;
  bytes_ = 0;
}

bool PortMemory::is_cut() const noexcept {
  return data_ != nullptr && entries[entry_].is_cut.load(std::memory_order_acquire);
}

bool PortMemory::is_replaced() const {
  struct stat status {};
  if (stat(path_.c_str(), &status) != 0) return true;
  return status.st_dev != device_ || status.st_ino != inode_;
}

}  // namespace roborun::sensor_port
