#include "components/synthetic_viewer/state/view_direction.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

namespace phantom::synthetic_viewer {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180;

std::string words(ViewNode node, double azimuth_deg, Language language = Language::kEnglish) {
  return in(language, direction_words(node, azimuth_deg * kRadPerDegree));
}

TEST(ViewDirection, IsSaidAsByWhoStandsBeforeTheMainView) {
  // The camera stands on −y and looks along +y: +x is at the right.
  EXPECT_EQ(words(ViewNode::kEast, -90), "from the right");
  EXPECT_EQ(words(ViewNode::kWest, -90), "from the left");
  EXPECT_EQ(words(ViewNode::kNorth, -90), "from the back");
  EXPECT_EQ(words(ViewNode::kSouth, -90), "from the front");
  EXPECT_EQ(words(ViewNode::kTop, -90), "from above");
  EXPECT_EQ(words(ViewNode::kBottom, -90), "from below");
  EXPECT_EQ(words(ViewNode::kCorner1, -90), "from the upper back right");
  EXPECT_EQ(words(ViewNode::kCorner7, -90), "from the lower front left");
  EXPECT_EQ(words(ViewNode::kCorner1, -90, Language::kGerman), "von hinten rechts oben");
  EXPECT_EQ(words(ViewNode::kAutomatic, -90), "automatic");
  // From the other side left is right, and from a corner a corner is straight.
  EXPECT_EQ(words(ViewNode::kEast, 90), "from the left");
  EXPECT_EQ(words(ViewNode::kCorner1, 45), "from the upper front");
}

TEST(ViewDirection, DiffersBetweenAllNodesWhereverTheMainViewStands) {
  for (int azimuth_deg = -180; azimuth_deg <= 180; azimuth_deg += 7) {
    std::set<std::string> all;
    for (int node = 0; node <= percept::kNodeCount; ++node)
      all.insert(words(static_cast<ViewNode>(node), azimuth_deg));
    EXPECT_EQ(all.size(), percept::kNodeCount + 1U) << azimuth_deg;
  }
}

}  // namespace
}  // namespace phantom::synthetic_viewer
