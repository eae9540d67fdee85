/// What a process that drives something gives up, so that whoever gets into it through an input gets no further:
/// first its capabilities, then the system calls that it has no use for.
#pragma once

#include <string>

namespace roborun::rt {

/// Before any other thread starts. Gives up all capabilities but those over files of others (a report in somebody's
/// folder, written as root), and with them what a started program could win (no_new_privs). The limits
/// for SCHED_FIFO and locked memory are raised before, which is all that real time needs; where they cannot be,
/// the capability in their place stays (CAP_SYS_NICE, CAP_IPC_LOCK). Empty if done, otherwise one line.
[[nodiscard]] std::string drop_capabilities();

/// For all threads of this process, for good: from now on a system call that is not in the list of
/// confinement.cpp fails with EPERM. No new programs, no new processes, no memory that is both written and run,
/// no sockets but UNIX, IP and CAN. A lane goes on: nothing is killed for it, since a vehicle hangs on it.
/// Once everything is set up: plugins are loaded, names of hosts are resolved. Allocates; not in a lane.
/// What is written through /proc/self/mem is not prevented. Empty if done, and in sanitizer builds, where it does
/// nothing; otherwise one line: what the kernel refused.
[[nodiscard]] std::string confine();

}  // namespace roborun::rt
