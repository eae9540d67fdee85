/// The exit codes of every command.
#pragma once

namespace roborun::app {

enum ExitCode : int {
  kDone = 0,          ///< It did what was asked, and the answer is good.
  kNotGood = 1,       ///< It ran, and the answer is no; with --help the command says which.
  kRefused = 2,       ///< Bad input, or a file or device that is missing, busy or cannot be read or written.
  kInterrupted = 130  ///< Ctrl-C, SIGTERM or SIGHUP; what was done so far is said on standard error.
};

inline constexpr const char* kExitCodes =
    "Exit codes of all commands: 0 done, 1 it ran and the answer is no (--help of the command says when), 2 "
    "bad input,\nor a file or device that is missing or cannot be read or written (one line says which), 130 "
    "Ctrl-C, SIGTERM or SIGHUP.";

}  // namespace roborun::app
