// What the operator may correct in the model: once, and only what still stands where it stood.
#include "components/synthetic_viewer/state/model_corrections.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace phantom::synthetic_viewer::model_corrections_test {
namespace {

using testing::HasSubstr;

class Corrections : public testing::Test {
 protected:
  void stands_at(double x_m, std::uint16_t id = 7) {
    messages::WorkspaceObject object;
    object.id = id;
    object.name = id == 7 ? "pump" : "vice";
    object.mesh_hash = 1;
    object.X_WO.translation_m.x() = x_m;
    corrections_.take(object);
  }
  void doubt(std::uint32_t number, std::uint64_t version, bool holds = true, std::uint64_t session = 1) {
    messages::ModelDoubt doubt;
    doubt.place = number % 16;
    doubt.stamp.session = session;
    doubt.doubt = number;
    doubt.holds = holds;
    doubt.workspace_version = version;
    doubt.object = 7;
    doubt.shift_m = {0.02, 0.0, 0.0};
    corrections_.take(doubt);
  }
  double corrected_x_m(std::uint32_t number) {
    const auto command = corrections_.correct(number);
    return command ? command->X_WO.translation_m.x() : std::nan("");
  }
  std::string why_not(std::uint32_t number) {
    const auto command = corrections_.correct(number);
    return command ? "" : command.status().message();
  }

  ModelCorrections corrections_;
};

TEST_F(Corrections, AnObjectIsShiftedOnceByTheDoubtThatItExplains) {
  corrections_.take(5, {});
  stands_at(0.1);
  doubt(3, 5);
  EXPECT_NEAR(corrected_x_m(3), 0.12, 1e-12);
  stands_at(0.12);
  EXPECT_THAT(why_not(3), HasSubstr("has been moved since"));
  doubt(3, 5, false);  // its end comes after the move
  EXPECT_THAT(why_not(3), HasSubstr("has been moved since"));
  doubt(4, 6);
  EXPECT_NEAR(corrected_x_m(4), 0.14, 1e-12) << "a new one of where it stands now";
}

TEST_F(Corrections, WhoJoinsLaterCannotShiftWhatMayHaveBeenMoved) {
  stands_at(0.12);
  doubt(3, 5, false);
  corrections_.take(6, {});
  EXPECT_THAT(why_not(3), HasSubstr("has been moved since"));
}

TEST_F(Corrections, AnObjectIsPutWhereACameraHasFoundItWhileItStandsWhereItStoodThen) {
  const auto why_not_put = [&](const std::string& object) {
    const auto command = corrections_.accept(object);
    return command ? "" : command.status().message();
  };
  stands_at(0.1);
  EXPECT_THAT(why_not_put("pump"), HasSubstr("no camera has found where 'pump' stands"));
  EXPECT_THAT(why_not_put("nothing"), HasSubstr("no camera has found"));
  messages::PoseFinding finding{.id = 7, .verdict = messages::PoseVerdict::kGone, .camera = "above"};
  finding.X_WO.translation_m.x() = 0.1;
  finding.corrected_WO.translation_m = {0.2, 0.05, 0.0};
  finding.corrected_WO.rotation = geometry::rotation_from_rpy(0.0, 0.0, 0.3);
  corrections_.take(finding);
  EXPECT_THAT(why_not_put("pump"), HasSubstr("no camera has found")) << "it is gone";
  finding.verdict = messages::PoseVerdict::kElsewhere;
  corrections_.take(finding);
  const auto command = corrections_.accept("pump");
  ASSERT_TRUE(command);
  EXPECT_EQ(command->operation, messages::WorkspaceOperation::kMove);
  EXPECT_EQ(command->id, 7);
  EXPECT_TRUE(geometry::same_pose(command->X_WO, finding.corrected_WO)) << "turned, too";
  stands_at(0.2);
  EXPECT_THAT(why_not_put("pump"), HasSubstr("has been moved since"));
}

TEST_F(Corrections, OtherVersionsMeanwhileChangeNothing) {
  corrections_.take(5, {});
  stands_at(0.1);
  doubt(3, 5);
  corrections_.take(6, {});
  corrections_.take(7, {});
  EXPECT_NEAR(corrected_x_m(3), 0.12, 1e-12);
}

TEST_F(Corrections, WhatIsNotKeptOrNotExplainedIsRefused) {
  EXPECT_THAT(why_not(3), HasSubstr("doubt 3 of the model is not kept any more"));
  doubt(3, 1);
  EXPECT_THAT(why_not(3), HasSubstr("no object explains it")) << "the object is not known";
  stands_at(0.1);
  doubt(4, 1);
  doubt(1, 1, true, 2);  // another phantom
  EXPECT_THAT(why_not(4), HasSubstr("not kept any more"));
}

TEST_F(Corrections, OnlyTheChangeThatIsShownIsUndone) {
  stands_at(0.1);
  stands_at(0.5, 8);
  stands_at(0.12);
  stands_at(0.6, 8);
  const auto other = corrections_.undo("pump");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.status().message(), "the newest change is of 'vice', not of 'pump'");
  const auto back = corrections_.undo("vice");
  ASSERT_TRUE(back);
  EXPECT_EQ(back->id, 8);
  EXPECT_NEAR(back->X_WO.translation_m.x(), 0.5, 1e-12);
}

}  // namespace
}  // namespace phantom::synthetic_viewer::model_corrections_test
