#include "platform/rt/lane_thread.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "platform/rt/heap_seal.hpp"

namespace roborun::rt {
namespace {

constexpr std::byte kPaint{0xA5};
constexpr std::size_t kProbeStack_bytes =
    64 * std::size_t{1024};  // the C library keeps it for the next thread
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t kMoreStack_bytes = std::size_t{4} << 20U;  // larger frames, and their own thread data
#else
constexpr std::size_t kMoreStack_bytes = 0;
#endif

std::vector<int> allowed_cpus() {
  std::vector<int> cpus;
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return cpus;
  for (std::size_t cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &set)) cpus.push_back(static_cast<int>(cpu));
  }
  return cpus;
}

void* nothing(void*) { return nullptr; }

}  // namespace

Placement placement_of(const core::LaneSpec& spec) {
  const std::vector<int> cpus = allowed_cpus();
  if (cpus.empty()) return {-1, spec.priority};
  const std::size_t index = std::min(spec.cpu_index, cpus.size() - 1);
  return {cpus[cpus.size() - 1 - index], spec.priority};
}

std::string why_no_priority() {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
  pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
  sched_param param{};
  for (const core::LaneSpec& spec : core::kLanes)
    param.sched_priority = std::max(param.sched_priority, spec.priority);
  pthread_attr_setschedparam(&attributes, &param);
  pthread_attr_setstacksize(&attributes, kProbeStack_bytes);
  pthread_t probe{};
  const int error = pthread_create(&probe, &attributes, nothing, nullptr);
  if (error == 0) pthread_join(probe, nullptr);
  pthread_attr_destroy(&attributes);
  if (error == 0) return {};
  return "real-time priority: " + std::string(std::strerror(error)) + " (SCHED_FIFO " +
         std::to_string(param.sched_priority) +
         "): run as root, grant CAP_SYS_NICE, or raise 'rtprio' in /etc/security/limits.conf";
}

std::vector<std::string> why_not_real_time() {
  std::vector<std::string> reasons;
  const std::size_t cpus = allowed_cpus().size();
  for (const core::LaneSpec& spec : core::kLanes) {
    if (spec.priority > 0 && spec.cpu_index >= cpus)
      reasons.push_back("CPU: lane " + std::string(spec.name) + " needs a CPU of its own, and there are " +
                        std::to_string(cpus));
  }
  if (std::string why = why_no_priority(); !why.empty()) reasons.push_back(std::move(why));
  return reasons;
}

void take_priority(int priority) noexcept {
  sched_param param{};
  param.sched_priority = priority;
  (void)pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
}

LaneThread::~LaneThread() {
  request_stop();
  join();
  if (stack_ != nullptr) munmap(stack_, stack_bytes_);
}

std::string LaneThread::start(const Placement& placement, bool watch_heap) {
  watch_heap_ = watch_heap;
  const std::string name = core::lane(lane_.id()).name;
  stack_bytes_ = core::lane(lane_.id()).stack_bytes + kMoreStack_bytes;
  void* block =
      mmap(nullptr, stack_bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
  if (block == MAP_FAILED) return "lane " + name + ": no memory for its stack";
  stack_ = static_cast<std::byte*>(block);
  std::memset(stack_, static_cast<int>(kPaint), stack_bytes_);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstack(&attributes, stack_, stack_bytes_);
  if (placement.cpu >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(placement.cpu), &set);
    pthread_attr_setaffinity_np(&attributes, sizeof set, &set);
  }
  if (placement.priority > 0) {
    pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
    sched_param param{};
    param.sched_priority = placement.priority;
    pthread_attr_setschedparam(&attributes, &param);
  }
  const int error = pthread_create(&thread_, &attributes, entry, this);
  pthread_attr_destroy(&attributes);
  if (error != 0) return "lane " + name + ": " + std::strerror(error);
  running_ = true;
  return {};
}

void* LaneThread::entry(void* self) noexcept {
  static_cast<LaneThread*>(self)->loop();
  return nullptr;
}

void LaneThread::loop() noexcept {
  prctl(PR_SET_NAME, core::lane(lane_.id()).name);
  // Ordinary threads may be woken up to 50 us late on purpose otherwise.
  prctl(PR_SET_TIMERSLACK, 1);
  (void)read_kernel_counters();  // once for nothing: what it touches is touched
  watch_this_thread(watch_heap_);
  const KernelCounters before = read_kernel_counters();
  while (!stop_.load(std::memory_order_acquire) && !lane_.reactions().stopping()) {
    const timespec wake = clock_.raw_time(lane_.release());
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr) == EINTR) {
    }
    lane_.wake(clock_.now());
    lane_.run_frame();
  }
  counters_ = read_kernel_counters() - before;
  watch_this_thread(false);
}

void LaneThread::join() noexcept {
  if (running_) pthread_join(thread_, nullptr);
  running_ = false;
}

std::size_t LaneThread::stack_high_water_bytes() const noexcept {
  std::size_t untouched = 0;
  while (untouched < stack_bytes_ && stack_[untouched] == kPaint) ++untouched;
  return stack_bytes_ - untouched;
}

}  // namespace roborun::rt
