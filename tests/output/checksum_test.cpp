#include "output/checksum.h"

#include <gtest/gtest.h>

namespace twilight {
namespace {

TEST(Checksum, MeetsThePublishedVectors) {
  // Fowler, Noll & Vo's test vectors of FNV-1a, 64 bits (draft-eastlake-fnv, RFC 9923).
  EXPECT_EQ(fnv1a64(std::string_view("")), "cbf29ce484222325");
  EXPECT_EQ(fnv1a64(std::string_view("a")), "af63dc4c8601ec8c");
  EXPECT_EQ(fnv1a64(std::string_view("foobar")), "85944171f73967e8");
}

TEST(Checksum, MeetsThePublishedVectorsOf128Bits) {
  // The same source.
  EXPECT_EQ(fnv1a128(""), "6c62272e07bb014262b821756295c58d");
  EXPECT_EQ(fnv1a128("a"), "d228cb696f1a8caf78912b704e4a8964");
  EXPECT_EQ(fnv1a128("foobar"), "343e1662793c64bf6f0d3597ba446f18");
}

}  // namespace
}  // namespace twilight
