#include "io/output_folder.hpp"

#include <fmt/format.h>

#include <string>
#include <system_error>
#include <vector>

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/durable_file.hpp"

namespace breccia::io {

namespace {

namespace fs = std::filesystem;

constexpr const char* kProbe = "probe";  // a file that says whether the folder can be written to

void create(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw IoError(fmt::format("output folder {}: cannot be created: {}", folder.string(), error.message()));
}

void require_empty(const fs::path& folder) {
  std::error_code error;
  const fs::directory_iterator entry(folder, error);
  if (error) throw IoError(fmt::format("output folder {}: cannot be read: {}", folder.string(), error.message()));
  if (entry == fs::directory_iterator()) return;
  throw UsageError(fmt::format("output folder {} is not empty (it holds {}): name another one with --out, or empty it",
                               folder.string(), entry->path().filename().string()));
}

void require_writable(const fs::path& folder) {
  const fs::path probe = folder / kProbe;
  write_file(probe, "");
  fs::remove(probe);
}

// What a run that was killed had not yet given its name.
void remove_unfinished(const fs::path& folder) {
  std::vector<fs::path> unfinished;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool is_result = name.starts_with("snap_") || name.starts_with("checkpoint_");
    if ((is_result && name.ends_with(".part")) || name == kProbe || name == temporary_name(kProbe)) {
      unfinished.push_back(entry.path());
    }
  }
  for (const fs::path& path : unfinished) {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
}

}  // namespace

void prepare_output_folder(const fs::path& folder, const mpi::Comm& comm) {
  on_root(comm, [&] {
    create(folder);
    require_empty(folder);
    require_writable(folder);
  });
}

void continue_output_folder(const fs::path& folder, const mpi::Comm& comm) {
  on_root(comm, [&] {
    create(folder);
    remove_unfinished(folder);
    if (!fs::exists(folder / "diagnostics.csv")) require_empty(folder);
    require_writable(folder);
  });
}

}  // namespace breccia::io
