// How the wrappers of hdf5.hpp notice that a call of the HDF5 C API failed. Private to those files.
#pragma once

#include <exception>
#include <string>

#include "io/hdf5.hpp"

namespace breccia::io::h5 {

/// A failed call; class File adds which file and object it was about.
class CallFailed : public std::exception {
 public:
  /// Takes the reason from HDF5's error stack, which the next call of HDF5 clears.
  CallFailed();
  [[nodiscard]] const char* what() const noexcept override { return reason_.c_str(); }

 private:
  std::string reason_;
};

inline void check(herr_t status) {
  if (status < 0) throw CallFailed();
}
inline Handle checked(hid_t id, Handle::Closer closer) {
  if (id < 0) throw CallFailed();
  return {id, closer};
}

/// A fixed-length string type of exactly `size` bytes without terminator: what VTK requires of the attribute Type.
Handle text_type(std::size_t size, bool ascii);

}  // namespace breccia::io::h5
