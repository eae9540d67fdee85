#include "platform/evaluation/worker_processes.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <vector>

#include "platform/input/input_error.hpp"

namespace roborun::evaluation {
namespace {

// The first byte of what a child sends.
constexpr char kAnswer = 'A';
constexpr char kRefusal = 'R';

struct Child {
  pid_t pid{};
  int fd{-1};
  std::size_t task{};
  std::string sent;
};

class Children {
 public:
  Children() = default;
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;
  ~Children() {
    for (const Child& child : running_) {
      (void)kill(child.pid, SIGKILL);
      (void)close(child.fd);
      (void)waitpid(child.pid, nullptr, 0);
    }
  }
  void start(std::size_t task, const std::function<std::string(std::size_t)>& work);
  /// Waits at most `timeout_ms`, reads what is there, and moves children that are done to `ended`.
  void collect(int timeout_ms, std::vector<Child>& ended);
  [[nodiscard]] std::size_t count() const { return running_.size(); }

 private:
  std::vector<Child> running_;
};

[[noreturn]] void child_main(pid_t parent, int fd, std::size_t task,
                             const std::function<std::string(std::size_t)>& work) {
  (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  (void)std::signal(SIGINT, SIG_IGN);  // the parent ends its children ...
  (void)std::signal(SIGHUP, SIG_IGN);
  (void)std::signal(SIGTERM, SIG_DFL);  // ... and its own handlers are not theirs
  std::string text;
  try {
    text = kAnswer + work(task);
  } catch (const InputError& error) {
    text = kRefusal + std::string(error.what());
  } catch (const std::exception& error) {
    fmt::print(stderr, "roborun: {}\n", error.what());
    _exit(1);
  }
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t n = write(fd, text.data() + at, text.size() - at);
    if (n < 0 && errno != EINTR) _exit(1);
    if (n > 0) at += static_cast<std::size_t>(n);
  }
  _exit(0);
}

void Children::start(std::size_t task, const std::function<std::string(std::size_t)>& work) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw InputError(fmt::format("--jobs: no pipe: {}", strerror(errno)));
  (void)std::fflush(nullptr);  // or the child would print it again
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    (void)close(ends[0]);
    child_main(parent, ends[1], task, work);
  }
  (void)close(ends[1]);
  if (pid < 0) {
    (void)close(ends[0]);
    throw InputError(fmt::format("--jobs: no process: {}: give fewer jobs", strerror(errno)));
  }
  running_.push_back({pid, ends[0], task, {}});
}

void Children::collect(int timeout_ms, std::vector<Child>& ended) {
  std::vector<pollfd> waiting;
  for (const Child& child : running_) waiting.push_back({child.fd, POLLIN, 0});
  if (poll(waiting.data(), waiting.size(), timeout_ms) <= 0) return;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    if (waiting[i].revents == 0) continue;
    std::array<char, 65536> block{};
    const ssize_t n = read(running_[i].fd, block.data(), block.size());
    if (n > 0) running_[i].sent.append(block.data(), static_cast<std::size_t>(n));
    if (n > 0 || (n < 0 && errno == EINTR)) continue;
    int status = 0;
    (void)close(running_[i].fd);
    running_[i].fd = -1;
    pid_t waited = 0;
    do {
      waited = waitpid(running_[i].pid, &status, 0);
    } while (waited < 0 && errno == EINTR);
    if (waited < 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0) running_[i].sent.clear();
    ended.push_back(running_[i]);
  }
  std::erase_if(running_, [](const Child& child) { return child.fd < 0; });
}

}  // namespace

bool run_in_processes(std::span<const std::size_t> tasks, int jobs, const WorkerCalls& calls) {
  constexpr int kTick_ms = 200;
  Children children;
  std::size_t next = 0;
  while (next < tasks.size() || children.count() > 0) {
    while (next < tasks.size() && children.count() < static_cast<std::size_t>(jobs))
      children.start(tasks[next++], calls.work);
    std::vector<Child> ended;
    children.collect(kTick_ms, ended);
    for (const Child& child : ended) {
      if (child.sent.empty()) {
        calls.died(child.task);
      } else if (child.sent.front() == kRefusal) {
        throw InputError(child.sent.substr(1));
      } else {
        calls.answered(child.task, child.sent.substr(1));
      }
    }
    if (calls.go_on && !calls.go_on()) return false;
  }
  return true;
}

}  // namespace roborun::evaluation
