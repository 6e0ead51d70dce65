#include "scene/from_root.hpp"

#include <cstddef>
#include <vector>

#include "breccia/error.hpp"

namespace breccia::scene {

std::string from_root(const mpi::Comm* comm, const std::function<std::string()>& read) {
  if (comm == nullptr) return read();
  // One byte of exit code, then the text or the message.
  std::vector<std::byte> message(1, std::byte{0});
  if (comm->is_root()) {
    std::string text;
    try {
      text = read();
    } catch (const Error& error) {
      message[0] = static_cast<std::byte>(error.code());
      text = error.what();
    }
    for (const char c : text) message.push_back(static_cast<std::byte>(c));
  }
  comm->broadcast(message);
  std::string text;
  for (std::size_t i = 1; i < message.size(); ++i) text.push_back(static_cast<char>(message[i]));
  const auto code = static_cast<ExitCode>(message[0]);
  if (code == ExitCode::kIo) throw IoError(text);
  if (code != ExitCode::kDone) throw UsageError(text);
  return text;
}

}  // namespace breccia::scene
