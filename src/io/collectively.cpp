#include "io/collectively.hpp"

#include <cstring>
#include <string>
#include <vector>

namespace breccia::io {

namespace {

[[noreturn]] void throw_as(ExitCode code, const std::string& message) {
  if (code == ExitCode::kUsage) throw UsageError(message);
  if (code == ExitCode::kNumerics) throw NumericsError(message);
  if (code == ExitCode::kIo) throw IoError(message);
  throw Error(code, message);
}

}  // namespace

void throw_everywhere(const std::optional<Error>& error, const mpi::Comm& comm) {
  const int first_failed = comm.min<std::int32_t>(error ? comm.rank() : comm.size());
  if (first_failed == comm.size()) return;

  std::vector<std::byte> packed;
  if (comm.rank() == first_failed) {
    const ExitCode code = error->code();
    packed.resize(sizeof(code) + std::strlen(error->what()));
    std::memcpy(packed.data(), &code, sizeof(code));
    std::memcpy(packed.data() + sizeof(code), error->what(), packed.size() - sizeof(code));
  }
  comm.broadcast(packed, first_failed);
  ExitCode code{};
  std::memcpy(&code, packed.data(), sizeof(code));
  throw_as(code,
           std::string(reinterpret_cast<const char*>(packed.data()) + sizeof(code), packed.size() - sizeof(code)));
}

}  // namespace breccia::io
