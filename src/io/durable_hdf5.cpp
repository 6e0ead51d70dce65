#include "io/durable_hdf5.hpp"

#include "breccia/error.hpp"
#include "io/collectively.hpp"
#include "io/durable_file.hpp"

namespace breccia::io {

void write_durably(const std::filesystem::path& path, std::uint64_t bytes, const mpi::Comm& comm,
                   const std::function<void(h5::File&)>& content,
                   const std::function<void(const std::filesystem::path&)>& finish) {
  const std::filesystem::path temporary = temporary_name(path);
  try {
    // Twice: before HDF5 has a file open that could not be closed on a full disk, and after it emptied the file.
    on_root(comm, [&] {
      discard_file(temporary);
      write_file(temporary, "");
      reserve_space(temporary, bytes);
      require_room_for_lock(temporary);
    });
    h5::File file = h5::File::create(temporary, comm);
    on_root(comm, [&] { reserve_space(temporary, bytes); });
    content(file);
    file.close();
    if (finish) finish(temporary);
    on_root(comm, [&] { commit_file(temporary, path); });
  } catch (const Error&) {
    if (comm.is_root()) discard_file(temporary);
    throw;
  }
}

}  // namespace breccia::io
