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

}  // namespace
}  // namespace twilight
