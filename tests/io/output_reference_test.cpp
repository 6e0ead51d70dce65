// The documentation says what the program writes.
#include "io/output_reference.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "io/diagnostics.hpp"
#include "io/fields.hpp"

namespace breccia::io {
namespace {

TEST(OutputReference, EveryFieldAndColumnIsThere) {
  const std::string text = output_reference();
  for (const Field& field : snapshot_fields()) EXPECT_NE(text.find(field.meaning), std::string::npos) << field.name;
  for (const DiagnosticsColumn& column : diagnostics_columns()) {
    EXPECT_NE(text.find(column.name), std::string::npos) << column.name;
  }
}

// BRECCIA_WRITE_DOCS=1 writes the page anew.
TEST(OutputReference, PageIsUpToDate) {
  const std::string path = BRECCIA_SOURCE_DIR "/docs/output-files.md";
  if (std::getenv("BRECCIA_WRITE_DOCS") != nullptr) std::ofstream(path) << output_reference();
  std::ifstream stream(path);
  std::ostringstream page;
  page << stream.rdbuf();
  EXPECT_EQ(page.str(), output_reference()) << "run this test once with BRECCIA_WRITE_DOCS=1";
}

}  // namespace
}  // namespace breccia::io
