#pragma once

namespace sovo::app {

/// What the command tells its caller; see docs/exit-codes.md.
enum ExitCode : int {
  kOk = 0,        ///< All was done as asked.
  kFailed = 1,    ///< The job began and failed: nothing tracked, the network refused, ...
  kUsage = 2,     ///< The command line or the configuration is wrong.
  kBadInput = 3,  ///< A file, folder or calibration is missing or unreadable.
};

/// The same in words, for the end of `--help`.
inline constexpr const char* kExitCodesHelp =
    "Exit codes: 0 done; 1 the job failed; 2 wrong command line or configuration; "
    "3 missing or bad input.";

}  // namespace sovo::app
