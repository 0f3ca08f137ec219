#include "output/csv_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

namespace twilight {
namespace {

TEST(CsvTable, NumbersReadBackExactly) {
  for (double value : {0.1, 1.0 / 3.0, 6.02214076e23, 5e-324, -0.0, 1e21}) {
    const double back = std::strtod(shortest_number(value).c_str(), nullptr);
    EXPECT_EQ(back, value);
    EXPECT_EQ(std::signbit(back), std::signbit(value));
  }
  EXPECT_EQ(shortest_number(0.1), "0.1");
}

TEST(CsvTable, HasCommentsHeaderAndRows) {
  CsvTable table({"azimuth_deg", "note"});
  table.add_comment("one\ntwo");
  table.add_row({1.5, "a,\"b\""});
  EXPECT_EQ(table.text(), "# one\n# two\nazimuth_deg,note\n1.5,\"a,\"\"b\"\"\"\n");
  std::ostringstream out;
  table.write("-", out);
  EXPECT_EQ(out.str(), table.text());
  out.setstate(std::ios::badbit);
  EXPECT_THROW(table.write("-", out), std::runtime_error);
  EXPECT_THROW(table.write("/nonexistent-folder/x.csv", out), std::runtime_error);
}

TEST(CsvTable, RefusesBadRows) {
  EXPECT_THROW(CsvTable({}), std::invalid_argument);
  CsvTable table({"a", "b"});
  EXPECT_THROW(table.add_row({1.0}), std::invalid_argument);
  EXPECT_THROW(table.add_row({1.0, std::nan("")}), std::logic_error);
}

}  // namespace
}  // namespace twilight
