#include "common/diagnostics/name_filter.hpp"

#include <gtest/gtest.h>

namespace phantom::diagnostics {
namespace {

TEST(NameFilter, KeepsAllWithoutPatterns) {
  EXPECT_TRUE(NameFilter().keeps("anything"));
  EXPECT_TRUE(NameFilter(std::vector<std::string>()).keeps_all());
}

TEST(NameFilter, KeepsWhatAnyPatternMatchesAsAWhole) {
  const NameFilter filter({"*_state", "percept", "mesh_?hunk", "[ab]x"});
  for (const char* name : {"master_state", "slave_state", "percept", "mesh_chunk", "bx"})
    EXPECT_TRUE(filter.keeps(name)) << name;
  for (const char* name : {"state", "percepts", "skin_percept", "cx", ""})
    EXPECT_FALSE(filter.keeps(name)) << name;
}

TEST(NameFilter, TakesAway) {
  const NameFilter some({"*_state", "!master_*"}), but({"!mesh_*"});
  EXPECT_TRUE(some.keeps("slave_state"));
  EXPECT_FALSE(some.keeps("master_state"));
  EXPECT_TRUE(but.keeps("percept"));
  EXPECT_FALSE(but.keeps("mesh_chunk"));
}

}  // namespace
}  // namespace phantom::diagnostics
