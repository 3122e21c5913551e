#include "components/synthetic_viewer/state/model_history.hpp"

#include <gtest/gtest.h>

#include "common/messages/living.hpp"

namespace phantom::synthetic_viewer::model_history_test {
namespace {

messages::WorkspaceObject object_at(double x_m, std::uint16_t id = 1, std::uint64_t mesh = 7) {
  messages::WorkspaceObject object;
  object.id = id;
  object.name = "object " + std::to_string(id);
  object.mesh_hash = mesh;
  object.X_WO.translation_m.x() = x_m;
  return object;
}

TEST(ModelHistory, TheNewestChangeIsUndoneFirst) {
  ModelHistory history;
  history.take(object_at(0.0));
  history.take(object_at(0.5, 2));
  EXPECT_EQ(history.newest(), nullptr) << "an object that comes is no change";
  history.take(object_at(0.1));
  history.take(object_at(0.6, 2));
  ASSERT_NE(history.newest(), nullptr);
  EXPECT_EQ(history.newest()->name, "object 2");
  EXPECT_EQ(history.newest()->before_WO.translation_m.x(), 0.5);
  history.take(object_at(0.5, 2));  // undone
  ASSERT_NE(history.newest(), nullptr);
  EXPECT_EQ(history.newest()->id, 1);
  EXPECT_EQ(history.newest()->before_WO.translation_m.x(), 0.0);
  history.take(object_at(0.0));
  EXPECT_EQ(history.newest(), nullptr);
}

TEST(ModelHistory, ASampleThatSaysTheSameAgainIsNoChange) {
  ModelHistory history;
  for (int i = 0; i < 3; ++i) history.take(object_at(0.0));
  EXPECT_EQ(history.newest(), nullptr);
  history.take(object_at(0.1));
  history.take(object_at(0.1));
  history.take(object_at(0.0));
  EXPECT_EQ(history.newest(), nullptr);
}

TEST(ModelHistory, WhatIsRemovedCannotBeMovedBack) {
  ModelHistory history;
  history.take(object_at(0.0));
  history.take(object_at(0.1));
  history.take(object_at(0.1, 1, 0));
  EXPECT_EQ(history.newest(), nullptr);
  history.take(object_at(0.3));
  EXPECT_EQ(history.newest(), nullptr) << "another one of that number";
}

TEST(ModelHistory, WhatWasCarriedHasReallyMoved) {
  ModelHistory history;
  history.take(object_at(0.0));
  history.take(object_at(0.1));
  history.forget({messages::CarriedObject{.id = 1}});
  EXPECT_EQ(history.newest(), nullptr);
  history.take(object_at(0.5));  // put down
  EXPECT_EQ(history.newest(), nullptr);
}

TEST(ModelHistory, LiveMatterMovesByItself) {
  ModelHistory history;
  for (int i = 0; i < 3; ++i) history.take(object_at(0.1 * i, messages::kLiveId));
  EXPECT_EQ(history.newest(), nullptr);
}

TEST(ModelHistory, IsBounded) {
  ModelHistory history;
  for (int i = 0; i < 100; ++i) history.take(object_at(0.01 * i));
  int undone = 0;
  while (const ModelChange* newest = history.newest()) {
    history.take(object_at(newest->before_WO.translation_m.x()));
    ASSERT_LE(++undone, 16);
  }
  EXPECT_EQ(undone, 16);
}

}  // namespace
}  // namespace phantom::synthetic_viewer::model_history_test
