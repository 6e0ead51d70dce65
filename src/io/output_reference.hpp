// The documentation of the output files, made from the tables that write them.
#pragma once

#include <string>

namespace breccia::io {

/// docs/output-files.md, Markdown.
std::string output_reference();

}  // namespace breccia::io
