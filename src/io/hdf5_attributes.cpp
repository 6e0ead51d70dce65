#include <algorithm>
#include <cstring>

#include "io/hdf5.hpp"
#include "io/hdf5_checks.hpp"

namespace breccia::io::h5 {

namespace {

Handle dataspace(std::optional<std::uint64_t> count) {
  if (!count) return checked(H5Screate(H5S_SCALAR), H5Sclose);
  const hsize_t extent = *count;
  return checked(H5Screate_simple(1, &extent, nullptr), H5Sclose);
}

void write_new_attribute(const Handle& object, const std::string& name, hid_t type, const Handle& space,
                         const void* values) {
  const Handle attribute =
      checked(H5Acreate2(object.get(), name.c_str(), type, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(H5Awrite(attribute.get(), type, values));
}

bool is_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
}

std::vector<std::string> read_fixed_texts(const Handle& attribute, const Handle& type, std::size_t count) {
  const std::size_t size = H5Tget_size(type.get());
  std::vector<char> raw(size * count);
  check(H5Aread(attribute.get(), type.get(), raw.data()));
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < count; ++i) {
    const char* text = raw.data() + i * size;
    texts.emplace_back(text, ::strnlen(text, size));
  }
  return texts;
}

std::vector<std::string> read_variable_texts(const Handle& attribute, const Handle& type, const Handle& space,
                                             std::size_t count) {
  std::vector<char*> raw(count, nullptr);
  check(H5Aread(attribute.get(), type.get(), raw.data()));
  std::vector<std::string> texts;
  for (const char* text : raw) texts.emplace_back(text != nullptr ? text : "");
  check(H5Dvlen_reclaim(type.get(), space.get(), H5P_DEFAULT, raw.data()));
  return texts;
}

}  // namespace

Handle text_type(std::size_t size, bool ascii) {
  Handle type = checked(H5Tcopy(H5T_C_S1), H5Tclose);
  check(H5Tset_size(type.get(), std::max<std::size_t>(size, 1)));  // HDF5 has no empty type: one NUL stands for ""
  check(H5Tset_strpad(type.get(), H5T_STR_NULLPAD));
  check(H5Tset_cset(type.get(), ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8));
  return type;
}

void File::write_attribute_values(const std::string& object, const std::string& name, hid_t type, const void* values,
                                  std::optional<std::uint64_t> count) {
  stage(object + "@" + name, "write the attribute",
        [&] { write_new_attribute(open_object(object), name, type, dataspace(count), values); });
}

void File::write_attribute(const std::string& object, const std::string& name, const std::string& text) {
  stage(object + "@" + name, "write the attribute", [&] {
    const Handle type = text_type(text.size(), is_ascii(text));
    write_new_attribute(open_object(object), name, type.get(), dataspace(std::nullopt), text.c_str());
  });
}

void File::write_attribute(const std::string& object, const std::string& name, const std::vector<std::string>& texts) {
  stage(object + "@" + name, "write the attribute", [&] {
    std::size_t size = 1;
    for (const std::string& text : texts) size = std::max(size, text.size());
    std::string packed(size * texts.size(), '\0');
    for (std::size_t i = 0; i < texts.size(); ++i) packed.replace(i * size, texts[i].size(), texts[i]);
    const Handle type = text_type(size, is_ascii(packed));
    write_new_attribute(open_object(object), name, type.get(), dataspace(texts.size()), packed.data());
  });
}

bool File::read_attribute_values(const std::string& object, const std::string& name, hid_t type, void* values,
                                 std::uint64_t count) const {
  bool found = false;
  stage(object + "@" + name, "read the attribute", [&] {
    const Handle owner = open_object(object);
    const htri_t answer = H5Aexists(owner.get(), name.c_str());
    check(answer);
    if (answer == 0) return;
    const Handle attribute = checked(H5Aopen(owner.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
    const Handle space = checked(H5Aget_space(attribute.get()), H5Sclose);
    const hssize_t stored = H5Sget_simple_extent_npoints(space.get());
    if (stored < static_cast<hssize_t>(count)) return;
    const std::size_t size = H5Tget_size(type);
    std::vector<char> all(static_cast<std::size_t>(stored) * size);
    check(H5Aread(attribute.get(), type, all.data()));
    std::memcpy(values, all.data(), count * size);
    found = true;
  });
  return found;
}

std::vector<std::string> File::read_attribute_texts(const std::string& object, const std::string& name) const {
  std::vector<std::string> texts;
  stage(object + "@" + name, "read the attribute", [&] {
    const Handle owner = open_object(object);
    const htri_t answer = H5Aexists(owner.get(), name.c_str());
    check(answer);
    if (answer == 0) return;
    const Handle attribute = checked(H5Aopen(owner.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
    const Handle type = checked(H5Aget_type(attribute.get()), H5Tclose);
    const Handle space = checked(H5Aget_space(attribute.get()), H5Sclose);
    const auto count = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get()));
    const htri_t variable = H5Tis_variable_str(type.get());
    check(variable);
    texts =
        variable > 0 ? read_variable_texts(attribute, type, space, count) : read_fixed_texts(attribute, type, count);
  });
  return texts;
}

}  // namespace breccia::io::h5
