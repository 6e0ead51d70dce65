// Errors are part of the interface: one line that says what, where and what would be right, and an exit code.
#pragma once

#include <stdexcept>
#include <string>

namespace breccia {

/// Exit codes of the command (documented in docs/usage.md).
enum class ExitCode : int {
  kDone = 0,
  kUsage = 2,     ///< wrong use or scene
  kNumerics = 3,  ///< the numbers went wrong
  kIo = 4,        ///< input or output
  kStopped = 75,  ///< stopped early, to be continued
};

/// An error a user can act on. what() is the one line to print.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  [[nodiscard]] ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

/// Wrong use of the command or a wrong scene (exit code 2).
class UsageError : public Error {
 public:
  explicit UsageError(const std::string& message) : Error(ExitCode::kUsage, message) {}
};
/// The numbers went wrong (exit code 3).
class NumericsError : public Error {
 public:
  explicit NumericsError(const std::string& message) : Error(ExitCode::kNumerics, message) {}
};
/// A file cannot be read or written (exit code 4).
class IoError : public Error {
 public:
  explicit IoError(const std::string& message) : Error(ExitCode::kIo, message) {}
};

}  // namespace breccia
