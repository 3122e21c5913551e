#include <gtest/gtest.h>

#include "components/synthetic_viewer/dds_adapter.hpp"

namespace phantom::synthetic_viewer {
namespace {

TEST(Conversion, SkinPercept) {
  messages::SkinPercept percept;
  percept.valid = true;
  percept.patch_m = 0.02;
  percept.greatest_mu_Pa_s_per_m = 32;
  percept.felt = {{7, {}, 8}, {0, {}, 100}};  // the object's skin: closer than the closest layer
  const SkinSample sample = skin_of(percept, 5);
  EXPECT_TRUE(sample.valid);
  ASSERT_EQ(sample.felt.size(), 2U);
  EXPECT_EQ(sample.felt[0].link, 7U);
  EXPECT_EQ(sample.felt[0].closeness, 0.25F);
  EXPECT_EQ(sample.felt[1].closeness, 1.0F);
  percept.valid = false;
  EXPECT_FALSE(skin_of(percept, 5).valid);
  EXPECT_TRUE(skin_of(percept, 5).felt.empty());
}

}  // namespace
}  // namespace phantom::synthetic_viewer
