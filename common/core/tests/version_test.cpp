#include "common/core/version.hpp"

#include <gmock/gmock.h>

namespace phantom::core {
namespace {

TEST(Version, IsThreeNumbers) { EXPECT_THAT(version(), testing::MatchesRegex("[0-9]+[.][0-9]+[.][0-9]+")); }

}  // namespace
}  // namespace phantom::core
