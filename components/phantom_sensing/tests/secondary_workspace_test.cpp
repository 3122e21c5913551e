#include "components/phantom_sensing/workspace/secondary_workspace.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace phantom::phantom_sensing {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

SecondaryWorkspace::Objects two_objects(double vessel_x_m = 0.1) {
  SecondaryWorkspace::Objects objects;
  objects[2] = {.id = 2, .name = "bone", .mesh_hash = 7};
  objects[3] = {.id = 3, .name = "vessel", .mesh_hash = 8};
  objects[3].X_WO.translation_m.x() = vessel_x_m;
  return objects;
}

TEST(SecondaryWorkspace, AreToldOnceTheyHaveStoodApartForLongerThanTwoCommandsTake) {
  SecondaryWorkspace apart;
  core::Nanoseconds now_ns = core::kNsPerSecond;
  const auto compare = [&](const auto& here, const auto& there, double after_s) {
    now_ns += core::from_seconds(after_s);
    return apart.compare(here, there, now_ns);
  };
  EXPECT_THAT(compare(two_objects(), two_objects(), 10.0), IsEmpty());
  EXPECT_THAT(compare(two_objects(0.2), two_objects(), 10.0), IsEmpty()) << "just moved in one";
  EXPECT_THAT(compare(two_objects(0.2), two_objects(0.2), 1.0), IsEmpty()) << "and in the other";
  EXPECT_THAT(compare(two_objects(0.3), two_objects(0.2), 10.0), IsEmpty());
  EXPECT_THAT(compare(two_objects(0.3), two_objects(0.2), 1.9), IsEmpty());
  EXPECT_THAT(compare(two_objects(0.3), two_objects(0.2), 0.2), ElementsAre("vessel"));
  EXPECT_THAT(compare(two_objects(0.3), two_objects(0.3), 0.1), IsEmpty()) << "as soon as both are told";
}

TEST(SecondaryWorkspace, TurnedAddedAndRemovedOnesAreApartAndRoundingIsNot) {
  const auto after_a_while = [](const SecondaryWorkspace::Objects& here,
                                const SecondaryWorkspace::Objects& there) {
    SecondaryWorkspace apart;
    apart.compare(here, there, 0);
    return apart.compare(here, there, SecondaryWorkspace::kReportedAfter_ns);
  };
  auto turned = two_objects();
  turned[2].X_WO.rotation = geometry::rotation_from_rpy(0.0, 0.0, 0.01);
  EXPECT_THAT(after_a_while(turned, two_objects()), ElementsAre("bone"));
  auto fewer = two_objects();
  fewer.erase(3);
  EXPECT_THAT(after_a_while(fewer, two_objects()), ElementsAre("vessel"));
  EXPECT_THAT(after_a_while(two_objects(), fewer), ElementsAre("vessel"));
  EXPECT_THAT(after_a_while(two_objects(0.1 + 1e-9), two_objects()), IsEmpty());
  EXPECT_THAT(after_a_while(two_objects(), {}), IsEmpty()) << "no server there has announced any";
}

TEST(SecondaryWorkspace, WhatAnArmCarriesInOneOnlyOrOtherwiseIsApart) {
  const auto carried_at = [](double x_m, const std::string& frame = "probe") {
    messages::CarriedObject held{.id = 3, .arm = "arm", .frame = frame};
    held.X_FO.translation_m.x() = x_m;
    return SecondaryWorkspace::with_carried(two_objects(), {held});
  };
  const auto apart = [](const SecondaryWorkspace::Objects& here, const SecondaryWorkspace::Objects& there) {
    SecondaryWorkspace workspaces;
    workspaces.compare(here, there, 0);
    return workspaces.compare(here, there, SecondaryWorkspace::kReportedAfter_ns);
  };
  EXPECT_THAT(apart(carried_at(0.0), carried_at(0.0)), IsEmpty());
  EXPECT_THAT(apart(carried_at(0.1), two_objects()), ElementsAre("vessel (carried by 'arm' at 'probe')"))
      << "even where its pose in the hand has the numbers of its place";
  EXPECT_THAT(apart(carried_at(0.0), carried_at(0.001)), testing::SizeIs(1));
  EXPECT_THAT(apart(carried_at(0.0), carried_at(0.0, "head")), testing::SizeIs(1));
}

}  // namespace
}  // namespace phantom::phantom_sensing
