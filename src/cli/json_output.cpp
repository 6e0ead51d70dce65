#include "cli/json_output.hpp"

#include <fmt/core.h>

#include "io/collectively.hpp"
#include "io/durable_file.hpp"

namespace breccia::cli {

void add_json_option(CLI::App& command, std::string& file) {
  command
      .add_option("--json", file, "Also write the result as JSON (SI units); - is standard output, and nothing else")
      ->type_name("FILE");
}

void write_json(const Json& value, const std::string& file, const mpi::Comm& comm) {
  if (file.empty()) return;
  io::on_root(comm, [&] {
    const std::string text = value.dump(2) + "\n";
    if (is_standard_output(file)) {
      fmt::print("{}", text);
    } else {
      io::write_file(file, text);
    }
  });
}

}  // namespace breccia::cli
